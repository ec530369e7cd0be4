"""What the log of a drive's ramps says: force, step length, whether they are steady."""

from stickslip_ros.contact.kernel import in_python
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, RAMP_START
from stickslip_ros.drive.walls import cell_force

STEADY_STEPS_MIN = 200
"""Steps before a run may be called steady."""
STEADY_WINDOW = 20
"""Steps over which a steady value may change by STEADY_CHANGE of itself."""
STEADY_CHANGE = 1e-3
STEADY_STEPS_MAX = 5000
"""Steps after which a run that looks for the steady state gives up."""
STEP_LENGTH_CYCLES = 10
"""Last cycles over which the step length is averaged."""


def is_steady(plant: Record, ramps: Array) -> bool:
    """
    Tell whether a run has become steady.

    Parameters
    ----------
    plant : record of PLANT
        The drive. With a load cell the mean force counts, which a one-sided one must show;
        without, the steps of the runner.
    ramps : array, shape (steps, 3)
        Log of the ramps: position after the fall, mean and final position, m.

    """
    if len(ramps) < STEADY_STEPS_MIN:
        return False
    if plant.cell_n_per_m > 0.0 or plant.walls.cell_n_per_m > 0.0:
        now, before = mean_force_n(plant, ramps), mean_force_n(plant, ramps[:-STEADY_WINDOW])
        touches = plant.cell_n_per_m > 0.0 or now > 0.0
    else:
        ends = ramps[:, RAMP_END]
        now = float(ends[-1] - ends[-1 - STEP_LENGTH_CYCLES])
        before = float(ends[-1 - STEADY_WINDOW] - ends[-1 - STEADY_WINDOW - STEP_LENGTH_CYCLES])
        touches = True
    return bool(touches and abs(now - before) <= STEADY_CHANGE * abs(now))


def mean_force_n(plant: Record, ramps: Array) -> float:
    """Return the force in the load cell at the mean position of the last cycle, N."""
    return float(in_python(cell_force)(plant, float(ramps[-1, RAMP_MEAN])))


def start_force_n(plant: Record, ramps: Array) -> float:
    """Return the force in the load cell at the start of the last ramp, its fall being over, N."""
    return float(in_python(cell_force)(plant, float(ramps[-1, RAMP_START])))


def step_length_m(ramps: Array) -> float:
    """Return the net motion per cycle over the last cycles, m; a first cycle starts at 0."""
    cycles = min(STEP_LENGTH_CYCLES, len(ramps))
    start_m = float(ramps[-1 - cycles, RAMP_END]) if cycles < len(ramps) else 0.0
    return (float(ramps[-1, RAMP_END]) - start_m) / cycles
