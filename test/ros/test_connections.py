"""Messages that never came are counted by the numbers of their publishers, never too high."""

import pytest

from stickslip_ros.ros.connections import SequenceGaps

A, B = 'a', 'b'


def lost(*stretches: tuple[set[str], list[int]]) -> int:
    """Give what is counted when such numbers come, each time before these publishers are seen."""
    gaps = SequenceGaps()
    for publishers, numbers in stretches:
        for number in numbers:
            gaps.take(number)
        gaps.settle(publishers)
    return gaps.lost


@pytest.mark.parametrize(
    ('stretches', 'count'),
    [
        ([({A}, [1, 2, 3])], 0),
        ([({A}, [1, 2, 6, 7, 10])], 3 + 2),
        ([({A}, [41, 42])], 0),
        ([({A}, [1, 2]), ({A}, [5])], 2),
        ([({A, B}, [1, 1, 2, 2, 3, 3])], 0),
        ([({A}, [1, 2]), ({A, B}, [50, 3, 51, 4])], 0),
        ([({A}, [1, 2]), ({A, B}, [50, 3, 51]), ({A, B}, [54, 6])], 2 + 2),
        ([({A}, [1, 2]), ({B}, [1, 2, 3])], 0),
        ([({A}, [None, None])], 0),
    ],
    ids=[
        'none',
        'two gaps',
        'before the first',
        'across a report',
        'two in step',
        'a newcomer far ahead',
        'of two',
        'started anew',
        'no numbers',
    ],
)
def test_gaps_are_counted(stretches: list, count: int):
    assert lost(*stretches) == count
