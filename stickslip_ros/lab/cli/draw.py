# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip draw``: the stand as one sees it."""

import argparse

from stickslip_ros.errors import StickSlipError, UnknownName
from stickslip_ros.files import prepare_output, replacing
from stickslip_ros.lab.cli.chosen import chosen_for, chosen_parameters
from stickslip_ros.lab.cli.printing import Answer
from stickslip_ros.lab.drawing.picture import draw_stand
from stickslip_ros.lab.drawing.urdf import robot_description
from stickslip_ros.lab.runs.recorded_run import open_run


def draw_verb(arguments: argparse.Namespace) -> Answer:
    """Write the drawing of a stand or a run, or the description of its bodies."""
    path, parameters = arguments.output, chosen_parameters(arguments)
    if path.suffix not in {'.svg', '.urdf'}:
        raise UnknownName('kind of drawing', path.suffix, 'use .svg or .urdf')
    prepare_output(path)
    run = None if arguments.file is None else open_run(arguments.file)
    if run and (arguments.params or arguments.assignments):
        raise StickSlipError('--params and --set are without effect on a recording; leave them')
    if path.suffix == '.urdf':
        text = robot_description(parameters if run is None else run.parameters)
    else:
        text = draw_stand(run or parameters, **chosen_for(draw_stand, arguments))
    with replacing(path) as part:
        part.write_text(text, encoding='utf-8')
    return Answer({'drawing': str(path)}, [f'drawing {path}'])
