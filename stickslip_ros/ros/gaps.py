"""Messages that never came, known by the numbers that DDS gives to those of a publisher."""

from collections.abc import Set
from itertools import islice

EXPECTED_MAX = 64
"""Next numbers that are kept: of so many publishers, and of gaps since the last report."""


class SequenceGaps:
    """
    Count what a full queue has lost on a topic.

    A message has a number, but does not say of which publisher: one that fits no publisher so far
    is a gap behind the nearest lower one, unless a publisher has come since. The count is exact
    for one publisher, and rather too low for several.

    Attributes
    ----------
    lost : int
        Messages lost, as far as it has been settled.

    """

    def __init__(self) -> None:
        self.lost = 0
        self._expected: dict[int, None] = {}
        self._gaps: list[tuple[int, int]] = []
        self._begun = 0
        self._known: Set[object] = frozenset()

    def take(self, number: int | None) -> None:
        """Note the number of a message that came; None where DDS gives none."""
        if number is None:
            return
        if number in self._expected:
            del self._expected[number]
        elif below := [each for each in self._expected if each < number]:
            self._gaps.append((max(below), number))
        else:
            self._begun += 1
        self._expected[number + 1] = None
        if len(self._expected) > EXPECTED_MAX:
            del self._expected[next(iter(self._expected))]

    def settle(self, publishers: Set[object]) -> None:
        """
        Count the gaps since the last call, but for the first messages of new publishers.

        Parameters
        ----------
        publishers : set
            Those that there are now, however identified.

        """
        begun_by_gap = max(0, len(publishers - self._known) - self._begun)
        for wanted, came in islice(self._gaps, begun_by_gap, None):
            self.lost += came - wanted
            self._expected.pop(wanted, None)
        self._known = frozenset(publishers)
        self._gaps.clear()
        self._begun = 0
