"""The checks of `./ja doctor`: is what the graph needs there, and how to fix what is not?"""

import errno
import glob
import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from ja_common.core.config import ConfigError
from ja_common.middleware import TESTED, load_middleware
from ja_common.python_command import code_command, module_command
from ja_common.ros_arguments import SAFE_DOMAIN_ID, domain_id
from ja_common.ros_defaults import PROFILE_VARIABLE
from ja_runner.image_transport import (
    ENOUGH_SHARED_MB,
    SHARED_MEMORY,
    free_shared_memory_mb,
    socket_buffer_advice,
)
from ja_runner.parts import is_installed

_PYTHONS = ((3, 10), (3, 13))
_RENDER = """
from ja_sim.core.scene import load_scene
from ja_sim.core.world import JointAttentionWorld
world = JointAttentionWorld(load_scene('easy'), 0, image_size=(64, 48))
print(world.observe().image.std() > 0)
"""


@dataclass(frozen=True)
class Finding:
    """What one check found. `fix`: what to do; '' when nothing is wrong.

    `needed`: does the simulated head need it? It needs no camera, for example.
    """

    name: str
    ok: bool
    text: str
    fix: str = ''
    needed: bool = True


def checks() -> dict[str, Callable[[], Finding]]:
    """Return all checks by name, in the order in which one depends on another."""
    return {
        'Python': check_python,
        'rclpy': check_rclpy,
        'shared memory': check_shared_memory,
        'stale segments': check_stale_segments,
        'ports': check_ports,
        'discovery': check_discovery,
        'graphics': check_graphics,
        'camera': check_camera,
    }


def check_python() -> Finding:
    """Check the version of Python."""
    version = sys.version_info[:2]
    text = '.'.join(map(str, version))
    ok = _PYTHONS[0] <= version <= _PYTHONS[1]
    return Finding('Python', ok, text, '' if ok else 'set JA_PYTHON to a Python 3.10 to 3.13')


def check_rclpy() -> Finding:
    """Check that rclpy can be imported, and that its middleware is Fast DDS."""
    found = load_middleware()
    wanted = os.environ.get('RMW_IMPLEMENTATION')
    if found.error and wanted and wanted != TESTED:
        fix = f'unset RMW_IMPLEMENTATION (it is {wanted}), or install it for this ROS'
        return Finding('rclpy', False, found.error, fix)
    if found.error:
        fix = 'delete .venv and run ./ja again; with ROS sourced, use the Python it is made for'
        return Finding('rclpy', False, found.error, fix)
    ok = found.name == TESTED
    fix = '' if ok else 'unset RMW_IMPLEMENTATION: only Fast DDS is tested'
    return Finding('rclpy', ok, f'{Path(found.rclpy).parent}, {found.name}', fix)


def check_shared_memory(folder: Path = SHARED_MEMORY) -> Finding:
    """Check that shared memory can be written and has room for images, or UDP for them."""
    free_mb, advice = free_shared_memory_mb(folder), socket_buffer_advice()
    text = f'{free_mb} MB free in {folder}'
    if not os.access(folder, os.W_OK):
        text, fix = f'{folder} cannot be written', f'mount a tmpfs at {folder}'
    else:
        fix = 'remove stale segments, or give a container more (--shm-size=512m)'
    if free_mb >= ENOUGH_SHARED_MB:
        return Finding('shared memory', True, text)
    until_then = f'they are lost until `{advice}`' if advice else 'slowly'
    return Finding(
        'shared memory', False, text, f'{fix}; until then images go over UDP, {until_then}'
    )


def check_stale_segments(folder: Path = SHARED_MEMORY) -> Finding:
    """Look for segments of Fast DDS that no process has mapped or open; harmless but large."""
    files = {Path(path) for path in glob.glob(f'{folder}/fastrtps_*')}
    used = _files_in_use()
    stale = sorted(
        path for path in files if str(path) not in used and not path.name.endswith('_el')
    )
    if not stale:
        return Finding('stale segments', True, 'none')
    size_mb = sum(path.stat().st_blocks * 512 for path in stale if path.exists()) / 1e6
    fix = f'when no ROS 2 program runs: rm {folder}/fastrtps_* {folder}/sem.fastrtps_*'
    text = f'{len(stale)} left behind by killed processes, {size_mb:.1f} MB'
    return Finding('stale segments', size_mb < ENOUGH_SHARED_MB, text, fix, needed=False)


def check_ports() -> Finding:
    """Check the ROS_DOMAIN_ID, and whether its first UDP port is free."""
    try:
        domain = domain_id()
    except ConfigError as error:
        return Finding('ports', False, str(error), f'export ROS_DOMAIN_ID=0 (to {SAFE_DOMAIN_ID})')
    port = 7400 + 250 * domain + 10  # unicast discovery of the first participant (DDSI-RTPS)
    if domain > SAFE_DOMAIN_ID:
        fix = (
            f'choose ROS_DOMAIN_ID from 0 to {SAFE_DOMAIN_ID}: above, the ports collide with the '
            'system'
        )
        return Finding('ports', False, f'domain {domain}', fix)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as test:
        try:
            test.bind(('127.0.0.1', port))
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                fix = 'allow UDP on the loopback interface'
                return Finding('ports', False, f'UDP {port}: {error.strerror}', fix)
            text = f'domain {domain}: in use, another ROS 2 graph runs there'
            fix = 'for a graph of your own choose another ROS_DOMAIN_ID'
            return Finding('ports', True, text, fix, needed=False)
    return Finding('ports', True, f'domain {domain}: free, UDP from {port}')


def check_discovery() -> Finding:
    """Send images from one process to another, and count those that arrive."""
    if load_middleware().error:
        return Finding('discovery', False, 'not checked: rclpy cannot be imported', 'see rclpy')
    try:
        domain_id()
    except ConfigError:
        return Finding('discovery', False, 'not checked: there is no such domain', 'see ports')
    # Imported here, because it imports rclpy, and without a middleware that ends this process.
    from ja_diagnostics import image_stream

    command = module_command(image_stream.__name__)
    receiver = subprocess.Popen(
        [*command, image_stream.RECEIVE],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    publisher = subprocess.Popen(
        [*command, image_stream.PUBLISH],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        found_s = json.loads(publisher.communicate(timeout=60)[0])['discovery_s']
        delays_ms = json.loads(receiver.communicate(timeout=60)[0])['delays_ms']
    except (ValueError, KeyError, subprocess.TimeoutExpired):
        fix = f'unset {PROFILE_VARIABLE} and ROS_AUTOMATIC_DISCOVERY_RANGE'
        return Finding('discovery', False, 'two processes did not find each other', fix)
    finally:
        for process in (receiver, publisher):
            process.kill()
            process.wait()
    share = len(delays_ms) / image_stream.IMAGES
    text = f'found in {found_s:.2f} s, {share:.0%} of 640x480 images at 60 Hz arrived'
    fix = '' if share > 0.9 else 'the machine is busy, or shared memory is not used: see above'
    return Finding('discovery', share > 0.5, text, fix)


def check_graphics() -> Finding:
    """Render one image in a separate process, because a broken driver may end it."""
    if not is_installed('ja_sim'):
        text = 'not checked: the simulator is not installed'
        return Finding('graphics', True, text, needed=False)
    found = subprocess.run(code_command(_RENDER), capture_output=True, text=True, check=False)
    if found.stdout.strip() == 'True':
        backend = os.environ.get('MUJOCO_GL') or 'chosen by the sim'
        return Finding('graphics', True, f'an image is rendered (MUJOCO_GL: {backend})')
    lines = found.stderr.strip().splitlines() or [f'exit code {found.returncode}']
    fix = 'sudo apt-get install -y libegl1 libgl1-mesa-dri, or libosmesa6 and MUJOCO_GL=osmesa'
    return Finding('graphics', False, lines[-1], fix)


def check_camera() -> Finding:
    """Look for cameras that this user may open."""
    devices = sorted(glob.glob('/dev/video*'))
    readable = [device for device in devices if os.access(device, os.R_OK | os.W_OK)]
    if readable:
        return Finding('camera', True, ', '.join(readable), needed=False)
    if devices:
        fix = 'sudo usermod -aG video $USER, and log in again'
        return Finding('camera', False, f'{", ".join(devices)}: no permission', fix, needed=False)
    fix = 'not needed for ./ja demo; ./ja rig --source also takes a video file or a folder'
    return Finding('camera', False, 'none', fix, needed=False)


def _files_in_use() -> set[str]:
    """Return the paths of the Fast DDS segments that any process has mapped."""
    used: set[str] = set()
    for process in psutil.process_iter():
        with suppress(psutil.Error):  # it has ended meanwhile, or belongs to another user
            paths = (mapped.path for mapped in process.memory_maps())
            used |= {path for path in paths if '/fastrtps_' in path}
    return used
