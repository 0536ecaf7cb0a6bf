"""`./ja docs`: build the pages of docs/ and the reference of all modules, or serve them."""

from __future__ import annotations

import argparse
import subprocess
import sys


def main() -> None:
    """Build into build/docs; end with the exit code of mkdocs, which is 1 after any warning."""
    parser = argparse.ArgumentParser(
        prog='./ja docs',
        description='Build the pages of docs/ and the reference of all modules into build/docs. '
        'Any warning is an error.',
        epilog='examples: `./ja docs`, `./ja docs --serve`',
    )
    parser.add_argument(
        '--serve', action='store_true', help='serve the pages to this machine, and follow changes'
    )
    serve = parser.parse_args().serve
    command = ['serve'] if serve else ['build', '--strict', '--quiet']
    done = subprocess.run([sys.executable, '-m', 'mkdocs', *command], check=False)
    if not serve and done.returncode == 0:
        print('build/docs/index.html')
    sys.exit(done.returncode)


if __name__ == '__main__':
    main()
