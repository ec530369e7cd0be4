# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip draw``: a drawing of the stand."""

import argparse

from stickslip_ros.errors import UnknownName
from stickslip_ros.files import prepare_output, replacing
from stickslip_ros.lab.cli.chosen import chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.drawing.picture import draw_stand
from stickslip_ros.lab.drawing.urdf import robot_description


def draw_verb(arguments: argparse.Namespace) -> Answer:
    """Write the drawing of a stand as SVG, or its bodies as URDF."""
    path, parameters = arguments.output, chosen_parameters(arguments)
    if path.suffix not in {'.svg', '.urdf'}:
        raise UnknownName('kind of drawing', path.suffix, 'use .svg or .urdf')
    prepare_output(path)
    text = (robot_description if path.suffix == '.urdf' else draw_stand)(parameters)
    with replacing(path) as part:
        part.write_text(text, encoding='utf-8')
    return Answer({'drawing': str(path)}, [f'drawing {path}'])
