# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Self-contained HTML pages of results."""

import base64
from collections.abc import Iterable
from html import escape
from pathlib import Path

import stickslip_ros
from stickslip_ros.errors import printable
from stickslip_ros.lab.figures.plotting import svg_of
from stickslip_ros.sections import Section, html_of

_BEGINNING = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
"""


def page_of(sections: Iterable[Section], command: str = '') -> str:
    """Return the page of sections, the same text for the same input; the first is the title."""
    first, *others = sections
    style = Path(__file__).with_name('page.css').read_text(encoding='utf-8')
    head = f'<title>{escape(first.title)}</title>\n<style>\n{style}</style>\n</head>\n<body>'
    body = [_part(first, 'h1'), *(_part(each, 'h2') for each in others)]
    made = f'<p>stickslip_ros {stickslip_ros.__version__}</p>'
    typed = f'<h2>Command</h2>\n<pre>{escape(command)}</pre>\n' if command else ''
    return printable('\n'.join([_BEGINNING + head, *body, f'{typed}{made}\n</body>\n</html>\n']))


def _part(section: Section, heading: str) -> str:
    picture = ''
    if section.draw is not None:
        svg = base64.b64encode(svg_of(section.draw()).encode()).decode()
        url = f'data:image/svg+xml;base64,{svg}'
        picture = f'\n<img src="{url}" alt="{escape(section.title)}, drawn">'
    return f'<section>\n{html_of(section, heading, picture)}\n</section>'
