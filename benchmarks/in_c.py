# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The same algorithm as ours in plain C: what a compiler without numba makes of it."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.case import PERIOD_S, ROUNDING_S, Ours, standard_case, worst_error
from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import RAMP_MEAN
from stickslip_ros.drive.records import ALL

SOURCE = Path(__file__).resolve().with_name('drive.c')
FAST = ('-O3', '-march=native', '-fno-tree-slp-vectorize')
"""Without the last one gcc 12 packs numbers that do not belong together: a sixth slower."""
FLAGS = (*FAST, '-std=c11', '-Wall', '-Wextra', '-Werror', '-shared', '-fPIC')
AS_WRITTEN, FUSED, REORDERED = 'C', 'C, fused', 'C, fused and reordered'
CONTRACTED = '-ffp-contract=fast'
ANY_ORDER = '-fassociative-math', '-freciprocal-math', '-fno-signed-zeros', '-fno-trapping-math'
ARITHMETIC = {
    AS_WRITTEN: ('-ffp-contract=off',),
    FUSED: (CONTRACTED,),
    REORDERED: (CONTRACTED, *ANY_ORDER),
}
"""As written each operation rounds, as ours do, and the bits are the same. Fused, a multiplication
and an addition round once; reordered, the compiler also calculates in another order."""
MORE_CYCLES = 10
"""Times as many cycles as other benchmarks run, so that calls and fresh states are nothing."""
TITLE = 'The same algorithm in plain C, equivalent rough profile'
PLANT_NUMBERS = (
    'mass_kg', 'per_kg', 'damping_n_s_per_m', 'cell_n_per_m', 'gain_m_per_v', 'rest_v',
    'voltage_min_v', 'voltage_max_v', 'slew_v_per_s', 'dt_s',
)  # fmt: skip
CURVE_NUMBERS = ('cells_per_m', 'core_m', 'limit_m', 'force_max_n', 'energy_max_j')
CAPACITY = 1024


def _form(doubles: str, *others: tuple[Any, ...]) -> Any:
    return np.dtype([*((name, np.float64) for name in doubles.split()), *others])


PLANT = _form(' '.join((*PLANT_NUMBERS, *CURVE_NUMBERS)), ('cells', 'u8'), ('cell_count', 'i8'))
WAVE = _form('start_v rise_v period_s', ('cycles', 'i8'))
MEMORY = _form('u_m force_n sense lost_j base_j', ('depth', 'i8'), ('stack', 'f8', 2 * CAPACITY))
STATE = _form(
    'ramp_s start_m start_m_s', ('cycle', 'i8'), ('numbers', 'f8', 8), ('memory', MEMORY)
)
"""The structures of drive.c; the first of the numbers of a state is its voltage."""


class InC:
    """The drive of ``Ours`` in C, by what ``compiled`` gave, over the same cycles."""

    def __init__(self, library: ctypes.CDLL, ours: Ours) -> None:
        plant, wave = ours.plants[0], ours.wave
        curve = plant.contacts[ALL].curve
        assert plant.only_long_steps
        self.work_s = ours.work_s
        self._advance = library.advance
        self._advance.argtypes = (
            *(ctypes.c_void_p,) * 3, *(ctypes.c_double,) * 2, ctypes.c_void_p, ctypes.c_long,
        )  # fmt: skip
        self._cells = np.array(curve.cells, dtype=np.float64, order='C')
        numbers = [getattr(plant, name) for name in PLANT_NUMBERS]
        numbers += [getattr(curve, name) for name in CURVE_NUMBERS]
        self._plant = np.array((*numbers, self._cells.ctypes.data, len(self._cells)), PLANT)
        self._wave = np.array((wave.start_v, wave.rise_v, wave.period_s, wave.cycles), WAVE)
        self._log = np.zeros((round(ours.work_s / PERIOD_S), 3))

    def __call__(self) -> Array:
        """Run, and return the mean force of every cycle, N."""
        state: Any = np.zeros((), STATE)
        state['numbers'][0] = self._plant['rest_v']
        state['memory']['sense'] = 1.0
        time_s = self.work_s
        places = [each.ctypes.data for each in (self._plant, state, self._wave)]
        while state['cycle'] < len(self._log):
            if not self._advance(*places, 0.0, time_s, self._log.ctypes.data, len(self._log)):
                raise RuntimeError(f'{SOURCE.name}: more than {CAPACITY} turning points')
            time_s = ROUNDING_S
        return np.asarray(self._plant['cell_n_per_m'] * self._log[:, RAMP_MEAN])


@contextmanager
def compiled(compiler: str, way: str) -> Iterator[ctypes.CDLL]:
    """Compile drive.c with one of ARITHMETIC, and give it as a library."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, 'drive.so')
        words = [*FLAGS, *ARITHMETIC[way], str(SOURCE), '-o', str(library), '-lm']
        subprocess.run([compiler, *words], check=True)
        yield ctypes.CDLL(str(library))


def c_compiler() -> str | None:
    """Return the C compiler on the path, if there is one."""
    return shutil.which('cc') or shutil.which('gcc') or shutil.which('clang')


def run(sizes: Sizes) -> Outcome:
    """Compare at the default step, where there is a C compiler."""
    compiler = c_compiler()
    if compiler is None:
        return Outcome(TITLE, [], [], ['left out: no C compiler is on the path'])
    cycles = MORE_CYCLES * sizes.cycles
    converged_n = Ours(standard_case({'sim.dt': sizes.converged_s}), cycles)()
    parameters = standard_case()
    ours = Ours(parameters, cycles)
    with ExitStack() as stack:
        runs: dict[str, Callable[[], Array]] = {'ours': ours}
        for way in ARITHMETIC:
            runs[way] = InC(stack.enter_context(compiled(compiler, way)), ours)
        times = in_turn([Program(run, ours.work_s) for run in runs.values()], sizes)
        forces_n = [run() for run in runs.values()]
    rows: list[Row] = []
    for i, name in enumerate(runs):
        ratios = times.ratios(0, i)
        rows.append(
            {
                'program': name,
                'longest_step': f'{parameters.sim.dt * 1e6:g} us',
                'times_real_time': 1.0 / times.median(i),
                'ours_over_this': float(np.median(ratios)),
                'lowest': float(ratios.min()),
                'highest': float(ratios.max()),
                'worst_error': worst_error(forces_n[i], converged_n),
                'difference': worst_error(forces_n[i], forces_n[0]),
            }
        )
    return Outcome(
        TITLE,
        rows,
        [],
        [
            f'{cycles} cycles; benchmarks/drive.c, {Path(compiler).name} {" ".join(FAST)}',
            'difference: from ours; fused: -ffp-contract=fast; reordered: sums and divisions too',
            'ours counts its passes, can forget turning points and can meet walls; C does not',
        ],
    )
