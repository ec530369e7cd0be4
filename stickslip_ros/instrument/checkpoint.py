# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The exact state of a bench as bytes, safe to read from files of unknown origin.

A line of JSON that says what it is, then compressed JSON: all parameters, what the bench remembers
(`state_tree`), and what was attached to it. What follows from the parameters is not stored.

"""

import hashlib
import json
import zlib
from collections.abc import Mapping
from typing import Any

import stickslip_ros
from stickslip_ros.drive.records import STATE
from stickslip_ros.errors import WrongKind
from stickslip_ros.instrument.sensing import CLASSES
from stickslip_ros.instrument.state_tree import HINT, plain, read, without_gaps
from stickslip_ros.parameters import Parameters, specs

FORMAT = 7
HEAD = ('format', 'version', 'kinds', 'sha256')
CONTENT = ('parameters', 'state', 'attached')
SIZE_MAX = 1 << 26
"""Bytes of the largest checkpoint, unpacked; a usual one has some hundred thousand."""
_KINDS = (STATE, *(each.KIND['memory'] for each in CLASSES.values()))
KINDS_DIGEST = hashlib.sha256(
    repr([without_gaps(kind).descr for kind in _KINDS]).encode()
).hexdigest()
"""Of all fields of the records: another one means that a state has another form."""
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


def pack(parameters: Parameters, state: Any, attached: Any) -> bytes:
    """Return a checkpoint: of a stand, what its bench remembers, and what is attached to it."""
    content = dict(zip(CONTENT, plain((parameters.flat(), state, attached)), strict=True))
    body = zlib.compress(json.dumps(content).encode(), 1)
    head = FORMAT, stickslip_ros.__version__, KINDS_DIGEST, hashlib.sha256(body).hexdigest()
    return json.dumps(dict(zip(HEAD, head, strict=True))).encode() + b'\n' + body


def unpack(data: bytes) -> tuple[Parameters, Any, Any]:
    """
    Return the stand of a checkpoint; its state and what was attached to it, not checked yet.

    Raises
    ------
    WrongKind
        If it is none, is damaged, or was made by a version whose state has another form.
    StickSlipError
        If a parameter is refused.

    """
    first, _, body = data.partition(b'\n')
    head = _parsed(first)
    found = [head.get(name) for name in HEAD] if isinstance(head, dict) else []
    if [type(each) for each in found] != [int, str, str, str]:
        raise _refusal('is none', HINT)
    form, version, kinds, digest = found
    if (form, kinds) != (FORMAT, KINDS_DIGEST):
        hint = 'use the sources that have saved it, or start from rest'
        raise _refusal(f'is of another form, {form}, that of version {version}', hint)
    if digest != hashlib.sha256(body).hexdigest():
        raise _refusal('is damaged: its SHA-256 differs', 'take another copy of the file')
    unpacker = zlib.decompressobj()
    try:
        text = unpacker.decompress(body, SIZE_MAX)
    except zlib.error:
        raise _refusal('is not compressed', HINT) from None
    content = _parsed(text) if unpacker.eof else None
    if not isinstance(content, dict) or content.keys() != set(CONTENT):
        raise _refusal(f'holds no state, or more than {SIZE_MAX} bytes', HINT)
    forms = {name: spec.kind for name, spec in specs().items()}
    values = read(forms, content['parameters'], 'checkpoint.parameters')
    return Parameters().updated(values), content['state'], content['attached']


def _parsed(text: bytes) -> Any:
    """Return what JSON says; None if it is none, is too deep, or has a name twice."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise ValueError('a name stands twice')
        return dict(pairs)

    try:
        return json.loads(text, object_pairs_hook=once)
    except (ValueError, RecursionError):
        return None


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


def _refusal(what: str, hint: str) -> WrongKind:
    return WrongKind('a checkpoint', what, 'a saved state of this version', hint)
