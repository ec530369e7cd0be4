"""A trace: blocks of samples whose columns are named, with their units, in the layout."""

import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from stickslip_ros.errors import WrongKind
from stickslip_ros.recording.messages import ArrayMessage
from stickslip_ros.recording.series import Series

#: Column that holds the time, in s.
TIME: Final = 't'
_LABEL: Final = re.compile(r'(?P<name>[^\[\]]+)(\[(?P<unit>[^\[\]]*)\])?')


def split_columns(blocks: Sequence[ArrayMessage], origin: str) -> dict[str, Series]:
    """
    Join the blocks of a trace and give its columns.

    Parameters
    ----------
    blocks : sequence of ArrayMessage
        Arrays of shape (samples, columns); the label of the second dimension lists the columns
        with their units, as ``t[s],voltage[V]``.
    origin : str
        Where they come from.

    Returns
    -------
    dict of str to Series
        Each column but the time, by its name without the unit. Empty without blocks.

    Raises
    ------
    WrongKind
        If a block is not a table, has other columns than the first, or has no time.

    """
    if not blocks:
        return {}
    units = _units(blocks[0], origin)
    for block in blocks:
        if block.labels != blocks[0].labels or block.data.shape[1:] != (len(units),):
            raise _not_a_table(block, origin)
    table = np.concatenate([block.data for block in blocks])
    columns = dict(zip(units, table.T.copy(), strict=True))
    time_s = columns.pop(TIME)
    return {
        name: Series(time_s, value, units[name], f'{origin} {name}')
        for name, value in columns.items()
    }


def _units(block: ArrayMessage, origin: str) -> dict[str, str]:
    """Give the unit of each column, in the order of the columns."""
    labels = block.labels[1].split(',') if len(block.labels) == 2 else []
    parts = [_LABEL.fullmatch(label) for label in labels]
    units = {part['name']: part['unit'] or '' for part in parts if part}
    if units.get(TIME) != 's' or len(units) != len(labels):
        raise _not_a_table(block, origin)
    return units


def _not_a_table(block: ArrayMessage, origin: str) -> WrongKind:
    return WrongKind(
        f'layout of a block of {origin}',
        (block.labels, block.data.shape),
        'that of one table with distinct columns, one of them t[s]',
        'read a topic that carries a trace',
    )
