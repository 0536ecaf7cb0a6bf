"""A folder whose files have the names of packages; each leaves a mark when it is imported."""

from pathlib import Path

_MARK = 'imported'
# Of the standard library, of libraries, of ROS, of ours; and what Python itself runs at its start.
_MODULES = (
    'json', 'typing', 'runpy', 'pathlib', 'subprocess', 'multiprocessing', 'numpy', 'typer',
    'yaml', 'torch', 'cv2', 'pip', 'venv', 'rclpy', 'std_msgs', 'ament_index_python', 'bootstrap',
    'ja_bringup', 'ja_common', 'ja_runner', 'ja_control', 'ja_sim', 'sitecustomize',
    'usercustomize', 'evil',
)  # fmt: skip


def make_hostile(folder: Path) -> Path:
    """Fill a folder with modules and packages of well-known names; return it."""
    folder.mkdir(exist_ok=True)
    mark = f'open({str(folder / _MARK)!r}, "a").write(__name__ + "\\n")\n'
    for name in _MODULES:
        (folder / name).mkdir()
        (folder / name / '__init__.py').write_text(mark)
        (folder / f'{name}.py').write_text(mark)
    return folder


def imported_from(folder: Path) -> list[str]:
    """Return the names of the modules of this folder that any process has imported."""
    mark = folder / _MARK
    return mark.read_text().split() if mark.exists() else []
