"""What a node of a graph is: its executable, its parameters, its remappings."""

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ja_common.python_command import module_command
from ja_common.ros_arguments import parameter_arguments


@dataclass(frozen=True)
class NodeSpec:
    """One node, as its own process or as one of many in a process.

    `executable` is the name of the executable: the file's name without `_node`, and the node's
    name unless it is remapped. `arguments` are further ROS arguments, the user's (`-r`, `-p`,
    `--params-file`); they stand last, so that they win. `environ` is added to the process's
    environment. `has_heartbeat`: the process is known to send heartbeats (`ja_common.node_main`).
    """

    package: str
    executable: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    remappings: Mapping[str, str] = field(default_factory=dict)
    arguments: Sequence[str] = ()
    environ: Mapping[str, str] = field(default_factory=dict)
    has_heartbeat: bool = True

    @property
    def module(self) -> str:
        """Return the full name of the node's module."""
        return f'{self.package}.{self.executable}_node'

    @property
    def class_name(self) -> str:
        """Return the name of the node's class in its module."""
        return ''.join(word.capitalize() for word in self.executable.split('_')) + 'Node'

    def ros_arguments(self) -> list[str]:
        """Return the node's arguments, from `--ros-args` on."""
        arguments = ['--ros-args', *parameter_arguments(self.parameters)]
        for old, new in self.remappings.items():
            arguments += ['-r', f'{old}:={new}']
        return [*arguments, *self.arguments]

    def command(self) -> list[str]:
        """Return the command line of the node's own process.

        The process ends with the process that starts it.
        """
        return module_command('ja_runner.child', self.module, *self.ros_arguments())

    def load(self) -> type:
        """Import and return the node's class, for the composition in one process."""
        return getattr(importlib.import_module(self.module), self.class_name)
