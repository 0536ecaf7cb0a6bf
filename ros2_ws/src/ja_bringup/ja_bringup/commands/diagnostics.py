"""The commands `doctor` and `topics`, for `./ja`."""

import json
import sys
from dataclasses import asdict
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option('--json', help='Print JSON, for scripts.')]


def register(app: typer.Typer) -> None:
    """Add the commands to an app."""
    app.command()(doctor)
    app.command()(topics)


def doctor(as_json: Json = False) -> None:
    """Check this machine, and print how to fix what is wrong; exit code 1: no demo can run."""
    from rich.console import Console

    from ja_diagnostics.doctor import checks

    console = Console(stderr=as_json)
    findings = []
    for name, check in checks().items():
        with console.status(f'{name} ...'):
            finding = check()
        findings.append(finding)
        if not as_json:
            mark = 'ok   ' if finding.ok else 'WRONG' if finding.needed else '-    '
            console.print(f'{mark} {name}: {finding.text}', markup=False, highlight=False)
            if finding.fix:
                console.print(f'      {finding.fix}', markup=False, highlight=False)
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings]))
    sys.exit(int(any(finding.needed and not finding.ok for finding in findings)))


def topics(
    context: typer.Context,
    time_s: Annotated[
        float, typer.Option('--time', min=0.1, help='Count messages for so many seconds.')
    ] = 2.0,
    as_json: Json = False,
) -> None:
    """List the topics of the running graph: type, quality of service, nodes, rate, purpose."""
    from rich.console import Console

    from ja_common.ros_arguments import check_ros_arguments
    from ja_diagnostics.topics_table import measure_topics, table_of_topics

    arguments = context.obj or []
    check_ros_arguments(arguments)
    with Console(stderr=True).status('counting messages ...'):
        rows = measure_topics(time_s, arguments)
    if as_json:
        print(json.dumps([asdict(row) for row in rows]))
    elif rows:
        Console().print(table_of_topics(rows))
    else:
        sys.exit('no node was found: is the graph running, in this ROS_DOMAIN_ID?')
