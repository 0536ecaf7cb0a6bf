"""The parts that a rig may leave out, and the error where one of them is needed."""

import importlib.util
from collections.abc import Iterable

from ja_common.core.config import ConfigError

PART_OF = {
    'ja_sim': 'sim',
    'ja_dashboard': 'dashboard',
    'ja_experiments': 'experiments',
    'ja_benchmarks': 'experiments',
}
"""The part of each package that JA_WITHOUT may leave out, when `./ja` installs the packages."""


def is_installed(module: str) -> bool:
    """Return whether Python finds a package, or a module, whose package alone is imported."""
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:  # the package of the module
        return False


def check_installed(packages: Iterable[str]) -> None:
    """Raise ConfigError for a package that was left out, with what to do."""
    for package in packages:
        if package in PART_OF and not is_installed(package):
            raise ConfigError(missing_part(package))


def missing_part(package: str) -> str:
    """Return the sentence about a package that is not installed."""
    return (
        f'{package} is not installed, because JA_WITHOUT left out the part {PART_OF[package]}: '
        "run the command once more with JA_WITHOUT='' before it, which installs every part"
    )
