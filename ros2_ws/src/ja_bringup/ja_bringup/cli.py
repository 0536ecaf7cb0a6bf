"""`./ja COMMAND`: the commands of the system."""

import sys

import typer

from ja_bringup.clean_end import clean_end
from ja_bringup.commands import (
    calibration,
    demo,
    development,
    diagnostics,
    experiments,
    meet,
    recording,
    rig,
    rig_tools,
)
from ja_bringup.examples import add_examples
from ja_common.core.config import ConfigError
from ja_common.core.home_folder import replace_missing_home
from ja_common.middleware import check_middleware
from ja_common.python_command import protect_children
from ja_common.ros_arguments import split_ros_arguments
from ja_common.ros_defaults import apply_ros_defaults
from ja_runner.parts import PART_OF, missing_part

app = typer.Typer(
    help='A camera head that learns joint attention, on ROS 2. ROS arguments go behind '
    '`--ros-args`, as for any node: -r, -p, --params-file, __ns.',
    epilog='`./ja COMMAND --help` shows examples. The tests: `./ja test`, which takes the '
    'arguments of pytest. The pages of docs/ and the reference of all modules: `./ja docs`.',
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

_FITTING_VERSIONS = 'those of requirements/*.lock, or of requirements/ubuntu-24.04.txt'

# In the order of the help page.
_GROUPS = (
    demo, rig, meet, development, experiments, recording, diagnostics, rig_tools, calibration
)  # fmt: skip
for _group in _GROUPS:
    _group.register(app)
add_examples(app)


def main() -> None:
    """Separate the ROS arguments, as rclpy does, and run the command."""
    protect_children()
    replace_missing_home()
    apply_ros_defaults()
    with clean_end():
        ours, ros = split_ros_arguments(sys.argv[1:])
        if ours[:1] != ['doctor']:  # which says more
            check_middleware()
        try:
            app(args=ours, obj=ros, prog_name='ja')
        except ModuleNotFoundError as error:
            package = (error.name or '').partition('.')[0]
            if package not in PART_OF:
                raise
            raise ConfigError(missing_part(package)) from None
        except ImportError as error:
            # One library refuses another, as pyarrow 26 does with NumPy 1; ours are not meant.
            if (error.name or '').startswith('ja_'):
                raise
            raise ConfigError(
                f'{error}; install versions that fit together: {_FITTING_VERSIONS}'
            ) from None


if __name__ == '__main__':
    main()
