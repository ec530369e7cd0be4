"""Verbs that compare the model with the paper, with other models and with references."""

from stickslip_ros.cli.options import PARAMETERS, PRELOAD, WORKERS, folder, option, verb

EVIDENCE = (
    verb(
        'roughness',
        'random rough lines against the equivalent profile',
        'Make random self-affine lines and a surface, check their spectra, and compare the '
        'contact of the lines with that of the equivalent rough profile, which has the same rms '
        'height and Hurst exponent; contact.line_seed chooses the lines. Writes '
        'DIR/roughness.png.',
        folder(),
        option('--realisations', 'number of random lines', int, default=100),
        *PARAMETERS,
        module='paper',
    ),
    verb(
        'laws',
        'force of every profile and friction law over amplitude',
        'Run the drive with every contact profile and every friction law at 0.1, 0.5 and 1 N. '
        'Writes DIR/laws.csv, DIR/laws.png, and DIR/laws.md with the caption. The laws take their '
        'stiffness and limit from the contact model, unless friction_law.* says otherwise.',
        folder(),
        option('--points', 'amplitudes up to 160 nm', int, default=16),
        *PARAMETERS,
        module='paper',
    ),
    verb(
        'figures',
        "the paper's figures, and what it leaves open",
        "Run the drive for the paper's Figs 2, 6 and 7, for damping, frequency, load-cell "
        'stiffness and slew rate, for a rounded saw-tooth, for piezos that ring, a frame that '
        'gives way, each unknown alone, a preload that changes within a step, for assumptions '
        'that meet all statements of the paper, and for what others measured. Writes '
        'for each figure DIR/NAME.csv (all digits, SI), DIR/NAME.png, DIR/NAME.svg, and '
        'DIR/NAME.md with the caption. Names: fig2, fig6a, fig6b, fig7, sensitivity, slew, '
        'rounded, ringing, ringing_slew, frame, unknowns, normal_motion, consistent, '
        'consistent_force, measured_impact, measured_force.',
        folder('runs/figures'),
        option('--only', 'default: all figures', metavar='NAMES'),
        option(
            '--points', 'points along an axis (default: what each figure needs)', int, default=0
        ),
        WORKERS,
        *PARAMETERS,
        module='paper',
    ),
    verb(
        'sensitivity',
        'which unknown matters most for force, 0-amplitude and step',
        'Screen all that is assumed at once, by the method of Morris: what each unknown does to '
        'force, 0-amplitude and free step at a preload, and what should be measured first. Writes '
        'DIR/screening.csv (every run), .png, .svg, and .md with the ranges. sim.seed chooses the '
        'trajectories.',
        folder('runs/sensitivity'),
        PRELOAD,
        option('--trajectories', 'ways through all unknowns', int, default=20),
        WORKERS,
        *PARAMETERS,
    ),
    verb(
        'validate',
        'contact and drive against closed forms, springs, 3-D',
        'Compare contact mechanics and drive with closed forms, springs stepped one by one, 3-D '
        'solutions and published numbers. Writes validation.md, validation.csv and '
        'validation.png. Exit status 1 if a check fails.',
        folder('runs/validation'),
    ),
)
