"""`scorer`: joins truth and fixations by their stamps, and tells after every trial."""

import csv
import math

import pytest
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ja_common.point_cloud_codec import encode_columns
from ja_common.topics import FIXATION, INTERRUPTED, SCORE, SIM_TRUTH, SUCCESS_RATE
from ja_sim.scorer_node import ScorerNode
from ja_sim.truth_codec import FIELDS
from node_bench import header, joint_state

LEFT, RIGHT = (0.3, 0.0), (-0.3, 0.1)


class Course:
    """Trials, as the sim and the evaluator tell of them."""

    def __init__(self, bench):
        self.bench = bench
        self.stamp_ns = 10**9
        self.image(trial=0)

    def image(self, trial, fixation=None, order=(SIM_TRUTH, FIXATION)):
        """Publish one image's truth and fixation: the caregiver attends to LEFT."""
        self.stamp_ns += 10**8
        messages = {
            SIM_TRUTH: truth(self.stamp_ns, trial),
            FIXATION: joint_state(self.stamp_ns, *(fixation or ())),
        }
        for topic in order:
            self.bench.publish(topic, messages[topic])
        self.bench.wait(lambda: self.bench.received(FIXATION) == self.bench.received(SIM_TRUTH))

    def score_after(self, trials):
        """Return the score published after so many trials: its message and its values."""
        heard = self.bench.messages(SCORE)  # latched: only the last is sure to be heard
        self.bench.wait(lambda: heard and heard[-1].message.endswith(f'of {trials} trials'))
        return heard[-1].message, {value.key: value.value for value in heard[-1].values}


def truth(stamp_ns, trial, attended=(1.0, 0.0)):
    columns = {name: [0.0, 0.0] for name in FIELDS} | {
        'pan': [LEFT[0], RIGHT[0]],
        'tilt': [LEFT[1], RIGHT[1]],
        'attended': list(attended) if trial else [0.0, 0.0],
        'in_view': [1.0, 1.0],
        'trial': [float(trial)] * 2,
    }
    return encode_columns(header(stamp_ns), columns)


def told_rate(course):
    rates = course.bench.messages(SUCCESS_RATE)
    return rates[-1].data if rates else None


@pytest.fixture
def make_course(make_bench):
    def make(**parameters):
        sent, received = [SIM_TRUTH, FIXATION, INTERRUPTED], [SUCCESS_RATE, SCORE]
        return Course(make_bench(ScorerNode, sent, received, **parameters))

    return make


def test_success_failure_and_giving_up(make_course):
    course = make_course()
    expected = [
        (LEFT, 'success', 1.0, '1 of 1 trials'),
        (RIGHT, 'failure', 0.5, '1 of 2 trials'),
        (None, 'given up', 1 / 3, '1 of 3 trials'),
    ]
    for trial, (fixation, last, rate, text) in enumerate(expected, start=1):
        course.image(trial)
        course.image(trial, fixation)
        course.image(trial + 1)
        message, values = course.score_after(trial)
        assert (values['last'], message) == (last, text)
        assert float(values['all success_rate']) == pytest.approx(rate, abs=1e-4)
        course.bench.wait(lambda rate=rate: told_rate(course) == pytest.approx(rate, abs=1e-6))
    low, high = map(float, values['all interval'].split())
    assert 0.0 < low < 1 / 3 < high < 1.0


def test_an_interrupted_trial_does_not_count(make_course):
    course = make_course()
    course.image(1)
    course.bench.publish(INTERRUPTED, header(course.stamp_ns))
    course.bench.wait(lambda: course.bench.received(INTERRUPTED) == 1)
    course.image(1, RIGHT)
    course.image(2, LEFT)
    course.image(3)
    assert course.score_after(1)[0] == '1 of 1 trials'


def test_order_of_the_two_topics_does_not_matter(make_course):
    course = make_course()
    course.image(1, LEFT, order=(FIXATION, SIM_TRUTH))
    course.image(2, order=(FIXATION, SIM_TRUTH))
    assert course.score_after(1)[0] == '1 of 1 trials'


def test_repeated_image_counts_once(make_course):
    course = make_course()
    course.image(1, LEFT)
    course.stamp_ns -= 10**8
    course.image(1, LEFT)
    for trial in (2, 3):
        course.image(trial)
    assert course.score_after(2)[0] == '1 of 2 trials'


def test_every_trial_is_a_row_on_disk_at_once(make_course, tmp_path):
    path = tmp_path / 'new' / 'trials.csv'
    course = make_course(csv_file=str(path))
    for trial, fixation in enumerate([LEFT, RIGHT, None], start=1):
        course.image(trial, fixation)
    course.image(trial=4)
    course.score_after(3)
    course.bench.wait(lambda: len(rows_of(path)) == 3)
    rows = rows_of(path)
    assert [row['trial'] for row in rows] == ['1', '2', '3']
    assert [row['success'] for row in rows] == ['1', '0', '0']
    assert [row['stamp_ns'] for row in rows] == ['1200000000', '1300000000', '1400000000']
    assert {row['objects'] for row in rows} == {'2'}
    assert {row['in_view'] for row in rows} == {'1'}
    assert float(rows[0]['attended_pan_rad']) == pytest.approx(LEFT[0])
    assert float(rows[1]['fixated_pan_rad']) == pytest.approx(RIGHT[0])
    assert float(rows[1]['fixated_tilt_rad']) == pytest.approx(RIGHT[1])
    assert rows[2]['fixated_pan_rad'] == '', 'given up'


def test_a_full_disk_takes_neither_a_score_nor_a_row(make_course, tmp_path):
    folder, away = tmp_path / 'scores', tmp_path / 'away'
    path = folder / 'trials.csv'
    course = make_course(csv_file=str(path))
    folder.rename(away)
    folder.write_text('a file in the place of the folder')
    for trial in (1, 2):
        course.image(trial, LEFT)
    course.image(trial=3)
    assert course.score_after(2)[0] == '2 of 2 trials'
    course.bench.wait_for_complaint('csv_file: not saved: ')
    folder.unlink()
    away.rename(folder)
    course.bench.wait(lambda: len(rows_of(path)) == 2)  # without a further trial
    course.bench.wait(lambda: 'csv_file' not in course.bench.complaint())


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_reset_counts_from_nought(make_course):
    course = make_course()
    course.image(1, LEFT)
    course.image(2, LEFT)
    course.score_after(1)
    assert course.bench.call(Trigger, 'sim/reset_score').success
    course.image(2)  # what is left of the trial under way does not count
    for trial in (3, 4):
        course.image(trial, RIGHT)
    course.bench.wait(lambda: course.score_after(1)[0] == '0 of 1 trials')


def lacking():
    return encode_columns(Header(), {'pan': [0.0], 'tilt': [0.0]})


@pytest.mark.parametrize(
    ('message', 'text'),
    [
        (lacking(), 'lacks the fields'),
        (truth(1, trial=1, attended=(1.0, 1.0)), '2 objects are marked as attended'),
        (encode_columns(Header(), {name: [] for name in FIELDS}), 'the truth holds no object'),
    ],
)
def test_broken_truth_is_one_clear_error_and_the_node_lives_on(make_course, message, text):
    course = make_course()
    course.bench.publish(SIM_TRUTH, message)
    course.bench.wait_for_complaint('/sim/truth: ')
    assert text in course.bench.complaint()
    course.bench.publish(FIXATION, joint_state(5, math.nan, 0.0))
    course.bench.wait_for_complaint('/fixation: position of')
    for trial in (1, 2):
        course.image(trial, LEFT)
    course.score_after(1)
