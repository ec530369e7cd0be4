"""The result of a benchmark: rows, targets, notes."""

from dataclasses import dataclass, field

Row = dict[str, str | float]


@dataclass(frozen=True)
class Verdict:
    """
    A target and what became of it.

    Attributes
    ----------
    target : str
        What was wanted, in words.
    wanted, found : float
        Numbers.
    at_most : bool
        Whether ``wanted`` is an upper limit.

    """

    target: str
    wanted: float
    found: float
    at_most: bool = False

    @property
    def met(self) -> bool:
        """Return whether the target was reached."""
        return self.found <= self.wanted if self.at_most else self.found >= self.wanted


@dataclass(frozen=True)
class Outcome:
    """
    The tables of one benchmark.

    Attributes
    ----------
    title : str
        What is compared.
    rows : list of dict
        All with the same keys.
    verdicts : list of Verdict
        Targets.
    notes : list of str
        What the reader must know.

    """

    title: str
    rows: list[Row]
    verdicts: list[Verdict] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
