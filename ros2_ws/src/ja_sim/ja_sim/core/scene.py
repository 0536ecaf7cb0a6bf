"""What a world is made of: frozen, validated descriptions, and their YAML files.

A scene file names only what differs from the defaults below; ``scenes/default.yaml`` is the
geometry in which all figures are measured. Angles are in degrees here because people write these
files; everything computed from them is in radians.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, get_type_hints

import yaml


class SceneError(ValueError):
    """A scene that cannot be built; the message says where and what to write instead."""


class _FieldError(ValueError):
    """A value out of range, with the name of its field so that the file's line can be found."""

    def __init__(self, name: str, message: str) -> None:
        super().__init__(f'{name} {message}')
        self.name = name


def _number(default: float, low: float, high: float) -> Any:
    return field(default=default, metadata={'range': (low, high)})


def _choice(default: str, *options: str) -> Any:
    return field(default=default, metadata={'options': options})


def _interval(default: tuple[float, float], low: float, high: float) -> Any:
    return field(default=default, metadata={'interval': (low, high)})


class _Validated:
    """Checks every field against the range or options it was declared with."""

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):  # type: ignore[arg-type]
            value, meta = getattr(self, item.name), item.metadata
            if 'range' in meta:
                _check_number(item.name, value, *meta['range'])
            elif 'interval' in meta:
                if not isinstance(value, tuple) or len(value) != 2 or not _ordered(value):
                    raise _FieldError(item.name, f'must be [low, high], not {value!r}')
                for bound in value:
                    _check_number(item.name, bound, *meta['interval'])
            elif 'options' in meta and value not in meta['options']:
                options = ', '.join(meta['options'])
                raise _FieldError(item.name, f'must be one of {options}, not {value!r}')


def _ordered(value: tuple[Any, ...]) -> bool:
    return all(isinstance(bound, int | float) for bound in value) and value[0] <= value[1]


def _check_number(name: str, value: object, low: float, high: float) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise _FieldError(name, f'must be a number, not {value!r}')
    if not low <= value <= high:
        raise _FieldError(name, f'must lie in [{low:g}, {high:g}], not {value:g}')


@dataclass(frozen=True)
class HeadSpec(_Validated):
    """The robot's head: servos, encoders and camera. The defaults are the *ideal* head.

    ``speed_limit_deg_s`` and ``acceleration_limit_deg_s2`` of 0 mean unlimited; a camera rate of 0
    exposes whenever it is asked, without latency.
    """

    pan_limit_deg: float = _number(60.0, 1.0, 170.0)
    tilt_limit_deg: float = _number(30.0, 1.0, 80.0)
    servo_frequency_rad_s: float = _number(150.0, 1.0, 300.0)
    speed_limit_deg_s: float = _number(0.0, 0.0, 3000.0)
    acceleration_limit_deg_s2: float = _number(0.0, 0.0, 100000.0)
    dead_time_s: float = _number(0.0, 0.0, 0.5)
    backlash_deg: float = _number(0.0, 0.0, 10.0)
    encoder_noise_deg: float = _number(0.0, 0.0, 5.0)
    encoder_step_deg: float = _number(0.0, 0.0, 5.0)
    encoder_delay_s: float = _number(0.0, 0.0, 0.5)
    view_pan_deg: float = _number(18.0, 2.0, 60.0)  # half of the field of view
    view_tilt_deg: float = _number(13.5, 2.0, 60.0)
    camera_rate_hz: float = _number(0.0, 0.0, 240.0)
    camera_latency_s: float = _number(0.0, 0.0, 0.5)
    exposure_time_s: float = _number(0.0, 0.0, 0.1)
    exposure_gain: float = _number(1.0, 0.2, 3.0)
    image_noise: float = _number(0.0, 0.0, 50.0)  # standard deviation [grey levels]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.camera_latency_s > 0.0 and self.camera_rate_hz == 0.0:
            raise _FieldError('camera_latency_s', 'needs a camera_rate_hz above 0')


HEAD_PRESETS = {
    'ideal': HeadSpec(),
    'hobby_servo': HeadSpec(
        servo_frequency_rad_s=30.0,
        speed_limit_deg_s=400.0,
        acceleration_limit_deg_s2=8000.0,
        dead_time_s=0.02,
        backlash_deg=1.0,
        encoder_noise_deg=0.1,
        encoder_step_deg=0.29,
        encoder_delay_s=0.01,
        camera_rate_hz=30.0,
        camera_latency_s=0.03,
        exposure_time_s=0.008,
        image_noise=3.0,
    ),
}


@dataclass(frozen=True)
class CaregiverSpec(_Validated):
    """Who she is, where she sits and how she behaves.

    ``identity``, ``hair`` and ``skin`` are names in the asset, or ``any``: drawn at each reset.
    """

    identity: str = 'any'
    distance_m: float = _number(1.2, 0.6, 4.0)
    pan_deg: float = _number(0.0, -60.0, 60.0)
    tilt_deg: float = _number(0.0, -20.0, 20.0)
    head_share: tuple[float, float] = _interval((0.6, 0.9), 0.0, 1.0)
    head_noise_deg: float = _number(1.0, 0.0, 15.0)
    reliability: float = _number(1.0, 0.0, 1.0)
    reaction_s: float = _number(0.2, 0.0, 5.0)
    turn_s: float = _number(0.3, 0.01, 5.0)
    attention_s: float = _number(10.0, 0.1, 3600.0)
    patience_s: float = _number(4.0, 0.1, 3600.0)
    eye_contact_deg: float = _number(4.0, 0.1, 20.0)
    eye_contact_speed_deg_s: float = _number(10.0, 0.1, 500.0)
    blink_rate_hz: float = _number(0.1, 0.0, 2.0)
    shows_object: str = _choice('no', 'no', 'shakes', 'holds')


@dataclass(frozen=True)
class ObjectsSpec(_Validated):
    """The things on and above the table, seen from the robot's head."""

    count: int = _number(5, 1, 10)
    pan_deg: tuple[float, float] = _interval((-40.0, 40.0), -90.0, 90.0)
    tilt_deg: tuple[float, float] = _interval((-15.0, 15.0), -45.0, 45.0)
    distance_m: tuple[float, float] = _interval((0.6, 1.0), 0.2, 3.0)
    radius_m: tuple[float, float] = _interval((0.02, 0.035), 0.005, 0.2)
    gap_to_face_deg: float = _number(8.0, 0.0, 40.0)
    gap_deg: float = _number(5.0, 0.0, 40.0)
    moving_share: float = _number(0.0, 0.0, 1.0)
    rearranged: str = _choice('replaced', 'never', 'moved', 'replaced')

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.count, int):
            raise _FieldError('count', f'must be a whole number, not {self.count!r}')


@dataclass(frozen=True)
class RoomSpec(_Validated):
    """The room and its light; ``light_variation`` 0 lights every reset alike."""

    furnished: bool = True
    light_variation: float = _number(0.5, 0.0, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.furnished, bool):
            raise _FieldError('furnished', f'must be true or false, not {self.furnished!r}')


@dataclass(frozen=True)
class Scene(_Validated):
    """A whole world, ready for :class:`ja_sim.core.world.JointAttentionWorld`."""

    name: str = 'default'
    head: HeadSpec = field(default_factory=HeadSpec)
    caregiver: CaregiverSpec = field(default_factory=CaregiverSpec)
    objects: ObjectsSpec = field(default_factory=ObjectsSpec)
    room: RoomSpec = field(default_factory=RoomSpec)


def scene_names() -> list[str]:
    """Names of the scenes shipped with the package."""
    folder = resources.files('ja_sim') / 'scenes'
    return sorted(Path(f.name).stem for f in folder.iterdir() if f.name.endswith('.yaml'))


def load_scene(name_or_path: str) -> Scene:
    """Read a scene shipped with the package by its name, or any file by its path.

    Raises :class:`SceneError` naming file and line of the first mistake.
    """
    path = Path(name_or_path)
    if path.suffix not in ('.yaml', '.yml'):
        if name_or_path not in scene_names():
            raise SceneError(
                f"no scene '{name_or_path}': the package has {', '.join(scene_names())}; "
                'a file of your own must end in .yaml'
            )
        path = Path(str(resources.files('ja_sim') / 'scenes' / f'{name_or_path}.yaml'))
    try:
        root = yaml.compose(path.read_text(encoding='utf-8'), Loader=yaml.SafeLoader)
    except OSError as error:
        raise SceneError(f'{path}: cannot be read: {error.strerror}') from None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise SceneError(f'{path}:{line}: not YAML: {error.problem}') from None
    reader = _Reader(path)
    scene = reader.read(Scene, root, Scene(name=path.stem)) if root else Scene(name=path.stem)
    assert isinstance(scene, Scene)
    return scene


class _Reader:
    """Turns YAML nodes into dataclasses; nodes, unlike plain dicts, still know their line."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self, cls: type, node: yaml.Node, base: Any) -> Any:
        """Read ``base`` (an instance of ``cls``) with the fields that the node names replaced."""
        if not isinstance(node, yaml.MappingNode):
            raise self._error(node, f'expected a table of settings, found {node.value!r}')
        types, values, nodes = get_type_hints(cls), {}, {}
        for key, value in node.value:
            if key.value == 'preset' and cls is HeadSpec:
                base = self._preset(value)
                continue
            if key.value not in types:
                raise self._error(key, f"unknown setting '{key.value}'{_hint(key.value, types)}")
            nodes[key.value] = value
            values[key.value] = self._value(types[key.value], value, getattr(base, key.value))
        try:
            return dataclasses.replace(base, **values)
        except _FieldError as error:
            raise self._error(nodes.get(error.name, node), str(error)) from None

    def _value(self, kind: Any, node: yaml.Node, default: Any) -> Any:
        if kind is HeadSpec and isinstance(node, yaml.ScalarNode):
            return self._preset(node)
        if dataclasses.is_dataclass(kind):
            return self.read(kind, node, default)  # type: ignore[arg-type]
        value = yaml.SafeLoader('').construct_object(node, deep=True)
        return tuple(value) if isinstance(value, list) else value

    def _preset(self, node: yaml.Node) -> HeadSpec:
        if node.value not in HEAD_PRESETS:
            names = ', '.join(HEAD_PRESETS)
            raise self._error(node, f"no head preset '{node.value}': choose {names}")
        return HEAD_PRESETS[node.value]

    def _error(self, node: yaml.Node, message: str) -> SceneError:
        return SceneError(f'{self._path}:{node.start_mark.line + 1}: {message}')


def _hint(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    return f", did you mean '{close[0]}'?" if close else ''
