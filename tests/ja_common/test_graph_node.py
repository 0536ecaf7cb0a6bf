"""The base of every node: one clear error for bad input, reasons of silence, a clean end."""

import os
import signal
from dataclasses import dataclass
from functools import partial

import pytest
import rclpy
import yaml
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

from ja_common.core.config import Configuration, parameter
from ja_common.core.health import Level
from ja_common.graph_node import GraphNode
from ja_common.node_main import spin_node
from ja_common.renamed_publisher import RenamedPublisher
from ja_common.topics import DIAGNOSTICS, FIXATION, IMAGE, JOINT_STATES, OLD_TARGET, TARGET
from node_bench import joint_state


class Listener(GraphNode):
    """Subscribes to fixations; each test sets what its callbacks do."""

    on_fixation = staticmethod(lambda message: None)
    on_call = staticmethod(lambda request, response: response)

    def __init__(self, **node_kwargs):
        super().__init__('listener', **node_kwargs)
        self.got = []
        self.subscribe(FIXATION, self._on_fixation, expected_every_s=0.05)
        self.advertise_service(
            Trigger, 'do', lambda request, response: self.on_call(request, response)
        )

    def _on_fixation(self, message):
        self.on_fixation(message)
        self.got.append(message)


@pytest.fixture
def bench(make_bench):
    return make_bench(Listener, publishes=[FIXATION], subscribes=[DIAGNOSTICS])


def fail(error):
    def raising(*_):
        raise type(error)(*error.args)

    return raising


@pytest.mark.parametrize(
    ('error', 'text'),
    [
        (ValueError('the ray is bent'), '/fixation: the ray is bent'),
        (OSError('disk full'), '/fixation: disk full'),
        (KeyError('oops'), "/fixation: KeyError: 'oops'"),
    ],
)
def test_node_survives_bad_input_and_logs_it_once(bench, capfd, error, text):
    bench.node.on_fixation = fail(error)
    for stamp_ns in (1, 2, 3):
        bench.publish(FIXATION, joint_state(stamp_ns))
    bench.wait(lambda: bench.received(FIXATION) == 3)
    assert text in bench.complaint()
    log = capfd.readouterr().err
    assert log.count(text) == 1
    assert ('Traceback' in log) == isinstance(error, KeyError), 'only for a fault of our own'
    bench.node.on_fixation = lambda message: None
    bench.publish(FIXATION, joint_state(4))
    bench.wait(lambda: bench.node.got)


class Ticking(GraphNode):
    """Calls `on_tick` from a timer, and `on_command` from a subscription of rclpy's own."""

    on_tick = staticmethod(lambda: None)
    on_command = staticmethod(lambda message, information: None)

    def __init__(self, **node_kwargs):
        super().__init__('ticking', **node_kwargs)
        self.ticks = self.commands = 0
        self.create_timer(0.01, self.tick)
        self.create_subscription(FIXATION.type, FIXATION.name, self.obey, 10)

    def tick(self):
        self.ticks += 1
        self.on_tick()

    def obey(self, message, information):
        self.commands += 1
        self.on_command(message, information)


@pytest.mark.parametrize('error', [ValueError('the spring is bent'), KeyError('the spring')])
def test_a_timer_survives_its_error_and_logs_it_once(make_bench, capfd, error):
    bench = make_bench(Ticking)
    bench.node.on_tick = fail(error)
    ticks = bench.node.ticks
    bench.wait(lambda: bench.node.ticks > ticks + 5)
    assert 'timer tick: ' in bench.complaint()
    assert capfd.readouterr().err.count('timer tick: ') == 1


def test_a_subscription_of_any_kind_survives_its_error(make_bench, capfd):
    bench = make_bench(Ticking, publishes=[FIXATION])
    bench.node.on_command = fail(KeyError('oops'))
    for stamp_ns in (1, 2, 3):
        bench.publish(FIXATION, joint_state(stamp_ns))
    bench.wait(lambda: bench.node.commands == 3)
    assert "/fixation: KeyError: 'oops'" in bench.complaint()
    assert capfd.readouterr().err.count('/fixation: KeyError') == 1


def test_a_start_is_quiet_while_others_start(make_bench, capfd):
    bench = make_bench(Listener)
    bench.wait(lambda: 'no node publishes it' in bench.complaint())
    assert capfd.readouterr().err == ''


def test_diagnostics_hold_name_level_and_figures_at_one_hertz(bench):
    bench.node.on_fixation = fail(ValueError('the ray is bent'))
    bench.publish(FIXATION, joint_state(1))
    bench.wait(lambda: bench.complaint() != 'OK')
    (status,) = bench.next(DIAGNOSTICS).status
    assert status.name == '/listener'
    assert status.level == bytes([Level.ERROR])
    assert 'the ray is bent' in status.message
    assert {value.key: value.value for value in status.values}['/fixation received'] == '1'


def test_silence_is_explained_by_the_quality_of_service(make_bench):
    bench = make_bench(Listener, subscribes=[DIAGNOSTICS])
    bench.wait_for_complaint('no message on /fixation for more than 0.15 s: no node publishes it')
    lossy = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    bench.peer.create_publisher(FIXATION.type, FIXATION.name, lossy)
    bench.wait_for_complaint(
        'peer publishes it with a quality of service that does not match: BEST_EFFORT VOLATILE '
        'is offered, RELIABLE VOLATILE is needed'
    )


def test_silence_of_a_publisher_is_reported_until_it_publishes(bench):
    bench.wait_for_complaint('peer is its publisher, but sends nothing')
    reports = len(bench.messages(DIAGNOSTICS))

    def silence_is_over():
        bench.publish(FIXATION, joint_state(1))
        texts = [d.status[0].message for d in bench.messages(DIAGNOSTICS)[reports:]]
        return any('sends nothing' not in message for message in texts)

    bench.wait(silence_is_over)


@pytest.mark.parametrize(
    ('error', 'text'),
    [
        (ValueError('not now'), 'not now'),
        (FileNotFoundError('no such file'), 'no such file'),
        (KeyError('oops'), "KeyError: 'oops'"),
    ],
)
def test_service_responds_with_the_error(bench, error, text):
    bench.node.on_call = fail(error)
    response = bench.call(Trigger, 'do')
    assert not response.success
    assert response.message == text


def test_sensor_of_any_reliability_is_received(make_bench):
    """A camera driver publishes best-effort, a rig reliably."""

    class Sensing(GraphNode):
        def __init__(self, **node_kwargs):
            super().__init__('sensing', **node_kwargs)
            self.got = set()
            self.subscribe(IMAGE, lambda message: self.got.add('image'))
            self.subscribe(JOINT_STATES, lambda message: self.got.add('joints'))

    bench = make_bench(Sensing, publishes=[IMAGE])
    lossy = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    joints = bench.peer.create_publisher(JOINT_STATES.type, JOINT_STATES.name, lossy)

    def received_both():
        bench.publish(IMAGE, IMAGE.type())
        joints.publish(joint_state(1))
        return bench.node.got == {'image', 'joints'}

    bench.wait(received_both)


@dataclass(frozen=True)
class Config(Configuration):
    gain: float = parameter(1.0, 'gain', low=0.0)


class Configured(GraphNode):
    """Sends a signal to its own process once it spins."""

    def __init__(self):
        super().__init__('configured')
        self.configure(Config)
        self.create_timer(0.01, lambda: os.kill(os.getpid(), signal.SIGINT))


def test_main_ends_quietly_on_a_signal(domain, capfd):
    spin_node(Configured, ['--ros-args', '-p', 'gain:=2'])
    assert not rclpy.ok()
    assert capfd.readouterr().err == ''


@pytest.mark.parametrize('domain_id', ['abc', '-1', '233', '1.5'])
def test_main_refuses_a_domain_that_does_not_exist(monkeypatch, capfd, domain_id):
    monkeypatch.setenv('ROS_DOMAIN_ID', domain_id)
    with pytest.raises(SystemExit) as ended:
        spin_node(Configured, [])
    assert ended.value.code == 2
    assert f"ROS_DOMAIN_ID is '{domain_id}'" in capfd.readouterr().err


def test_main_ends_quietly_when_stopped_while_the_node_is_made(domain, capfd):
    made = []

    def make_node():
        os.kill(os.getpid(), signal.SIGTERM)
        made.append(GraphNode('late'))
        return made[0]

    spin_node(make_node, [])
    assert made, 'no line of the node was interrupted'
    assert not rclpy.ok()
    assert capfd.readouterr().err == ''


def test_main_does_not_hide_another_fault(domain):
    def make_node():
        raise RuntimeError('the wheel came off')

    with pytest.raises(RuntimeError, match='wheel'):
        spin_node(make_node, [])
    assert not rclpy.ok()


@pytest.mark.parametrize(
    ('args', 'text'),
    [
        (['-p', 'gain:=-1.0'], 'gain = -1.0 is outside the range from 0.0'),
        (['-p', 'gain:=-1'], 'gain = -1.0 is outside the range from 0.0'),
        (['-p', 'gain:=loud'], "gain = 'loud' is a str; a float is needed"),
        (['--params-file', '/no/such/file.yaml'], '/no/such/file.yaml'),
        (['--nonsense'], '--nonsense'),
    ],
)
def test_main_refuses_bad_arguments_in_one_line(domain, capfd, args, text):
    with pytest.raises(SystemExit) as ended:
        spin_node(Configured, ['--ros-args', *args])
    assert ended.value.code == 2
    lines = capfd.readouterr().err.splitlines()
    (error,) = [line for line in lines if '[rcl' not in line]  # rcl logs lines of its own
    assert error.startswith('error: ')
    assert text in error
    assert not rclpy.ok()


@dataclass(frozen=True)
class FixedConfig(Configuration):
    rate_hz: float = parameter(2.0, 'rate', low=1.0, high=9.0)
    scene: str = parameter('table', 'scene')
    camera: str = parameter('off', 'second camera', choices=('on', 'off'))


@dataclass(frozen=True)
class FreeConfig(Configuration):
    gain: float = parameter(0.5, 'gain', low=0.0, high=1.0)


class Tuned(GraphNode):
    """Has read-only parameters, and one that may be set."""

    def __init__(self, **node_kwargs):
        super().__init__('tuned', **node_kwargs)
        self.configure(FixedConfig)
        self.configure(FreeConfig, lambda config: None)


class ParameterClient:
    """Calls the services of parameters as `ros2 param dump` and `ros2 param load` do."""

    def __init__(self, bench):
        self._bench = bench
        self._client = AsyncParameterClient(bench.peer, bench.node.get_fully_qualified_name())
        bench.wait(self._client.services_are_ready)

    def dump(self):
        names = self._answer(self._client.list_parameters()).result.names
        values = self._answer(self._client.get_parameters(names)).values
        return dict(zip(names, values, strict=True))

    def load_file(self, path):
        return self._answer(self._client.load_parameter_file(str(path))).results

    def set_atomically(self, **values):
        parameters = [Parameter(name, value=value) for name, value in values.items()]
        return self._answer(self._client.set_parameters_atomically(parameters)).result

    def _answer(self, future):
        self._bench.wait(future.done)
        return future.result()


def test_a_dump_of_the_parameters_is_loaded_without_an_error(make_bench, tmp_path):
    """Of read-only parameters too: of ours, and of those that rclpy gives to every node."""
    bench = make_bench(Tuned)
    client = ParameterClient(bench)
    dumped = {name: parameter_value_to_python(value) for name, value in client.dump().items()}
    assert {'rate_hz', 'scene', 'gain', 'use_sim_time'} <= dumped.keys()
    dumped |= {'rate_hz': 2, 'gain': 0.75}  # YAML of another tool may write 2 for 2.0
    path = tmp_path / 'tuned.yaml'
    path.write_text(yaml.safe_dump({'/tuned': {'ros__parameters': dumped}}))
    results = client.load_file(path)
    assert len(results) == len(dumped)
    assert [result.reason for result in results if not result.successful] == []
    assert bench.node.get_parameter('gain').value == 0.75
    assert bench.node.get_parameter('rate_hz').type_ is Parameter.Type.DOUBLE


@pytest.mark.parametrize(
    ('values', 'refused'),
    [
        ({'scene': 'shelf'}, 'scene'),
        ({'scene': 'shelf', 'gain': 0.9}, 'scene'),
        ({'rate_hz': 2.5, 'scene': 'table'}, 'rate_hz'),
        ({'rate_hz': True}, 'rate_hz'),
        ({'rate_hz': '2.0'}, 'rate_hz'),
        ({'camera': True}, 'camera'),
        ({'scene': False}, 'scene'),
    ],
)
def test_another_value_of_a_read_only_parameter_is_refused(make_bench, values, refused):
    bench = make_bench(Tuned)
    result = ParameterClient(bench).set_atomically(**values)
    assert not result.successful
    assert result.reason == f'Trying to set a read-only parameter: {refused}.'
    assert bench.node.get_parameter('gain').value == 0.5, 'all or nothing'


class Renamed(GraphNode):
    """Offers a service and publishes a topic, each under its old name as well."""

    def __init__(self, **node_kwargs):
        super().__init__('renamed', **node_kwargs)
        self.calls = 0
        self.publisher = RenamedPublisher(self, TARGET, OLD_TARGET)
        self.advertise_renamed_service(Trigger, 'renamed/do', 'do', self._on_do)

    def _on_do(self, _, response):
        self.calls += 1
        response.success = True
        return response


def test_an_old_name_of_a_service_works_with_one_warning(make_bench, capfd):
    bench = make_bench(partial(Renamed, namespace='left'))
    assert bench.call(Trigger, 'left/renamed/do').success
    assert capfd.readouterr().err == ''
    for _ in range(2):
        assert bench.call(Trigger, 'left/do').success
    assert bench.node.calls == 3
    text = 'the service /left/do was called, which the next release will not have: call '
    assert capfd.readouterr().err.count(f'{text}/left/renamed/do') == 1


def test_an_old_name_of_a_topic_works_with_one_warning(make_bench, capfd):
    bench = make_bench(Renamed)
    publisher, heard = bench.node.publisher, []
    assert not publisher.is_subscribed
    publisher.publish(TARGET.type())

    def listen(topic):
        bench.peer.create_subscription(topic.type, topic.name, lambda _: heard.append(topic), 10)

    def publish_until(count):
        def another():
            publisher.publish(TARGET.type())
            return len(set(heard)) == count

        bench.wait(another)

    listen(TARGET)
    bench.wait(lambda: publisher.is_subscribed)
    publish_until(1)
    assert 'subscribe' not in capfd.readouterr().err
    listen(OLD_TARGET)
    publish_until(2)
    publish_until(2)
    text = 'a node subscribes to /target, which the next release will not have: subscribe to '
    assert capfd.readouterr().err.count(f'{text}/salient_feature_detector/target') == 1
