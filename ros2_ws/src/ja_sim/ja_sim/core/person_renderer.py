"""One person of the asset alone, to be pasted into another picture."""

from __future__ import annotations

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from ja_sim.core.caregiver import Appearance, CaregiverBodies
from ja_sim.core.gaze import GazePose
from ja_sim.core.render import Renderer, buffer_size
from ja_sim.core.specs import CaregiverSpec

_FAR_M = 3.0


class PersonRenderer:
    """One person before a black background, 1 m away, drawn with any turn of the head."""

    def __init__(self, image_size: tuple[int, int], focal_px: float) -> None:
        """Build the scene; ``image_size``: (width, height) [px]. RenderError without OpenGL."""
        self._image_size = image_size
        spec = mujoco.MjSpec()
        self._bodies = CaregiverBodies(spec, CaregiverSpec(distance_m=1.0))
        spec.worldbody.add_light(pos=[0.0, 0.6, 0.8], dir=[0.8, -0.4, -0.5], diffuse=[0.7] * 3)
        spec.visual.headlight.ambient[:] = 0.35
        body = spec.worldbody.add_body(name='camera')
        body.add_camera(
            name='eye', quat=[0.5, 0.5, -0.5, -0.5], resolution=list(image_size),
            sensor_size=list(image_size), focal_pixel=[focal_px] * 2,
        )  # fmt: skip
        size = buffer_size(image_size)
        spec.visual.global_.offwidth, spec.visual.global_.offheight = size
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._bodies.bind_model(self._model)
        self._renderer: Renderer | None = None

    def draw(
        self, appearance: Appearance, yaw: float
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return a picture (H, W, 3) of RGB, and where it shows the person, (H, W) in 0..1.

        ``yaw``: how far the head is turned to the person's left [rad].
        """
        self._bodies.apply_appearance(appearance)
        self._bodies.place(self._data, GazePose(np.array([yaw, 0.0]), np.zeros((2, 2))), False)
        self._bodies.place_arm(self._data, None)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        if self._renderer is None:
            self._renderer = Renderer(self._model, self._data, 'eye', self._image_size)
        picture = self._renderer.draw('eye')
        mask = (self._renderer.read_depth() < _FAR_M).astype(np.float32)
        # A little inwards: at the edge the black background shines through.
        mask = cv2.GaussianBlur(cv2.erode(mask, np.ones((3, 3))), (5, 5), 0)
        return picture, mask
