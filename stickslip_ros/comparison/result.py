"""What a comparison comes to: a tree of numbers, all of B minus A in SI units."""

from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from stickslip_ros.comparison.agreement import Agreement, Part, agreement_of
from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.notebook import html_table
from stickslip_ros.parameters import Scalar

UNITS = {'n': 'N', 'm': 'm', 'v': 'V', 'j': 'J', 's': 's', 'hz': 'Hz'}


class Incomparable(StickSlipError):
    """Two inputs, each valid, cannot be compared."""

    def __init__(self, what: object, problem: str, hint: str) -> None:
        super().__init__(f'{what} {problem}; {hint}')


@dataclass(frozen=True)
class Side:
    """
    One of the two: its file or ``model``, what kind of thing that is, and what it says of itself.

    Described is everything that is known: parameters, seed, versions, columns with one value.
    Changed are the parameters that differ from the default, None if the file does not say. Rows
    are those of a table, or samples of the finest quantity of a run.

    """

    origin: str
    kind: str
    rows: int
    described: dict[str, Scalar]
    changed: dict[str, Scalar] | None
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return what JSON can say, but not all that is known."""
        return {name: value for name, value in asdict(self).items() if name != 'described'}


@dataclass(frozen=True)
class NamedDifference:
    """A parameter, seed or version that A and B both name and do not share."""

    name: str
    a: Scalar
    b: Scalar


@dataclass(frozen=True)
class Alignment:
    """
    What was added to the times of B, as ``given`` or as ``estimated``.

    Of an estimate: the mean coefficient of all quantities at the best whole sample, and the
    spacing of the samples that were compared.

    """

    shift_s: float
    method: str
    correlation: float | None = None
    sample_s: float | None = None


@dataclass(frozen=True, eq=False)
class Compared:
    """A quantity of A and B, point by point."""

    name: str  # with its unit
    parts: tuple[Part, ...]
    left_out: int  # points of A that have no part
    offset: float = 0.0  # what was found and added to all values of B

    @cached_property
    def agreement(self) -> Agreement:
        """How far B is from A over all parts."""
        return agreement_of(self.parts)

    @property
    def unit(self) -> str:
        """SI unit of the quantity."""
        return UNITS[self.name.rpartition('_')[2]]

    def to_json(self) -> dict[str, Any]:
        """Return what JSON can say."""
        return {
            'name': self.name,
            'agreement': asdict(self.agreement),
            'parts': [part.to_json() for part in self.parts],
            'left_out': self.left_out,
            'offset': self.offset,
            'unit': self.unit,
        }


@dataclass(frozen=True, eq=False)
class ComparisonReport:
    """The whole, along AMPLITUDE or TIME; without an alignment times were taken as they are."""

    a: Side
    b: Side
    axis: str
    quantities: tuple[Compared, ...]
    alignment: Alignment | None = None

    @property
    def differences(self) -> tuple[NamedDifference, ...]:
        """What both say of themselves and say differently, in A's order."""
        return tuple(
            NamedDifference(name, value, self.b.described[name])
            for name, value in self.a.described.items()
            if name in self.b.described and self.b.described[name] != value
        )

    def save(self, path: str | Path, command: str = '') -> Path:
        """
        Write a page of HTML that needs nothing else, in place of an older one.

        It names the ``command`` that made it, if there was one.

        Raises
        ------
        RecordingError
            If it cannot be written.

        """
        # ruff: noqa: PLC0415 - they import this
        from stickslip_ros.comparison.report import report_page

        page, path = report_page(self, command), Path(path)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(page, encoding='utf-8')
        except OSError as error:
            problem = f'cannot be written ({error.strerror})'
            raise RecordingError(path, problem, 'choose another place') from None
        return path

    def _repr_html_(self) -> str:
        from stickslip_ros.comparison.words import sections

        tables = [html_table(title, rows, header) for title, header, rows in sections(self)]
        return '\n'.join(tables)

    def to_json(self) -> dict[str, Any]:
        """Return what JSON can say."""
        return {
            'a': self.a.to_json(),
            'b': self.b.to_json(),
            'axis': self.axis,
            'differences': [asdict(each) for each in self.differences],
            'alignment': self.alignment and asdict(self.alignment),
            'quantities': [each.to_json() for each in self.quantities],
        }
