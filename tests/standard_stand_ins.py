"""Classes with the fields of vision_msgs, hri_msgs and tf2_msgs, for where those are missing.

Made from the definitions in tests/ja_perception/standard_messages, so no field can be invented.
"""

import importlib
from functools import cache
from pathlib import Path
from typing import Any

from ja_perception.standard_codec import HriTypes, VisionTypes

DEFINITIONS = Path(__file__).parent / 'ja_perception' / 'standard_messages'
_NUMBERS = {'float32': float, 'float64': float, 'uint8': int, 'uint32': int}


class StandIn:
    """A message: fields with the defaults of ROS; a name that is no field is refused."""

    fields: dict[str, Any]

    def __init__(self, **values: Any) -> None:
        unknown = values.keys() - self.fields.keys()
        assert not unknown, f'{type(self).__name__} has no {unknown}'
        for name, make in self.fields.items():
            object.__setattr__(self, name, values.get(name, make()))

    def __setattr__(self, name: str, value: Any) -> None:
        assert name in self.fields, f'{type(self).__name__} has no {name}'
        object.__setattr__(self, name, value)


@cache
def stand_in(package: str, name: str) -> Any:
    """Return a class with the fields of a message definition, or the real one if there is none."""
    path = DEFINITIONS / package / 'msg' / f'{name}.msg'
    if not path.exists():
        return getattr(importlib.import_module(f'{package}.msg'), name)
    fields = {}
    for line in path.read_text().splitlines():
        code = line.partition('#')[0].split()
        if len(code) == 2 and '=' not in code[1]:
            fields[code[1]] = _maker(package, code[0])
    return type(name, (StandIn,), {'fields': fields})


def _maker(package: str, kind: str) -> Any:
    if kind == 'string':
        return str
    if kind in _NUMBERS:
        return _NUMBERS[kind]
    if kind.endswith(']'):
        return list
    owner, _, name = kind.rpartition('/')
    return lambda: stand_in(owner or package, name)()


VISION = VisionTypes(
    *(
        stand_in('vision_msgs', name)
        for name in ('Detection2DArray', 'Detection2D', 'ObjectHypothesisWithPose')
    )
)
HRI = HriTypes(
    *(
        stand_in('hri_msgs', name)
        for name in (
            'IdsList',
            'NormalizedRegionOfInterest2D',
            'FacialLandmarks',
            'NormalizedPointOfInterest2D',
        )
    )
)
