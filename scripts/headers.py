# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Check that programs begin with copyright and licence (`make lint`); ``--write`` adds them."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINES = (
    'Copyright 2026 The stickslip_ros maintainers',
    'SPDX-License-Identifier: Apache-2.0',
)
COMMENTS = {'.py': '#', '.sh': '#', '': '#', '.js': '//', '.c': '//'}
OF_OTHERS = {'uPlot.iife.min.js'}
EXAMPLES = ROOT / 'docs' / 'examples'
"""Of which others copy files into packages of their own."""


def split(path: Path) -> tuple[str, str, str]:
    """Return the first line of a script, the header that belongs behind it, and the rest."""
    text = path.read_text(encoding='utf-8')
    first, end, rest = text.partition('\n') if text.startswith('#!') else ('', '', text)
    mark = COMMENTS[path.suffix]
    return first + end, ''.join(f'{mark} {line}'.rstrip() + '\n' for line in LINES), rest


def sources() -> list[Path]:
    """List what the repository holds and can be commented: programs."""
    listed = subprocess.run(['git', 'ls-files'], cwd=ROOT, check=True, stdout=subprocess.PIPE)
    paths = [ROOT / name for name in listed.stdout.decode().splitlines()]
    kept = [path for path in paths if path.suffix in COMMENTS and path.name not in OF_OTHERS]
    kept = [path for path in kept if EXAMPLES not in path.parents]
    return [path for path in kept if path.suffix or path.read_bytes()[:2] == b'#!']


def main() -> None:
    """Name or mend the files that lack it."""
    lacking = []
    for path in sources():
        first, header, rest = split(path)
        if not rest.startswith(header):
            lacking.append(path)
            if '--write' in sys.argv:
                gap = '\n' if rest else ''
                path.write_text(first + header + gap + rest, encoding='utf-8')
    for path in lacking:
        print(f'{path.relative_to(ROOT)}: no copyright and licence')
    if lacking and '--write' not in sys.argv:
        sys.exit(f'{len(lacking)} files; add them with: python scripts/headers.py --write')


if __name__ == '__main__':
    main()
