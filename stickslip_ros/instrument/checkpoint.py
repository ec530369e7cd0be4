# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The exact state of a bench as bytes, safe to read from files of unknown origin.

A line of JSON identifies it. Compressed JSON follows with all parameters, the state of the bench
(`state_tree`), and an attachment. Values that follow from the parameters are not stored.

"""

import hashlib
import json
import zlib
from collections.abc import Iterator, Mapping
from types import GenericAlias
from typing import Any

import stickslip_ros
from stickslip_ros.budget import JSON_BYTES, load_json
from stickslip_ros.drive.records import STATE
from stickslip_ros.errors import WrongKind
from stickslip_ros.instrument.sensing import CLASSES
from stickslip_ros.instrument.state_tree import HINT, read_tree, to_tree, without_gaps
from stickslip_ros.parameters import Parameters, spec_of, specs

FORMAT = 8
HEAD = ('format', 'version', 'kinds', 'sha256')
CONTENT = ('parameters', 'state', 'attached')
SIZE_MAX = JSON_BYTES.most
_KINDS = (STATE, *(each.KIND['memory'] for each in CLASSES.values()))
KINDS_DIGEST = hashlib.sha256(
    repr([without_gaps(kind).descr for kind in _KINDS]).encode()
).hexdigest()
"""Digest of all fields of the records; it changes with the form of the state."""


def pack_checkpoint(parameters: Parameters, state: Any, attached: Any) -> bytes:
    """Return a checkpoint of parameters, the state of a bench, and an attachment."""
    content = dict(zip(CONTENT, to_tree((parameters.flat(), state, attached)), strict=True))
    body = zlib.compress(json.dumps(content).encode(), 1)
    head = FORMAT, stickslip_ros.__version__, KINDS_DIGEST, hashlib.sha256(body).hexdigest()
    return json.dumps(dict(zip(HEAD, head, strict=True))).encode() + b'\n' + body


def unpack_checkpoint(data: bytes) -> tuple[Parameters, Any, Any]:
    """
    Return parameters, unchecked state and unchecked attachment of a checkpoint.

    Raises WrongKind if it is no checkpoint, is damaged, or its version has another form of the
    state; StickSlipError if a parameter is refused.

    """
    first, _, body = data.partition(b'\n')
    head = _parsed(first)
    found = [head.get(name) for name in HEAD] if isinstance(head, dict) else []
    if [type(each) for each in found] != [int, str, str, str]:
        raise _refusal('is not recognised', HINT)
    form, version, kinds, digest = found
    if (form, kinds) != (FORMAT, KINDS_DIGEST):
        hint = 'use the version that saved it, or start from rest'
        raise _refusal(f'has another state form, {form} of version {version}', hint)
    if digest != hashlib.sha256(body).hexdigest():
        raise _refusal('is damaged: its SHA-256 differs', 'take another copy of the file')
    unpacker = zlib.decompressobj()
    try:
        # Not `zlib.decompress`: a small file may unpack to gigabytes.
        text = unpacker.decompress(body, SIZE_MAX)
    except zlib.error:
        raise _refusal('is not compressed', HINT) from None
    content = _parsed(text) if unpacker.eof else None
    if not isinstance(content, dict) or content.keys() != set(CONTENT):
        raise _refusal(f'holds no state, or more than {SIZE_MAX} bytes', HINT)
    forms = {
        name: GenericAlias(tuple, (spec.kind, ...)) if spec.is_array else spec.kind
        for name, spec in specs().items()
    }
    values = read_tree(forms, content['parameters'], 'checkpoint.parameters')
    return Parameters().updated(values), content['state'], content['attached']


def _parsed(text: bytes) -> Any:
    """Return the value of JSON; None if it is invalid, too deep, or repeats a name."""

    def unique_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise ValueError('repeated name')
        return dict(pairs)

    try:
        return load_json(text, object_pairs_hook=unique_names)
    except ValueError:
        return None


def changed_stand(parameters: Parameters, changes: Mapping[str, object]) -> Parameters:
    """
    Return the parameters of a saved state with changes.

    Raises WrongKind if the saved state depends on a changed parameter, by its declaration.

    """
    stand = parameters.updated(changes)
    before, after = parameters.flat(), stand.flat()
    for name in changes:
        if before[name] != after[name] and not spec_of(name).resumable:
            hint = f'change {", ".join(_resumable())}, or start from rest'
            raise WrongKind(name, after[name], f'{before[name]}, as in the checkpoint', hint)
    return stand


def _resumable() -> Iterator[str]:
    """Yield what may change in a saved state: parameters, and whole groups, as ``jog.*``."""
    free = [name for name, spec in specs().items() if spec.resumable]
    parts = {name.partition('.')[0] for name in specs().keys() - free}
    whole = (name.partition('.')[0] for name in free)
    named = (
        name if group in parts else f'{group}.*' for name, group in zip(free, whole, strict=True)
    )
    yield from dict.fromkeys(named)


def _refusal(what: str, hint: str) -> WrongKind:
    return WrongKind('a checkpoint', what, 'a saved state of this version', hint)
