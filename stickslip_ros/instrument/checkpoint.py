"""
The exact state of a bench as bytes, safe to read from files of unknown origin.

Python's pickle, but only of the classes listed here, none of which does anything when it is made;
arrays are checked against the kinds of records that this version has.

"""

import array
import hashlib
import io
import json
import pickle
import zlib
from collections import deque
from collections.abc import Mapping
from functools import cache
from types import MethodType
from typing import Any, NamedTuple

import numpy as np

import stickslip_ros
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.records import PLANT, STATE, Wave
from stickslip_ros.errors import WrongKind
from stickslip_ros.instrument.closed_loop import ClosedLoop, Goal
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.motion import Motion, Running
from stickslip_ros.instrument.position_loop import Level, LoopSettings, PositionLoop, Steps
from stickslip_ros.instrument.reports import Event, Identity, Result, Status
from stickslip_ros.instrument.sensing import SENSORS, Noise, Sensing
from stickslip_ros.instrument.stand import Stand
from stickslip_ros.parameters import FaultParameters, Parameters, dump_yaml, parse_yaml

REPORT = 'report'
FORMAT = 3
SIZE_MAX = 1 << 27
"""Bytes of the largest checkpoint; a usual one has some hundred thousand."""
KINDS = {'PLANT': PLANT, 'STATE': STATE, 'SENSORS': SENSORS}
KINDS_DIGEST = hashlib.sha256(repr([kind.descr for kind in KINDS.values()]).encode()).hexdigest()
"""Of all fields of the records: another one means that a state has another form."""
NUMBERS = frozenset(['<f8', '<i8', '<u8', '|b1', '|u1'])
"""Numbers of which arrays may be made."""
CLASSES: tuple[Any, ...] = (
    ClosedLoop,
    Event,
    FaultParameters,
    Goal,
    Identity,
    Joints,
    Level,
    LoopSettings,
    Motion,
    Noise,
    PositionLoop,
    Request,
    Result,
    Running,
    Sensing,
    Stand,
    Status,
    Steps,
    Wave,
    deque,
)
CHANGEABLE = ('closed_loop.', 'frame_id.', 'jog.', 'limits.', 'record.', 'step.')
CHANGEABLE_NODE = frozenset(
    (
        'autostart',
        'sim.checkpoint',
        'sim.joint_name',
        'sim.joint_states_rate',
        'sim.lockstep',
        'sim.publish_clock',
        'sim.publish_truth',
        'sim.real_time_factor',
        'sim.time_origin',
    )
)
CHANGEABLE_PLANT = frozenset(('amplifier.slew_rate', 'runner.damping', 'runner.mass'))
"""Parameters on which nothing depends that is remembered: of moves, and numbers of the plant."""


@cache
def without_gaps(kind: Any) -> Any:
    """Return a kind of record without gaps between its fields, in which anything may stand."""
    if kind.subdtype is not None:
        base, shape = kind.subdtype
        return np.dtype((without_gaps(base), shape))
    if kind.names is None:
        return kind
    return np.dtype([(name, without_gaps(kind.fields[name][0])) for name in kind.names])


class Head(NamedTuple):
    """
    What a checkpoint says before the state.

    Attributes
    ----------
    parameters : Parameters
        The stand.
    state : bytes
        All else, for ``unpack``.

    """

    parameters: Parameters
    state: bytes


def pack(parameters: Parameters, state: Mapping[str, Any], known: Mapping[str, Any]) -> bytes:
    """
    Return a checkpoint.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    state : mapping of str to object
        What is remembered.
    known : mapping of str to object
        What whoever reads it has already: it is named, not stored.

    """
    stream = io.BytesIO()
    _Writer(stream, known).dump(dict(state))
    body = zlib.compress(stream.getvalue(), 1)
    head = {
        'format': FORMAT,
        'version': stickslip_ros.__version__,
        'kinds': KINDS_DIGEST,
        'sha256': hashlib.sha256(body).hexdigest(),
        'parameters': dump_yaml(parameters, 'Parameters of the checkpoint; SI units.'),
    }
    return json.dumps(head).encode() + b'\n' + body


def read_head(data: bytes) -> Head:
    """
    Return the stand of a checkpoint, and its state still packed.

    Raises
    ------
    WrongKind
        If it is none, is damaged, or was made by a version whose state has another form.

    """
    first, _, body = data.partition(b'\n')
    try:
        head = json.loads(first)
        made, digest = (head['format'], head['kinds']), head['sha256']
        version, text = head['version'], head['parameters']
    except (ValueError, KeyError, TypeError):
        raise _refusal('is none', 'give one that a bench has saved') from None
    if made != (FORMAT, KINDS_DIGEST):
        hint = f'use stickslip_ros {version}, which has saved it'
        raise _refusal(f'is of another form, that of version {version}', hint)
    if hashlib.sha256(body).hexdigest() != digest:
        raise _refusal('is damaged: its SHA-256 differs', 'take another copy of the file')
    return Head(parse_yaml(text, 'checkpoint'), body)


def unpack(body: bytes, known: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return what is remembered, with ``known`` as in ``pack``.

    Raises
    ------
    WrongKind
        If it holds anything but what ``pack`` writes.

    """
    try:
        unpacker = zlib.decompressobj()
        plain = unpacker.decompress(body, SIZE_MAX)
        state = _Reader(io.BytesIO(plain), known).load()
    except Exception as error:  # noqa: BLE001 - bytes that nobody has packed may do anything
        raise _refusal(f'cannot be read ({error})', 'give one that a bench has saved') from None
    if not isinstance(state, dict):
        raise _refusal('holds no state', 'give one that a bench has saved')
    return state


def changed_stand(parameters: Parameters, changes: Mapping[str, object]) -> Parameters:
    """
    Return a stand with other parameters for a state that was saved of it.

    Raises
    ------
    WrongKind
        If what is remembered depends on one of them.

    """
    stand = parameters.updated(changes)
    before, after = parameters.flat(), stand.flat()
    for name in changes:
        is_free = name.startswith(CHANGEABLE) or name in CHANGEABLE_PLANT | CHANGEABLE_NODE
        if before[name] != after[name] and not is_free:
            hint = (
                f'change {", ".join(sorted(CHANGEABLE_PLANT))} or {"*, ".join(CHANGEABLE)}*, or '
                'start from rest'
            )
            raise WrongKind(name, after[name], f'{before[name]}, as in the checkpoint', hint)
    return stand


def take_over_changes(plants: Record, before: Record, after: Record) -> None:
    """Write into plants the fields in which those of two stands at rest differ; in place."""
    for name in plants.dtype.names or ():
        if not is_same(before[name], after[name]):
            plants[name] = after[name]


def is_same(first: Record, second: Record) -> bool:
    """Return whether records hold the same bytes in all fields."""
    packed = without_gaps(first.dtype)
    return bool(first.astype(packed).tobytes() == second.astype(packed).tobytes())


def _refusal(what: str, hint: str) -> WrongKind:
    return WrongKind('a checkpoint', what, 'a saved state of this version', hint)


def array_of(kind: str, shape: tuple[int, ...], data: bytes) -> Array:
    """Return an array of records of a kind, or of numbers."""
    if kind not in KINDS and kind not in NUMBERS:
        raise ValueError(f'no arrays of {kind}')
    if kind in KINDS:
        return np.frombuffer(data, without_gaps(KINDS[kind])).reshape(shape).astype(KINDS[kind])
    return np.frombuffer(bytearray(data), kind).reshape(shape)


def numbers_of(code: str, data: bytes) -> 'array.array[Any]':
    """Return an ``array.array``."""
    return array.array(code, data)


ALLOWED = {(each.__module__, each.__qualname__): each for each in (*CLASSES, array_of, numbers_of)}


class _Writer(pickle.Pickler):
    """Names what is known, takes arrays apart, and refuses every other class."""

    def __init__(self, stream: io.BytesIO, known: Mapping[str, Any]) -> None:
        super().__init__(stream, pickle.HIGHEST_PROTOCOL)
        self._known = known
        self._names = {id(each): name for name, each in known.items()}

    def persistent_id(self, value: Any) -> str | None:
        """Return the name of a known object; of bound methods a new object is made every time."""
        if isinstance(value, MethodType) and value == self._known.get(REPORT):
            return REPORT
        return self._names.get(id(value))

    def reducer_override(self, value: Any) -> Any:
        """Say how an object is taken apart."""
        if isinstance(value, np.ndarray):
            for name, kind in KINDS.items():
                if value.dtype == kind:
                    return array_of, (
                        name,
                        value.shape,
                        value.astype(without_gaps(kind)).tobytes(),
                    )
            return array_of, (value.dtype.str, value.shape, value.tobytes())
        if isinstance(value, array.array):
            return numbers_of, (value.typecode, value.tobytes())
        if not isinstance(value, (*CLASSES, type, type(array_of))):
            raise TypeError(f'a checkpoint cannot hold {type(value).__qualname__}')
        return NotImplemented


class _Reader(pickle.Unpickler):
    """Makes nothing but what is allowed."""

    def __init__(self, stream: io.BytesIO, known: Mapping[str, Any]) -> None:
        super().__init__(stream)
        self._known = known

    def persistent_load(self, name: Any) -> Any:
        """Return what is known under a name."""
        return self._known[name]

    def find_class(self, module: str, name: str) -> Any:
        """Return a class that is allowed."""
        return ALLOWED[module, name]
