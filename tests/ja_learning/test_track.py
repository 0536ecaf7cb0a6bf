"""What a learner starts from: named by what was really used, and never mixed."""

import pytest

from ja_common.core.config import ConfigError
from ja_common.core.detection import Detection, Kind
from ja_learning.core.checkpoint import load_checkpoint, save_checkpoint
from ja_learning.core.checkpoint_folder import CheckpointConfig, CheckpointFolder
from ja_learning.core.gaze_line_config import GazeLineConfig
from ja_learning.core.learner_registry import make_learner
from ja_learning.core.network_config import NetworkConfig
from ja_learning.core.track import TRACKS, Origin, Start, Track, TrackConfig
from made_up_trials import trial

BALL = Detection(Kind.OBJECT, 0.1, 0.0, 100.0, 60.0, 9.0, 9.0, 0.9)
NEAR = BALL._replace(range_m=1.2, range_deviation_m=0.02)
PIXELS, LANDMARKS = GazeLineConfig(), GazeLineConfig(face_reader='landmarks')
EYES, OTHER_EYES = {'face.onnx': 'a' * 64}, {'face.onnx': 'b' * 64}


def origin(ranges=False):
    return Origin(TrackConfig(use_ranges=ranges))


def test_tracks_have_names():
    assert [str(track) for track in TRACKS] == [
        'strict', 'strict with depth',
        'self-supervised', 'self-supervised with depth',
        'synthetic others', 'synthetic others with depth',
        'landmarks', 'landmarks with depth',
    ]  # fmt: skip
    assert [Track.parse(str(track)) for track in TRACKS] == list(TRACKS)
    with pytest.raises(ValueError, match="'magic' is no track: strict"):
        Track.parse('magic')


def test_the_reader_of_faces_decides_the_start():
    assert Track.of_learner(PIXELS) == Track(Start.STRICT)
    assert Track.of_learner(LANDMARKS, depth=True) == Track(Start.LANDMARKS, depth=True)


@pytest.mark.parametrize(
    ('first_guess', 'start'),
    [
        ('none', Start.STRICT),
        ('eigenfaces', Start.STRICT),
        ('watched', Start.SELF_SUPERVISED),
        ('others', Start.SYNTHETIC_OTHERS),
    ],
)
def test_a_face_code_decides_the_start_of_a_learner_from_pixels(first_guess, start):
    config = GazeLineConfig(first_guess=first_guess)
    assert Track.of_learner(config) == Track(start)
    landmarks = GazeLineConfig(first_guess=first_guess, face_reader='landmarks')
    assert Track.of_learner(landmarks).start is Start.LANDMARKS


def test_a_checkpoint_names_the_files_that_the_learner_has_opened(saved):
    start = origin()
    start.set_weight_files(EYES)
    start.set_code_files({'code.npz': 'c' * 64})
    path = saved(start)
    _, description = load_checkpoint(path)
    assert description['weight_files'] == EYES | {'code.npz': 'c' * 64}
    again = origin()
    again.set_code_files({'code.npz': 'd' * 64})
    assert resume(path, again).path == path
    assert again.set_weight_files(EYES).startswith('code.npz was cccc')


def test_the_papers_network_is_strict_whatever_there_is():
    assert Track.of_learner(NetworkConfig(), depth=True) == Track(Start.STRICT)


def test_depth_is_what_was_used_and_not_what_was_allowed():
    allowed = origin(ranges=True)
    assert allowed.allowed([BALL]) == [BALL]
    assert str(allowed.track(PIXELS)) == 'strict'
    assert allowed.allowed([BALL, NEAR]) == [BALL, NEAR]
    allowed.allowed([BALL])
    assert str(allowed.track(PIXELS)) == 'strict with depth'
    allowed.reset()
    assert str(allowed.track(PIXELS)) == 'strict'


def test_ranges_that_are_not_allowed_do_not_reach_the_learner():
    strict = origin()
    (found,) = strict.allowed([NEAR])
    assert found[:13] == BALL[:13]
    assert found.range_m != found.range_m
    assert str(strict.track(PIXELS)) == 'strict'


@pytest.fixture
def saved(tmp_path):
    """Save a checkpoint of an origin and a configuration; return its folder and the path."""

    def save(start, config=PIXELS):
        learner = make_learner('gaze_line', 0, config)
        learner.update(trial(1))
        folder = CheckpointFolder(tmp_path, CheckpointConfig(), start)
        path = folder.save(learner)
        folder.close()
        return path

    return save


def resume(path, start, config=PIXELS):
    folder = CheckpointFolder(path.parent, CheckpointConfig(), start)
    try:
        return folder.resume_into(make_learner('gaze_line', 0, config))
    finally:
        folder.close()


def test_a_checkpoint_names_its_track_and_its_weight_files(saved):
    start = origin(ranges=True)
    start.set_weight_files(EYES)
    start.allowed([NEAR])
    _, description = load_checkpoint(saved(start))
    assert description['track'] == 'strict with depth'
    assert description['weight_files'] == EYES


@pytest.mark.parametrize(
    ('before', 'after', 'sentence'),
    [
        ((True, PIXELS), (False, PIXELS), 'of the track strict with depth, .* the track strict,'),
        ((False, PIXELS), (True, PIXELS), 'of the track strict, .* the track strict with depth,'),
        ((False, PIXELS), (False, LANDMARKS), 'of the track strict, .* the track landmarks,'),
    ],
)
def test_a_checkpoint_of_another_track_is_not_resumed(saved, before, after, sentence):
    path = saved(origin(before[0]), before[1])
    with pytest.raises(ConfigError, match=sentence):
        resume(path, origin(after[0]), after[1])


def test_a_rig_whose_depth_camera_was_never_there_resumes(saved):
    path = saved(origin(ranges=True))
    again = origin(ranges=True)
    assert resume(path, again).path == path
    assert str(again.track(PIXELS)) == 'strict'


def test_depth_that_was_used_stays_in_the_name(saved):
    start = origin(ranges=True)
    start.allowed([NEAR])
    path = saved(start)
    again = origin(ranges=True)
    assert resume(path, again).path == path
    assert str(again.track(PIXELS)) == 'strict with depth'


def test_a_checkpoint_from_before_there_were_tracks_is_strict(saved):
    path = saved(origin())
    arrays, description = load_checkpoint(path)
    for name in ('track', 'track_allowed', 'weight_files'):
        del description[name]
    save_checkpoint(path, arrays, description)
    assert resume(path, origin()).path == path
    with pytest.raises(ConfigError, match='of the track strict'):
        resume(path, origin(ranges=True))


@pytest.mark.parametrize(
    'spoiled', [{'track': 7}, {'weight_files': 3}, {'weight_files': {'a': 1}}]
)
def test_a_description_that_makes_no_sense_is_refused(saved, spoiled):
    path = saved(origin())
    arrays, description = load_checkpoint(path)
    save_checkpoint(path, arrays, description | spoiled)
    with pytest.raises(ConfigError, match=r'is no track|weight_files'):
        resume(path, origin())


def test_other_weight_files_of_the_same_track_are_named(saved):
    start = origin()
    assert start.set_weight_files(EYES) == ''
    path = saved(start)
    again = origin()
    assert resume(path, again).path == path
    assert again.set_weight_files(EYES) == ''
    assert again.set_weight_files(OTHER_EYES).startswith('face.onnx was aaaa')
    fresh = origin()
    fresh.set_weight_files(OTHER_EYES)
    assert fresh.changed_weight_files() == '', 'nothing was learned with others'
    resume(path, fresh)
    assert fresh.changed_weight_files().endswith('and is bbbbbbbbbbbbbbbb')
