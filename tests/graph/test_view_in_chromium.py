"""The live page of a running graph in a real browser; docs/view.md says what it needs.

JA_SCREENSHOTS=FOLDER keeps screenshots.
"""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from nicegui import __version__

from chromium import browsers, console_errors, needs_chromium, served_page, wait
from ros_testing import PATIENCE_S

pytestmark = [pytest.mark.slow, needs_chromium]

# Name, width and height [px], and whether it is a phone.
SCREENS = [('laptop', 1366, 1000, False), ('phone', 390, 844, True)]


ATTACK = """<!doctype html><title>another site</title>
<iframe src="http://ADDRESS/"></iframe>
<script>
results = {};
function note(what, target, good, bad) {
  target[`on${good}`] = () => results[what] = 'open';
  target[`on${bad}`] = () => results[what] ??= 'closed';
}
const socket = '/_nicegui_ws/socket.io/?EIO=4&transport=websocket';
note('socket', new WebSocket(`ws://ADDRESS${socket}`), 'open', 'close');
for (const [tag, path] of [['img', '/favicon.ico'], ['script', 'SCRIPT']]) {
  const element = document.createElement(tag);
  note(tag, element, 'load', 'error');
  element.src = `http://ADDRESS${path}`;
  document.head.append(element);
}
for (const [what, options] of [
  ['page', {}],
  ['cookies', {credentials: 'include'}],
  ['post', {method: 'POST', body: '40'}],
])
  fetch('http://ADDRESS/', options)
    .then(() => results[what] = 'open', () => results[what] = 'closed');
</script>"""


@pytest.fixture
def demo(request, domain: int, tmp_path: Path) -> Iterator[tuple[str, int]]:
    """Start a demo, with further options; return the address of its page and its process id."""
    options = getattr(request, 'param', [])
    process = subprocess.Popen(
        [sys.executable, '-m', 'ja_bringup.cli', 'demo', '--exam', '0', '--on-death', 'restart',
         *options],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    lines = []
    for line in iter(process.stdout.readline, ''):
        lines.append(line)
        if 'live page: ' in line:
            break
    else:
        raise AssertionError(f'the demo ended without an address: {"".join(lines)}')
    yield lines[-1].split('live page: ')[1].strip(), process.pid
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, output


@pytest.fixture
def page(request, domain: int, tmp_path: Path) -> Iterator[str]:
    """Serve the page on a host, without a graph; return its address."""
    with served_page(tmp_path, '--ros-args', '-p', f'host:={request.param}') as address:
        yield address


@pytest.fixture
def foreign_page() -> Iterator[Callable[[str], str]]:
    """Return a maker of another site's page that uses the page at an address in every way."""
    pages: dict[str, bytes] = {}

    class Site(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header('Content-Type', 'text/html')
            self.end_headers()
            self.wfile.write(pages.get(self.path, b''))

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(('127.0.0.1', 0), Site) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()

        def make(address: str) -> str:
            attack = ATTACK.replace('SCRIPT', f'/_nicegui/{__version__}/static/nicegui.js')
            pages['/attack'] = attack.replace('ADDRESS', urlsplit(address).netloc).encode()
            return f'http://localhost:{server.server_address[1]}/attack'

        yield make
        server.shutdown()


@pytest.fixture
def browse() -> Iterator[Callable]:
    with browsers() as start:
        yield start


def keep(browser, name: str) -> None:
    if folder := os.environ.get('JA_SCREENSHOTS'):
        Path(folder).mkdir(parents=True, exist_ok=True)
        browser.save_screenshot(str(Path(folder) / f'view_{name}.png'))


def text(browser) -> str:
    return browser.find_element('css selector', 'body').text


def picture(browser) -> np.ndarray:
    """Return the robot's picture as the browser shows it, (H, W, 3) BGR."""
    png = browser.find_element('css selector', 'img').screenshot_as_png
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)


def source(browser) -> str:
    return browser.execute_script("return document.images[0]?.src ?? ''")


def wait_for_picture(browser) -> None:
    wait(lambda: browser.execute_script('return document.images[0]?.naturalWidth') == 640)


@pytest.mark.parametrize('screen', SCREENS, ids=lambda screen: screen[0])
def test_a_viewer_sees_and_controls_the_robot(screen, demo, browse):
    name, width, height, phone = screen
    browser = browse(width, height, phone)
    browser.get(demo[0])
    wait(lambda: 'running' in text(browser) and 'fixated by' in text(browser))
    wait_for_picture(browser)
    first, first_source = picture(browser), source(browser)
    # A new picture, not only a change of its style.
    wait(lambda: source(browser) != first_source)
    wait(lambda: np.abs(picture(browser).astype(int) - first).mean() > 2)
    wide = browser.execute_script('return document.documentElement.scrollWidth')
    assert wide <= width, 'no element is wider than the screen'
    keep(browser, name)

    toggle = browser.find_element('xpath', "//div[contains(@class,'q-toggle')][.='pause']")
    toggle.click()
    wait(lambda: 'the simulation is paused' in text(browser))
    keep(browser, f'{name}_paused')
    toggle.click()
    paused = source(browser)
    wait(lambda: 'the simulation is paused' not in text(browser))
    wait(lambda: source(browser) != paused)
    assert console_errors(browser) == [], "the page's own policy blocks nothing of it"


@pytest.mark.parametrize('demo', [['--senses', 'eyes,depth']], indirect=True, ids=['senses'])
@pytest.mark.parametrize('screen', SCREENS, ids=lambda screen: screen[0])
def test_landmarks_gaze_ranges_and_the_track_are_shown(screen, demo, browse):
    name, width, height, phone = screen
    browser = browse(width, height, phone)
    browser.get(demo[0])
    wait(lambda: 'landmarks' in text(browser) and 'iris_landmark.onnx=' in text(browser))
    # The demo ends in order only after a scored trial.
    wait(lambda: 'success, last' in text(browser))
    wait_for_picture(browser)
    wait(lambda: browser.find_elements('css selector', 'line.gaze'))
    wait(lambda: pink(picture(browser)) > 30)  # the arrow of her gaze
    titles = browser.execute_script(
        "return [...document.querySelectorAll('svg title')].map(title => title.textContent)"
    )
    assert any(re.fullmatch(r'(face|object \d+), \d\.\d\d m', title) for title in titles), titles
    keep(browser, f'{name}_senses')
    wide = browser.execute_script('return document.documentElement.scrollWidth')
    assert wide <= width, 'no element is wider than the screen'
    assert console_errors(browser) == []


def pink(image: np.ndarray) -> int:
    """Return how many pixels have about the colour of the arrow."""
    blue, green, red = np.moveaxis(image.astype(int), -1, 0)
    return int(((red > 210) & (green < 130) & (blue > 150)).sum())


@pytest.mark.parametrize('page', ['127.0.0.1', '0.0.0.0'], indirect=True)
def test_the_page_is_for_itself_and_for_no_other_site(page, foreign_page, browse):
    browser = browse(*SCREENS[0][1:])
    browser.get(page)
    # The number of seconds comes through the socket.
    wait(lambda: 'no new image for' in text(browser))
    assert 'token' not in browser.current_url
    browser.refresh()
    wait(lambda: 'no new image for' in text(browser))
    assert console_errors(browser) == []

    browser.get(foreign_page(page))
    wait(lambda: browser.execute_script('return Object.keys(results).length') == 6)
    results = browser.execute_script('return results')
    assert set(results.values()) == {'closed'}, results
    browser.switch_to.frame(0)
    assert 'Joint attention' not in text(browser)


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
def test_a_name_that_was_rebound_to_this_machine_shows_nothing(page, browse):
    browser = browse(*SCREENS[0][1:])
    browser.get(f'http://evil.example:{urlsplit(page).port}/')
    assert 'not served under that host name' in text(browser)


@pytest.mark.parametrize('page', ['0.0.0.0'], indirect=True)
def test_without_its_token_the_page_shows_nothing(page, browse):
    browser = browse(*SCREENS[0][1:])
    browser.get(page.split('?')[0])
    assert 'needs its token' in text(browser)


def test_a_frozen_graph_is_shown_as_stopped(demo, browse):
    browser = browse(*SCREENS[0][1:])
    address, pid = demo
    browser.get(address)
    wait(lambda: 'fixated by' in text(browser))
    wait_for_picture(browser)
    bright = picture(browser).mean()
    sim = child(pid, 'ja_sim.sim_node')
    os.kill(sim, signal.SIGSTOP)
    try:
        wait(lambda: 'no new image for' in text(browser))
        wait(lambda: picture(browser).mean() < 0.7 * bright)  # the old picture is darkened
        frozen = source(browser)
        keep(browser, 'stopped')
    finally:
        os.kill(sim, signal.SIGCONT)
    wait(lambda: 'no new image for' not in text(browser))
    wait(lambda: source(browser) != frozen)


def child(parent: int, module: str) -> int:
    """Return the process id of a node that a demo has started."""
    children = Path(f'/proc/{parent}/task/{parent}/children').read_text().split()
    return next(int(p) for p in children if module in Path(f'/proc/{p}/cmdline').read_text())
