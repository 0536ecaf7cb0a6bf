"""Options that several commands of `./ja` share."""

from enum import Enum
from typing import Annotated, Optional

import typer


class OnDeathChoice(str, Enum):
    """What happens when a node dies."""

    stop = 'stop'
    restart = 'restart'


OnDeath = Annotated[OnDeathChoice, typer.Option(help='What to do when a node dies.')]
HungAfter = Annotated[
    float,
    typer.Option(
        '--hung-after',
        min=2.0,
        help='A node without a sign of life for so many seconds is killed, as one that died.',
    ),
]
OneProcess = Annotated[bool, typer.Option('--one-process', help='All nodes in one process.')]
Record = Annotated[bool, typer.Option('--record', help='Record all topics into runs/.')]
Senses = Annotated[
    str,
    typer.Option(
        help='What it senses beside the picture, with commas: eyes (her head pose and eyes from '
        'landmarks), depth (a depth camera) or second-camera.'
    ),
]
View = Annotated[bool, typer.Option(help='Serve the live page, and print its address.')]
Markers = Annotated[
    bool,
    typer.Option(
        '--markers', help='Publish `markers` for RViz and Foxglove, while one of them reads them.'
    ),
]
Only = Annotated[
    str,
    typer.Option(
        '--only',
        help='Run only these nodes of the graph here, with commas: learning_module. The others '
        'run on another machine.',
    ),
]
Without = Annotated[
    str,
    typer.Option('--without', help='Leave these nodes to another machine, with commas.'),
]
Frames = Annotated[
    bool,
    typer.Option(
        '--frames',
        help='Publish where the frames of the head are: `head/camera_pose`, and `tf` if tf2_msgs '
        'is installed. Not beside robot_state_publisher.',
    ),
]
StandardOutputs = Annotated[
    bool,
    typer.Option(
        '--standard-outputs',
        help='Publish what is seen as vision_msgs, and people as in REP-155, if those types are '
        'installed.',
    ),
]
Swap = Annotated[
    Optional[list[str]],
    typer.Option(
        help='Run your node in place of one of ours: gate=my_lab/my_gate. May be given several '
        'times.'
    ),
]
