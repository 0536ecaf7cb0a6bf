"""The page and its picture as a browser gets them, from a model with one frame."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import cv2
import httpx
import numpy as np
import pytest
from nicegui import ui
from nicegui.testing import User, user_simulation

from fake_page import PICTURE, FakeModel
from ja_common.core.health import Level
from ja_dashboard.core.view_model import NodeHealth, RunState, State
from ja_dashboard.image_feed import Picture
from ja_dashboard.page import PICTURE_URL, Page, facts_html, nodes_html
from ja_dashboard.server import picture_app
from ros_testing import PATIENCE_S


def browse(model: FakeModel, steps: Callable[[User], Awaitable[None]]) -> None:
    async def visit() -> None:
        async with user_simulation(root=Page(model).build) as user:
            await user.open('/')
            await steps(user)

    asyncio.run(visit())


async def until(condition: Callable[[], object], timeout_s: float = PATIENCE_S) -> None:
    """Let the page run until the condition holds."""
    end_s = asyncio.get_running_loop().time() + timeout_s
    while not condition():
        assert asyncio.get_running_loop().time() < end_s, f'not within {timeout_s:g} s'
        await asyncio.sleep(0.01)


def dialogs(user: User) -> list[ui.dialog]:
    return [each for each in user.client.elements.values() if isinstance(each, ui.dialog)]


def test_it_shows_what_the_robot_does():
    async def steps(user):
        await user.should_see('looking at the caregiver')
        await user.should_see('running')
        await user.should_see('gate: hello')
        [picture] = user.find(ui.interactive_image).elements
        assert 'ja-old' not in picture.classes

    browse(FakeModel(), steps)


def test_a_stopped_graph_is_shown_as_stopped_and_its_picture_as_old():
    async def steps(user):
        await user.should_see('no new image for 9 s')
        [picture] = user.find(ui.interactive_image).elements
        assert 'ja-old' in picture.classes

    browse(FakeModel(state=State(RunState.STOPPED, 'no new image for 9 s')), steps)


def test_an_open_page_is_a_viewer_and_shows_each_new_picture():
    model = FakeModel()

    async def steps(user):
        await until(lambda: model.viewers >= 3)
        [shown] = user.find(ui.interactive_image).elements
        for stamp_ns in (7, 8):
            model.frame = replace(model.frame, picture=Picture(stamp_ns, *PICTURE))
            await until(lambda stamp_ns=stamp_ns: shown.source == f'{PICTURE_URL}?{stamp_ns}')

    browse(model, steps)


def test_buttons_make_requests_and_a_reset_asks_first():
    model = FakeModel()

    async def steps(user):
        user.find('home').click()
        user.find(marker='sim/pause').click()
        user.find('reset learning').click()
        await user.should_see('The learner will start from initial weights.')
        assert model.requests == [('gate/home',), ('sim/pause', True)]
        user.find('keep everything').click()
        # The page deletes the dialog after it has dealt with the answer.
        await until(lambda: not dialogs(user))
        assert model.requests[2:] == []
        user.find('reset learning').click()
        await user.should_see('forget everything')
        user.find('forget everything').click()
        await until(lambda: not dialogs(user))
        assert model.requests[2:] == [('reset_learning',)]

    browse(model, steps)


def test_controls_without_a_service_are_hidden():
    async def steps(user):
        await user.should_see('home')
        await user.should_not_see('rearrange')
        await user.should_not_see('save checkpoint')

    browse(FakeModel(), steps)


def test_settings_show_the_values_of_the_graph_without_setting_them():
    model = FakeModel()

    async def steps(user):
        [learner] = user.find(marker='learner').elements
        assert (learner.value, list(learner.options)) == ('paper', ['paper', 'gaze_line'])
        [objects] = user.find(marker='objects').elements
        assert objects.value == 3
        model.frame = replace(model.frame, settings={'objects': 5, 'learner': 'paper'})
        await until(lambda: objects.value == 5)
        assert model.requests == []
        learner.set_value('gaze_line')
        assert model.requests == [('learner', 'gaze_line')]

    browse(model, steps)


def get_picture(model: FakeModel) -> httpx.Response:
    async def get() -> httpx.Response:
        transport = httpx.ASGITransport(picture_app(model))
        async with httpx.AsyncClient(transport=transport, base_url='http://test') as client:
            return await client.get(f'{PICTURE_URL}?1')

    return asyncio.run(get())


def test_the_picture_is_the_newest_one_as_jpeg():
    model = FakeModel(picture=Picture(1, *PICTURE))
    answer = get_picture(model)
    assert model.viewers == 1
    assert answer.headers['content-type'] == 'image/jpeg'
    drawn = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert drawn.shape == (480, 640, 3)
    assert np.ptp(drawn) > 100


def test_before_the_first_picture_there_is_none():
    assert get_picture(FakeModel()).status_code == 404


@pytest.mark.parametrize('level', list(Level))
def test_every_node_shows_its_level_and_its_text_is_escaped(level):
    shown = nodes_html([NodeHealth('/gate', level, 'no <image>', 0.0, {})], {})
    assert f'title="{level.name}"' in shown
    assert '<image>' not in shown
    assert ('no &lt;image&gt;' in shown) is (level is not Level.OK)


def test_facts_are_escaped():
    shown = facts_html({'phase': '<b>'})
    assert '<b>' not in shown
    assert '&lt;b&gt;' in shown
