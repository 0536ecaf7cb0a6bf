"""Run a graph in either composition, with its progress on the terminal."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from rclpy.context import Context

from ja_common.core.config import ConfigError
from ja_common.core.live_page import LIVE_PAGE
from ja_common.private_executor import own_executor
from ja_common.ros_arguments import check_ros_arguments
from ja_common.ros_defaults import apply_ros_defaults
from ja_runner.companion import Companion
from ja_runner.graph import NodeSpec
from ja_runner.one_process import run_in_one_process
from ja_runner.progress import Display, ProgressNode
from ja_runner.supervisor import OnDeath, Supervisor

# The learner and the gate are kept side by side, so that they are of the same age when they go on.
_MEMORY = {
    'learning_module': {'checkpoint_folder': 'checkpoints'},
    'gate': {'trials_file': 'trials'},
}


def new_run_folder(name: str, parent: Path = Path('runs')) -> Path:
    """`runs/<time>-<name>`, made."""
    folder = parent / f'{time.strftime("%Y%m%d-%H%M%S")}-{name}'
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def run_graph(
    graph: Sequence[NodeSpec],
    folder: Path,
    title: str,
    done: Callable[[ProgressNode], bool],
    *,
    one_process: bool = False,
    view: bool = False,
    on_death: OnDeath = 'stop',
    arguments: Sequence[str] = (),
    memory: Path | None = None,
) -> tuple[int, ProgressNode]:
    """Run until `done`, a signal, or a death; the exit code, and the node that has watched.

    `arguments`: the ROS arguments that all nodes get (a namespace is the watcher's as well).
    `memory`: where what is learned is kept, and taken up if it is there; by default the folder.
    `view`: serve the live page beside the graph, in a process of its own.
    """
    apply_ros_defaults()
    check_ros_arguments(arguments)
    graph = [_with_memory(spec, (memory or folder).absolute()) for spec in graph]
    watcher: list[ProgressNode] = []

    def make_watcher(context: Context) -> ProgressNode:
        cli = ['--ros-args', *arguments] if arguments else []
        watcher.append(ProgressNode(context=context, cli_args=cli, use_global_arguments=False))
        return watcher[0]

    with Display(title) as display, ExitStack() as beside:
        page: Companion | None = None
        if view:
            spec = NodeSpec('ja_dashboard', 'view', arguments=arguments)
            page = Companion(spec, folder / 'log', display.say, LIVE_PAGE)
            beside.enter_context(page)

        def is_done() -> bool:
            display.show(watcher[0])
            if page is not None:
                page.look()
            return done(watcher[0])

        if one_process:
            code = run_in_one_process(graph, make_watcher, is_done, display.say)
        else:
            code = _run_processes(graph, folder, make_watcher, is_done, on_death, display.say)
    return code, watcher[0]


def check_memory(folder: Path) -> None:
    """Raises ConfigError when a run has left nothing that another could go on from."""
    checkpoints = folder / _MEMORY['learning_module']['checkpoint_folder']
    if not list(checkpoints.glob('*.npz')):
        raise ConfigError(f'{folder} cannot be resumed: there is no checkpoint in {checkpoints}')


def _with_memory(spec: NodeSpec, folder: Path) -> NodeSpec:
    """What the node learns outlives it in the folder, if nobody named another place."""
    ours = {name: str(folder / place) for name, place in _MEMORY.get(spec.thing, {}).items()}
    return replace(spec, parameters={**ours, **spec.parameters})


def _run_processes(
    graph: Sequence[NodeSpec],
    folder: Path,
    make_watcher: Callable[[Context], ProgressNode],
    is_done: Callable[[], bool],
    on_death: OnDeath,
    say: Callable[[str], None],
) -> int:
    with own_executor() as executor:
        executor.add_node(make_watcher(executor.context))

        def tick() -> bool:
            executor.spin_once(timeout_sec=0.1)
            return is_done()

        return Supervisor(graph, folder / 'log', on_death, say).run(tick)
