"""Make docs/images/demo.webp, the moving picture of the README, from a recording of a demo.

    ./ja demo --record
    .venv/bin/python tools/make_demo_animation.py runs/<time>-record

Shown are some trials of visual feedback, before the learner knew anything, and the last trials.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont
from rclpy.serialization import deserialize_message

from ja_common.core.detection import Detection, Kind
from ja_common.core.fixation import WIDTH_SIXTH
from ja_common.core.geometry import angle_between, rays_of_directions
from ja_common.detection_codec import decode_detections
from ja_common.image_codec import decode_image
from ja_common.joint_codec import JointCodec, JointConfig
from ja_common.message_types import message_class
from ja_common.status_values import status_values
from ja_common.time_codec import to_ns
from ja_common.topics import (
    CAMERA_INFO,
    DETECTIONS,
    FIXATION,
    GATE_STATUS,
    IMAGE,
    JOINT_STATES,
    SIM_TRUTH,
)
from ja_recording.core.reader import Recording
from ja_sim.truth_codec import decode_truth

OUTPUT = Path(__file__).parents[1] / 'docs' / 'images' / 'demo.webp'
TRIALS_SHOWN = 5
FRAME_MS, OUTCOME_MS = 260, 900
SIGHT, CURVE = (440, 330), (300, 330)
CAPTION_PX = 34
WINDOW = 30
_DOES = {
    'look': 'looks at her',
    'search': 'searches her',
    'glance': 'glances aside',
    'shift': 'turns',
}
_SOURCE = {'VF': ' (visual feedback)', 'LM': ' (the learner)'}
_FACE, _OBJECT, _MEANT = (255, 220, 60), (255, 255, 255), (0, 230, 120)
_GREEN, _RED, _INK = (0, 140, 90), (200, 70, 0), (40, 40, 40)


@dataclass(frozen=True)
class Moment:
    """One image and what the nodes published about it.

    `meant`: ray to the attended object. `outcome`: whether this was fixated, on the image that
    ends a trial. `earlier`: the outcomes before.
    """

    picture: np.ndarray
    focal_px: float
    detections: list[Detection]
    meant: tuple[float, float]
    phase: str
    source: str
    p_lm: float
    outcome: bool | None
    earlier: list[bool]


def moments(recording: Recording) -> Iterator[Moment]:
    """Yield every image of the recording, once, when the gate has answered it."""
    joints = JointCodec(JointConfig())
    kept: dict[str, Any] = {}
    outcomes: list[bool] = []
    shifting, shown_ns = False, -1
    answered = (CAMERA_INFO, IMAGE, DETECTIONS, FIXATION, JOINT_STATES, SIM_TRUTH)
    for message in recording.messages({f'/{topic.name}' for topic in (*answered, GATE_STATUS)}):
        name = message.topic.name.lstrip('/')
        said = deserialize_message(message.data, message_class(message.topic.type_name))
        kept[name] = said
        if name != GATE_STATUS.name or any(topic.name not in kept for topic in answered):
            continue
        values = status_values(said)
        image = kept[IMAGE.name]
        if 'source' not in values or to_ns(image.header.stamp) == shown_ns:
            continue
        shown_ns = to_ns(image.header.stamp)
        truth = decode_truth(kept[SIM_TRUTH.name])
        fixated = joints.decode(kept[FIXATION.name]) if shifting else None
        shifting = values['phase'] == 'shift'
        outcome = None
        if fixated is not None:
            nearest = np.argmin(angle_between(truth.directions, fixated))
            outcome = bool(nearest == truth.attended)
        posture = joints.decode_posture(kept[JOINT_STATES.name])
        yield Moment(
            decode_image(image),
            kept[CAMERA_INFO.name].k[0],
            decode_detections(kept[DETECTIONS.name]),
            tuple(rays_of_directions(posture, truth.directions[truth.attended])),
            values['phase'],
            values['source'],
            float(values['p_lm']),
            outcome,
            list(outcomes),
        )
        if outcome is not None:
            outcomes.append(outcome)


def chosen(every: list[Moment]) -> list[Moment]:
    """Return some trials led by visual feedback, and the last ones."""
    practice = next(len(moment.earlier) for moment in every if moment.p_lm < 0.5) + 1
    last = len(every[-1].earlier) - TRIALS_SHOWN
    shown = [*range(practice, practice + TRIALS_SHOWN), *range(last, last + TRIALS_SHOWN)]
    return [moment for moment in every if len(moment.earlier) in shown]


def sight(moment: Moment) -> Image.Image:
    """Draw the camera's image, boxes of the detections, and a ring around the attended object."""
    enlarged = SIGHT[0] / moment.picture.shape[1]
    drawn = cv2.resize(moment.picture, SIGHT, interpolation=cv2.INTER_CUBIC)
    for seen in moment.detections:
        half = np.array([seen.width, seen.height]) / 2
        corners = [enlarged * (np.array([seen.u, seen.v]) + sign * half) for sign in (-1, 1)]
        low, high = (tuple(map(round, corner)) for corner in corners)
        colour = _FACE if seen.kind is Kind.FACE else _OBJECT
        cv2.rectangle(drawn, low, high, colour, 2, cv2.LINE_AA)
    focal = enlarged * moment.focal_px
    centre = np.array(SIGHT) / 2
    radius = round(focal * np.tan(WIDTH_SIXTH))
    cv2.circle(drawn, tuple(map(round, centre)), radius, _OBJECT, 1, cv2.LINE_AA)
    at = tuple(map(round, centre + focal * np.array(moment.meant)))
    cv2.circle(drawn, at, round(0.08 * SIGHT[0]), _MEANT, 3, cv2.LINE_AA)
    return Image.fromarray(drawn)


def curve(moment: Moment, trials: int) -> Image.Image:
    """Draw the success of the last trials up to this moment."""
    figure = Figure(figsize=(CURVE[0] / 100, CURVE[1] / 100), dpi=100, layout='constrained')
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    successes = np.array(moment.earlier, float)
    if len(successes):
        sums = np.concatenate([np.zeros(WINDOW), np.cumsum(successes)])
        count = np.minimum(np.arange(len(successes)) + 1, WINDOW)
        axes.plot((sums[WINDOW:] - sums[:-WINDOW]) / count, color='#0072B2')
    axes.set(xlim=(0, trials), ylim=(0, 1.02), xlabel='trials')
    axes.set_title(f'success, last {WINDOW} trials', fontsize=10)
    axes.axhline(1 / 3, color='grey', linewidth=0.8, linestyle=':')
    axes.spines[['top', 'right']].set_visible(False)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])


def frame(moment: Moment, trials: int) -> Image.Image:
    """Draw image and curve side by side, with a caption below."""
    size = (SIGHT[0] + CURVE[0], SIGHT[1] + CAPTION_PX)
    whole = Image.new('RGB', size, 'white')
    whole.paste(sight(moment), (0, 0))
    whole.paste(curve(moment, trials), (SIGHT[0], 0))
    text, ink = _DOES[moment.phase] + _SOURCE.get(moment.source, ''), _INK
    if moment.outcome is not None:
        text, ink = ('the same as she', _GREEN) if moment.outcome else ('another than she', _RED)
        text = f'looks at {text}'
    text = f'trial {len(moment.earlier) + 1}: {text}'
    pen = ImageDraw.Draw(whole)
    pen.text((10, SIGHT[1] + 7), text, ink, ImageFont.load_default(size=17))
    ring = 'ring: the attended object; the robot does not know it'
    small = ImageFont.load_default(size=12)
    pen.text((size[0] - 10, SIGHT[1] + 10), ring, _GREEN, small, anchor='ra')
    return whole


def main() -> None:
    """Write the animation."""
    every = list(moments(Recording(Path(sys.argv[1]))))
    shown = chosen(every)
    first, *others = [frame(moment, len(every[-1].earlier)) for moment in shown]
    lengths = [FRAME_MS if moment.outcome is None else OUTCOME_MS for moment in shown]
    first.save(
        OUTPUT, save_all=True, append_images=others, duration=lengths, loop=0, quality=60, method=6
    )
    print(f'{OUTPUT}: {len(shown)} images, {OUTPUT.stat().st_size / 1e6:.2f} MB')


if __name__ == '__main__':
    main()
