"""`scorer`: compares the truth with the fixations; no other node may subscribe to the truth."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from std_msgs.msg import Float32, Header
from std_srvs.srv import Trigger

from ja_common.core.config import Configuration, parameter
from ja_common.graph_node import GraphNode
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.node_main import spin_node
from ja_common.reported_save import ReportedSave
from ja_common.synchroniser import StampedSet, Synchroniser
from ja_common.time_codec import to_ns
from ja_common.topics import FIXATION, INTERRUPTED, SCORE, SIM_TRUTH, SUCCESS_RATE
from ja_sim.core.score import Score, TrialOutcome
from ja_sim.core.trial_table import TrialTable
from ja_sim.truth_codec import decode_truth


@dataclass(frozen=True)
class ScorerConfig(Configuration):
    """What is reported, and where it is stored."""

    window_trials: int = parameter(100, 'trials of the recent success rate', low=1, high=100000)
    csv_file: str = parameter('', 'file for one row per trial; empty: none')


class ScorerNode(GraphNode):
    """Publishes the success of joint attention after every trial."""

    def __init__(self, **node_kwargs: Any) -> None:
        super().__init__('scorer', **node_kwargs)
        self._config = self.configure(ScorerConfig)
        self._joints = JointCodec(self.configure(JointConfig))
        self._score = Score(self._config.window_trials)
        Synchroniser(self).call_with(
            {SIM_TRUTH: decode_truth, FIXATION: self._joints.decode}, self._score_image
        )
        self.subscribe(INTERRUPTED, self._on_interrupted)
        self._success_rate_publisher = self.create_topic_publisher(SUCCESS_RATE)
        self._score_publisher = self.create_topic_publisher(SCORE)
        self.advertise_service(Trigger, 'sim/reset_score', self._on_reset)
        self._table: TrialTable | None = None
        if self._config.csv_file:
            self._table = TrialTable(Path(self._config.csv_file).expanduser())
            self._table_save = ReportedSave(self, 'csv_file', self._table.save)

    def destroy_node(self) -> None:
        """Write the rows that are not written yet, then destroy the node."""
        if self._table is not None:
            self._table_save.close()
        super().destroy_node()

    def _score_image(self, found: StampedSet) -> None:
        outcome = self._score.score_image(found[SIM_TRUTH], found[FIXATION])
        if outcome is None:
            return
        self._publish_score(outcome)
        if self._table is not None:
            self._table.append_trial(outcome)
            self._table_save.request()

    def _on_interrupted(self, message: Header) -> None:
        self._score.interrupt_trial(to_ns(message.stamp))

    def _publish_score(self, outcome: TrialOutcome) -> None:
        rates = self._score.rates()
        values = {'objects': str(outcome.objects)}
        for name, rate in rates.items():
            low, high = rate.interval
            values |= {
                f'{name} trials': str(rate.trials),
                f'{name} success_rate': f'{rate.rate:.4f}',
                f'{name} interval': f'{low:.4f} {high:.4f}',
            }
        values['last'] = (
            'success' if outcome.success else 'failure' if outcome.fixated else 'given up'
        )
        self._success_rate_publisher.publish(Float32(data=rates['recent'].rate))
        self._score_publisher.publish(
            DiagnosticStatus(
                name=self.get_fully_qualified_name(),
                hardware_id=self.get_namespace(),
                message=f'{rates["all"].successes} of {rates["all"].trials} trials',
                values=[KeyValue(key=key, value=value) for key, value in values.items()],
            )
        )

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Any:
        self._score = Score(self._config.window_trials)
        response.success, response.message = True, 'counting from zero'
        return response


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    spin_node(ScorerNode, args)


if __name__ == '__main__':
    main()
