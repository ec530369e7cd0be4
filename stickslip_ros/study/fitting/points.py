"""Measured forces that a fit is made to, and the CSV file that they stand in."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import RecordingError
from stickslip_ros.study.experiment import read_experiment

NEEDED = ('preload_n', 'amplitude_m', 'force_n')
FREQUENCY, SIGMA = 'frequency_hz', 'force_sigma_n'
DEFAULT_FREQUENCY_HZ = 1000.0
EXAMPLE = f'its first line names the columns: {",".join(NEEDED)}, and may name {FREQUENCY},{SIGMA}'


@dataclass(frozen=True, eq=False)
class Points:
    """
    Generated forces of a drive at some preloads, amplitudes and frequencies.

    Attributes
    ----------
    preload_n, amplitude_m, frequency_hz : array, shape (points,)
        What was set.
    force_n : array, shape (points,)
        Mean force on the load cell that was read.
    sigma_n : array, shape (points,), or None
        Standard errors of the readings; None if they are not known.

    """

    preload_n: Array
    amplitude_m: Array
    frequency_hz: Array
    force_n: Array
    sigma_n: Array | None = None

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.force_n)

    @property
    def largest_n(self) -> float:
        """Largest measured force, N."""
        return float(np.max(np.abs(self.force_n)))

    @property
    def scale_n(self) -> Array:
        """What residuals are divided by, N: the standard errors, or one force for all points."""
        if self.sigma_n is not None:
            return self.sigma_n
        return np.full(len(self), self.largest_n)


def read_points(path: Path, frequency_hz: float = DEFAULT_FREQUENCY_HZ) -> Points:
    """
    Read an experiment by amplitude.

    Parameters
    ----------
    path : Path
        CSV file with a header, as docs/compare.md says.
    frequency_hz : float
        Frequency of the points if the file has no such column.

    Raises
    ------
    StickSlipError
        If the file cannot be read, has no forces, or all forces are 0.

    """
    experiment = read_experiment(path)
    columns = experiment.columns
    for name in NEEDED:
        if name not in columns:
            raise RecordingError(path, f'has no column {name}', EXAMPLE)
    points = Points(
        preload_n=columns['preload_n'],
        amplitude_m=columns['amplitude_m'],
        frequency_hz=columns.get(FREQUENCY, np.full(len(columns['force_n']), frequency_hz)),
        force_n=columns['force_n'],
        sigma_n=columns.get(SIGMA),
    )
    if points.largest_n == 0.0:
        raise RecordingError(path, 'has no force other than 0', 'check the column force_n')
    return points
