"""Parameters of time, stand and runner."""

from dataclasses import dataclass

from stickslip_ros.parameters.fields import ASSUMED, TABLE_1, Checked, count, quantity, switch


@dataclass(frozen=True)
class SimParameters(Checked):
    """How time runs: the step inside, the block outside, the pace."""

    dt: float = quantity(
        5e-6,
        's',
        1e-8,
        2e-5,
        ASSUMED,
        'longest step; shorter if the runner swings fast, in falls, on springs, for rival laws',
    )
    block: float = quantity(
        1e-3,
        's',
        1e-4,
        0.1,
        ASSUMED,
        'time per update: period of position and force, and of commands',
    )
    seed: int = count(1, '', 0, 2**31 - 1, ASSUMED, 'seed of every random number')
    real_time_factor: float = quantity(
        1.0,
        '',
        0.0,
        1000.0,
        ASSUMED,
        'simulated seconds per wall-clock second; 0 is as fast as possible',
    )
    publish_clock: bool = switch(
        False, ASSUMED, 'publish simulated time on /clock; not together with use_sim_time'
    )
    publish_truth: bool = switch(
        False, ASSUMED, 'publish what the sensors look at, without their errors, on truth/...'
    )
    lockstep: bool = switch(
        False, ASSUMED, 'advance only as far as command/grant allows: same bytes at any speed'
    )


@dataclass(frozen=True)
class StandParameters(Checked):
    """The frame that holds the six hemispheres."""

    preload: float = quantity(
        0.5,
        'N',
        1e-3,
        100.0,
        'Section 2',
        'preload F_p of the external spring; 0.1 to 1 N in the paper',
    )
    preload_end: float = quantity(
        0.0, 'N', 0.0, 100.0, ASSUMED, 'preload to ramp to from the start on; 0 keeps the preload'
    )
    preload_rate: float = quantity(
        1.0, 'N/s', 1e-6, 1e6, ASSUMED, 'rate at which the preload changes when asked to'
    )
    preload_limit: float = quantity(
        2.0, 'N', 1e-3, 100.0, ASSUMED, 'largest preload that a command may ask for'
    )
    load_limit: float = quantity(
        10.0, 'N', 0.0, 1000.0, ASSUMED, 'largest external force that a command may ask for'
    )
    travel_min: float = quantity(-5e-3, 'm', -1.0, -1e-7, ASSUMED, 'place of the lower end stop')
    travel_max: float = quantity(5e-3, 'm', 1e-7, 1.0, ASSUMED, 'place of the upper end stop')
    stop_stiffness: float = quantity(
        0.0,
        'N/m',
        0.0,
        1e9,
        ASSUMED,
        'stiffness of the end stops; 0 is a runner without end stops',
    )


@dataclass(frozen=True)
class RunnerParameters(Checked):
    """The moving body."""

    mass: float = quantity(3e-3, 'kg', 1e-6, 10.0, TABLE_1, 'mass m of the runner')
    damping: float = quantity(
        0.0, 'N s/m', 0.0, 1e4, ASSUMED, 'viscous damping c of the runner; the paper names none'
    )
