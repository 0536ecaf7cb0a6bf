"""Algorithms and records without ROS."""

from ja_sim.core.graphics import require_named_backend

# Before any module here imports MuJoCo.
require_named_backend()
