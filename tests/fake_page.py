"""A model of the live page without a graph; as a program it serves the page: HOST [ALLOWED]."""

import sys
import threading

import numpy as np

from ja_common.core.camera_model import CameraModel
from ja_common.core.detection import Detection, Kind
from ja_common.core.health import Level
from ja_dashboard.core.view_model import CurvePoints, NodeHealth, RunState, State
from ja_dashboard.image_feed import Picture
from ja_dashboard.view_node import Frame

FACE = Detection(Kind.FACE, 0.0, 0.0, 160.0, 120.0, 60.0, 80.0, 0.9)
CAMERA = CameraModel.from_field_of_view(320, 240, 0.6)
# All of a picture but its stamp.
PICTURE = (np.full((240, 320, 3), 60, np.uint8), [FACE], None, CAMERA, 0.004)
SERVICES = frozenset({'gate/enable', 'gate/home', 'reset_learning', 'sim/pause', 'sim/step'})


class FakeModel:
    """Shows one frame, and records the requests and the viewers."""

    def __init__(self, **changes):
        self.requests = []
        self.viewers = 0
        self.frame = Frame(
            **{
                'state': State(RunState.RUNNING, 'looking at the caregiver'),
                'facts': {'p(LM)': '0.31'},
                'node_health': [NodeHealth('/gate', Level.WARN, 'no <image>', 0.0, {})],
                'latencies_ms': {'detections': 4.2},
                'curve': CurvePoints([1], [1.0], [0.2], [1.0], [0.0]),
                'log': [(1, 'gate: hello')],
                'settings': {'objects': 3, 'learner': 'paper'},
                'choices': {'learner': ('paper', 'gaze_line')},
                'services': SERVICES,
                'switches': {'gate/enable': True, 'sim/pause': False},
                **changes,
            }
        )

    def note_viewer(self):
        self.viewers += 1

    def show_truth(self, shown):
        self.requests.append(('truth', shown))

    def call_switch(self, service, on):
        self.requests.append((service, on))

    def call_trigger(self, service):
        self.requests.append((service,))

    def set_remote_parameter(self, name, value):
        self.requests.append((name, value))

    def report_failure(self, where, error):
        self.requests.append((where, str(error)))


if __name__ == '__main__':
    from ja_dashboard.server import Server

    with Server(FakeModel(picture=Picture(1, *PICTURE)), sys.argv[1], 8300, *sys.argv[2:]) as page:
        print(page.address, flush=True)
        threading.Event().wait()
