"""The page and its picture as a browser gets them, from a robot of our own making."""

import asyncio
from collections.abc import Awaitable, Callable

import cv2
import httpx
import numpy as np
import pytest
from nicegui import ui
from nicegui.testing import User, user_simulation

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.health import Level
from ja_dashboard.core.view_model import CurvePoints, Light, RunState, State
from ja_dashboard.image_feed import Picture
from ja_dashboard.page import PICTURE_URL, Page, facts_html, nodes_html
from ja_dashboard.server import picture_app
from ja_dashboard.view_node import Frame

SERVICES = frozenset({'enable', 'home', 'reset_learning', 'sim/pause', 'sim/step'})


class Robot:
    """Shows one frame, and keeps the orders that it is given."""

    def __init__(self, **changes):
        self.orders = []
        self.frame = Frame(
            **{
                'state': State(RunState.RUNNING, 'looking at the caregiver'),
                'facts': {'p(LM)': '0.31'},
                'lights': [Light('/gate', Level.WARN, 'no <image>', 0.0, {})],
                'latencies_ms': {'detections': 4.2},
                'curve': CurvePoints([1], [1.0], [0.2], [1.0], [0.0]),
                'log': [(1, 'gate: hello')],
                'settings': {'objects': 3, 'learner': 'paper'},
                'choices': {'learner': ('paper', 'gaze_line')},
                'services': SERVICES,
                'switches': {'enable': True, 'sim/pause': False},
                **changes,
            }
        )

    def watched(self):
        pass

    def show_truth(self, shown):
        self.orders.append(('truth', shown))

    def switch(self, service, on):
        self.orders.append((service, on))

    def trigger(self, service):
        self.orders.append((service,))

    def set(self, name, value):
        self.orders.append((name, value))


def browse(robot: Robot, steps: Callable[[User], Awaitable[None]]) -> None:
    async def visit() -> None:
        async with user_simulation(root=Page(robot).build) as user:
            await user.open('/')
            await steps(user)

    asyncio.run(visit())


def test_it_tells_what_the_robot_does():
    async def steps(user):
        await user.should_see('looking at the caregiver')
        await user.should_see('running')
        await user.should_see('gate: hello')

    browse(Robot(), steps)


def test_a_stopped_graph_is_shown_as_stopped_and_its_picture_as_old():
    async def steps(user):
        await user.should_see('no new image for 9 s')
        [picture] = user.find(ui.interactive_image).elements
        assert 'ja-old' in picture.classes

    browse(Robot(state=State(RunState.STOPPED, 'no new image for 9 s')), steps)


def test_buttons_give_orders_and_a_reset_asks_first():
    robot = Robot()

    async def steps(user):
        user.find('home').click()
        user.find(marker='sim/pause').click()
        user.find('reset learning').click()
        await user.should_see('Everything that was learned will be forgotten.')
        assert robot.orders == [('home',), ('sim/pause', True)]
        user.find('keep it').click()
        await asyncio.sleep(0.1)
        user.find('reset learning').click()
        await user.should_see('forget it')
        user.find('forget it').click()
        await asyncio.sleep(0.1)
        assert robot.orders[2:] == [('reset_learning',)]

    browse(robot, steps)


def test_what_the_graph_does_not_offer_is_not_shown():
    async def steps(user):
        await user.should_see('home')
        await user.should_not_see('rearrange')
        await user.should_not_see('save checkpoint')

    browse(Robot(), steps)


def test_settings_show_what_the_graph_says_without_setting_it():
    robot = Robot()

    async def steps(user):
        [learner] = user.find(marker='learner').elements
        assert (learner.value, list(learner.options)) == ('paper', ['paper', 'gaze_line'])
        [objects] = user.find(marker='objects').elements
        assert objects.value == 3
        assert robot.orders == []
        learner.set_value('gaze_line')
        assert robot.orders == [('learner', 'gaze_line')]

    browse(robot, steps)


def get_picture(robot: Robot) -> httpx.Response:
    async def get() -> httpx.Response:
        transport = httpx.ASGITransport(picture_app(robot))
        async with httpx.AsyncClient(transport=transport, base_url='http://test') as client:
            return await client.get(f'{PICTURE_URL}?1')

    return asyncio.run(get())


def test_the_picture_is_the_newest_one_as_jpeg():
    face = Detection(Kind.FACE, 0.0, 0.0, 160.0, 120.0, 60.0, 80.0, 0.9)
    camera = CameraModel.from_field_of_view(320, 240, 0.6)
    picture = Picture(1, np.full((240, 320, 3), 60, np.uint8), [face], None, camera, 0.004)
    answer = get_picture(Robot(picture=picture))
    assert answer.headers['content-type'] == 'image/jpeg'
    drawn = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
    assert drawn.shape == (480, 640, 3)
    assert np.ptp(drawn) > 100


def test_before_the_first_picture_there_is_none():
    assert get_picture(Robot()).status_code == 404


@pytest.mark.parametrize('level', list(Level))
def test_every_light_has_its_colour_and_its_text_is_no_markup(level):
    shown = nodes_html([Light('/gate', level, 'no <image>', 0.0, {})], {})
    assert f'title="{level.name}"' in shown
    assert '<image>' not in shown
    assert ('no &lt;image&gt;' in shown) is (level is not Level.OK)


def test_facts_are_no_markup():
    assert '<b>' not in facts_html({'phase': '<b>'})
