"""The senses that a graph may have beside the picture, and the parameters that switch them on."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ja_common.core.config import ConfigError
from ja_runner.graph import MEMORY_PARAMETERS
from ja_runner.node_spec import NodeSpec

_DETECTOR = 'salient_feature_detector'
_WITH_RANGES = {'use_ranges': True}

SENSES: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    'eyes': {
        _DETECTOR: {'read_gaze': True},
        'learning_module': {'face_reader': 'landmarks'},
    },
    'depth': {
        'sim': {'depth': 'sensor'},
        _DETECTOR: {'depth': 'picture'},
        'learning_module': _WITH_RANGES,
    },
    'second-camera': {
        'sim': {'second_camera': 'on'},
        _DETECTOR: {'depth': 'second_camera'},
        'learning_module': _WITH_RANGES,
    },
}
"""By sense: the parameters of each node that has a part in it."""

_BOTH_MEASURE_RANGES = {'depth', 'second-camera'}


def parse_senses(text: str) -> list[str]:
    """Return the senses of a list with commas; raises ConfigError for one that does not exist."""
    senses = [each for each in (part.strip() for part in text.split(',')) if each]
    for each in senses:
        if each not in SENSES:
            raise ConfigError(f'{each!r} is no sense: choose some of {", ".join(SENSES)}')
    if set(senses) >= _BOTH_MEASURE_RANGES:
        raise ConfigError('depth and second-camera both measure ranges: choose one of them')
    return senses


def with_senses(graph: Sequence[NodeSpec], senses: Sequence[str]) -> list[NodeSpec]:
    """Return a graph whose nodes have these senses. Nodes that the graph lacks need nothing.

    What a rig learns with other senses is kept in another folder: tracks are not mixed. Raises
    ConfigError when its learner uses no senses: the paper's network.
    """
    extra: dict[str, dict[str, Any]] = {}
    for sense in senses:
        for node, parameters in SENSES[sense].items():
            extra.setdefault(node, {}).update(parameters)
    learners = {
        spec.parameters.get('learner') for spec in graph if spec.executable == 'learning_module'
    }
    if extra and 'paper' in learners:
        raise ConfigError(
            "the paper's network reads the picture of her face alone: --senses is for gaze_line"
        )
    return [
        replace(
            spec,
            parameters={
                **spec.parameters,
                **extra.get(spec.executable, {}),
                **_memory_of(senses, spec.parameters),
            },
        )
        for spec in graph
    ]


def _memory_of(senses: Sequence[str], parameters: Mapping[str, Any]) -> dict[str, str]:
    """Return where a node with these senses saves: in `runs/rig-eyes` for `runs/rig`."""
    suffix = ''.join(f'-{sense}' for sense in SENSES if sense in senses)
    places = {name: Path(parameters[name]) for name in MEMORY_PARAMETERS if parameters.get(name)}
    return {
        name: str(place.parent.with_name(place.parent.name + suffix) / place.name)
        for name, place in places.items()
    }
