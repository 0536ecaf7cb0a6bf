"""The command `rig`, for `./ja`."""

import sys
from typing import Annotated, Optional

import typer

from ja_bringup.commands.options import (
    Frames,
    HungAfter,
    Markers,
    OnDeath,
    OnDeathChoice,
    OneProcess,
    Only,
    Record,
    Senses,
    StandardOutputs,
    Swap,
    View,
    Without,
)
from ja_runner.graph import RECORDER, part_of_graph, replace_nodes, rig_graph, with_arguments
from ja_runner.senses import parse_senses, with_senses
from ja_runner.supervisor import Supervision


def register(app: typer.Typer) -> None:
    """Add the command to an app."""
    app.command()(rig)


def rig(
    context: typer.Context,
    source: Annotated[
        Optional[str],
        typer.Option(
            help='Webcam, address (rtsp://...), film or folder of pictures, in which a digital '
            "head looks around. Without it, the graph uses the rig's own camera and motors."
        ),
    ] = None,
    time_s: Annotated[
        float, typer.Option('--time', min=0.0, help='End after so many seconds.')
    ] = 0.0,
    senses: Senses = '',
    only: Only = '',
    without: Without = '',
    swap: Swap = None,
    record: Record = False,
    one_process: OneProcess = False,
    view: View = True,
    markers: Markers = False,
    frames: Frames = False,
    standard_outputs: StandardOutputs = False,
    on_death: OnDeath = OnDeathChoice.stop,
    hung_after_s: HungAfter = Supervision.hung_after_s,
) -> None:
    """Run the same graph on real pictures: a digital head in them, or a rig's own motors."""
    from ja_common.core.run_folder import new_run_folder
    from ja_runner.run import run_graph

    arguments = context.obj or []
    whole = with_senses(rig_graph(source), parse_senses(senses))
    graph, elsewhere = part_of_graph(whole, only, without)
    graph = replace_nodes(graph, swap or ())
    code, _ = run_graph(
        with_arguments([*[RECORDER] * record, *graph], arguments),
        new_run_folder('rig'),
        'Joint attention, on real pictures',
        lambda node: 0.0 < time_s < node.elapsed_s,
        one_process=one_process,
        view=view,
        markers=markers,
        frames=frames,
        standard_outputs=standard_outputs,
        supervision=Supervision(on_death.value, hung_after_s),
        arguments=arguments,
        elsewhere=with_arguments(elsewhere, arguments),
    )
    sys.exit(code)
