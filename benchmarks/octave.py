"""The algorithm of the paper in GNU Octave, close to the authors' MATLAB."""

import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.io import savemat

from benchmarks import rival
from benchmarks.case import PERIOD_S, Ours, ours_at, standard_case, worst_error
from benchmarks.clock import Array, Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.rival import SIX, Grid
from benchmarks.sizes import Sizes

FOLDER = Path(__file__).resolve().parent
TITLE = 'The algorithm of the paper in GNU Octave, equivalent rough profile'
GRID = Grid(springs=100, step_s=2e-6, fall_steps=8)


def run(sizes: Sizes) -> Outcome:
    """Compare, where Octave is installed."""
    octave = shutil.which('octave-cli') or shutil.which('octave')
    if octave is None:
        return Outcome(TITLE, [], [], ['left out: octave is not on the path'])
    cycles = sizes.octave_cycles
    parameters = standard_case()
    springs = rival.equal_springs(parameters, GRID.springs, SIX)
    reference_n = Ours(standard_case({'sim.dt': sizes.converged_s}), cycles)()
    ours, step_s = ours_at({}, sizes.steps_s, cycles, reference_n)
    own_s, integrals = _octave(octave, springs, rival.path_of(parameters, GRID, cycles))
    forces_n = rival.mean_forces(parameters, integrals)
    times = in_turn([Program(ours, cycles * PERIOD_S)], sizes)
    per_second = own_s / (cycles * PERIOD_S)
    rows: list[Row] = [
        {
            'program': 'ours',
            'setting': f'{step_s * 1e6:g} us',
            'times_real_time': 1.0 / times.median(0),
            'ratio': 1.0,
            'worst_error': worst_error(ours(), reference_n),
        },
        {
            'program': 'Octave',
            'setting': f'{len(springs.limit_n)} springs, {GRID.step_s * 1e6:g} us',
            'times_real_time': 1.0 / per_second,
            'ratio': per_second / times.median(0),
            'worst_error': worst_error(forces_n, reference_n),
        },
    ]
    note = f'{cycles} cycles; Octave times its loop itself, without its start, once'
    return Outcome(TITLE, rows, [], [note])


def _octave(octave: str, springs: rival.Springs, path: Array) -> tuple[float, Array]:
    parameters = standard_case()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, 'input.mat')
        savemat(
            file,
            {
                'shear': springs.shear_n_per_m,
                'limit': springs.limit_n,
                'mass': parameters.runner.mass,
                'cell_stiffness': parameters.load_cell.stiffness,
                'path': path,
            },
        )
        words = [octave, '--quiet', '--eval', f"paper_algorithm('{file}')"]
        done = subprocess.run(words, cwd=FOLDER, check=True, capture_output=True, text=True)
    numbers = np.array([float(word) for word in done.stdout.split()])
    return float(numbers[0]), numbers[1:]
