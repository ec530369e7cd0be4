# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors of the package: a message gives value, unit, limit and remedy."""

import re
from collections.abc import Sequence

QUOTED, PROBLEM, MESSAGE = 60, 300, 2000
"""Longest quoted value, problem (which may quote a file) and message, characters."""


class StickSlipError(Exception):
    """Base of the errors that this package raises, in a line; a long text loses its middle."""

    def __init__(self, text: str = '') -> None:
        super().__init__(shortened(text).replace('\n', '\\n'))


def printable(text: str) -> str:
    """Return a text, perhaps of a foreign file, with escapes for characters that are not seen."""
    return re.sub(
        r'[^\n\t -~]', lambda one: one[0] if one[0].isprintable() else ascii(one[0])[1:-1], text
    )


def shortened(text: str) -> str:
    """Return a printable text without its middle if it is longer than MESSAGE."""
    if len(text) > MESSAGE:
        text = f'{text[: MESSAGE // 2]}...{text[-MESSAGE // 2 :]}'
    return printable(text)


def quoted(value: object) -> str:
    """Return the repr of a value, cut to QUOTED characters; of a table its class."""
    text = repr(value)
    return f'<{type(value).__name__}>' if '\n' in text else _begin(text, QUOTED)


def _begin(text: str, length: int) -> str:
    return text if len(text) <= length else f'{text[:length]}...'


class OutOfRange(StickSlipError, ValueError):
    """
    A value is outside its limit.

    The name is as the user wrote it (``stand.preload``), the unit is SI or empty, the limit has
    words, number and unit (``above the maximum 1 N``), and the hint says what to do.

    """

    def __init__(self, name: str, value: object, unit: str, limit: str, hint: str) -> None:
        text = f'{value:.6g}' if isinstance(value, float) else quoted(value)
        shown = f'{text} {unit}' if unit else text
        super().__init__(f'{name} {shown} is {limit}; {hint}')
        self.name = name
        self.value = value
        self.unit = unit
        self.hint = hint


class UnknownName(StickSlipError, KeyError):
    """A name of a kind (``parameter``, ``topic``) is not known; the hint names some that are."""

    def __init__(self, kind: str, name: str, hint: str) -> None:
        super().__init__(f'{kind} {quoted(name)} is not known; {hint}')
        self.name = name

    def __str__(self) -> str:
        """Return the message without the quotes of a KeyError."""
        return str(self.args[0])


class WrongKind(StickSlipError, TypeError):
    """A value is not of the expected kind, such as ``a finite number``."""

    def __init__(self, name: str, value: object, expected: str, hint: str) -> None:
        super().__init__(f'{name} {quoted(value)} is not {expected}; {hint}')
        self.name = name
        self.value = value


class WrongUse(StickSlipError, TypeError, AttributeError):
    """A call has wrong arguments, or an attribute cannot be used; the text names the right use."""


class RecordingError(StickSlipError):
    """
    A file cannot be written or read; the message gives the problem and the remedy.

    The table, titles and rows of texts, shows what is there; the command line prints it too.

    """

    def __init__(
        self, path: object, problem: str, hint: str, *, table: Sequence[Sequence[str]] = ()
    ) -> None:
        super().__init__(f'{path}: {_begin(problem, PROBLEM)}; {hint}')
        self.path = path
        self.table = table


class Miscounted(RecordingError):
    """A recording does not hold the messages that it counts."""

    status = 1  # exit status of a verb: a check failed
