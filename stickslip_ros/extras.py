# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Import optional packages on demand; an error names the command that installs them."""

import importlib
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from typing import Any

from stickslip_ros.errors import StickSlipError

LAB = 'matplotlib', 'pandas', 'rich', 'scipy'
"""Packages of the extra ``lab``, the laboratory; a robot does without."""
ROS_MODULES = re.compile(r'rclpy|\w+_(msgs|srvs|interfaces)\b')


class MissingExtra(StickSlipError, ImportError):
    """An optional package is not installed; ``purpose`` is the subject of the message."""

    def __init__(self, purpose: str, module: str) -> None:
        extra = f"'stickslip_ros[lab]', or pip install {' '.join(LAB)}"
        hint = f'install it with: pip install {extra if module in LAB else module}'
        super().__init__(f'{purpose} needs the package {module!r}, which is missing; {hint}')


def load_extra(purpose: str, module: str) -> Any:
    """Import an optional package; MissingExtra if it is not installed."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingExtra(purpose, error.name or module) from None


def require_lab(purpose: str) -> None:
    """Raise MissingExtra, before work of the laboratory begins, if a package of it is missing."""
    for module in LAB:
        with suppress(ImportError, ValueError):  # hidden from imports
            if find_spec(module):
                continue
        raise MissingExtra(purpose, module)


class MissingRos(StickSlipError, ImportError):
    """ROS 2 is not installed, or its environment is not set up."""


@contextmanager
def needs_ros(what: str) -> Iterator[None]:
    """Raise MissingRos or MissingExtra for ``what`` if the code within lacks a package."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition('.')[0]
        if package in {*LAB, 'mcap'}:
            raise MissingExtra(what, package) from None
        if not ROS_MODULES.match(error.name or ''):
            raise
        hint = "source its setup.bash, or take the wheels: pip install 'stickslip_ros[jazzy]'"
        raise MissingRos(f'{what} needs ROS 2, but {error.name} is missing; {hint}') from None
