"""Checks of the Coulomb limit in the drive: a free runner under a load below and above it."""

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.validation.bank_history import LIMIT_PER_PRELOAD
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Scale,
    Tolerance,
    compare,
    compare_worst,
)

PRELOAD_N, MASS_KG = 0.5, 3e-3
SHARES = (0.5, 1.2)
"""Loads below and above the limit, as shares of it."""
BLOCKS, BLOCK_S = 20, 1e-3
FIRST_STEP = Tolerance(
    3e-4, 'half a step of 0.6 us without friction, times 5 for the small excess'
)
STILL = Tolerance(1e-8, 'half a step of 0.6 us without friction, out of 20 ms, squared')


def coulomb() -> list[Check]:
    """Check that the runner rests under the lesser load and that the greater one moves it."""
    limit_n = LIMIT_PER_PRELOAD * PRELOAD_N
    time_s = BLOCKS * BLOCK_S
    resting, sliding = (_loaded(share * limit_n) for share in SHARES)
    free_m = 0.5 * SHARES[0] * limit_n / MASS_KG * time_s**2
    excess_n = (SHARES[1] - 1.0) * limit_n
    moved_m = 0.5 * excess_n / MASS_KG * time_s**2
    slides_n = float(sliding.state.contact_n)
    free = Scale(free_m, 'the way without friction')
    half, more = 'Coulomb, load of half the limit', 'Coulomb, load of 1.2 limits'
    rest_m = float(resting.state.position_m)
    return [
        compare_worst(f'{half}: motion', 'rest', [0.0], [rest_m], 'm', STILL, free),
        compare(f'{more}: force', 'mu 2 sqrt2 F_p', limit_n, slides_n, 'N', ROUNDING),
        compare(
            f'{more}: motion',
            '(F_ext - mu 2 sqrt2 F_p) t^2/(2 m)',
            moved_m,
            float(sliding.state.position_m),
            'm',
            FIRST_STEP,
        ),
    ]


def _loaded(load_n: float) -> Bench:
    """Return a bench whose free runner a constant load has pulled."""
    values = {'contact.law': 'coulomb', 'load_cell.contact': 'absent'}
    bench = Bench(Parameters().updated({**values, 'stand.preload': PRELOAD_N}))
    requests = [Request('load', (load_n, 0.0, 0.0, 0.0, 0.0, 0.0))]
    for _ in range(BLOCKS):
        bench.update(bench.time_ns + bench.parameters.block_ns, requests)
        requests = []
    return bench
