# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Write what a release needs and only its maintainer knows: `make release ARGS='URL MAIL'`.

URL is the public address of the source, MAIL that of the maintainer. Until then places that end
in .invalid (RFC 2606) stand for them in setup.py, package.xml and CITATION.cff.

"""

import ast
import re
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import yaml

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from stickslip_ros import __version__  # noqa: E402 - this tree's, not an installed one

FILES = 'setup.py', 'package.xml', 'CITATION.cff'
URL, MAIL = 'https://stickslip-ros.invalid', 'noreply@stickslip-ros.invalid'
ADDRESS = re.compile(r'https://[\w.-]+(/[\w.~+-]+)+', re.ASCII)
MAIL_ADDRESS = re.compile(r'[\w.+-]+@[\w-]+(\.[\w-]+)+', re.ASCII)
"""What needs no quotes or escapes in Python, XML and YAML."""
_BECAUSE = re.compile(r'^ *(#|<!--).*(RFC 2606|on no public host yet).*\n', re.MULTILINE)
"""Comments that say why those places stand there."""
NEXT = f"""\
Then, in this order:
  .ci/run                                     tests on both distributions, wheel, workspace
  git commit, git tag -a v{__version__}
  make wheel                                  dist/ is the release
  twine upload dist/*                         .venv-release has it
"""


def main() -> None:
    """Check the changelog, write the addresses if nobody did, say what remains."""
    [heading, *_] = re.findall(r'^(\S.*)\n-+$', (ROOT / 'CHANGELOG.rst').read_text(), re.MULTILINE)
    if not re.fullmatch(rf'{re.escape(__version__)} \(\d{{4}}-\d\d-\d\d\)', heading):
        sys.exit(f'CHANGELOG.rst begins with {heading}; write {__version__} and its date')
    texts = {ROOT / name: (ROOT / name).read_text(encoding='utf-8') for name in FILES}
    if any(URL in text for text in texts.values()):
        write_addresses(texts)
    else:
        print('the addresses were written before')
    print(NEXT, end='')


def write_addresses(texts: dict[Path, str]) -> None:
    """Write them into files in place of those that stand for them, and leave out why."""
    url, mail = ask('public address of the source', 1), ask('mail of the maintainer', 2)
    if not ADDRESS.fullmatch(url):
        sys.exit(
            f'{url}: give an address such as https://example.org/stickslip, of letters, digits '
            'and . _ ~ + - /, without a slash at its end'
        )
    if not MAIL_ADDRESS.fullmatch(mail):
        sys.exit(
            f'{mail}: give an address of mail such as someone@example.org, of letters, digits '
            'and . _ + -'
        )
    said = {
        path: _BECAUSE.sub('', text).replace(MAIL, mail).replace(URL, url)
        for path, text in texts.items()
    }
    for path, text in said.items():
        check_syntax(path, text)
    for path, text in said.items():
        path.write_text(text, encoding='utf-8')
        print(f'{path.name}: written')


def check_syntax(path: Path, text: str) -> None:
    """End if the text of a file could not be read."""
    readers: dict[str, Callable[[str], object]] = {
        '.py': ast.parse,
        '.xml': ET.fromstring,
        '.cff': yaml.safe_load,
    }
    try:
        readers[path.suffix](text)
    except (SyntaxError, ET.ParseError, yaml.YAMLError) as error:
        sys.exit(f'{path.name} would be broken, and nothing was written: {error}')


def ask(what: str, place: int) -> str:
    """Return an argument, or what is typed instead of it."""
    return sys.argv[place] if len(sys.argv) > place else input(f'{what}: ').strip()


if __name__ == '__main__':
    main()
