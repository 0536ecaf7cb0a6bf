"""A meeting on the page without a graph: a simulated scene, and a state for each phase.

As a program it serves the page, and shows the state whose name it reads from its standard input:
FOLDER, where the report of the state `ended` lies.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from fake_page import SERVICES, FakeModel
from ja_common.core.camera_model import CameraModel
from ja_dashboard.core.meeting_view import MeetingView
from ja_dashboard.core.view_model import SceneView
from ja_dashboard.image_feed import Picture

CONTROLS = SERVICES | {'caregiver/pause', 'caregiver/end', 'caregiver/rearranged'}
THINGS = '1 0.31 0.19;2 -0.03 0.22;3 0.34 -0.02;4 -0.19 0.05;5 0.2 0.04;12 0.9 0.1'
MEASURED = {
    'trial': '24', 'trials': '40', 'things': THINGS, 'chance': '0.2000', 'learner_trials': '23',
    'learner_successes': '17', 'learner_interval': '0.5353 0.8745', 'successes': '17',
}  # fmt: skip
STATES = {
    'starting': ('I look for things: 1 of at least 2.', {'trial': '1', 'trials': '40'}),
    'no_person': ('I see no person.', MEASURED),
    'camera': ('Look at the camera.', MEASURED | {'answer': '5', 'right': 'true'}),
    'thing': ('Look at thing 4.', MEASURED | {'number': '4'}),
    'right': ('I looked at thing 4: right.', MEASURED | {
        'phase': 'answer', 'number': '4', 'answer': '4', 'right': 'true'
    }),
    'wrong': ('I looked at thing 2: wrong.', MEASURED | {
        'phase': 'answer', 'number': '4', 'answer': '2', 'right': 'false'
    }),
    'rearrange': ('Move the things to other places.', MEASURED | {
        'answer': '2', 'right': 'false'
    }),
    'paused': ('Paused.', MEASURED),
    'ended': ('The meeting has ended.', MEASURED | {'trial': '40', 'learner_trials': '38',
        'learner_successes': '29', 'learner_interval': '0.6079 0.8701', 'successes': '30',
    }),
}  # fmt: skip
"""Message and values by the phase; a phase of its own name unless it has another one."""


def meeting(state, **values):
    """Return what the page receives in a state."""
    message, known = STATES[state]
    return MeetingView.of(message, {'phase': state} | known | values)


def simulated_scene():
    """Return a picture and a scene of the simulation: five things before her."""
    from ja_sim.core.scene import load_scene
    from ja_sim.core.world import JointAttentionWorld

    scene = load_scene('easy')
    head = replace(scene.head, view_pan_deg=26.0, view_tilt_deg=20.0)
    objects = replace(scene.objects, count=5, pan_deg=(-22.0, 22.0), tilt_deg=(2.0, 14.0))
    world = JointAttentionWorld(
        replace(scene, head=head, objects=objects), seed=3, image_size=(960, 720)
    )
    for _ in range(12):
        world.step(0.1)
    lens, truth = world.intrinsics, world.truth_at_exposure()
    picture = Picture(
        1, world.observe().image, [], None,
        CameraModel(lens.width, lens.height, lens.fx, lens.fy, lens.cx, lens.cy), 0.0,
    )  # fmt: skip
    world.close()
    shown = SceneView(
        half_view=(0.45, 0.35), low=np.zeros(2), high=np.zeros(2), posture=np.zeros(2)
    )
    places = ';'.join(
        f'{number} {pan:.4f} {tilt:.4f}'
        for number, (pan, tilt) in enumerate(truth.directions, start=1)
    )
    return picture, shown, f'{places};6 0.9 0.1'


class FakeMeeting(FakeModel):
    """A page model that shows a state of a meeting."""

    def __init__(self, picture=None, scene=None, things=THINGS, report=''):
        super().__init__(
            services=CONTROLS, picture=picture, scene=scene,
            recent=() if picture is None else (picture,),
        )  # fmt: skip
        self._values = {'things': things, 'report': report}
        self._stamp_ns = 1

    def show(self, state, **values):
        """Show a state, with other values."""
        more = {'things': self._values['things']} if state != 'starting' else {}
        if state == 'ended':
            more['report'] = self._values['report']
        self.frame = replace(self.frame, meeting=meeting(state, **more | values))


def main(folder: Path) -> None:
    """Serve the page; show each state that a line of the standard input names."""
    from ja_dashboard.server import Server

    picture, scene, things = simulated_scene()
    model = FakeMeeting(picture, scene, things, str(folder / 'report.html'))
    with Server(model, '127.0.0.1', 8400) as page:
        print(page.address, flush=True)
        for line in sys.stdin:
            name, _, option = line.strip().partition(' ')
            if name == 'requests':
                print(model.requests, flush=True)
                continue
            if name == 'none':
                model.frame = replace(model.frame, meeting=None)
            elif name == 'silent':
                model.show('thing')
                shown = replace(model.frame.meeting, silent_s=7.0)
                model.frame = replace(model.frame, meeting=shown)
            elif name == 'hostile':
                model.show('thing', number=option)
                shown = replace(
                    model.frame.meeting, message='<img src=x onerror=hacked=1>{{ 1+1 }}'
                )
                model.frame = replace(model.frame, meeting=shown)
            else:
                model.show(name)
            print('shown', flush=True)


if __name__ == '__main__':
    main(Path(sys.argv[1]))
