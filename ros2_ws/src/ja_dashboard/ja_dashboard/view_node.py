"""`view`: a live page for people. It only listens, calls services and sets parameters."""

import math
import os
import queue
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Log
from rclpy.clock import Clock, ClockType
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from ja_common.core.config import Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.live_page import LIVE_PAGE
from ja_common.graph_node import GraphNode, spin_node
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.parameters import choices_of
from ja_common.polled_subscription import PolledSubscription
from ja_common.status_values import status_values
from ja_common.topics import DIAGNOSTICS, EVERY_SCORE, FIXATION, GATE_STATUS, LOG, Topic
from ja_dashboard.core.view_model import CurvePoints, Glance, Light, State, ViewModel
from ja_dashboard.image_feed import ALL_OF_ONE_LOOK, LIMITS, ImageFeed, Picture

LOOK_EVERY_S = 0.1
_ASK_EVERY_S = 2.0
_WATCHED_FOR_S = 3.0
_NICENESS = 10  # where the processor is scarce, the graph comes first
_SWITCHES = ('enable', 'sim/pause')
_TRIGGERS = (
    'home', 'save_checkpoint', 'reset_learning', 'sim/step', 'sim/rearrange',
)  # fmt: skip
_SETTINGS = {
    'learner': 'learning_module',
    'real_time_factor': 'sim',
    'objects': 'sim',
}
"""Parameters that the page sets, and whose they are."""


@dataclass(frozen=True)
class ViewConfig(Configuration):
    """Where the page is served."""

    host: str = parameter('127.0.0.1', 'address of the page; 0.0.0.0 serves it to everybody')
    port: int = parameter(
        8080, 'port of the page; the next one that is free if it is taken', low=1, high=65535
    )


@dataclass(frozen=True)
class Frame:
    """All that the page shows at one moment; never changed, so that any thread may read it."""

    state: State
    facts: dict[str, str]
    lights: list[Light]
    latencies_ms: dict[str, float]
    curve: CurvePoints
    log: list[tuple[int, str]]
    settings: dict[str, Any]
    choices: dict[str, tuple[str, ...]]
    services: frozenset[str]
    switches: dict[str, bool]
    glance: Glance | None = None
    picture: Picture | None = None


class ViewNode(GraphNode):
    """Gathers a `frame` for the page ten times a second, and does what its buttons say.

    Everything that comes once an image is heard only while somebody watches. The public methods
    may be called from another thread; what they ask for is done by the executor's.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('view', **node_kwargs)
        self.config = self.configure(ViewConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._model = ViewModel(time.monotonic())
        self._sight: ImageFeed | None = None
        self._orders: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._watched_s = -math.inf
        self._truth_shown = False
        self._limits: np.ndarray | None = None
        self._settings: dict[str, Any] = {}
        self._choices: dict[str, tuple[str, ...]] = {}
        self._remote = {
            node: AsyncParameterClient(self, node) for node in {'gate', *_SETTINGS.values()}
        }
        self._switches = {name: self.create_client(SetBool, name) for name in _SWITCHES}
        self._triggers = {name: self.create_client(Trigger, name) for name in _TRIGGERS}
        self._fixations = PolledSubscription(self, FIXATION, ALL_OF_ONE_LOOK)
        self._statuses = PolledSubscription(self, GATE_STATUS, ALL_OF_ONE_LOOK)
        self.subscribe(EVERY_SCORE, self._on_score)
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)
        self.subscribe(LOG, self._on_log)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(LOOK_EVERY_S, self._look, clock=steady)
        self.create_timer(_ASK_EVERY_S, self._ask_parameters, clock=steady)
        self.frame = self._gather()

    def destroy_node(self) -> None:
        """Let go of the mailboxes, which the node does not know, then of the node."""
        for mailbox in self.mailboxes.values():
            mailbox.close()
        super().destroy_node()

    @property
    def mailboxes(self) -> dict[Topic, PolledSubscription]:
        """What is heard at the moment without waking the executor."""
        always = {FIXATION: self._fixations, GATE_STATUS: self._statuses}
        return always | (self._sight.boxes if self._sight is not None else {})

    def watched(self) -> None:
        """Somebody looks at the page; to be said again and again while it is true."""
        self._watched_s = time.monotonic()

    def show_truth(self, shown: bool) -> None:
        """Show where everything really is, in simulation; or stop it."""
        self._truth_shown = shown

    def switch(self, service: str, on: bool) -> None:
        """Call a std_srvs/SetBool; its answer goes to the log."""
        client = self._switches[service]
        self._orders.put(partial(self._call, client, service, SetBool.Request(data=on)))

    def trigger(self, service: str) -> None:
        """Call a std_srvs/Trigger; its answer goes to the log."""
        self._orders.put(partial(self._call, self._triggers[service], service, Trigger.Request()))

    def set(self, name: str, value: Any) -> None:
        """Set one of the parameters that the page knows; the answer goes to the log."""
        self._orders.put(partial(self._set, name, value))

    def _look(self) -> None:
        while not self._orders.empty():
            self._orders.get()()
        now_s = time.monotonic()
        self._open_or_close_eyes(now_s)
        fixations = self._fixations.take_messages()
        if any(message.name for message, _ in fixations):
            self._model.hear_fixation()
        for message, _ in self._statuses.take_messages():
            self._model.hear_gate(status_values(message))
        if self._sight is not None:
            if self._limits is not None:
                self._sight.limits = self._limits
            self._sight.show_truth(self._truth_shown)
            self._sight.look(now_s, fixations)
        self.frame = self._gather()

    def _open_or_close_eyes(self, now_s: float) -> None:
        watched = now_s - self._watched_s < _WATCHED_FOR_S
        if watched and self._sight is None:
            self._model.watch(now_s)
            self._sight = ImageFeed(self, self._model, self._joints)
            self._ask_parameters()
        elif not watched and self._sight is not None:
            self._sight.close()
            self._sight = None

    def _gather(self) -> Frame:
        now_s, model, sight = time.monotonic(), self._model, self._sight
        ready = {**self._switches, **self._triggers}
        return Frame(
            state=model.state(now_s),
            facts=model.facts(),
            lights=model.lights(now_s),
            latencies_ms=dict(sight.latencies_ms) if sight else {},
            curve=model.curve_points(now_s),
            log=list(model.log),
            settings=dict(self._settings),
            choices=dict(self._choices),
            services=frozenset(n for n, client in ready.items() if client.service_is_ready()),
            switches=model.switches(),
            glance=sight.glance if sight else None,
            picture=sight.picture if sight else None,
        )

    def _on_score(self, message: DiagnosticStatus) -> None:
        self._model.hear_score(status_values(message).get('last') == 'success', time.monotonic())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = Level(int.from_bytes(status.level, 'little'))
            values = status_values(status)
            light = Light(status.name, level, status.message, time.monotonic(), values)
            self._model.hear_health(light)

    def _on_log(self, message: Log) -> None:
        if message.level >= LoggingSeverity.INFO:
            self._model.hear_log(f'{message.name}: {message.msg}')

    def _call(self, client: Any, name: str, request: Any) -> None:
        if not client.service_is_ready():
            self._model.hear_log(f'{name}: nobody offers this service')
            return

        def answered(future: Future) -> None:
            answer = future.result()
            verdict = '' if answer.success else 'refused: '
            self._model.hear_log(f'{name}: {verdict}{answer.message}')

        client.call_async(request).add_done_callback(answered)

    def _set(self, name: str, value: Any) -> None:
        client = self._remote[_SETTINGS[name]]
        if not client.services_are_ready():
            self._model.hear_log(f'{name}: {_SETTINGS[name]} is not there')
            return

        def answered(future: Future) -> None:
            result = future.result().results[0]
            text = str(value) if result.successful else f'refused: {result.reason}'
            self._model.hear_log(f'{name}: {text}')
            self._ask_parameters()

        client.set_parameters([Parameter(name, value=value)]).add_done_callback(answered)

    def _ask_parameters(self) -> None:
        if self._sight is None:
            return
        gate = self._remote['gate']
        if gate.services_are_ready():
            gate.get_parameters(list(LIMITS)).add_done_callback(self._note_limits)
        for name, owner in _SETTINGS.items():
            client = self._remote[owner]
            if client.services_are_ready():
                noted = partial(self._note_setting, name)
                client.get_parameters([name]).add_done_callback(noted)
                if name not in self._choices:
                    described = partial(self._note_choices, name)
                    client.describe_parameters([name]).add_done_callback(described)

    def _note_limits(self, future: Future) -> None:
        values = [parameter_value_to_python(value) for value in future.result().values]
        if len(values) == len(LIMITS) and None not in values:
            self._limits = np.array(values).reshape(2, 2)

    def _note_setting(self, name: str, future: Future) -> None:
        values = [parameter_value_to_python(value) for value in future.result().values]
        if values and values[0] is not None:
            self._settings[name] = values[0]

    def _note_choices(self, name: str, future: Future) -> None:
        for descriptor in future.result().descriptors:
            if choices := choices_of(descriptor):
                self._choices[name] = choices


def main(args: list[str] | None = None) -> None:
    """Run the node and serve its page."""
    os.nice(_NICENESS)
    # Only here: the web libraries are of no use to who makes the node alone.
    from ja_dashboard.server import Server

    with ExitStack() as servers:

        def served() -> ViewNode:
            node = ViewNode()
            server = servers.enter_context(Server(node, node.config.host, node.config.port))
            print(f'{LIVE_PAGE}{server.address}', flush=True)
            return node

        spin_node(served, args)


if __name__ == '__main__':
    main()
