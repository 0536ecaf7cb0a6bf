"""Run a graph in one process or in many, with its progress on the terminal."""

import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from rclpy.context import Context

from ja_common.core.config import ConfigError
from ja_common.core.files import check_writable
from ja_common.core.live_page import LIVE_PAGE
from ja_common.private_context import private_executor
from ja_common.ros_arguments import check_ros_arguments
from ja_common.ros_defaults import apply_ros_defaults
from ja_runner.companion import Companion
from ja_runner.image_transport import image_loss_warning
from ja_runner.node_spec import NodeSpec
from ja_runner.one_process import run_in_one_process
from ja_runner.parameter_files import check_parameter_files
from ja_runner.parts import check_installed, is_installed
from ja_runner.progress import Display, ProgressNode
from ja_runner.running_nodes import claim_names, full_names
from ja_runner.supervisor import DEFAULT, Supervision, Supervisor

# Learner and gate save into the same folder, so that both resume from the same trial.
_MEMORY = {
    'learning_module': {'checkpoint_folder': 'checkpoints'},
    'gate': {'trials_file': 'trials'},
}

_COMPANIONS = {
    'view': ('ja_dashboard', 'is no live page'),
    'markers': ('ja_dashboard', 'are no markers'),
    'head_frames': ('ja_control', 'are no frames'),
    'standard_outputs': ('ja_perception', 'are no standard outputs'),
}
"""The nodes beside a graph: the package of each, and what is missing without it."""
_STAMPED = {'head_frames', 'standard_outputs'}
"""Those that compare the stamps of sensors with their clock, which has to be the graph's."""


def run_graph(
    graph: Sequence[NodeSpec],
    folder: Path,
    title: str,
    done: Callable[[ProgressNode], bool],
    *,
    one_process: bool = False,
    view: bool = False,
    markers: bool = False,
    frames: bool = False,
    standard_outputs: bool = False,
    supervision: Supervision = DEFAULT,
    arguments: Sequence[str] = (),
    memory: Path | None = None,
    elsewhere: Sequence[NodeSpec] = (),
) -> tuple[int, ProgressNode]:
    """Run until `done`, a signal, or a death; return the exit code and the progress node.

    Raises ConfigError if nodes of the same names run in this ROS domain already, or for a
    parameter file that is for none of the nodes.
    `arguments`: the ROS arguments of all nodes (the progress node gets the namespace as well).
    `memory`: the folder in which learner and gate save what they learned, and from which they
    resume if it is there; by default `folder`.
    `view`: serve the live page beside the graph, in its own process. In the same way `markers`
    draws for RViz and Foxglove, `frames` publishes where the frames of the head are, and
    `standard_outputs` what was seen, in the message types of others. `elsewhere`: the nodes of the
    graph that run on another machine, for which the parameter files may be as well.
    """
    apply_ros_defaults()
    check_ros_arguments(arguments)
    check_installed(spec.package for spec in graph)
    for place in {folder, memory or folder}:
        check_writable(place)
    graph = [_with_memory(spec, (memory or folder).absolute()) for spec in graph]
    wanted = (view, markers, frames, standard_outputs)
    beside_graph = [
        NodeSpec(package, name, _clock_of(graph) if name in _STAMPED else {}, arguments=arguments)
        for (name, (package, _)), is_wanted in zip(_COMPANIONS.items(), wanted, strict=True)
        if is_wanted
    ]
    unread = check_parameter_files(full_names([*graph, *beside_graph, *elsewhere]), arguments)
    progress: list[ProgressNode] = []

    def make_progress_node(context: Context) -> ProgressNode:
        cli = ['--ros-args', *arguments] if arguments else []
        progress.append(ProgressNode(context=context, cli_args=cli, use_global_arguments=False))
        return progress[0]

    with claim_names(graph), Display(title) as display, ExitStack() as beside:
        for sentence in unread:
            display.print_line(f'warning: {sentence}')
        companions: list[Companion] = []
        for spec in beside_graph:
            if not is_installed(spec.package):
                _, missing = _COMPANIONS[spec.executable]
                display.print_line(f'there {missing}: {spec.package} is not installed')
                continue
            announcement = LIVE_PAGE if spec.executable == 'view' else ''
            companion = Companion(spec, folder / 'log', display.print_line, announcement)
            companions.append(beside.enter_context(companion))

        def is_done() -> bool:
            display.update(progress[0])
            for companion in companions:
                companion.report_events()
            return display.reader_has_gone or done(progress[0])

        if one_process:
            code = run_in_one_process(graph, make_progress_node, is_done, display.print_line)
        else:
            code = _run_processes(
                graph, folder, make_progress_node, is_done, supervision, display.print_line
            )
    if not progress:  # a node could not be made: the display shows which, and why
        sys.exit(code)
    return code, progress[0]


def check_memory(folder: Path) -> None:
    """Raise ConfigError when the run in this folder left no checkpoint to resume from."""
    checkpoints = folder / _MEMORY['learning_module']['checkpoint_folder']
    if not list(checkpoints.glob('*.npz')):
        raise ConfigError(f'{folder} cannot be resumed: there is no checkpoint in {checkpoints}')


def _clock_of(graph: Sequence[NodeSpec]) -> dict[str, bool]:
    return {'use_sim_time': any(spec.parameters.get('use_sim_time') for spec in graph)}


def _with_memory(spec: NodeSpec, folder: Path) -> NodeSpec:
    """Return the node with parameters that save what it learns, unless they are set already."""
    ours = {name: str(folder / place) for name, place in _MEMORY.get(spec.executable, {}).items()}
    return replace(spec, parameters={**ours, **spec.parameters})


def _run_processes(
    graph: Sequence[NodeSpec],
    folder: Path,
    make_progress_node: Callable[[Context], ProgressNode],
    is_done: Callable[[], bool],
    supervision: Supervision,
    report: Callable[[str], None],
) -> int:
    if warning := image_loss_warning():
        report(warning)
    with private_executor() as executor:
        executor.add_node(make_progress_node(executor.context))

        def tick() -> bool:
            executor.spin_once(timeout_sec=0.1)
            return is_done()

        return Supervisor(graph, folder / 'log', supervision, report).run(tick)
