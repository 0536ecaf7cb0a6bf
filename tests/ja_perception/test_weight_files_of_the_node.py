"""The detector publishes, latched, which files of learned weights it has opened."""

import hashlib
from importlib.resources import files

import pytest

from ja_common.topics import WEIGHT_FILES
from ja_common.weight_files_codec import decode_weight_files
from ja_perception.salient_feature_detector_node import SalientFeatureDetectorNode

FACE_DETECTOR = 'blazeface_short_range.onnx'
LANDMARKS = {'face_landmark.onnx', 'iris_landmark.onnx'}


def published(make_bench, **parameters):
    bench = make_bench(SalientFeatureDetectorNode, subscribes=[WEIGHT_FILES], **parameters)
    bench.wait(lambda: bench.messages(WEIGHT_FILES))
    return decode_weight_files(bench.messages(WEIGHT_FILES)[-1])


def test_a_late_subscriber_gets_the_hash_of_the_file_that_is_shipped(make_bench):
    shipped = (files('ja_perception.models') / FACE_DETECTOR).read_bytes()
    assert published(make_bench) == {FACE_DETECTOR: hashlib.sha256(shipped).hexdigest()}


@pytest.mark.parametrize(
    ('finder', 'names'),
    [('haar', ['haarcascade_frontalface_default.xml']), ('template', [FACE_DETECTOR])],
)
def test_another_finder_has_other_files(make_bench, finder, names):
    assert list(published(make_bench, face_finder=finder)) == names


def test_a_reader_of_landmarks_adds_its_networks(make_bench):
    assert published(make_bench, read_gaze=True).keys() == {FACE_DETECTOR} | LANDMARKS
