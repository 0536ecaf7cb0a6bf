"""A learner taught by a recording: the same lessons as in life, the same weights every time."""

import csv

import numpy as np
import pytest

from ja_bringup.recording.learner_score import score_learner, success_rate, write_csv
from ja_bringup.recording.reader import Recording
from ja_common.core.config import ConfigError
from ja_common.core.detection import Detection, Kind
from ja_common.core.geometry import rays_of_directions
from ja_common.core.stamps import NS_PER_S
from ja_common.detection_codec import encode_detections
from ja_common.image_codec import encode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.point_cloud_codec import encode_columns
from ja_common.topics import DETECTIONS, FACE_IMAGE, FIXATION, JOINT_STATES, SIM_TRUTH
from ja_learning.core.checkpoint import load_checkpoint
from ja_learning.core.checkpoint_folder import LAST
from ja_learning.core.network import NetworkConfig, ThreeLayerNetwork
from ja_learning.core.trial import Trial
from ja_sim.truth_codec import FIELDS
from node_bench import header
from recordings import write_recording

LOOK = np.zeros(2)
JOINTS = JointCodec(JointConfig())
TRIALS = 40


def day(count: int = TRIALS) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Trials: the face (a bright column where she looks), what she means, another object."""
    rng = np.random.default_rng(0)
    trials = []
    for _ in range(count):
        meant = np.array([rng.uniform(-0.25, 0.25), 0.1])
        face = np.full((30, 25), 100, np.uint8)
        column = int(12 + 40 * meant[0])
        face[:, column - 1 : column + 2] = 250
        trials.append((face, meant, np.array([-meant[0] + 0.1, -0.1])))
    return trials


def said_in(trials, with_truth: bool = True):
    """Two images a trial: the look, and the fixation of what she means (always the right one)."""
    for number, (face, meant, other) in enumerate(trials):
        for part, posture in enumerate((LOOK, meant)):
            stamp_ns = (2 * number + part) * NS_PER_S // 10
            head = header(stamp_ns)
            if with_truth:
                columns = np.zeros((len(FIELDS), 2))
                columns[FIELDS.index('pan')] = meant[0], other[0]
                columns[FIELDS.index('tilt')] = meant[1], other[1]
                columns[FIELDS.index('attended')] = 1, 0
                columns[FIELDS.index('trial')] = number + 1
                truth = encode_columns(head, dict(zip(FIELDS, columns, strict=True)))
                yield stamp_ns, SIM_TRUTH, truth
            yield stamp_ns, JOINT_STATES, JOINTS.encode(head, posture, np.zeros(2))
            seen = [detected(Kind.OBJECT, posture, each) for each in (meant, other)]
            if part == 0:
                yield stamp_ns, FACE_IMAGE, encode_image(face, head.stamp, '')
                seen.append(detected(Kind.FACE, posture, LOOK))
            yield stamp_ns, DETECTIONS, encode_detections(head, seen)
            yield stamp_ns, FIXATION, JOINTS.encode(head, meant if part else None)


def detected(kind: Kind, posture, direction) -> Detection:
    x, y = map(float, rays_of_directions(posture, direction))
    return Detection(kind, x, y, 0.0, 0.0, 9.0, 9.0, 1.0, attended=kind is Kind.FACE)


def recorded(path, count: int = TRIALS, **kwargs) -> Recording:
    return Recording(write_recording(path, said_in(day(count), **kwargs)))


def learned(recording: Recording, folder, seed: int = 0, **parameters):
    """The scored trials, and the weights in the end."""
    every = {'checkpoint_folder': folder, 'seed': seed, **parameters}
    arguments = [part for name, value in every.items() for part in ('-p', f'{name}:={value}')]
    return score_learner(recording, arguments), load_checkpoint(folder / LAST)[0]


def same(a, b) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


@pytest.mark.parametrize('learner', ['paper', 'gaze_line'])
def test_the_same_recording_and_seed_give_the_same_weights(learner, tmp_path):
    recording = recorded(tmp_path / 'r')
    first = learned(recording, tmp_path / 'a', learner=learner)
    assert len(first[0]) == TRIALS
    again = learned(recording, tmp_path / 'b', learner=learner)
    assert first[0] == again[0]
    assert same(first[1], again[1])


def test_another_seed_gives_other_weights(tmp_path):
    recording = recorded(tmp_path / 'r')
    _, weights = learned(recording, tmp_path / 'a', seed=0)
    _, others = learned(recording, tmp_path / 'b', seed=1)
    assert not same(weights, others)


def test_the_node_learns_what_the_network_learns_from_the_same_trials(tmp_path):
    _, weights = learned(recorded(tmp_path / 'r'), tmp_path / 'a', seed=3)
    network = ThreeLayerNetwork(NetworkConfig(), 3)
    for face, meant, _ in day():
        network.learn(Trial(face, LOOK[np.newaxis], meant))
    for name in ('hidden_weights', 'hidden_biases', 'output_weights', 'output_biases'):
        array = network.state()[name]
        np.testing.assert_allclose(weights[name], array, atol=1e-6)


def test_the_curve_rises_and_knows_the_truth(tmp_path):
    recording = recorded(tmp_path / 'r', count=3 * TRIALS)
    trials, _ = learned(recording, tmp_path / 'a', learning_rate=0.03)
    offs = [trial.off_rad for trial in trials]
    assert np.mean(offs[-10:]) < 0.6 * np.mean(offs[:10])
    assert success_rate(trials, 'recorded').rate == 1.0
    assert success_rate(trials[-10:]).rate > success_rate(trials[:10]).rate


def test_without_truth_there_is_an_angle_but_no_success(tmp_path):
    trials, _ = learned(recorded(tmp_path / 'r', with_truth=False), tmp_path / 'a')
    assert len(trials) == TRIALS
    assert {trial.success for trial in trials} == {None}
    assert success_rate(trials).trials == 0
    write_csv(trials, tmp_path / 'a.csv')
    rows = list(csv.DictReader((tmp_path / 'a.csv').open()))
    assert [float(row['off_rad']) for row in rows] == [trial.off_rad for trial in trials]
    assert rows[0]['success'] == ''


def test_a_recording_without_what_a_learner_needs_is_refused(tmp_path):
    said = [each for each in said_in(day()) if each[1] is not FIXATION]
    recording = Recording(write_recording(tmp_path / 'r', said))
    with pytest.raises(ConfigError, match='lacks fixation'):
        score_learner(recording)
