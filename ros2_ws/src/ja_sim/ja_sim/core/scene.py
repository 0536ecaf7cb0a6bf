"""A scene, and the YAML files that describe one.

A file names only what differs from the defaults in :mod:`ja_sim.core.specs`.
"""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any, get_type_hints

import yaml

from ja_common.core.config import ConfigError, Configuration, checked, parameter
from ja_common.core.safe_files import compose_yaml, construct_yaml, read_text
from ja_sim.core.specs import (
    HEAD_PRESETS,
    CaregiverSpec,
    HeadSpec,
    ObjectsSpec,
    RoomSpec,
    SensesSpec,
)


class SceneError(ConfigError):
    """A scene that cannot be built; the message names the place, the mistake and its fix."""


@dataclass(frozen=True)
class Scene(Configuration):
    """A whole world, ready for :class:`ja_sim.core.world.JointAttentionWorld`."""

    name: str = parameter('default', 'Its name in reports')
    head: HeadSpec = field(default_factory=HeadSpec)
    caregiver: CaregiverSpec = field(default_factory=CaregiverSpec)
    objects: ObjectsSpec = field(default_factory=ObjectsSpec)
    room: RoomSpec = field(default_factory=RoomSpec)
    senses: SensesSpec = field(default_factory=SensesSpec)


def scene_names() -> list[str]:
    """Return the names of the scenes shipped with the package."""
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
        root = compose_yaml(read_text(path), str(path))
        scene = Scene(name=path.stem)
        return _with_photo_beside(path, _Reader(path).read(Scene, root, scene)) if root else scene
    except SceneError:
        raise
    except ConfigError as error:
        raise SceneError(str(error)) from None


def _with_photo_beside(path: Path, scene: Scene) -> Scene:
    """Return the scene with a relative path of her photograph taken from the scene's folder."""
    photo = scene.caregiver.photo
    if not photo:
        return scene
    caregiver = dataclasses.replace(scene.caregiver, photo=str(path.parent / photo))
    return dataclasses.replace(scene, caregiver=caregiver)


class _Reader:
    """Turns YAML nodes into dataclasses; nodes, unlike plain dicts, still know their line."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self, cls: type, node: yaml.Node, base: Any) -> Any:
        """Read ``base`` (an instance of ``cls``) with the fields that the node names replaced."""
        if not isinstance(node, yaml.MappingNode):
            found = repr(node.value)[:50] if isinstance(node, yaml.ScalarNode) else 'a list'
            raise self._error(node, f'expected a table of settings, found {found}')
        types, values = get_type_hints(cls), {}
        known = {item.name: item for item in dataclasses.fields(cls)}
        for key, value in node.value:
            if key.value == 'preset' and cls is HeadSpec:
                base = self._preset(value)
                continue
            if key.value not in known:
                name = key.value[:50]
                raise self._error(key, f"unknown setting '{name}'{_hint(name, known)}")
            values[key.value] = self._value(types[key.value], value, getattr(base, key.value))
            try:
                if 'description' in known[key.value].metadata:
                    checked(known[key.value], values[key.value])
            except ConfigError as error:
                raise self._error(key, str(error)) from None
        try:
            return dataclasses.replace(base, **values)
        except ConfigError as error:
            raise self._error(node, str(error)) from None

    def _value(self, kind: Any, node: yaml.Node, default: Any) -> Any:
        if kind is HeadSpec and isinstance(node, yaml.ScalarNode):
            return self._preset(node)
        if dataclasses.is_dataclass(kind):
            return self.read(kind, node, default)  # type: ignore[arg-type]
        value = construct_yaml(node, str(self._path))
        return tuple(value) if isinstance(value, list) else value

    def _preset(self, node: yaml.Node) -> HeadSpec:
        if not isinstance(node, yaml.ScalarNode) or node.value not in HEAD_PRESETS:
            names = ', '.join(HEAD_PRESETS)
            raise self._error(node, f"no head preset '{str(node.value)[:50]}': choose {names}")
        return HEAD_PRESETS[node.value]

    def _error(self, node: yaml.Node, message: str) -> SceneError:
        return SceneError(f'{self._path}:{node.start_mark.line + 1}: {message}')


def _hint(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    return f", did you mean '{close[0]}'?" if close else ''
