"""Roughness as an equivalent axisymmetric body: Hess's factor and the Pohrt-Popov rule."""

import math

POHRT_POPOV = 1.9412
"""Number of the Pohrt-Popov rule, Eq. 16."""


def hess_factor(exponent: float) -> float:
    """
    Return kappa(n), by which Hess's rule stretches the profile Q r^n onto one dimension.

    Parameters
    ----------
    exponent : float
        n > 0.

    Notes
    -----
    g(x) = |x| int_0^|x| f'(r) / sqrt(x^2 - r^2) dr of f = Q r^n is kappa(n) Q |x|^n with
    kappa(n) = (sqrt(pi)/2) n Gamma(n/2) / Gamma((n+1)/2); kappa(1) = pi/2, kappa(2) = 2.

    """
    ratio = math.gamma(exponent / 2.0) / math.gamma((exponent + 1.0) / 2.0)
    return 0.5 * math.sqrt(math.pi) * exponent * ratio


def rough_prefactor_3d(rms_height_m: float, hurst: float, radius_m: float) -> float:
    """
    Return Q_3D of the axisymmetric body Q_3D r^H that presses like the rough surface (Eq. 16).

    Parameters
    ----------
    rms_height_m : float
        Root mean square of the heights h, m.
    hurst : float
        Hurst exponent H, in (0, 1].
    radius_m : float
        Radius R of the sphere, m; the system length is L = 2 R.

    Returns
    -------
    float
        Q_3D, m^(1-H).

    """
    length_m = 2.0 * radius_m
    slope = math.pow(2.0 * (hurst + 1.0) / (POHRT_POPOV * length_m), hurst + 1.0)
    return slope * (hurst + 1.0) * length_m / (2.0 * hurst * hess_factor(hurst)) * rms_height_m


def rough_prefactor_1d(rms_height_m: float, hurst: float, radius_m: float) -> float:
    """
    Return Q_1D = kappa(H) Q_3D of the one-dimensional profile Q_1D |x|^H (Eq. 17), m^(1-H).

    Parameters
    ----------
    rms_height_m : float
        Root mean square of the heights h, m.
    hurst : float
        Hurst exponent H, in (0, 1].
    radius_m : float
        Radius R of the sphere, m.

    """
    return hess_factor(hurst) * rough_prefactor_3d(rms_height_m, hurst, radius_m)
