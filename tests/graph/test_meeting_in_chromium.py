"""The page of a meeting in a real browser, in each phase; docs/view.md says what it needs.

JA_SCREENSHOTS=FOLDER keeps screenshots; those of a request are the pictures of docs/meet.md.
"""

import ast
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.context import Context
from selenium.webdriver.common.keys import Keys
from std_srvs.srv import SetBool

import fake_meeting
from chromium import browsers, console_errors, needs_chromium, served_page, wait
from fake_meeting import MEASURED, STATES
from ja_caregiver.core.meeting import Meeting, MeetingTrial, save_meeting
from ja_caregiver.core.report import write_report
from ja_common.executor import CachedWaitSetExecutor
from ja_common.graph_node import GraphNode
from ja_common.topics import CAREGIVER_REQUEST
from ros_testing import spin_until

pytestmark = [pytest.mark.slow, needs_chromium]

# Name, width and height [px], and whether it is a phone.
SCREENS = [
    ('laptop', 1366, 768, False),
    ('phone', 390, 844, True),
    ('phone_on_its_side', 844, 390, True),
    ('wide', 1920, 1080, False),
]
LAPTOP = SCREENS[0][1:]
# At two metres, letters of 8 mm are as large as those of a book: 30 px on a usual screen. A phone
# has smaller pixels, and is held or stands nearer.
LEAST_SENTENCE_PX = {'laptop': 60, 'phone': 30, 'phone_on_its_side': 30, 'wide': 60}
LEAST_NUMBER_PX = {'laptop': 280, 'phone': 150, 'phone_on_its_side': 140, 'wide': 400}
OUTSIDE = """return [...document.querySelectorAll('.mb *')]
  .filter(each => !each.closest('dialog, svg, .mb-mark, .mb-help dl'))
  .filter(each => {
    const {left, top, right, bottom, width} = each.getBoundingClientRect();
    return width && (left < -1 || top < -1 || right > innerWidth + 1 || bottom > innerHeight + 1);
  }).map(each => each.className || each.tagName)"""
VOICE = """
spoken = []; silenced = 0;
speechSynthesis.speak = each => spoken.push(each.text);
speechSynthesis.cancel = () => silenced++;"""


class Served:
    """The page of a fake meeting, in a process of its own."""

    def __init__(self, process: subprocess.Popen) -> None:
        self._process = process
        self.address = process.stdout.readline().strip()

    def show(self, state: str) -> None:
        assert self._ask(state) == 'shown'

    @property
    def requests(self) -> list[tuple]:
        return ast.literal_eval(self._ask('requests'))

    def _ask(self, line: str) -> str:
        self._process.stdin.write(f'{line}\n')
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a meeting that has ended, with its report."""
    folder = tmp_path_factory.mktemp('meet')
    things = {1: (0.0, 0.0), 2: (0.3, 0.0)}
    trials = tuple(
        MeetingTrial(n, n, 1 + n % 2, things, 1 + n % 2, 1 + (n + n // 8) % 2)
        for n in range(1, 13)
    )
    meeting = Meeting('2026-11-30T20:00:00+0000', 'webcam', 0, 'gaze', 'pixels', 'done', trials)
    save_meeting(meeting, folder)
    write_report(meeting, folder)
    return folder


@pytest.fixture(scope='module')
def meeting(folder: Path) -> Iterator[Served]:
    environ = {k: v for k, v in os.environ.items() if k != 'PYTEST_CURRENT_TEST'}
    command = [sys.executable, fake_meeting.__file__, str(folder)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environ
    ) as process:
        yield Served(process)
        process.kill()


@pytest.fixture(scope='module')
def browse() -> Iterator[Callable]:
    with browsers() as start:
        yield start


@pytest.fixture(scope='module')
def laptop(browse):
    """Return a browser, of which a test may change nothing but the page."""
    browser = browse(*LAPTOP)
    browser.execute_cdp_cmd('Page.addScriptToEvaluateOnNewDocument', {'source': VOICE})
    return browser


@pytest.fixture
def browser(laptop, meeting: Served):
    """Return a browser at the page, whose voice is recorded in `spoken`."""
    meeting.show('thing')
    laptop.get(f'{meeting.address}/meet')
    wait(lambda: phase(laptop) == 'thing' and picture_is_shown(laptop))
    return laptop


def phase(browser) -> str:
    return browser.execute_script("return document.querySelector('.mb')?.dataset.phase ?? ''")


def text(browser) -> str:
    return browser.find_element('css selector', '.mb').text


def shows(browser, css: str) -> bool:
    return any(each.is_displayed() for each in browser.find_elements('css selector', css))


def picture_is_shown(browser) -> bool:
    return browser.execute_script(
        "return document.querySelector('.mb-view img')?.naturalWidth > 0"
    )


def font_px(browser, css: str) -> float:
    script = f"return getComputedStyle(document.querySelector('{css}')).fontSize"
    return float(browser.execute_script(script).removesuffix('px'))


def press(browser, key: str) -> None:
    browser.switch_to.active_element.send_keys(key)


def button(browser, name: str):
    found = browser.find_elements('css selector', '.mb-controls button, .mb-confirm[open] button')
    return next(each for each in found if each.text.startswith(name))


def switch(browser, meeting: Served, state: str) -> None:
    """Show another state, and wait for it."""
    meeting.show(state)
    message, values = STATES[state]
    shown = values.get('phase', state)
    wait(lambda: phase(browser) == shown and message in text(browser))


def keep(browser, name: str) -> None:
    if folder := os.environ.get('JA_SCREENSHOTS'):
        Path(folder).mkdir(parents=True, exist_ok=True)
        # Without what moves, so that a picture of the docs is always the same.
        browser.execute_script('document.getAnimations().forEach(each => each.cancel())')
        browser.save_screenshot(str(Path(folder) / f'meet_{name}.png'))


@pytest.mark.parametrize('screen', SCREENS, ids=lambda screen: screen[0])
def test_each_phase_fits_the_screen_and_can_be_read_from_afar(screen, meeting, browse):
    name, width, height, phone = screen
    browser = browse(width, height, phone)
    meeting.show('starting')
    browser.get(f'{meeting.address}/meet')
    wait(lambda: phase(browser) == 'starting' and picture_is_shown(browser))
    for state in STATES:
        switch(browser, meeting, state)
        keep(browser, f'{name}_{state}')
        assert browser.execute_script(OUTSIDE) == [], state
        size = 'return [document.documentElement.scrollWidth, document.body.scrollHeight]'
        wide, high = browser.execute_script(size)
        assert wide <= width, state
        assert high <= height, state
        if state == 'thing':
            assert font_px(browser, '.mb-sentence') >= LEAST_SENTENCE_PX[name]
            assert font_px(browser, '.mb-number') >= LEAST_NUMBER_PX[name]
            assert browser.find_element('css selector', '.mb-number').text == '4'
    assert console_errors(browser) == [], "the page's own policy blocks nothing of it"


def test_right_and_wrong_differ_in_more_than_their_colour(browser, meeting):
    seen = {}
    for state in ('right', 'wrong'):
        switch(browser, meeting, state)
        word = browser.find_element('css selector', '.mb-verdict').text
        symbol = browser.find_element('css selector', '.mb-symbol path').get_attribute('d')
        shape, line = browser.execute_script("""return [
          getComputedStyle(document.querySelector('.mb-symbol')).borderRadius,
          getComputedStyle(document.querySelector('.mb-frame')).outlineStyle]""")
        seen[state] = (word, symbol, shape, line)
    assert (seen['right'][0], seen['wrong'][0]) == ('Right', 'Wrong')
    assert all(right != wrong for right, wrong in zip(*seen.values(), strict=True))


def test_the_numbers_stand_in_the_picture_and_the_asked_one_is_larger(browser):
    frame, *marks = browser.execute_script("""
      const box = each => (({left, top, width, height}) => [left, top, width, height])(
        each.getBoundingClientRect());
      return [document.querySelector('.mb-view'), ...document.querySelectorAll('.mb-mark b')]
        .map(box)""")
    texts = [each.text for each in browser.find_elements('css selector', '.mb-mark b')]
    sizes = dict(zip(texts, (mark[3] for mark in marks), strict=True))
    assert sorted(sizes) == ['1', '2', '3', '4', '5', '6']
    assert sizes['4'] == max(sizes.values()) > 1.3 * sizes['1']
    for left, top, width, height in marks:
        assert frame[0] <= left
        assert left + width <= frame[0] + frame[2]
        assert frame[1] <= top
        assert top + height <= frame[1] + frame[3]
    assert len(browser.find_elements('css selector', '.mb-outside')) == 1


def test_the_picture_comes_back_after_the_end(browser, meeting):
    switch(browser, meeting, 'ended')
    assert not shows(browser, '.mb-view img')
    switch(browser, meeting, 'camera')
    assert shows(browser, '.mb-view img')


def test_the_space_bar_pauses_and_goes_on(browser, meeting):
    before = len(meeting.requests)
    press(browser, ' ')
    wait(lambda: meeting.requests[before:] == [('caregiver/pause', True)])
    switch(browser, meeting, 'paused')
    press(browser, ' ')
    wait(lambda: meeting.requests[before + 1 :] == [('caregiver/pause', False)])


def test_it_ends_only_after_a_confirmation(browser, meeting):
    before = len(meeting.requests)
    press(browser, Keys.ESCAPE)
    wait(lambda: shows(browser, '.mb-confirm'))
    press(browser, Keys.ESCAPE)
    wait(lambda: not shows(browser, '.mb-confirm'))
    button(browser, 'End').click()
    wait(lambda: shows(browser, '.mb-confirm'))
    button(browser, 'Go on').click()
    assert meeting.requests[before:] == []
    press(browser, Keys.ESCAPE)
    wait(lambda: shows(browser, '.mb-confirm'))
    press(browser, Keys.ENTER)
    wait(lambda: meeting.requests[before:] == [('caregiver/end',)])
    assert not shows(browser, '.mb-confirm')


def test_enter_states_that_the_things_were_moved_in_that_phase_alone(browser, meeting):
    before = len(meeting.requests)
    press(browser, Keys.ENTER)
    switch(browser, meeting, 'rearrange')
    press(browser, Keys.ENTER)
    wait(lambda: meeting.requests[before:] == [('caregiver/rearranged',)])
    button(browser, 'Done').click()
    wait(lambda: len(meeting.requests) == before + 2)


def test_a_key_after_a_click_does_not_press_that_button_again(browser, meeting):
    before = len(meeting.requests)
    button(browser, 'Voice').click()
    press(browser, ' ')
    wait(lambda: meeting.requests[before:] == [('caregiver/pause', True)])
    assert button(browser, 'Voice').text.startswith('Voice on')


def test_each_request_is_spoken_once_and_only_with_the_voice_on(browser, meeting):
    def spoken():
        return browser.execute_script('return spoken')

    assert button(browser, 'Voice').text.startswith('Voice off')
    switch(browser, meeting, 'camera')
    assert spoken() == []
    press(browser, 'v')
    wait(lambda: spoken() == ['Look at the camera.'])
    assert button(browser, 'Voice').text.startswith('Voice on')
    for state in ('thing', 'wrong', 'camera'):
        switch(browser, meeting, state)
    wait(lambda: len(spoken()) == 4)
    assert spoken()[1:3] == ['Look at thing 4.', 'I looked at thing 2: wrong.']
    button(browser, 'Voice').click()
    switch(browser, meeting, 'thing')
    assert len(spoken()) == 4
    assert browser.execute_script('return silenced') > 0


def test_a_browser_without_a_voice_states_it(browser, meeting):
    browser.execute_script("""
      speechSynthesis.speak = each => each.onerror({error: 'synthesis-unavailable'})""")
    press(browser, 'v')
    found = button(browser, 'Voice')
    wait(lambda: 'synthesis-unavailable' in found.get_attribute('title'))
    assert found.text.startswith('Voice off')


def test_the_help_covers_neither_the_number_nor_the_sentence(browser):
    press(browser, 'h')
    wait(lambda: shows(browser, '.mb-help'))
    apart = """
      const box = css => document.querySelector(css).getBoundingClientRect();
      const [a, b] = [...arguments].map(box);
      return a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top"""
    for css in ('.mb-number', '.mb-sentence'):
        assert browser.execute_script(apart, '.mb-help', css)
    keep(browser, 'laptop_help')
    press(browser, Keys.ESCAPE)
    wait(lambda: not shows(browser, '.mb-help'))
    assert not shows(browser, '.mb-confirm')


def test_texts_of_the_graph_are_shown_as_they_are(browser, meeting):
    meeting.show('hostile')
    wait(lambda: '<img src=x onerror=hacked=1>{{ 1+1 }}' in text(browser))
    assert browser.execute_script('return typeof hacked') == 'undefined'
    assert console_errors(browser) == []


def test_nothing_moves_for_those_who_want_no_motion(browser, meeting):
    def moving():
        return browser.execute_script('return document.getAnimations().length')

    assert moving() > 0
    reduced = {'features': [{'name': 'prefers-reduced-motion', 'value': 'reduce'}]}
    browser.execute_cdp_cmd('Emulation.setEmulatedMedia', reduced)
    try:
        wait(lambda: moving() == 0)
    finally:
        browser.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': []})


def test_a_scorer_that_has_died_is_shown_as_silent(browser, meeting):
    meeting.show('silent')
    wait(lambda: 'The meeting is silent.' in text(browser))
    assert not shows(browser, '.mb-number')
    keep(browser, 'laptop_silent')


def test_the_first_page_leads_to_the_meeting_and_a_link_to_the_full_view(browser, meeting):
    meeting.show('none')
    browser.get(meeting.address)
    wait(lambda: 'looking at the caregiver' in browser.page_source)
    meeting.show('camera')
    wait(lambda: browser.current_url.endswith('/meet') and phase(browser) == 'camera')
    browser.get(meeting.address)
    wait(lambda: browser.current_url.endswith('/meet') and phase(browser) == 'camera')
    browser.find_element('link text', 'Full view').click()
    wait(lambda: browser.current_url.endswith('/view'))
    wait(lambda: 'looking at the caregiver' in browser.page_source)
    browser.find_element('link text', 'the meeting').click()
    wait(lambda: phase(browser) == 'camera')


def test_the_end_leads_to_the_report(browser, meeting):
    switch(browser, meeting, 'ended')
    assert 'This is better than guessing.' in text(browser)
    browser.get(browser.find_element('link text', 'Open the report').get_attribute('href'))
    assert '12 of 12' in browser.find_element('css selector', 'body').text
    size = browser.execute_script("return getComputedStyle(document.querySelector('b')).fontSize")
    assert float(size.removesuffix('px')) > 40, 'its style is applied'
    assert console_errors(browser) == []


@pytest.fixture
def live_page(domain: int, tmp_path: Path) -> Iterator[str]:
    """Serve the page of a `view` in the test's domain; return its address."""
    with served_page(tmp_path) as address:
        yield address


def test_a_scorer_of_the_graph_is_shown_and_paused(live_page, ros_context: Context, laptop):
    scorer = GraphNode('request_scorer', context=ros_context)
    paused: list[bool] = []

    def pause(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        paused.append(request.data)
        response.success = True
        return response

    scorer.advertise_service(SetBool, 'caregiver/pause', pause)
    values = MEASURED | {'phase': 'thing', 'number': '12'}
    asked = DiagnosticStatus(
        name='/request_scorer', message='Look at thing 12.',
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )  # fmt: skip
    scorer.create_timer(
        0.2, partial(scorer.create_topic_publisher(CAREGIVER_REQUEST).publish, asked)
    )
    executor = CachedWaitSetExecutor(context=ros_context)
    executor.add_node(scorer)
    laptop.get(live_page)
    spin_until(executor, lambda: phase(laptop) == 'thing' and 'Look at thing 12.' in text(laptop))
    assert laptop.find_element('css selector', '.mb-number').text == '12'
    spin_until(executor, lambda: button(laptop, 'Pause').is_enabled())
    press(laptop, ' ')
    spin_until(executor, lambda: paused == [True])
    executor.shutdown()
    scorer.destroy_node()
