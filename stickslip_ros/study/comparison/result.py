"""What a comparison comes to: a tree of numbers, all of B minus A in SI units."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar

AMPLITUDE, TIME = 'amplitude_m', 'time_s'
"""The two axes along which things are compared."""
UNITS = {'n': 'N', 'm': 'm', 'v': 'V', 'j': 'J', 's': 's', 'hz': 'Hz'}


@dataclass(frozen=True)
class ChiSquare:
    """
    The difference measured by its uncertainty.

    Attributes
    ----------
    chi_square : float
        Sum of the squares of (B - A) / sigma.
    degrees_of_freedom : int
        Number of points; nothing was fitted.
    p_value : float
        Probability of a sum at least so large by chance alone.
    largest_residual : float
        (B - A) / sigma of the point where it is largest in size.
    within_one_sigma, within_two_sigma : float
        Shares of the points; 0.683 and 0.954 are expected of normal noise.

    """

    chi_square: float
    degrees_of_freedom: int
    p_value: float
    largest_residual: float
    within_one_sigma: float
    within_two_sigma: float


@dataclass(frozen=True)
class Agreement:
    """
    How far B is from A.

    Attributes
    ----------
    points : int
        Number of compared points.
    bias : float
        Mean of B - A.
    rms : float
        Root mean square of B - A.
    largest : float
        B - A where it is largest in size.
    largest_at : dict of str to scalar
        Where that is.
    correlation : float or None
        Pearson's coefficient; None if A or B is constant.
    relative_rms : float or None
        ``rms`` over the range of A; None if A is constant.
    chi_square : ChiSquare or None
        None unless uncertainties are known.

    """

    points: int
    bias: float
    rms: float
    largest: float
    largest_at: dict[str, Scalar]
    correlation: float | None
    relative_rms: float | None
    chi_square: ChiSquare | None


@dataclass(frozen=True, eq=False)
class Curve:
    """
    What was compared, point by point.

    Attributes
    ----------
    x : array, shape (n,)
        Amplitude or time of A's points.
    a, b : array, shape (n,)
        A, and B interpolated onto A's points.
    sigma : array, shape (n,), or None
        Uncertainty of B - A.

    """

    x: Array
    a: Array
    b: Array
    sigma: Array | None

    @property
    def difference(self) -> Array:
        """B - A."""
        return self.b - self.a


@dataclass(frozen=True)
class Threshold:
    """
    What is read off one force curve, of its own points.

    Attributes
    ----------
    zero_amplitude_m : float or None
        Where the line through the rising flank meets zero force; None without a flank.
    saturation : float
        Largest force.
    saturation_at_m : float
        Amplitude of that.

    """

    zero_amplitude_m: float | None
    saturation: float
    saturation_at_m: float


@dataclass(frozen=True)
class Part:
    """
    One stretch of a quantity: one preload of a sweep, or a whole run.

    Attributes
    ----------
    at : dict of str to scalar
        Preload, and what else varies; empty for a run.
    agreement : Agreement
        How far B is from A here.
    threshold_a, threshold_b : Threshold or None
        Of forces by amplitude.
    curve : Curve
        The points.

    """

    at: dict[str, Scalar]
    agreement: Agreement
    threshold_a: Threshold | None
    threshold_b: Threshold | None
    curve: Curve


@dataclass(frozen=True)
class Compared:
    """A quantity: its name with its unit, all its points, and its parts."""

    name: str
    agreement: Agreement
    parts: tuple[Part, ...]
    left_out: int

    @property
    def unit(self) -> str:
        """SI unit of the quantity."""
        return UNITS[self.name.rpartition('_')[2]]


@dataclass(frozen=True)
class Side:
    """
    One of the two.

    Attributes
    ----------
    origin : str
        Its file, or ``model``.
    kind : str
        What that is, in words.
    rows : int
        Rows of a table; samples of the finest quantity of a run.
    described : dict of str to scalar
        Everything that is known of it: parameters, seed, versions, columns with one value.
    changed : dict of str to scalar or None
        Parameters that differ from the default; None if the file does not say.
    notes : tuple of str
        Comments of an experiment file, and runs that were not steady.

    """

    origin: str
    kind: str
    rows: int
    described: dict[str, Scalar]
    changed: dict[str, Scalar] | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Difference:
    """A parameter, seed or version that A and B both name and do not share."""

    name: str
    a: Scalar
    b: Scalar


@dataclass(frozen=True)
class Alignment:
    """
    How B was moved in time.

    Attributes
    ----------
    shift_s : float
        Added to the times of B.
    method : str
        ``given`` or ``estimated``.
    correlation : float or None
        Of the estimate: mean of the coefficients of all quantities at the best whole sample.
    sample_s : float or None
        Of the estimate: spacing of the samples that were compared.

    """

    shift_s: float
    method: str
    correlation: float | None = None
    sample_s: float | None = None


@dataclass(frozen=True)
class Comparison:
    """
    The whole comparison.

    Attributes
    ----------
    a, b : Side
        What was compared.
    axis : str
        AMPLITUDE or TIME.
    differences : tuple of Difference
        What they say of themselves differently.
    alignment : Alignment or None
        None if times were taken as they are.
    quantities : tuple of Compared
        The numbers.

    """

    a: Side
    b: Side
    axis: str
    differences: tuple[Difference, ...]
    alignment: Alignment | None
    quantities: tuple[Compared, ...]

    def to_json(self) -> dict[str, Any]:
        """Return what JSON can say; the points themselves only along amplitudes."""
        content = dataclasses.asdict(self)
        for side in (content['a'], content['b']):
            del side['described']
        for quantity, told in zip(self.quantities, content['quantities'], strict=True):
            told['unit'] = quantity.unit
            for part, told_part in zip(quantity.parts, told['parts'], strict=True):
                told_part['curve'] = self._told_curve(part.curve)
        return content

    def _told_curve(self, curve: Curve) -> dict[str, Any] | None:
        if self.axis == TIME:
            return None
        sigma = None if curve.sigma is None else curve.sigma.tolist()
        return {
            self.axis: curve.x.tolist(),
            'a': curve.a.tolist(),
            'b': curve.b.tolist(),
            'sigma': sigma,
        }


def differences_of(a: Side, b: Side) -> tuple[Difference, ...]:
    """Return what both sides say of themselves and say differently, in A's order."""
    return tuple(
        Difference(name, value, b.described[name])
        for name, value in a.described.items()
        if name in b.described and b.described[name] != value
    )
