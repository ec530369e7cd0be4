"""Optional packages: imported when needed; a missing one is named with the command to install."""

import importlib
from typing import Any

from stickslip_ros.errors import StickSlipError


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
