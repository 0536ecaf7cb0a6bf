"""`view`: the live page. It only subscribes, calls services and sets parameters."""

import math
import os
import queue
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
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
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from ja_common.camera_input import CameraInputConfig
from ja_common.core.config import Configuration, parameter
from ja_common.core.health import Level
from ja_common.core.live_page import LIVE_PAGE
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.parameters import choices_of
from ja_common.polled_subscription import PolledSubscription
from ja_common.status_values import status_values
from ja_common.topics import (
    CAREGIVER_REQUEST,
    DIAGNOSTICS,
    EVERY_SCORE,
    FIXATION,
    GATE_STATUS,
    LOG,
    TRACK,
    WEIGHT_FILES,
    Topic,
)
from ja_common.weight_files_codec import decode_weight_files
from ja_dashboard.core.meeting_view import MeetingView
from ja_dashboard.core.view_model import CurvePoints, NodeHealth, SceneView, State, ViewModel
from ja_dashboard.image_feed import LIMITS, MESSAGES_PER_POLL, ImageFeed, Picture

POLL_EVERY_S = 0.1
_ASK_EVERY_S = 2.0
_VIEWER_STAYS_S = 3.0
_NICENESS = 10  # on a busy processor the graph comes first
_SWITCHES = ('gate/enable', 'sim/pause', 'caregiver/pause')
_TRIGGERS = (
    'gate/home', 'save_checkpoint', 'reset_learning', 'sim/step', 'sim/rearrange',
    'caregiver/end', 'caregiver/rearranged',
)  # fmt: skip
_SETTINGS = {
    'learner': 'learning_module',
    'real_time_factor': 'sim',
    'objects': 'sim',
}
"""Parameters that the page sets, and the node of each."""
_SETTING_TYPES = {'learner': (str,), 'real_time_factor': (float, int), 'objects': (int,)}


@dataclass(frozen=True)
class ViewConfig(Configuration):
    """Where the page is served."""

    host: str = parameter(
        '127.0.0.1',
        'address of the page; 0.0.0.0 serves it to every machine that shows its token',
    )
    port: int = parameter(
        8080, 'port of the page; the next one that is free if it is taken', low=1, high=65535
    )
    allowed_hosts: str = parameter(
        '', 'further names under which browsers may open the page: NAME or NAME:PORT, with commas'
    )


@dataclass(frozen=True)
class Frame:
    """All that the page shows at one moment; immutable, so that any thread may read it."""

    state: State
    facts: dict[str, str]
    node_health: list[NodeHealth]
    latencies_ms: dict[str, float]
    curve: CurvePoints
    log: list[tuple[int, str]]
    settings: dict[str, Any]
    choices: dict[str, tuple[str, ...]]
    services: frozenset[str]
    switches: dict[str, bool]
    scene: SceneView | None = None
    picture: Picture | None = None
    recent: tuple[Picture, ...] = ()
    meeting: MeetingView | None = None


class ViewNode(GraphNode):
    """Makes a `frame` for the page ten times a second, and carries out its requests.

    It subscribes to the topics of images only while the page has a viewer. The public methods may
    be called from another thread; the thread of the executor carries their requests out.
    """

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('view', **node_kwargs)
        self.config = self.configure(ViewConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._camera = self.configure(CameraInputConfig)
        self._model = ViewModel(time.monotonic())
        self._feed: ImageFeed | None = None
        self._requests: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._viewer_s = -math.inf
        self._truth_shown = False
        self._limits: np.ndarray | None = None
        self._meeting: MeetingView | None = None
        self._request_s = -math.inf
        self._settings: dict[str, Any] = {}
        self._choices: dict[str, tuple[str, ...]] = {}
        self._remote = {
            node: AsyncParameterClient(self, node) for node in {'gate', *_SETTINGS.values()}
        }
        self._switches = {name: self.create_client(SetBool, name) for name in _SWITCHES}
        self._triggers = {name: self.create_client(Trigger, name) for name in _TRIGGERS}
        self._fixations = PolledSubscription(self, FIXATION, MESSAGES_PER_POLL)
        self._statuses = PolledSubscription(self, GATE_STATUS, MESSAGES_PER_POLL)
        self.subscribe(EVERY_SCORE, self._on_score)
        self.subscribe(DIAGNOSTICS, self._on_diagnostics)
        self.subscribe(LOG, self._on_log)
        self.subscribe(CAREGIVER_REQUEST, self._on_request)
        self.subscribe(TRACK, self._on_track)
        self.subscribe(WEIGHT_FILES, self._on_weight_files)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(POLL_EVERY_S, self._poll, clock=steady)
        self.create_timer(_ASK_EVERY_S, self._ask_parameters, clock=steady)
        self.frame = self._make_frame()

    def destroy_node(self) -> None:
        """Close the polled subscriptions, which the node does not know, then the node."""
        for subscription in self.polled_subscriptions.values():
            subscription.close()
        super().destroy_node()

    @property
    def polled_subscriptions(self) -> dict[Topic, PolledSubscription]:
        """Return the current subscriptions that do not wake the executor."""
        always = {FIXATION: self._fixations, GATE_STATUS: self._statuses}
        return always | (self._feed.subscriptions if self._feed is not None else {})

    def note_viewer(self) -> None:
        """Note that the page has a viewer; call it repeatedly while it has one."""
        self._viewer_s = time.monotonic()

    def show_truth(self, shown: bool) -> None:
        """Show the true positions of the objects, in simulation, or hide them."""
        self._truth_shown = shown

    def call_switch(self, service: str, on: bool) -> None:
        """Call a std_srvs/SetBool; its answer goes to the log."""
        client = self._switches[service]
        self._requests.put(partial(self._call, client, service, SetBool.Request(data=on)))

    def call_trigger(self, service: str) -> None:
        """Call a std_srvs/Trigger; its answer goes to the log."""
        self._requests.put(
            partial(self._call, self._triggers[service], service, Trigger.Request())
        )

    def set_remote_parameter(self, name: str, value: Any) -> None:
        """Set one of the parameters that the page knows; the answer goes to the log."""
        self._requests.put(partial(self._set, name, value))

    def report_failure(self, where: str, error: Exception) -> None:
        """Report what a part of the page could not show."""
        text = f'{where}: {type(error).__name__}: {error}'
        self._requests.put(partial(self.report_problem, where, text))

    def _poll(self) -> None:
        while not self._requests.empty():
            self.call_guarded('request of the page', self._requests.get())
        now_s = time.monotonic()
        self._open_or_close_feed(now_s)
        fixations = self._fixations.take_messages()
        if any(message.name for message, _ in fixations):
            self._model.record_fixation()
        for message, _ in self._statuses.take_messages():
            self._model.record_gate_status(status_values(message))
        if self._feed is not None:
            self.call_guarded('images', self._poll_feed, self._feed, now_s, fixations)
        self.frame = self._make_frame()

    def _poll_feed(self, feed: ImageFeed, now_s: float, fixations: list[Any]) -> None:
        if self._limits is not None:
            feed.limits = self._limits
        feed.show_truth(self._truth_shown)
        feed.poll_messages(now_s, fixations)

    def _open_or_close_feed(self, now_s: float) -> None:
        has_viewer = now_s - self._viewer_s < _VIEWER_STAYS_S
        if has_viewer and self._feed is None:
            self._model.reset_silence(now_s)
            self._feed = ImageFeed(self, self._model, self._joints, self._camera)
            self._ask_parameters()
        elif not has_viewer and self._feed is not None:
            self._feed.close()
            self._feed = None

    def _make_frame(self) -> Frame:
        now_s, model, feed = time.monotonic(), self._model, self._feed
        clients = {**self._switches, **self._triggers}
        return Frame(
            state=model.state(now_s),
            facts=model.facts(),
            node_health=model.node_health(now_s),
            latencies_ms=dict(feed.latencies_ms) if feed else {},
            curve=model.curve_points(now_s),
            log=list(model.log),
            settings=dict(self._settings),
            choices=dict(self._choices),
            services=frozenset(n for n, client in clients.items() if client.service_is_ready()),
            switches=model.switches(),
            scene=feed.scene if feed else None,
            picture=feed.picture if feed else None,
            recent=tuple(feed.recent) if feed else (),
            meeting=self._meeting and replace(self._meeting, silent_s=now_s - self._request_s),
        )

    def _on_score(self, message: DiagnosticStatus) -> None:
        self._model.record_trial(status_values(message).get('last') == 'success', time.monotonic())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.call_guarded(DIAGNOSTICS.name, self._record_status, status)

    def _record_status(self, status: DiagnosticStatus) -> None:
        number = int.from_bytes(status.level, 'little')
        if number not in list(Level):
            raise ValueError(f'level {number} of {status.name!r} is no level of a diagnosis')
        values = status_values(status)
        health = NodeHealth(status.name, Level(number), status.message, time.monotonic(), values)
        self._model.record_health(health)

    def _on_log(self, message: Log) -> None:
        if message.level >= LoggingSeverity.INFO:
            self._model.append_log(f'{message.name}: {message.msg}')

    def _on_request(self, message: DiagnosticStatus) -> None:
        self._meeting = MeetingView.of(message.message, status_values(message))
        self._request_s = time.monotonic()

    def _on_track(self, message: String) -> None:
        self._model.track = message.data

    def _on_weight_files(self, message: DiagnosticStatus) -> None:
        self._model.weight_files = decode_weight_files(message)

    def _call(self, client: Any, name: str, request: Any) -> None:
        if not client.service_is_ready():
            self._model.append_log(f'{name}: no node offers this service')
            return

        def log_answer(future: Future) -> None:
            answer = future.result()
            verdict = '' if answer.success else 'refused: '
            self._model.append_log(f'{name}: {verdict}{answer.message}')

        self._when_done(client.call_async(request), name, log_answer)

    def _set(self, name: str, value: Any) -> None:
        client = self._remote[_SETTINGS[name]]
        if not client.services_are_ready():
            self._model.append_log(f'{name}: {_SETTINGS[name]} is not running')
            return

        def log_result(future: Future) -> None:
            [result] = future.result().results
            text = str(value) if result.successful else f'refused: {result.reason}'
            self._model.append_log(f'{name}: {text}')
            self._ask_parameters()

        self._when_done(client.set_parameters([Parameter(name, value=value)]), name, log_result)

    def _ask_parameters(self) -> None:
        if self._feed is None:
            return
        gate = self._remote['gate']
        if gate.services_are_ready():
            limits = gate.get_parameters(list(LIMITS))
            self._when_done(limits, 'limits of the joints', self._store_limits)
        for name, owner in _SETTINGS.items():
            client = self._remote[owner]
            if client.services_are_ready():
                store = partial(self._store_setting, name)
                self._when_done(client.get_parameters([name]), name, store)
                if name not in self._choices:
                    store_choices = partial(self._store_choices, name)
                    self._when_done(client.describe_parameters([name]), name, store_choices)

    def _when_done(self, future: Future, where: str, callback: Callable[[Future], None]) -> None:
        """Have a callback read an answer, which may come from a foreign node of the same name."""
        future.add_done_callback(partial(self.call_guarded, where, callback))

    def _store_limits(self, future: Future) -> None:
        values = [parameter_value_to_python(value) for value in future.result().values]
        if not values or None in values:
            return  # a gate of another make has no such parameters
        limits = np.array(values, float)
        if limits.shape != (len(LIMITS),) or not (limits[:2] < limits[2:]).all():
            raise ValueError(f'{LIMITS} of the gate are no limits: {values}')
        self._limits = limits.reshape(2, 2)

    def _store_setting(self, name: str, future: Future) -> None:
        values = [parameter_value_to_python(value) for value in future.result().values]
        if not values or values[0] is None:
            return
        if type(values[0]) not in _SETTING_TYPES[name] or values[0] != values[0]:
            raise ValueError(f'{_SETTINGS[name]} has an unusable value of {name}: {values[0]!r}')
        self._settings[name] = values[0]

    def _store_choices(self, name: str, future: Future) -> None:
        for descriptor in future.result().descriptors:
            if choices := choices_of(descriptor):
                self._choices[name] = choices


def main(args: list[str] | None = None) -> None:
    """Run the node and serve its page."""
    os.nice(_NICENESS)
    # Imported here: a process that makes only the node does not load the web libraries.
    from ja_dashboard.server import Server

    with ExitStack() as servers:

        def make_served_node() -> ViewNode:
            node = ViewNode()
            config = node.config
            server = servers.enter_context(
                Server(node, config.host, config.port, config.allowed_hosts)
            )
            print(f'{LIVE_PAGE}{server.address}', flush=True)
            return node

        spin_node(make_served_node, args)


if __name__ == '__main__':
    main()
