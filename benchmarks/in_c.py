"""The same algorithm as ours in plain C: what a compiler without numba makes of it."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from benchmarks.case import PERIOD_S, ROUNDING_S, Ours, ours_at, standard_case, worst_error
from benchmarks.clock import Array, Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.drive.advance import RAMP_MEAN
from stickslip_ros.drive.records import ALL

SOURCE = Path(__file__).resolve().with_name('drive.c')
FAST = ('-O3', '-march=native', '-fno-tree-slp-vectorize')
"""Without the last one gcc 12 packs numbers that do not belong together: a sixth slower."""
FLAGS = (*FAST, '-std=c11', '-Wall', '-Wextra', '-Werror', '-shared', '-fPIC')
AS_WRITTEN, FUSED, REORDERED = 'C', 'C, fused', 'C, fused and reordered'
ARITHMETIC = {
    AS_WRITTEN: ('-ffp-contract=off',),
    FUSED: ('-ffp-contract=fast',),
    REORDERED: (
        '-ffp-contract=fast',
        '-fassociative-math',
        '-freciprocal-math',
        '-fno-signed-zeros',
        '-fno-trapping-math',
    ),
}
"""As written each operation rounds, as ours do, and the bits are the same. Fused, a multiplication
and an addition round once; reordered, the compiler also calculates in another order."""
MORE_CYCLES = 10
"""Times as many cycles as other benchmarks run, so that calls and fresh states are nothing."""
TITLE = 'The same algorithm in plain C, equivalent rough profile'
MEMORY_NUMBERS = ('u_m', 'force_n', 'sense', 'lost_j', 'base_j')
STATE_NUMBERS = (
    'voltage_v', 'foot_m', 'position_m', 'velocity_m_per_s',
    'feet_work_j', 'load_work_j', 'damping_lost_j', 'position_m_s',
)  # fmt: skip
PLANT_NUMBERS = (
    'mass_kg', 'per_kg', 'damping_n_s_per_m', 'cell_n_per_m', 'gain_m_per_v', 'rest_v',
    'voltage_min_v', 'voltage_max_v', 'slew_v_per_s', 'dt_s',
)  # fmt: skip
CURVE_NUMBERS = ('cells_per_m', 'core_m', 'limit_m', 'force_max_n', 'energy_max_j')
CAPACITY = 1024


def _doubles(*names: str) -> list[tuple[str, type]]:
    return [(name, ctypes.c_double) for name in names]


class CPlant(ctypes.Structure):
    """Plant of drive.c."""

    _fields_ = (
        *_doubles(*PLANT_NUMBERS, *CURVE_NUMBERS),
        ('cells', ctypes.c_void_p),
        ('cell_count', ctypes.c_long),
    )


class CWave(ctypes.Structure):
    """Wave of drive.c."""

    _fields_ = (*_doubles('start_v', 'rise_v', 'period_s'), ('cycles', ctypes.c_long))


class CMemory(ctypes.Structure):
    """Memory of drive.c."""

    _fields_ = (
        *_doubles(*MEMORY_NUMBERS),
        ('depth', ctypes.c_long),
        ('stack', ctypes.c_double * (2 * CAPACITY)),
    )


class CState(ctypes.Structure):
    """State of drive.c."""

    _fields_ = (
        *_doubles('ramp_s', 'start_m', 'start_m_s'),
        ('cycle', ctypes.c_long),
        *_doubles(*STATE_NUMBERS),
        ('memory', CMemory),
    )


class InC:
    """
    The drive of ``Ours`` in C, over the same cycles.

    Parameters
    ----------
    library : CDLL
        What ``compiled`` gave.
    ours : Ours
        Gives plant and wave.

    Attributes
    ----------
    state : CState
        State after the last run.

    """

    def __init__(self, library: ctypes.CDLL, ours: Ours) -> None:
        plant = ours.plants[0]
        curve = plant.contacts[ALL].curve
        assert plant.only_long_steps
        self.work_s = ours.work_s
        self.state = CState()
        self._advance = library.advance
        self._advance.argtypes = (
            *(ctypes.c_void_p,) * 3, *(ctypes.c_double,) * 2, ctypes.c_void_p, ctypes.c_long,
        )  # fmt: skip
        self._cells = np.array(curve.cells, dtype=np.float64, order='C')
        self._plant = CPlant(
            *(getattr(plant, name) for name in PLANT_NUMBERS),
            *(getattr(curve, name) for name in CURVE_NUMBERS),
            self._cells.ctypes.data,
            len(self._cells),
        )
        wave = ours.wave
        self._wave = CWave(wave.start_v, wave.rise_v, wave.period_s, wave.cycles)
        self._log = np.zeros((round(ours.work_s / PERIOD_S), 3))

    def __call__(self) -> Array:
        """Run, and return the mean force of every cycle, N."""
        self.state = CState()
        self.state.voltage_v = self._plant.rest_v
        self.state.memory.sense = 1.0
        time_s = self.work_s
        while self.state.cycle < len(self._log):
            if not self._advance(
                ctypes.byref(self._plant), ctypes.byref(self.state), ctypes.byref(self._wave),
                0.0, time_s, self._log.ctypes.data, len(self._log),
            ):  # fmt: skip
                raise RuntimeError(f'{SOURCE.name}: more than {CAPACITY} turning points')
            time_s = ROUNDING_S
        return np.asarray(self._plant.cell_n_per_m * self._log[:, RAMP_MEAN])


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
    """Compare, where there is a C compiler, at the default step and at the longest accurate."""
    compiler = c_compiler()
    if compiler is None:
        return Outcome(TITLE, [], [], ['left out: no C compiler is on the path'])
    cycles = MORE_CYCLES * sizes.cycles
    converged_n = Ours(standard_case({'sim.dt': sizes.converged_s}), cycles)()
    _, longest_s = ours_at({}, sizes.steps_s, cycles, converged_n)
    rows: list[Row] = []
    with ExitStack() as stack:
        libraries = {way: stack.enter_context(compiled(compiler, way)) for way in ARITHMETIC}
        for step_s in (standard_case().sim.dt, longest_s):
            rows += _rows(libraries, step_s, cycles, converged_n, sizes)
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


def _rows(
    libraries: Mapping[str, ctypes.CDLL],
    step_s: float,
    cycles: int,
    converged_n: Array,
    sizes: Sizes,
) -> list[Row]:
    """Return the rows of ours and of C at one step."""
    ours = Ours(standard_case({'sim.dt': step_s}), cycles)
    runs: dict[str, Callable[[], Array]] = {'ours': ours}
    runs |= {way: InC(library, ours) for way, library in libraries.items()}
    ours_n = ours()
    times = in_turn([Program(run, ours.work_s) for run in runs.values()], sizes)
    rows: list[Row] = []
    for i, (name, run) in enumerate(runs.items()):
        ratios, forces_n = times.ratios(0, i), run()
        rows.append(
            {
                'program': name,
                'longest_step': f'{step_s * 1e6:g} us',
                'times_real_time': 1.0 / times.median(i),
                'ours_over_this': float(np.median(ratios)),
                'lowest': float(ratios.min()),
                'highest': float(ratios.max()),
                'worst_error': worst_error(forces_n, converged_n),
                'difference': worst_error(forces_n, ours_n),
            }
        )
    return rows
