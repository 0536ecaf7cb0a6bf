"""Pictures without a display: an OpenGL context of its own for the cameras of a scene."""

from __future__ import annotations

import atexit
import importlib
import os
import weakref
from typing import Any

import cv2
import mujoco
import numpy as np

from ja_sim.core.graphics import ADVICE, RenderError, choose_backend

# Drawn larger by this factor and reduced. Measured (docs/lab_notes/world.md): the rasteriser's own
# multisampling costs twice as much for the same edges.
SUPERSAMPLING = 1.5


def _make_context(width: int, height: int) -> Any:
    # Mesa's software rasteriser would start a thread per core, and every picture waits for all
    # of them: 9.2 ms on two busy cores, where the drawing itself takes 5.1 ms.
    os.environ.setdefault('LP_NUM_THREADS', '0')
    name = choose_backend()
    try:
        context = importlib.import_module(f'mujoco.{name}').GLContext(width, height)
        context.make_current()
    except Exception as error:  # the bindings raise what the driver returns
        raise RenderError(f'{ADVICE}; {name}: {error}') from error
    return context


def buffer_size(image_size: tuple[int, int]) -> tuple[int, int]:
    """Return the width and height [px] of what is drawn for a picture of ``image_size``."""
    width, height = image_size
    return round(SUPERSAMPLING * width), round(SUPERSAMPLING * height)


class Renderer:
    """Draws what cameras of a compiled scene see.

    OpenGL belongs to a thread: draw and close in the one that made the renderer.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, camera: str, image_size: tuple[int, int]
    ) -> None:
        """Open a context and try it with ``camera``.

        ``image_size``: (width, height) [px]. Raises RenderError without OpenGL.
        """
        width, height = buffer_size(image_size)
        self._image_size = image_size
        self._model, self._data = model, data
        self._viewport = mujoco.MjrRect(0, 0, width, height)
        self._image = np.empty((height, width, 3), np.uint8)
        self._depth = np.empty((height, width), np.float32)
        self._gl = _make_context(width, height)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
        self._free = weakref.finalize(self, _free, self._context, self._gl)
        # At exit this must run before MuJoCo's bindings shut OpenGL down, so it is registered
        # after them; a finalizer's own exit hook would run as late as the first one registered.
        self._free.atexit = False
        atexit.register(self._free)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        # Near things at 1, far ones at 0: floating-point numbers then resolve both.
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._scene = mujoco.MjvScene(model, maxgeom=1000)
        self._options = mujoco.MjvOption()
        self._no_perturbation = mujoco.MjvPerturb()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        mujoco.mj_forward(model, data)
        if self.draw(camera).std() < 1.0:
            raise RenderError(f'{ADVICE}; the driver that is there draws empty images')

    def draw(self, camera: str) -> np.ndarray:
        """Draw what a camera sees, (H, W, 3) uint8 RGB; the kinematics must be current."""
        self._gl.make_current()
        self._camera.fixedcamid = self._model.camera(camera).id
        model, data, options, scene = self._model, self._data, self._options, self._scene
        # The room last: the objects hide much of it, and what is hidden costs nothing.
        moving, fixed = mujoco.mjtCatBit.mjCAT_DYNAMIC, mujoco.mjtCatBit.mjCAT_STATIC
        mujoco.mjv_updateScene(model, data, options, None, self._camera, moving, scene)
        mujoco.mjv_addGeoms(model, data, options, self._no_perturbation, fixed, scene)
        mujoco.mjr_render(self._viewport, self._scene, self._context)
        mujoco.mjr_readPixels(self._image, None, self._viewport, self._context)
        upright = self._image[::-1]  # OpenGL's first row is the lowest
        return cv2.resize(upright, self._image_size, interpolation=cv2.INTER_AREA)

    def read_depth(self) -> np.ndarray:
        """Return the distances along the optical axis of the last picture drawn, (H, W) [m]."""
        self._gl.make_current()
        mujoco.mjr_readPixels(None, self._depth, self._viewport, self._context)
        # One sample for each pixel, the one nearest to its centre: an average across an edge
        # would be the distance of nothing.
        depth = cv2.resize(
            self._depth[::-1], self._image_size, interpolation=cv2.INTER_NEAREST_EXACT
        )
        extent, lens = self._model.stat.extent, self._model.vis.map
        near, far = extent * lens.znear, extent * lens.zfar
        return np.float32(near * far) / (depth * np.float32(far - near) + np.float32(near))

    def close(self) -> None:
        """Free the graphics memory."""
        self._free()
        atexit.unregister(self._free)


def _free(context: mujoco.MjrContext, gl: Any) -> None:
    try:
        gl.make_current()
    except Exception:  # the bindings raise what the driver returns
        pass  # another thread holds it: the memory is freed with the process
    else:
        context.free()
    # Always free it here: the bindings would try again, and log an error, after EGL shuts down.
    gl.free()
