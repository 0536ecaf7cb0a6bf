"""The page of a meeting as a browser gets it, from a model with one frame."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import replace

import cv2
import httpx
import numpy as np
import pytest
from nicegui.testing import User, user_simulation

from fake_meeting import STATES, FakeMeeting
from fake_page import CAMERA, FakeModel
from ja_dashboard.core.view_model import RunState, SceneView, State
from ja_dashboard.image_feed import Picture
from ja_dashboard.meeting_page import (
    FULL_VIEW_URL,
    MEETING_URL,
    PLAIN_PICTURE_URL,
    REPORT_URL,
    MeetingBoard,
    board_of,
)
from ja_dashboard.page import Page
from ja_dashboard.server import picture_app
from ros_testing import PATIENCE_S


def picture(stamp_ns: int, grey: int = 60, size: tuple[int, int] = (240, 320)) -> Picture:
    return Picture(stamp_ns, np.full((*size, 3), grey, np.uint8), [], None, CAMERA, 0.0)


def scene(posture: tuple[float, float] | None = (0.0, 0.0)) -> SceneView:
    at = None if posture is None else np.array(posture)
    return SceneView((0.3, 0.2), np.zeros(2), np.zeros(2), posture=at)


@pytest.fixture
def model() -> FakeMeeting:
    model = FakeMeeting(picture(1), scene())
    model.show('thing')
    return model


def browse(
    model: FakeModel, path: str, steps: Callable[[User], Awaitable[None]] | None = None
) -> str:
    """Open a page and take steps on it; return the path to which the page was led."""

    async def visit() -> str:
        async with user_simulation(root=Page(model).build) as user:
            answer = await user.http_client.get(path)
            if answer.is_redirect:
                return answer.headers['location']
            await user.open(path)
            if steps is not None:
                await steps(user)
            return path

    return asyncio.run(visit())


async def until(condition: Callable[[], object]) -> None:
    end_s = asyncio.get_running_loop().time() + PATIENCE_S
    while not condition():
        assert asyncio.get_running_loop().time() < end_s
        await asyncio.sleep(0.01)


def board_element(user: User) -> MeetingBoard:
    [board] = user.find(MeetingBoard).elements
    return board


def test_the_first_page_is_the_meeting_while_one_runs(model):
    assert browse(model, '/') == MEETING_URL
    model.frame = replace(model.frame, meeting=replace(model.frame.meeting, silent_s=9.0))
    assert browse(model, '/') == '/', 'not of one that has died'
    assert browse(FakeModel(), '/') == '/'


def test_the_full_view_stays_open_while_a_meeting_runs(model):
    async def steps(user):
        await user.should_see('looking at the caregiver')
        await user.should_see('the meeting')

    assert browse(model, FULL_VIEW_URL, steps) == FULL_VIEW_URL


def test_a_first_page_that_is_open_leads_to_a_meeting_that_starts(model):
    running, model.frame = model.frame, replace(model.frame, meeting=None)

    async def steps(user):
        await user.should_not_see('the meeting')
        model.frame = running
        await until(lambda: user.back_history[-1:] == [MEETING_URL])
        assert board_element(user)

    browse(model, '/', steps)


def test_it_shows_what_the_scorer_publishes_and_follows_it(model):
    async def steps(user):
        board = board_element(user)
        assert board.board['message'] == 'Look at thing 4.'
        assert board.board['number'] == 4
        model.show('wrong')
        await until(lambda: board.board['phase'] == 'answer')
        assert (board.board['right'], board.board['answer']) == (False, 2)
        await until(lambda: model.viewers >= 3)  # an open page is a viewer

    browse(model, MEETING_URL, steps)


def test_an_equal_board_is_sent_once(model):
    async def steps(user):
        board = board_element(user)
        sent = []
        board.update = lambda: sent.append(board.board['phase'])
        viewers = model.viewers
        await until(lambda: model.viewers > viewers + 3)
        assert sent == []
        model.show('paused')
        await until(lambda: sent)
        await until(lambda: model.viewers > viewers + 9)
        assert sent == ['paused']

    browse(model, MEETING_URL, steps)


def test_its_buttons_are_services_of_the_scorer(model):
    async def steps(user):
        board = user.find(MeetingBoard)
        for event, argument in (('pause', True), ('pause', False), ('moved', None), ('end', None)):
            board.trigger(event, argument)
        await until(lambda: len(model.requests) == 4)

    browse(model, MEETING_URL, steps)
    assert model.requests == [
        ('caregiver/pause', True), ('caregiver/pause', False),
        ('caregiver/rearranged',), ('caregiver/end',),
    ]  # fmt: skip


def test_a_frame_that_cannot_be_shown_is_reported(model):
    async def steps(user):
        model.frame = replace(model.frame, picture=picture(2), scene='none')
        await until(lambda: model.requests)
        assert model.requests[0][0] == 'page of the meeting'

    browse(model, MEETING_URL, steps)


@pytest.mark.parametrize('state', STATES)
def test_a_board_is_json_and_names_its_phase(state, model):
    model.show(state)
    board = board_of(model.frame)
    json.dumps(board, allow_nan=False)
    assert board['phase'] in ('answer', state)
    assert board['message'] == STATES[state][0]


def test_without_a_meeting_it_states_how_to_start_one():
    board = board_of(FakeModel().frame)
    assert (board['phase'], board['silent']) == ('idle', False)
    assert './ja meet' in board['message']
    assert board['controls'] == []


def test_a_silent_meeting_is_shown_as_silent(model):
    model.frame = replace(model.frame, meeting=replace(model.frame.meeting, silent_s=4.0))
    board = board_of(model.frame)
    assert board['silent']
    assert board['message'] == 'The meeting is silent.'


def test_the_numbers_stand_at_the_things_of_this_picture(model):
    model.show('thing', things='4 0.1 0.0;7 2.0 0.0')
    model.frame = replace(model.frame, scene=scene((0.1, 0.0)))
    board = board_of(model.frame)
    assert board['picture'] == f'{PLAIN_PICTURE_URL}?1'
    assert board['aspect'] == pytest.approx(4 / 3)
    inside, outside = board['marks']
    assert (inside['number'], inside['outside']) == (4, False)
    assert (inside['x'], inside['y']) == pytest.approx((0.5, 0.5))
    assert (outside['number'], outside['outside']) == (7, True)


def test_without_a_posture_or_a_picture_there_are_no_numbers(model):
    model.frame = replace(model.frame, scene=scene(None))
    assert board_of(model.frame)['marks'] == []
    model.frame = replace(model.frame, picture=None)
    board = board_of(model.frame)
    assert (board['picture'], board['marks'], board['live']) == ('', [], False)


def test_an_old_picture_is_marked_as_old(model):
    assert board_of(model.frame)['live']
    model.frame = replace(model.frame, state=State(RunState.STOPPED, 'no new image for 9 s'))
    assert not board_of(model.frame)['live']


def get(model: FakeModel, path: str) -> httpx.Response:
    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(picture_app(model))
        async with httpx.AsyncClient(transport=transport, base_url='http://test') as client:
            return await client.get(path)

    return asyncio.run(ask())


def brightness(answer: httpx.Response) -> float:
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR).mean()


def test_the_picture_is_that_of_the_stamp_and_else_the_newest():
    model = FakeMeeting(picture(9, 200), scene())
    model.frame = replace(model.frame, recent=(picture(8, 100), picture(9, 200)))
    assert brightness(get(model, f'{PLAIN_PICTURE_URL}?8')) == pytest.approx(100, abs=2)
    assert brightness(get(model, f'{PLAIN_PICTURE_URL}?9')) == pytest.approx(200, abs=2)
    for query in ('', '?7', '?<b>', '?8&8'):
        assert brightness(get(model, f'{PLAIN_PICTURE_URL}{query}')) == pytest.approx(200, abs=2)
    assert model.viewers == 6


def test_before_the_first_picture_there_is_none():
    assert get(FakeModel(), PLAIN_PICTURE_URL).status_code == 404


def test_a_wide_picture_is_made_smaller_for_the_network():
    content = picture(1, size=(1200, 3840)).plain_jpeg()
    shown = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert shown.shape == (400, 1280, 3)


def test_the_report_is_served_once_it_is_there(tmp_path):
    model = FakeMeeting(report=str(tmp_path / 'report.html'))
    model.show('ended')
    assert board_of(model.frame)['report']['address'] == ''
    assert get(model, REPORT_URL).status_code == 404
    (tmp_path / 'report.html').write_text('<h1>a report</h1>')
    (tmp_path / 'meeting.json').write_text('{}')
    assert board_of(model.frame)['report'] == {
        'address': REPORT_URL, 'path': str(tmp_path / 'report.html')
    }  # fmt: skip
    answer = get(model, REPORT_URL)
    assert answer.text == '<h1>a report</h1>'
    assert answer.headers['content-type'].startswith('text/html')


def test_no_other_file_is_served_as_a_report(tmp_path):
    (tmp_path / 'secret.html').write_text('secret')
    model = FakeMeeting(report=str(tmp_path / 'secret.html'))
    model.show('ended')
    assert get(model, REPORT_URL).status_code == 404
    assert get(FakeModel(), REPORT_URL).status_code == 404
