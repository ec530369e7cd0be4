"""What a family of checks hands over: its checks, and panels of curves for the page of plots."""

from collections.abc import Iterable
from dataclasses import dataclass

from stickslip_ros.contact.profile import Array
from stickslip_ros.validation.checks import Check


@dataclass(frozen=True)
class Curve:
    """
    One curve of a panel.

    Attributes
    ----------
    label : str
        Its name in the legend.
    x, y : array
        Values in the units of the panel's labels.
    style : str
        ``line``, ``dashed`` or ``points``.
    colour : int
        Curves of one number share a colour.

    """

    label: str
    x: Array
    y: Array
    style: str = 'line'
    colour: int = 0


@dataclass(frozen=True)
class Panel:
    """
    One panel of the page.

    Attributes
    ----------
    title, x_label, y_label : str
        Texts, with units.
    curves : tuple of Curve
        What is drawn.
    log_x, log_y : bool
        Whether an axis is logarithmic.
    x_ticks : tuple of float
        Places of the ticks; those that suit if empty.

    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    log_x: bool = False
    log_y: bool = False
    x_ticks: tuple[float, ...] = ()


@dataclass(frozen=True)
class Findings:
    """
    Result of one family of checks.

    Attributes
    ----------
    family : str
        Its name.
    checks : tuple of Check
        The comparisons.
    panels : tuple of Panel
        Its part of the page of plots.

    """

    family: str
    checks: tuple[Check, ...]
    panels: tuple[Panel, ...] = ()


def failed_checks(findings: Iterable[Findings]) -> list[Check]:
    """Return the checks that fail, of all families."""
    return [check for found in findings for check in found.checks if not check.passed]
