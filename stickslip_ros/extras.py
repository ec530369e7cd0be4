# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Optional packages: imported when needed; a missing one is named with the command to install."""

import importlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from stickslip_ros.errors import StickSlipError

OF_ROS = re.compile(r'rclpy|\w+_(msgs|srvs|interfaces)\b')


class MissingExtra(StickSlipError):
    """A package that the request needs is not installed; the purpose begins a sentence."""

    def __init__(self, purpose: str, module: str) -> None:
        hint = f'install it with: pip install {module}'
        super().__init__(f'{purpose} needs the package {module!r}, which is missing; {hint}')


def load_extra(purpose: str, module: str) -> Any:
    """Import a package that is an optional dependency; MissingExtra if it is not installed."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingExtra(purpose, error.name or module) from None


class MissingRos(StickSlipError, ImportError):
    """ROS 2 is not installed, or its environment is not set up."""


@contextmanager
def needs_ros(what: str) -> Iterator[None]:
    """Say of what is imported or run within that it needs ROS 2, where that is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        if not OF_ROS.match(error.name or ''):
            raise
        hint = "source its setup.bash, or take the wheels: pip install 'stickslip_ros[jazzy]'"
        raise MissingRos(f'{what} needs ROS 2, but {error.name} is missing; {hint}') from None
