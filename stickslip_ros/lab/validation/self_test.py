# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The self-test of an installation: answers against the references of the package."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from stickslip_ros.lab.validation import bank, contacts, drive, laws, layouts, roughness
from stickslip_ros.lab.validation.references import Reference, arguments_of, read_references
from stickslip_ros.process.stopping import stop_if_asked

MODULES = (contacts, roughness, bank, laws, drive, layouts)
ANSWERS = {quantity: answer for module in MODULES for quantity, answer in module.ANSWERS.items()}
"""Functions by quantity."""


@dataclass(frozen=True)
class CheckedAnswer:
    """A reference, and the answer of this installation, SI."""

    reference: Reference
    ours: float

    @property
    def error(self) -> float:
        """The difference, divided by ``relative_to``."""
        return abs(self.ours - self.reference.reference) / self.reference.relative_to

    @property
    def passed(self) -> bool:
        """Whether the error is a number and within the tolerance."""
        return self.error <= self.reference.tolerance


def answer(row: Reference) -> float:
    """Compute the answer to a reference."""
    return float(ANSWERS[row.quantity](**arguments_of(row.case)))


def validate(
    rows: Iterable[Reference] | None = None, progress: Callable[[int, int], None] = lambda *_: None
) -> dict[str, list[CheckedAnswer]]:
    """Compare with references, by default all; return outcomes by family."""
    compared = [row for row in read_references() if row.is_compared] if rows is None else rows
    families: dict[str, list[Reference]] = {}
    for row in compared:
        families.setdefault(row.family, []).append(row)
    outcomes: dict[str, list[CheckedAnswer]] = {}
    for family, members in families.items():
        progress(len(outcomes), len(families))
        found = outcomes[family] = []
        for row in members:
            stop_if_asked()
            found.append(CheckedAnswer(row, answer(row)))
    return outcomes


def failed(outcomes: Mapping[str, Sequence[CheckedAnswer]]) -> list[CheckedAnswer]:
    """Return the answers that failed."""
    return [each for found in outcomes.values() for each in found if not each.passed]
