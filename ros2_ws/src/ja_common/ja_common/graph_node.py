"""The base of every node: topics, services, timers, parameters, health."""

import time
import traceback
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from ja_common.core.config import ConfigError, Configuration
from ja_common.core.health import Health, Level
from ja_common.core.parameter_page import project_parameters
from ja_common.core.parameter_sections import parameter_sections
from ja_common.core.unread_parameters import unread_parameters
from ja_common.discovery_refresher import DiscoveryRefresher
from ja_common.parameters import declare_config
from ja_common.rclpy_private import keep_from_context, parameter_names, parameter_overrides
from ja_common.silence import why_silent
from ja_common.stamp_watch import watch_stamps
from ja_common.topics import CLOCK, DIAGNOSTICS, Topic

Config = TypeVar('Config', bound=Configuration)

# So many reports, one a second, may /clock be missing while a graph starts.
_CLOCK_PATIENCE = 3


class GraphNode(Node):
    """A node that survives bad input, and reports its health and silent inputs at 1 Hz.

    Callbacks of topics, services and timers may raise ValueError with one clear sentence for input
    that cannot be used (or OSError for a file): it is logged once with the topic's name, shown in
    /diagnostics, and the node runs on.
    """

    refuses_unknown_parameters = False
    """Whether the node must not start with a parameter that reaches nothing (`check_parameters`).

    True where a misspelt name would leave a motor with a default in place of a safe value.
    """

    def __init__(self, name: str, **node_kwargs: Any) -> None:
        super().__init__(name, **node_kwargs)
        keep_from_context(self)
        self.health = Health(time.monotonic())
        # By resolved name; `./ja reference` makes the tables of docs/ from these.
        self.subscribed_topics: dict[str, Topic] = {}
        self.published_topics: dict[str, Topic] = {}
        self.advertised_services: dict[str, Any] = {}
        self.renamed_services: dict[str, str] = {}  # old name -> new one
        self._unread_parameters: list[str] = []
        self._reports_without_clock = 0
        self._diagnostics = self.create_topic_publisher(DIAGNOSTICS)
        self._discovery_refresher = DiscoveryRefresher(self)
        # Wall time, not /clock: a simulation that stands still must be reported as well.
        self.create_timer(1.0, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def configure(
        self, config_class: type[Config], changed: Callable[[Config], None] | None = None
    ) -> Config:
        """Declare a configuration dataclass as this node's parameters; see `declare_config`."""
        return declare_config(self, config_class, changed)

    def check_parameters(self, arguments: Sequence[str]) -> None:
        """Report parameters that this node was given and does not have; call it once it is made.

        `arguments`: its ROS arguments, without `--ros-args`. Raises ConfigError instead, where the
        class has `refuses_unknown_parameters` and they are not for nodes of others.
        """
        unread = list(
            unread_parameters(
                self.get_fully_qualified_name(),
                parameter_names(self),
                parameter_overrides(self),
                parameter_sections(arguments),
                project_parameters(),
            )
        )
        for parameter in unread:
            if parameter.is_foreign:
                self.get_logger().warning(parameter.sentence)
        self._unread_parameters = [each.sentence for each in unread if not each.is_foreign]
        if self._unread_parameters and self.refuses_unknown_parameters:
            raise ConfigError('; '.join(self._unread_parameters))
        self._report_unread_parameters()

    def create_topic_publisher(self, topic: Topic) -> Publisher:
        """Create a publisher of a topic."""
        publisher = self.create_publisher(
            topic.type,
            topic.name,
            topic.publisher_qos,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        self.published_topics[publisher.topic_name] = topic
        return publisher

    def subscribe(
        self,
        topic: Topic,
        callback: Callable[[Any], None],
        expected_every_s: float | None = None,
    ) -> None:
        """Subscribe; when silent for longer than `expected_every_s` [s, wall time], warn why."""

        def receive(message: Any) -> None:
            self.health.record_message(resolved, time.monotonic())
            check_stamp(message)
            callback(message)

        # Default event callbacks cost a third of the throughput; `why_silent` explains instead.
        subscription = self.create_subscription(
            topic.type,
            topic.name,
            receive,
            topic.subscriber_qos,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )
        resolved = subscription.topic_name
        self.subscribed_topics[resolved] = topic
        check_stamp = watch_stamps(
            topic,
            lambda: None if self._in_lockstep() else self.get_clock().now().nanoseconds,
            lambda text: self.report_problem(
                f'stamps of {resolved}', f'{resolved}: {text}', Level.WARN
            ),
        )
        self.health.watch_input(resolved, expected_every_s)

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., None],
        *more: Any,
        **options: Any,
    ) -> Subscription:
        """Subscribe as rclpy does; an error of the callback is a problem of this node."""
        where = self.resolve_topic_name(topic)

        @wraps(callback)  # rclpy counts the arguments that the callback takes
        def receive(*received: Any) -> None:
            self.call_guarded(where, callback, *received)

        return super().create_subscription(msg_type, topic, receive, *more, **options)

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], None],
        *more: Any,
        **options: Any,
    ) -> Timer:
        """Create a timer as rclpy does; an error of the callback is a problem of this node."""
        where = f'timer {getattr(callback, "__name__", "")}'.rstrip()

        def expire() -> None:
            self.call_guarded(where, callback)

        return super().create_timer(timer_period_sec, expire, *more, **options)

    def advertise_service(
        self, service_type: Any, name: str, callback: Callable[[Any, Any], Any]
    ) -> None:
        """Offer a service; an error of the callback becomes `success = False` with its text."""

        def guarded(request: Any, response: Any) -> Any:
            try:
                return callback(request, response)
            except (ValueError, OSError) as error:
                text = str(error)
            except Exception as error:
                text = f'{type(error).__name__}: {error}'
                self.report_problem(name, f'{name}: {text}\n{traceback.format_exc()}')
            response.success, response.message = False, text
            return response

        service = self.create_service(service_type, name, guarded)
        self.advertised_services[service.srv_name] = service_type

    def advertise_renamed_service(
        self, service_type: Any, name: str, old_name: str, callback: Callable[[Any, Any], Any]
    ) -> None:
        """Offer a service, for one more release also under its old name, with one warning."""

        has_warned = False
        old, new = (self.resolve_service_name(each) for each in (old_name, name))

        def call_by_old_name(request: Any, response: Any) -> Any:
            nonlocal has_warned
            if not has_warned:
                has_warned = True
                self.get_logger().warning(
                    f'the service {old} was called, which the next release will not have: call '
                    f'{new}'
                )
            return callback(request, response)

        self.advertise_service(service_type, name, callback)
        self.advertise_service(service_type, old_name, call_by_old_name)
        self.renamed_services[old] = new

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters as rclpy does; a read-only one may be set to the value that it has.

        So `ros2 param load` takes back what `ros2 param dump` has written.
        """
        changed = [each for each in parameter_list if not self._is_unchanged_read_only(each)]
        if parameter_list and not changed:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(changed)

    def _is_unchanged_read_only(self, parameter: Parameter) -> bool:
        if not self.has_parameter(parameter.name):
            return False
        if not self.describe_parameter(parameter.name).read_only:
            return False
        known = self.get_parameter(parameter.name)
        value = known.value
        if known.type_ is Parameter.Type.STRING and parameter.type_ is Parameter.Type.BOOL:
            # rclpy's reader of parameter files takes the quotes off: 'off' arrives as False.
            value = {'on': True, 'yes': True, 'off': False, 'no': False}.get(value)
            return bool(value is parameter.value)
        whole = (Parameter.Type.INTEGER, Parameter.Type.DOUBLE)  # `1` for a float that is 1.0
        kinds = (parameter.type_, known.type_)
        return (kinds[0] == kinds[1] or kinds == whole) and bool(parameter.value == value)

    def namespaced_folder(self, folder: str | Path) -> Path:
        """Return the subfolder for the files of this node's namespace: one for each head."""
        return Path(folder).expanduser() / self.get_namespace().strip('/')

    def report_problem(
        self, where: str, message: str, level: Level = Level.ERROR, quiet: bool = False
    ) -> None:
        """Show a problem in /diagnostics, and log it when it is news and not `quiet`."""
        if self.health.record_problem(where, message, time.monotonic(), level, quiet):
            log = self.get_logger()
            if level >= Level.ERROR:
                log.error(message)
            else:
                log.warning(message)

    def call_guarded(self, where: str, callback: Callable[..., None], *args: Any) -> None:
        """Call a callback; an error of it is a problem of this node, at `where`."""
        try:
            callback(*args)
        except (ValueError, OSError) as error:
            self.report_problem(where, f'{where}: {error}')
        except ExternalShutdownException:
            raise  # the node ends itself, as the camera at the end of a film
        except Exception as error:
            # No bad input but a bug: the node runs on, and the trace is logged.
            text = f'{where}: {type(error).__name__}: {error}\n{traceback.format_exc()}'
            self.report_problem(where, text)

    def _in_lockstep(self) -> bool:
        """Return whether the time of this node is that of the images, whatever its clock says."""
        return self.has_parameter('lockstep') and self.get_parameter('lockstep').value

    def _report_unread_parameters(self) -> None:
        for sentence in self._unread_parameters:
            self.report_problem(sentence, sentence, Level.WARN)

    def _report_missing_clock(self) -> None:
        """Report that the time of this node stands still because nothing publishes it."""
        simulated = self.get_parameter('use_sim_time').value
        alone = simulated and not self.count_publishers(CLOCK.name)
        # Nodes of a graph start one after the other.
        self._reports_without_clock = self._reports_without_clock + 1 if alone else 0
        if self._reports_without_clock > _CLOCK_PATIENCE:
            text = (
                f'use_sim_time is true, and no node publishes {CLOCK.name}: start the simulator '
                'or player that does, or set use_sim_time:=false'
            )
            self.report_problem('simulated time', text, Level.WARN)
        elif not alone:
            self.health.clear_problem('simulated time')

    def _report(self) -> None:
        self._report_unread_parameters()
        if halted_s := self._discovery_refresher.refresh(time.monotonic()):
            self.report_problem('halt', f'this node stood still for {halted_s:.1f} s', Level.WARN)
        self._report_missing_clock()
        now_s = time.monotonic()
        silent = self.health.silent_inputs(now_s)
        for name in self.subscribed_topics:
            where = f'silence of {name}'
            if name in silent:
                why = why_silent(self, name, self.subscribed_topics[name])
                text = f'no message on {name} for more than {silent[name]:g} s: {why}'
                quiet = self.health.is_starting(name, now_s)
                self.report_problem(where, text, Level.WARN, quiet)
            else:
                self.health.clear_problem(where)
        report = self.health.report(now_s)
        status = DiagnosticStatus(
            level=bytes([report.level]),
            name=self.get_fully_qualified_name(),
            message=report.message,
            hardware_id=self.get_namespace(),
            values=[KeyValue(key=key, value=value) for key, value in report.values.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)
