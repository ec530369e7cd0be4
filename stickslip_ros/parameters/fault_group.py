"""Faults of the stand: the parameters that may change while the drive runs."""

from dataclasses import dataclass

from stickslip_ros.parameters.fields import (
    ASSUMED,
    Checked,
    choice,
    count,
    quantity,
    switch,
    words,
)

SENSOR_FAULTS = ('none', 'freeze', 'dropout')


@dataclass(frozen=True)
class FaultParameters(Checked):
    """What is broken at the moment; ``~/clear_faults`` mends it."""

    interferometer: str = choice(
        'none',
        SENSOR_FAULTS,
        ASSUMED,
        'position reading that stands still, or is not a number',
        live=True,
    )
    interferometer_offset: float = quantity(
        0.0, 'm', -1.0, 1.0, ASSUMED, 'jump of the position reading', live=True
    )
    load_cell: str = choice(
        'none',
        SENSOR_FAULTS,
        ASSUMED,
        'force reading that stands still, or is not a number',
        live=True,
    )
    load_cell_offset: float = quantity(
        0.0, 'N', -1e3, 1e3, ASSUMED, 'jump of the force reading', live=True
    )
    amplifier_off: bool = switch(
        False, ASSUMED, 'amplifier without power: the piezo goes to the lowest voltage', live=True
    )
    dead_foot: int = count(
        0,
        '',
        0,
        6,
        ASSUMED,
        'foot that no longer moves, 1 and 2 above, 3 to 6 below; 0 is none',
        live=True,
    )
    runner_stuck: bool = switch(False, ASSUMED, 'runner that does not move', live=True)
    missed_steps: float = quantity(
        0.0, '', 0.0, 1.0, ASSUMED, 'share of the steps that the amplifier leaves out', live=True
    )
    command_delay: float = quantity(
        0.0, 's', 0.0, 10.0, ASSUMED, 'time that a command takes to arrive', live=True
    )
    schedule: str = words('', ASSUMED, 'YAML file of faults and their times; empty is none')

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the faults that there are, in the order of declaration."""
        return tuple(
            name
            for name, field in self.__dataclass_fields__.items()
            if field.metadata['spec'].live and getattr(self, name) != field.default
        )
