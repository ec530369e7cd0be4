# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Check the types of the calls of the package in the Python examples of the documentation.

The blocks of a page that import the package are a program; so is each file of `docs/examples` that
does. Functions of the examples have no annotations, so that these alone are not asked for.

"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r'^```python\n(.*?)^```', re.DOTALL | re.MULTILINE)
IMPORTS = re.compile(r'^(?:from|import) stickslip_ros\b', re.MULTILINE)
STRICT = (
    '--strict',
    '--config-file=pyproject.toml',
    '--allow-untyped-defs',
    '--allow-untyped-calls',
    '--disable-error-code=var-annotated',
)


def main() -> int:
    """Return the status of mypy over the examples."""
    with tempfile.TemporaryDirectory() as folder:
        programs = [
            str(path)
            for path in sorted((ROOT / 'docs/examples').rglob('*.py'))
            if IMPORTS.search(path.read_text(encoding='utf-8'))
        ]
        for page in (ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md'))):
            text = '\n'.join(BLOCK.findall(page.read_text(encoding='utf-8')))
            if IMPORTS.search(text):
                name = '_'.join(page.relative_to(ROOT).with_suffix('').parts)
                programs.append(str(Path(folder, f'page_{name}.py')))
                Path(programs[-1]).write_text(text, encoding='utf-8')
        words = [sys.executable, '-m', 'mypy', *STRICT, *programs]
        path = os.environ | {'MYPYPATH': 'docs/examples/scan_controller'}
        return subprocess.run(words, cwd=ROOT, env=path, check=False).returncode


if __name__ == '__main__':
    sys.exit(main())
