"""Drawn people with faces that a detector finds, in clothes and with hair of their own."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from synthetic_pictures import draw_face, room

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class DrawnPerson:
    """A person: the centre of the face (u, v) and its width [px], clothes, hair, look, beard."""

    u: float
    v: float = 100.0
    width: float = 60.0
    clothes: Colour = (60, 70, 110)
    hair: Colour = (60, 40, 30)
    look: float = 0.0
    beard: bool = False


def picture_of(*people: DrawnPerson, width: int = 320, height: int = 240) -> NDArray[np.uint8]:
    """Return an (H, W, 3) RGB picture of a room with people, the first one farthest away."""
    picture = room(width, height)
    for person in people:
        _draw(picture, person)
    return picture


def _draw(picture: NDArray[np.uint8], person: DrawnPerson) -> None:
    u, v, w = person.u, person.v, person.width
    top = (round(u - 1.1 * w), round(v + 0.75 * w))
    bottom = (round(u + 1.1 * w), round(v + 3.0 * w))
    cv2.rectangle(picture, top, bottom, person.clothes, cv2.FILLED)
    draw_face(picture, u, v, w, person.look)
    if person.beard:
        chin = (round(u), round(v + 0.4 * w))
        size = (round(0.35 * w), round(0.22 * w))
        cv2.ellipse(picture, chin, size, 0, 0, 360, person.hair, cv2.FILLED)
    hair = (round(u), round(v - 0.72 * w))
    cv2.ellipse(
        picture, hair, (round(0.5 * w), round(0.2 * w)), 0, 0, 360, person.hair, cv2.FILLED
    )
