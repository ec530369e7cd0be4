# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The sensors of the stand, from true values to readings."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import VOLTAGE
from stickslip_ros.instrument import sensors
from stickslip_ros.instrument.reports import FIRST_READING, Readings
from stickslip_ros.instrument.sensors.interferometer import Interferometer
from stickslip_ros.instrument.sensors.reader import Reader
from stickslip_ros.kernels.kernel import entry_point, with_types_kept
from stickslip_ros.parameters import SENSORS, FaultParameters, Parameters
from stickslip_ros.units import NANO

CLASSES: dict[str, type[Reader]] = {
    row.name: getattr(
        import_module(f'{sensors.__name__}.{row.name}'),
        row.group.__name__.removesuffix('Parameters'),
    )
    for row in SENSORS
}
"""Class of each sensor, by its name: LoadCell of the module ``load_cell``."""


@with_types_kept
@entry_point
def fill_times(trace: Array, start_ns: int, sample_ns: int) -> None:
    """Fill the first column of a trace with the times of its samples, s."""
    for i in range(len(trace)):
        trace[i, 0] = (start_ns + (i + 1) * sample_ns) * NANO


class Sensing:
    """All sensors as attributes; those that are not installed stay at rest."""

    REMEMBERED: ClassVar[Mapping[str, Any]] = {
        **CLASSES,
        '_faults': FaultParameters,
        'reading_m': float | None,
    }
    interferometer: Interferometer
    load_cell: Reader

    def __init__(self, parameters: Parameters) -> None:
        installed = parameters.sensors
        for row in SENSORS:
            column = FIRST_READING + installed.index(row) if row in installed else 0
            setattr(self, row.name, CLASSES[row.name](row, column, parameters))
        # In reverse order, because the first sensors overwrite true values that others measure.
        self._readers: list[Reader] = [getattr(self, row.name) for row in installed[::-1]]
        # Whether a status bit of a sensor can begin or end within blocks.
        self.may_alarm = any(reader.may_alarm for reader in self._readers)
        self._sample_ns = parameters.sample_ns
        self._samples = parameters.block_ns // parameters.sample_ns
        self._faults = FaultParameters()
        self.reading_m: float | None = 0.0  # position at the end of the last update, if known

    @property
    def position_m(self) -> float:
        """Mean position reading of the last block, m; NaN without a reading."""
        return self.interferometer.position_m

    def reset(self) -> None:
        """Return to the start: rest at zero, no tare, a beam, and the same noise again."""
        for reader in self._readers:
            reader.reset()
        self._faults = FaultParameters()
        self.reading_m = 0.0

    def recall(self, values: dict[str, Any]) -> None:
        self._apply_faults(values.pop('_faults'))
        self.reading_m = values.pop('reading_m')
        for name, memory in values.items():
            getattr(self, name).recall(memory)

    def read(self, trace: Array, end_ns: int, faults: FaultParameters) -> Readings:
        """
        Fill times and readings into a trace of true values; return its readings.

        It may hold several blocks unless the sensors ``may_alarm``, as status bits are of the end.

        """
        if faults is not self._faults:
            self._apply_faults(faults)
        fill_times(trace, end_ns - len(trace) * self._sample_ns, self._sample_ns)
        truth = trace[-1].copy()
        for reader in self._readers:
            reader.read(trace)
        self.interferometer.keep(trace[-self._samples :])
        return Readings(end_ns, truth.item(VOLTAGE), trace, truth)

    def _apply_faults(self, faults: FaultParameters) -> None:
        self._faults = faults
        for reader in self._readers:
            reader.apply_faults(faults)

    @property
    def status_bits(self) -> int:
        bits = 0
        for reader in self._readers:
            bits |= reader.status_bits
        return bits
