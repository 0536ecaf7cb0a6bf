"""The effect of our ROS defaults: discovery, and 640x480 images at 60 Hz between two processes."""

import json
import os
import subprocess

import numpy as np

from ja_benchmarks.rows import Row, percentile_99, row
from ja_common.core.config import ConfigError
from ja_common.python_command import module_command
from ja_common.ros_defaults import ENVIRONMENT
from ja_diagnostics import image_stream as _image_stream

REPEATS = 5


def run() -> dict[str, Row]:
    """Measure with our defaults and with those of ROS (both on this machine alone)."""
    bare = {name: value for name, value in os.environ.items() if name not in ENVIRONMENT}
    localhost = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    rows: dict[str, Row] = {}
    for name, environ in (("ROS's defaults", bare | localhost), ('ours', bare | ENVIRONMENT)):
        rows |= {f'{figure}, {name}': each for figure, each in _measure(environ).items()}
    return rows


def _measure(environ: dict[str, str]) -> dict[str, Row]:
    discovery_s, share, delays_ms = [], [], []
    for _ in range(REPEATS):
        receiver = _start(_image_stream.RECEIVE, environ, stderr=subprocess.PIPE)
        assert receiver.stderr is not None
        receiver.stderr.readline()  # it has subscribed: what follows is discovery alone
        publisher = _start(_image_stream.PUBLISH, environ)
        discovery_s.append(_result(publisher)['discovery_s'])
        received = _result(receiver)['delays_ms']
        share.append(len(received) / _image_stream.IMAGES)
        delays_ms += received
    return {
        'discovery': row(discovery_s, 's'),
        'images delivered': row(share, 'share'),
        'image delay, median': row(delays_ms, 'ms', np.median),
        'image delay, 99th percentile': row(delays_ms, 'ms', percentile_99),
    }


def _start(what: str, environ: dict[str, str], stderr: int | None = None) -> subprocess.Popen:
    return subprocess.Popen(
        module_command(_image_stream.__name__, what),
        env=environ, stdout=subprocess.PIPE, stderr=stderr, text=True,
    )  # fmt: skip


def _result(process: subprocess.Popen) -> dict:
    output, _ = process.communicate(timeout=120)
    if process.returncode:
        raise ConfigError('the stream of images broke off')
    return json.loads(output)
