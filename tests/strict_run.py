"""A run whose opened files are all written down: `python strict_run.py LOG KIND ...`.

Files that Python opens are seen by an audit hook. OpenCV opens files without Python: each path
that is passed to it counts as opened.
"""

import os
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def main() -> None:
    """Write down the files that the run opens: a demo in one process, or robots without ROS."""
    log = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def note(event: str, arguments: tuple[Any, ...]) -> None:
        if event == 'open' and isinstance(arguments[0], str | bytes | os.PathLike):
            os.write(log, os.fsencode(os.path.abspath(os.fsdecode(arguments[0]))) + b'\n')

    sys.addaudithook(note)
    _audit_opencv()
    kind, arguments = sys.argv[2], sys.argv[3:]
    if kind == 'demo':
        sys.argv = ['ja', 'demo', '--one-process', '--no-view', '--exam', '0', *arguments]
        runpy.run_module('ja_bringup.cli', run_name='__main__')
    else:
        _without_ros(arguments)


def _audit_opencv() -> None:
    """Announce each path that is passed to a function or class of OpenCV as a file it opens."""
    import cv2

    def audited(made: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            for each in (*args, *kwargs.values()):
                if isinstance(each, str | os.PathLike) and Path(each).is_file():
                    sys.audit('open', os.fspath(each), 'rb', 0)
            return made(*args, **kwargs)

        return call

    for module in (cv2, cv2.dnn):
        for name, found in list(vars(module).items()):
            reads = name.startswith(('read', 'Cascade', 'Face', 'blobFrom', 'DetectionModel'))
            if callable(found) and reads:
                setattr(module, name, audited(found))


def _without_ros(learners: list[str]) -> None:
    """Render looks, and let a robot with each of the learners go through a few trials."""
    from ja_experiments.agents.trial_loop import TrialLoop
    from ja_experiments.config import ExperimentConfig
    from ja_experiments.datasets.looks import load_looks
    from ja_learning.core.learner_registry import make_learner
    from ja_sim.core.scene import load_scene

    looks = load_looks('easy', 0, 4)
    places = load_scene('easy').objects
    for learner in learners:
        loop = TrialLoop(ExperimentConfig(), places, looks, make_learner(learner, 0), 0)
        loop.run(5)


if __name__ == '__main__':
    main()
