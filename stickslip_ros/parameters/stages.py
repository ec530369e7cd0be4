# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parameter files of stages whose layout differs from the paper's, found by name."""

from pathlib import Path

from stickslip_ros.errors import UnknownName
from stickslip_ros.parameters.arguments import checked_arguments


@checked_arguments
def stage_file(name: str) -> Path:
    """
    Return the ROS parameter file of a stage, as ``'clamp'``.

    Raises
    ------
    UnknownName
        If there is no stage of that name; the message lists the names.

    """
    files = stage_files()
    if name not in files:
        raise UnknownName('stage', name, f'the stages are {", ".join(files)}')
    return files[name]


def stage_files() -> dict[str, Path]:
    """Return the files of all stages by name: in the source, or in the nearest ``share``."""
    source, *above = Path(__file__).resolve().parents[2:]
    folders = (source, *(each / 'share' / 'stickslip_ros' for each in above))
    found = (sorted(each.glob('config/stages/*.yaml')) for each in folders)
    return {file.stem: file for file in next(filter(None, found), [])}
