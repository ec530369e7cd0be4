"""Check package.xml as catkin_pkg does, with its warnings as errors: `make lint`."""

import sys
from pathlib import Path

from catkin_pkg.package import InvalidPackage, parse_package

MANIFEST = Path(__file__).resolve().parents[1] / 'package.xml'


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
    return found


if __name__ == '__main__':
    messages = complaints(MANIFEST)
    print('\n'.join(messages) or 'package.xml: format 3, ament_python, no warnings')
    sys.exit(bool(messages))
