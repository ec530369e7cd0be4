# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Check package.xml: `make lint`.

It is read as catkin_pkg does, with warnings as errors; its version is that of the package.

"""

import sys
from pathlib import Path

from catkin_pkg.package import InvalidPackage, parse_package

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from stickslip_ros import __version__  # noqa: E402 - this tree's, not an installed one


def complaints(path: Path) -> list[str]:
    """List what is wrong with a manifest; colcon would fall back to plain Python in silence."""
    found: list[str] = []
    try:
        package = parse_package(path, warnings=found)
    except InvalidPackage as error:
        return [*found, str(error)]
    if package.package_format != 3:
        found.append(f'format {package.package_format}; write format="3"')
    if package.get_build_type() != 'ament_python':
        found.append(f'build type {package.get_build_type()}; export ament_python')
    if package.version != __version__:
        found.append(
            f'version {package.version}, but {__version__} in stickslip_ros/__init__.py; '
            'write the same in both'
        )
    return found


if __name__ == '__main__':
    messages = complaints(ROOT / 'package.xml')
    print('\n'.join(messages) or f'package.xml: {__version__}, format 3, ament_python')
    sys.exit(bool(messages))
