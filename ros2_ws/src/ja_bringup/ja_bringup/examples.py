"""Examples for every command: the end of its `--help`; a test parses each of them."""

import typer

EXAMPLES: dict[str, dict[str, str]] = {
    'demo': {
        './ja demo': 'one minute: exam, practice, exam',
        './ja demo --learner paper --trials 2000 --time 600': "the paper's network needs more",
        './ja demo --scene default --record --one-process': 'a harder scene, all of it recorded',
        './ja demo --senses eyes,depth': 'it reads her eyes, and has a depth camera',
        './ja demo --caregiver me.jpg': 'your face plays the caregiver',
        './ja demo --resume runs/X-demo': 'resume an earlier run with all that it learned',
        './ja demo --swap gate=my_lab/my_gate --ros-args -p max_shifts:=3': 'a node of yours',
    },
    'rig': {
        './ja rig --source 0': 'a webcam, and a digital head in its picture',
        './ja rig --source walk.mp4 --time 60 --no-view': 'a video file',
        './ja rig --senses eyes --source 0': 'the learner reads her head pose and her eyes',
        './ja rig --record --ros-args -r image_raw:=/camera/image_raw': 'your camera and motors',
    },
    'meet': {
        './ja meet --source 0': 'you are the caregiver, before a webcam',
        './ja meet --source 0 --trials 60 --pace 0.7 --senses eyes': 'longer, slower, with eyes',
        './ja meet --source 0 --resume runs/X-meet': 'go on with what it learned of you',
        './ja meet --make-schedule film --trials 60': 'to film yourself: a page that speaks',
        './ja meet me.mp4 --schedule film/schedule.csv --offset 3.2': 'a film instead of a camera',
        './ja meet --rehearse sim.mp4 --trials 60 --pace 2': 'a film of the simulated caregiver',
        './ja meet --stills pictures': 'a folder of stills that state where each face looks',
        './ja meet --ros-args -r image_raw:=/camera/image_raw': 'your camera and motors',
    },
    'figures': {
        './ja figures --trials 30000 --seeds 3': 'a tenth of the paper, in a minute',
        './ja figures --ablations 5 --output runs/paper': 'all, and what the paper leaves open',
        './ja figures --values chosen': 'with the values that a sweep chose, not the first tried',
        './ja figures --data data/monday': 'on recorded faces (./ja export)',
    },
    'sweep': {
        './ja sweep grid.yaml --workers 2': 'a grid of experiments; the same line resumes it',
        './ja sweep grid.yaml --scheduler tcp://cluster:8786': 'on a Dask cluster',
    },
    'score-learner': {
        './ja score-learner': 'the baselines in every task of the benchmark',
        'PYTHONPATH=. ./ja score-learner my_lab.nearest:Nearest --seeds 0-3': 'a learner of yours',
        './ja score-learner ppo tabular --task five-objects --output runs/ppo': 'two, in one task',
    },
    'bench': {
        './ja bench': 'everything; takes a while',
        './ja bench recording --json figures.json': 'one of them, for a script too',
        './ja bench learning_speed --quick': 'in three minutes, on other caregivers',
    },
    'reference': {
        './ja reference': 'after a change of a topic or a parameter',
        './ja reference --folder preview': 'to look at it first',
    },
    'record': {
        './ja record': 'until Ctrl-C, into runs/<time>-record',
        "./ja record --exclude 'image|rosout' --time 60": 'a minute without pictures and log',
        './ja record --keep-s 3600 --ros-args -p split_s:=60.0': 'always the last hour',
    },
    'replay': {
        './ja replay runs/X-record --speed 2': 'everything again, twice as fast',
        './ja replay runs/X-record --without detections --without face_image': 'for your detector',
        './ja replay runs/X-record --score --ros-args -p learner:=paper -p seed:=3': 'its curve',
        './ja replay runs/X-record --score --json': 'the same for a script',
    },
    'export': {
        './ja export runs/X-record --to data/monday': 'one recording',
        './ja export runs/X-record runs/Y-record --to data/both --licence CC-BY-4.0': 'several',
        './ja export runs/X-record --to data/demo --ros-args -p look_around:=both_sides': (
            'of ./ja demo --record, whose robot looks around'
        ),
    },
    'faults': {
        './ja faults': 'every fault, once; a table after four minutes',
        './ja faults --only network': 'those with this in their name',
    },
    'soak': {
        './ja soak --time 28800': 'a night',
        './ja soak --time 600 --camera-rate-hz 30 --ros-args -p scene:=easy': 'ten minutes, quick',
    },
    'calibrate': {
        './ja calibrate --to head.yaml --ros-args -r image_raw:=/camera/image_raw': 'your camera',
        './ja calibrate --ros-args -p amplitude_rad:=0.06 -p loops:=4': 'less far, more often',
        './ja calibrate --ros-args -p use_sim_time:=true': 'of a simulated head',
    },
    'doctor': {
        './ja doctor': 'what is wrong, and how to fix it',
        "./ja doctor --json | jq '.[] | select(.ok | not)'": 'only what is wrong',
    },
    'topics': {
        './ja topics': 'of the graph in this ROS_DOMAIN_ID',
        'ROS_DOMAIN_ID=7 ./ja topics --time 10 --json': 'of another one, counted for longer',
    },
}
"""By command: lines to type, and the purpose of each."""


def add_examples(app: typer.Typer) -> None:
    """Add the examples below the options of every registered command."""
    for command in app.registered_commands:
        name = command.name or command.callback.__name__  # type: ignore[union-attr]
        lines = [f'{line}   # {purpose}' for line, purpose in EXAMPLES.get(name, {}).items()]
        # A paragraph for each line: lines of one paragraph would be joined.
        command.epilog = '\n\n'.join(['Examples:', *lines])
