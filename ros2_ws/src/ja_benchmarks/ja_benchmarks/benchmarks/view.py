"""The cost of a viewer of the live page: images a second with and without one, in one run."""

import threading
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np

from ja_benchmarks.rows import Row, row
from ja_common.core.config import ConfigError
from ja_common.core.live_page import LIVE_PAGE
from ja_dashboard.page import PICTURE_URL
from ja_runner.companion import Companion
from ja_runner.graph import sim_graph
from ja_runner.node_spec import NodeSpec
from ja_runner.progress import ProgressNode
from ja_runner.run import run_graph

WARM_UP_S = 8.0
BLOCK_S = 5.0
BLOCKS = 12
PICTURE_EVERY_S = 0.1


def run() -> dict[str, Row]:
    """Alternate blocks with and without a viewer, so that other load affects both equally."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        announcements: list[str] = []
        spec = NodeSpec('ja_dashboard', 'view')
        with Companion(spec, folder / 'log', announcements.append, LIVE_PAGE) as page:
            blocks = _Blocks(page, announcements)
            code, _ = run_graph(sim_graph(), folder, 'bench view', blocks.tick)
    if code:
        raise ConfigError('the graph did not run to the end of the measurement')
    return blocks.rows()


class _Blocks:
    """Turns the viewer on and off, and counts the images of each block."""

    def __init__(self, page: Companion, announcements: list[str]) -> None:
        self._page = page
        self._announcements = announcements
        self._viewer: _Viewer | None = None
        self._edge: tuple[float, int] | None = None
        self._rates: dict[bool, list[float]] = {False: [], True: []}
        self._pictures = 0

    def tick(self, node: ProgressNode) -> bool:
        self._page.report_events()
        now_s = time.monotonic()
        if not self._announcements or node.elapsed_s < WARM_UP_S:
            return False
        if self._edge is None:
            self._edge = (now_s, node.images)
        began_s, images = self._edge
        if now_s - began_s < BLOCK_S:
            return False
        watched = self._viewer is not None
        self._rates[watched].append((node.images - images) / (now_s - began_s))
        if self._viewer is None:
            self._viewer = _Viewer(self._announcements[0].removeprefix(LIVE_PAGE))
            self._viewer.start()
        else:
            self._pictures += self._viewer.stop()
            self._viewer = None
        self._edge = (time.monotonic(), node.images)
        return sum(map(len, self._rates.values())) >= BLOCKS

    def rows(self) -> dict[str, Row]:
        without, watched = self._rates[False], self._rates[True]
        ratio = np.array(watched) / np.array(without)
        return {
            'image steps, no viewer': row(without, 'images/s'),
            'image steps, one viewer': row(watched, 'images/s'),
            'one viewer against none': row(ratio, '(ratio)'),
            'pictures to the viewer': {
                'value': self._pictures / (len(watched) * BLOCK_S),
                'unit': 'pictures/s',
                'n': self._pictures,
                'interval': None,
            },
        }


class _Viewer(threading.Thread):
    """A thread that fetches pictures as a browser does, one after the other."""

    def __init__(self, address: str) -> None:
        super().__init__(name='viewer', daemon=True)
        self._url = f'{address}{PICTURE_URL}'
        self._stopped = threading.Event()
        self._pictures = 0

    def run(self) -> None:
        while not self._stopped.wait(PICTURE_EVERY_S):
            try:
                with urlopen(self._url, timeout=5.0) as answer:
                    self._pictures += bool(answer.read())
            except HTTPError:
                continue  # before the first picture

    def stop(self) -> int:
        """Stop, and return the number of pictures received."""
        self._stopped.set()
        self.join()
        return self._pictures
