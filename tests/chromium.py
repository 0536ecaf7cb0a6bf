"""Chromium without a window, for the tests of pages; docs/view.md says what they need."""

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ros_testing import PATIENCE_S

CHROMIUM, DRIVER = shutil.which('chromium'), shutil.which('chromedriver')

needs_chromium = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason='needs chromium and chromium-driver'
)


@contextmanager
def served_page(folder: Path, *arguments: str) -> Iterator[str]:
    """Run a `view` in a folder, with ROS arguments; give the address of its page in the block."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'ja_dashboard.view_node', *arguments],
        cwd=folder, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    yield process.stdout.readline().split('live page: ')[1].strip()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0


@contextmanager
def browsers() -> Iterator[Callable]:
    """Give a maker of browsers in the block: width and height [px], and whether it is a phone."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    started = []

    def start(width: int, height: int, phone: bool) -> webdriver.Chrome:
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for flag in (
            'headless=new', 'no-sandbox', 'disable-gpu', 'disable-quic', 'no-first-run',
            'disable-background-networking', 'disable-component-update', 'disable-sync',
            'hide-scrollbars', 'host-resolver-rules=MAP evil.example 127.0.0.1',
        ):  # fmt: skip
            options.add_argument(f'--{flag}')
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        browser = webdriver.Chrome(options=options, service=Service(DRIVER))
        started.append(browser)
        screen = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': phone}
        browser.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', screen)
        return browser

    try:
        yield start
    finally:
        for browser in started:
            browser.quit()


def wait(condition: Callable[[], object], timeout_s: float = PATIENCE_S) -> None:
    """Sleep until the condition holds."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, f'not within {timeout_s:g} s'
        time.sleep(0.1)


def console_errors(browser) -> list[str]:
    """Return the errors in the console of the browser."""
    return [entry['message'] for entry in browser.get_log('browser') if entry['level'] == 'SEVERE']
