"""A film of the simulated caregiver who follows a schedule: a rehearsal without a person.

A wide camera that stands still films her, as a phone on a table would film a person. She looks at
the camera and, when asked, at the thing that the schedule names; where it has hands move the
things, they stand elsewhere in the next picture. Optics, compression and noise are not those in
which the learners were made, and the world has another seed.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_caregiver.core.film_clips import places_of_directions
from ja_caregiver.core.schedule import (
    Place,
    Rearrangement,
    Schedule,
    ScheduledLook,
    Segment,
)
from ja_common.core.config import ConfigError, Configuration, parameter
from ja_common.core.files import SaveError, why_not_written
from ja_sim.core.behaviour import ROBOT, CaregiverBehaviour
from ja_sim.core.scene import Scene, load_scene
from ja_sim.core.specs import CaregiverSpec
from ja_sim.core.world import START_NS, JointAttentionWorld

# The places of the things lie in the film with a margin, so that the window can centre them.
_FIELD_SHARE = 0.8
_LARGEST_TILT_DEG = 15.0
_REARRANGED_AFTER_S = 0.5
_CODECS = {'.mp4': 'mp4v', '.avi': 'MJPG'}


@dataclass(frozen=True)
class RehearsalConfig(Configuration):
    """The film and its camera."""

    seed: int = parameter(1000, 'seed of the world', low=0)
    scene: str = parameter('default', 'name of a scene, or path of a scene file (YAML)')
    width: int = parameter(1280, 'width of the film [px]', low=64, high=4096)
    height: int = parameter(720, 'height of the film [px]', low=48, high=4096)
    rate_hz: float = parameter(10.0, 'pictures a second', low=1.0, high=60.0)
    view_deg: float = parameter(70.0, 'horizontal view of the camera', low=20.0, high=110.0)
    image_noise: float = parameter(
        3.0, 'standard deviation of a pixel in grey levels', low=0.0, high=50.0
    )
    exposure_gain: float = parameter(1.1, 'brightness of the film', low=0.2, high=3.0)


class _FollowsSchedule(CaregiverBehaviour):
    """She attends to what a schedule names, whatever the robot does."""

    def __init__(
        self,
        spec: CaregiverSpec,
        rng: np.random.Generator,
        segments: tuple[Segment, ...],
        index_of: Callable[[int], int],
    ) -> None:
        """`index_of` returns which object has a number now."""
        super().__init__(spec, rng)
        self._coming, self._index_of, self._until_s = list(segments), index_of, 0.0

    def update(self, now_s: float, offset_rad: float, speed_rad_s: float, objects: int) -> bool:
        """Go to the segment of this time; return True where the things are moved."""
        moved = False
        while self._coming and now_s >= self._begin_s(self._coming[0]):
            segment = self._coming.pop(0)
            self._until_s = segment.end_s
            if isinstance(segment, Rearrangement):
                moved, self._until_s = True, now_s
                continue
            drawn = self._choose_response(objects)
            self.response = replace(drawn, attended=self._index_of(segment.thing), reliable=True)
        return moved

    def attends_to(self, now_s: float) -> int:
        """Return the index of the thing she looks at now, or ROBOT."""
        return self.response.attended if now_s < self._until_s else ROBOT

    @staticmethod
    def _begin_s(segment: Segment) -> float:
        if isinstance(segment, Rearrangement):
            # Once she looks at the camera again.
            return min(segment.start_s + _REARRANGED_AFTER_S, segment.end_s)
        return segment.start_s


class _DirectedWorld(JointAttentionWorld):
    """A world whose caregiver follows a schedule."""

    def __init__(
        self,
        scene: Scene,
        seed: int,
        image_size: tuple[int, int],
        segments: tuple[Segment, ...],
    ) -> None:
        self._segments = segments
        super().__init__(scene, seed, image_size)

    def reset(self, seed: int | None = None) -> None:
        """Restart, with the schedule from its start."""
        super().reset(seed)
        rng = np.random.default_rng([self._seed, 1])
        self._behaviour = _FollowsSchedule(
            self.scene.caregiver, rng, self._segments, lambda thing: int(self.order[thing - 1])
        )

    @property
    def order(self) -> NDArray[np.intp]:
        """Return the indices of the objects, (n,), by their numbers: from left to right."""
        return np.argsort(-self.truth().directions[:, 0])


class Rehearsal:
    """A simulated person who follows a schedule, filmed by a wide camera at rest."""

    def __init__(self, schedule: Schedule, config: RehearsalConfig = RehearsalConfig()) -> None:
        """Build the world. Raises ConfigError where the things have no room in the film."""
        self._schedule, self._config = schedule, config
        scene = _scene(load_scene(config.scene), schedule.things, config)
        size = (config.width, config.height)
        self._world = _DirectedWorld(scene, config.seed, size, schedule.segments)
        self._places: dict[int, tuple[Place, ...]] = {}

    def pictures(self) -> Iterator[NDArray[np.uint8]]:
        """Yield the pictures (H, W, 3) uint8 RGB of the film, up to the end of the schedule."""
        config, looks = self._config, self._schedule.looks
        count = math.ceil((self._schedule.end_s + 1.0) * config.rate_hz)
        for number in range(count):
            self._world.step((START_NS + round((number + 1) / config.rate_hz * 1e9)
                              - self._world.now_ns) * 1e-9)  # fmt: skip
            time_s = (number + 1) / config.rate_hz
            for index, look in enumerate(looks):
                if look.start_s <= time_s <= look.end_s and index not in self._places:
                    self._places[index] = self._places_now()
            yield np.asarray(self._world.observe().image, np.uint8)

    def schedule(self) -> Schedule:
        """Return the schedule with the places of all things; after the last picture."""
        places = iter(range(len(self._schedule.looks)))
        segments = tuple(
            replace(each, things=self._places[next(places)])
            if isinstance(each, ScheduledLook)
            else each
            for each in self._schedule.segments
        )
        # The first picture shows the world one step after its start.
        return Schedule(segments, self._config.view_deg, -1 / self._config.rate_hz)

    def close(self) -> None:
        """Free the graphics context."""
        self._world.close()

    def _places_now(self) -> tuple[Place, ...]:
        config = self._config
        size, view = (config.width, config.height), math.radians(config.view_deg)
        directions = self._world.truth().directions[self._world.order]
        places = places_of_directions(directions, size, view)
        return tuple((float(u), float(v)) for u, v in places)


def film_rehearsal(
    schedule: Schedule,
    path: Path,
    config: RehearsalConfig = RehearsalConfig(),
    progress: Callable[[float], None] = lambda share: None,
) -> Schedule:
    """Write a film of a schedule, and return the schedule with the places of all things.

    `path` ends in .mp4 or .avi. `progress` receives the share that is done, 0-1. Raises
    ConfigError for another ending, SaveError where the film cannot be written.
    """
    codec = _CODECS.get(path.suffix.lower())
    if codec is None:
        raise ConfigError(f'{path}: the name of a film ends in {" or ".join(_CODECS)}')
    rehearsal = Rehearsal(schedule, config)
    # The encoder needs a file of its own ending; a film that is not whole has another name.
    part = path.with_name(f'.{path.stem}.{os.getpid()}{path.suffix}')
    size = (config.width, config.height)
    writer = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fourcc = cv2.VideoWriter.fourcc(*codec)
        writer = cv2.VideoWriter(str(part), fourcc, config.rate_hz, size)
        if not writer.isOpened():
            raise SaveError(
                f'{path} cannot be written as a film: is the folder writable, and does this '
                f'OpenCV have the codec {codec}?'
            )
        total = math.ceil((schedule.end_s + 1.0) * config.rate_hz)
        for number, picture in enumerate(rehearsal.pictures(), 1):
            writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
            progress(number / total)
        writer.release()
        os.replace(part, path)
    except OSError as error:
        if isinstance(error, SaveError):
            raise
        raise SaveError(why_not_written(path, error)) from error
    finally:
        if writer is not None:
            writer.release()
        with contextlib.suppress(OSError):
            part.unlink()
        rehearsal.close()
    return rehearsal.schedule()


def _scene(scene: Scene, things: int, config: RehearsalConfig) -> Scene:
    """Return the scene as the film's camera sees it, with all things in the film."""
    half = math.tan(math.radians(config.view_deg / 2))
    half_height = half * config.height / config.width
    pan = _FIELD_SHARE * config.view_deg / 2
    tilt = min(_FIELD_SHARE * math.degrees(math.atan(half_height)), _LARGEST_TILT_DEG)
    head = replace(
        scene.head,
        view_pan_deg=config.view_deg / 2,
        view_tilt_deg=math.degrees(math.atan(half_height)),
        image_noise=config.image_noise,
        exposure_gain=config.exposure_gain,
        camera_rate_hz=0.0,
        camera_latency_s=0.0,
    )
    objects = replace(
        scene.objects,
        count=things,
        pan_deg=(max(scene.objects.pan_deg[0], -pan), min(scene.objects.pan_deg[1], pan)),
        tilt_deg=(max(scene.objects.tilt_deg[0], -tilt), min(scene.objects.tilt_deg[1], tilt)),
        rearranged='replaced',
    )
    return replace(scene, head=head, objects=objects)
