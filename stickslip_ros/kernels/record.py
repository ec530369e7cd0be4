# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Records that kernels read and change: elements of structured arrays.

A record is passed by reference, including nested records and arrays of records, and is changed in
place. Its fields are attributes in Python, with or without numba.

"""

import mmap
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np

LARGE = 1 << 20
"""Size of a large record, bytes: a plant, most of which is never touched."""
_PRIVATE = {'flags': mmap.MAP_PRIVATE} if hasattr(mmap, 'MAP_PRIVATE') else {}
FLOAT, COUNT, FLAG = np.float64, np.int64, np.bool_
RecordKind: TypeAlias = Any
"""Type of a record, a numpy dtype."""
Record: TypeAlias = Any
"""A record of some kind."""
FieldType: TypeAlias = Any
"""Type of a field: FLOAT, COUNT, FLAG or a kind; for an array a pair of type and shape."""


class _Fields(np.void):
    """An element of a structured array with fields as attributes; faster than np.record."""

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


def kind(**fields: FieldType) -> RecordKind:
    """Return the type of records with these fields, each aligned."""
    names = {name: property(itemgetter(name)) for name in fields}
    element = type('Fields', (_Fields,), names)
    return np.dtype((element, np.dtype(list(fields.items()), align=True)))


def records(of: RecordKind, made: Record = None, /, **values: Any) -> Any:
    """
    Return an array of one record with some fields; the others are 0, or as in ``made``.

    numba finds its type faster than that of a record.

    """
    if made is None and of.itemsize > LARGE:  # fresh pages are zeros, free until touched
        made = np.frombuffer(mmap.mmap(-1, of.itemsize, **_PRIVATE), of)
    elif made is None:
        made = np.zeros(1, of)
    one = made[0]  # numpy copies a record into a record at once, but into an array by its fields
    for name, value in values.items():
        one[name] = value
    return made


def record(of: RecordKind, **values: Any) -> Record:
    """Return a record; parameters of ``records``."""
    return records(of, **values)[0]
