"""The face finders by name: the only place that lists them."""

from collections.abc import Callable

from ja_perception.core.blazeface import BlazeFace
from ja_perception.core.faces import FaceFinder
from ja_perception.core.haar import HaarFaces
from ja_perception.core.template_faces import TemplateFaces

FACE_FINDERS: dict[str, Callable[[], FaceFinder]] = {
    'blazeface': BlazeFace,
    'haar': HaarFaces,
    'template': lambda: TemplateFaces(BlazeFace()),
}
