# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The blocks of a page of the documentation, and the commands in them."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).resolve().parents[1] / 'docs'
BLOCK = re.compile(r'^```(\S*)[^\n]*\n(.*?)^```$', re.DOTALL | re.MULTILINE)
FILE = re.compile(r'`([\w.]+\.(?:csv|py))`')
NAMED_INSIDE = re.compile(r'# ([\w.]+\.py)\n')


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    text: str
    file: str  # the name that the paragraph above it or its first line gives; '' is none


def blocks_of(page: Path, language: str = '') -> Iterator[Block]:
    """Give the fenced blocks of a page, or those of a language, in their order."""
    text = page.read_text(encoding='utf-8')
    for block in BLOCK.finditer(text):
        above = text[: block.start()].rstrip().rpartition('\n\n')[2]
        names = NAMED_INSIDE.findall(block[2][:80]) or FILE.findall(above) or ['']
        if language in ('', block[1]):
            yield Block(block[1], block[2], names[0])


def commands_of(block: Block) -> Iterator[str]:
    """Give the commands of a block of a shell, each whole; its continued lines are joined."""
    command = ''
    for line in block.text.splitlines(keepends=True):
        command += line
        try:
            is_whole = not command.endswith('\\\n') and shlex.split(command, comments=True)
        except ValueError:  # a quotation goes on
            continue
        if is_whole:
            yield command.replace('\\\n', ' ').strip()
            command = ''
    assert not command.strip() or command.lstrip().startswith('#'), command
