# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameters as the page shows them and people type them."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from stickslip_ros.errors import StickSlipError, WrongKind
from stickslip_ros.parameters import Parameters, load_yaml, spec_of
from stickslip_ros.parameters.stages import stage_file
from stickslip_ros.parameters.typed import with_point
from stickslip_ros.units import DISPLAY, display_unit, parse_quantity

_NUMBER = r'(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?'
_UNIT = '|'.join(sorted(DISPLAY, key=len, reverse=True))
_IN_SI = re.compile(rf'((?:{_NUMBER} to )?{_NUMBER}|,(?= [^ ]+[;:])) ({_UNIT})(?![\w/^]| [ms]\b)')
"""An SI unit that the page does not show, after a number, a range, or a comma."""


def is_of_start(name: str) -> bool:
    """Return whether a parameter is given at the start only: also names, files and folders."""
    spec = spec_of(name)
    return spec.fixed or (spec.kind is str and not spec.choices)


def shown_value(value: Any, unit: str) -> str:
    """Return a value of a parameter as the text of a field, in the displayed unit."""
    if isinstance(value, tuple):
        return ', '.join(shown_value(each, unit) for each in value)
    if isinstance(value, float):
        return f'{display_unit(unit)[0] * value:.15g}'
    return str(value).lower() if isinstance(value, bool) else str(value)


def in_shown_units(text: str) -> str:
    """Return a text of the drive with its SI values in the displayed units of the fields."""

    def shown(found: re.Match[str]) -> str:
        factor, unit = display_unit(found[2])
        return re.sub(_NUMBER, lambda one: f'{factor * float(one[0]):.12g}', found[1]) + f' {unit}'

    return _IN_SI.sub(shown, text)


def typed_value(name: str, text: str, unit: str) -> str:
    """Return the text of a field with a unit: a bare number is in the displayed one."""
    number = with_point(name, text.strip())
    is_bare = parse_quantity(number, '') is not None
    return number + display_unit(unit)[1] if is_bare else number


def read_setting(name: str, value: object) -> Any:
    """Return the checked value of a parameter; the text of a number may have a unit."""
    spec = spec_of(name)
    if is_of_start(name):
        raise StickSlipError(f'the page does not set {name}; start the drive with it')
    if isinstance(value, str) and spec.kind in (float, int):
        texts = value.strip(' []').split(',') if spec.is_array else [value]
        value = ','.join(typed_value(name, each, spec.unit) for each in texts)
    return spec.check(name, value)


def read_settings(values: object) -> dict[str, Any]:
    """Return the checked values of texts by name."""
    if not isinstance(values, dict):
        raise WrongKind('parameters', values, 'a table of values', 'reload the page')
    return {name: read_setting(name, text) for name, text in values.items()}


@contextmanager
def uploaded(content: bytes, suffix: str) -> Iterator[Path]:
    """Give a file with an uploaded content; refusals do not show its path."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f'upload{suffix}')
        path.write_bytes(content)
        try:
            yield path
        except StickSlipError as error:
            raise StickSlipError(str(error).replace(f'{path}: ', '')) from None


def read_parameter_file(content: bytes, name: str) -> dict[str, str]:
    """Return all values of an uploaded parameter file, or of a stage, as texts of fields."""
    if not content:
        return shown_values(load_yaml(stage_file(name)))
    with uploaded(content, '.yaml') as path:
        return shown_values(load_yaml(path))


def shown_values(parameters: Parameters) -> dict[str, str]:
    """Return the values of all parameters as texts of fields, but of those of the start."""
    return {
        name: shown_value(value, spec_of(name).unit)
        for name, value in parameters.flat().items()
        if not is_of_start(name)
    }


def changed_values(stand: Parameters) -> dict[str, str]:
    """Return the values that differ from the defaults as texts of fields."""
    return {name: shown_value(v, spec_of(name).unit) for name, v in stand.changed().items()}
