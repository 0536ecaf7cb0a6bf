"""Which OpenGL draws: chosen before MuJoCo is imported, which loads what MUJOCO_GL names.

EGL with Mesa's software rasteriser needs neither display nor GPU; OSMesa is the fallback.
"""

from __future__ import annotations

import ctypes.util
import os

LIBRARIES = {'egl': 'EGL', 'osmesa': 'OSMesa'}
ADVICE = (
    'no OpenGL for rendering: install EGL with Mesa '
    '(Debian, Ubuntu: apt install libegl1 libgl1-mesa-dri)'
)


class RenderError(RuntimeError):
    """Nothing can be drawn on this machine; the message names what to install."""


def require_named_backend() -> None:
    """Raise RenderError if MUJOCO_GL names a missing library: MuJoCo cannot be imported then."""
    if os.environ.get('MUJOCO_GL', '').lower() in LIBRARIES:
        choose_backend()


def choose_backend() -> str:
    """Return the backend that MUJOCO_GL names, or else the first that is installed."""
    wanted = os.environ.get('MUJOCO_GL', '').lower()
    if wanted and wanted not in LIBRARIES:
        raise RenderError(f"MUJOCO_GL={wanted}: the world renders with 'egl' or 'osmesa'")
    for name in [wanted] if wanted else LIBRARIES:
        if ctypes.util.find_library(LIBRARIES[name]):
            return name
    raise RenderError(f'{ADVICE}; MUJOCO_GL={wanted} is not there' if wanted else ADVICE)
