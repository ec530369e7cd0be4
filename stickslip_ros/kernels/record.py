# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Records: what kernels read and change, as elements of structured arrays.

A record is handed over by reference, nested ones and arrays of records included, and changed in
place. In Python its fields are attributes, with or without numba.

"""

from mmap import MAP_PRIVATE, mmap
from typing import Any, TypeAlias

import numpy as np

LARGE = 1 << 20
"""Bytes of a record from which on most of it is never touched: a plant."""
FLOAT, COUNT, FLAG = np.float64, np.int64, np.bool_
Kind: TypeAlias = Any
"""Type of a record, a numpy dtype."""
Record: TypeAlias = Any
"""A record of some kind; its fields are those that the kind was made of."""
Field: TypeAlias = Any
"""Type of a field: FLOAT, COUNT, FLAG, another kind; or one of these and the shape of an array."""


class _Fields(np.void):
    """An element of a structured array with its fields as attributes: faster than np.record."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except ValueError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


def kind(**fields: Field) -> Kind:
    """Return the type of records with these fields, each aligned."""
    return np.dtype((_Fields, np.dtype(list(fields.items()), align=True)))


def records(of: Kind, **values: Any) -> Any:
    """
    Return an array of one record.

    What is called block after block takes such arrays: their type is found faster.

    Parameters
    ----------
    of : Kind
        Type of the record.
    values : number, array or record
        Its fields; those left out are 0.

    """
    if of.itemsize > LARGE:  # fresh pages are zeros, too, that take no time until they are touched
        made: Any = np.frombuffer(mmap(-1, of.itemsize, MAP_PRIVATE), of)
    else:
        made = np.zeros(1, of)
    for name, value in values.items():
        made[name] = value
    return made


def record(of: Kind, **values: Any) -> Record:
    """Return a record, as ``records`` does."""
    return records(of, **values)[0]
