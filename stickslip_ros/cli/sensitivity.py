"""``stickslip sensitivity``: which of the unknowns matters most."""

import argparse

from stickslip_ros.cli.chosen import chosen_parameters
from stickslip_ros.cli.printing import Answer, table
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import make_folder
from stickslip_ros.paper.figure import write_figure
from stickslip_ros.paper.make import make_tables
from stickslip_ros.paper.screening import READ, SCREENING, effects_of
from stickslip_ros.progress import shown_progress


def sensitivity_verb(arguments: argparse.Namespace) -> Answer:
    """Run the drive along the trajectories, rank the unknowns, draw."""
    parameters = chosen_parameters(arguments)
    if arguments.trajectories < SCREENING.points_min:
        limit, hint = f'below {SCREENING.points_min}', 'give 10 or more for a ranking to rely on'
        raise OutOfRange('--trajectories', arguments.trajectories, '', limit, hint)
    make_folder(arguments.output)
    with shown_progress('runs', quiet=arguments.json) as progress:
        tables = make_tables(
            [SCREENING],
            parameters,
            points=arguments.trajectories,
            workers=arguments.workers,
            progress=progress,
        )
    runs = tables[SCREENING.name]
    with shown_progress('drawing', quiet=arguments.json):
        files = write_figure(SCREENING, runs, parameters, arguments.output)
    effects = effects_of(runs)
    content = {
        factor: {reading: effect._asdict() for reading, effect in each.items()}
        for factor, each in effects.items()
    }
    rows = [
        (
            factor,
            *(
                f'{scale * each[name].size:.1f} ± {scale * each[name].error:.1f}'
                for name, (scale, _) in READ.items()
            ),
        )
        for factor, each in effects.items()
    ]
    header = ('unknown', *(label for _, label in READ.values()))
    shown = table('mean size of the effects, over the whole range of an unknown', rows, header)
    answer = {'effects': content, 'files': [str(path) for path in files]}
    return Answer(answer, [shown, f'figure  {files[2]}'])
