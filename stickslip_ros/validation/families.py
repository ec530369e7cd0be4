"""The families of checks, in the order of the table."""

from collections.abc import Callable, Sequence

from stickslip_ros.stopping import heed_stop
from stickslip_ros.validation.contact_case import contact_case
from stickslip_ros.validation.energy import energy
from stickslip_ros.validation.findings import Findings
from stickslip_ros.validation.friction_laws import friction_laws
from stickslip_ros.validation.hysteresis import hysteresis
from stickslip_ros.validation.jaeger import jaeger
from stickslip_ros.validation.normal_load import normal_load
from stickslip_ros.validation.ring_down import ring_down
from stickslip_ros.validation.roughness import roughness
from stickslip_ros.validation.spectra import spectra
from stickslip_ros.validation.spring_bank import spring_bank
from stickslip_ros.validation.tables import tables
from stickslip_ros.validation.tangential import tangential
from stickslip_ros.validation.three_dimensions import three_dimensions

Family = Callable[[], Findings]

FAMILIES: tuple[Family, ...] = (
    normal_load,
    roughness,
    tables,
    tangential,
    hysteresis,
    energy,
    jaeger,
    three_dimensions,
    contact_case,
    spectra,
    ring_down,
    spring_bank,
    friction_laws,
)
"""A new family is a function without arguments that returns Findings, and one line here."""


def validate(families: Sequence[Family] | None = None) -> tuple[Findings, ...]:
    """
    Run families of checks.

    Parameters
    ----------
    families : sequence of callable, optional
        FAMILIES if None.

    """
    return tuple(_heeding(family) for family in (FAMILIES if families is None else families))


def _heeding(family: Family) -> Findings:
    heed_stop()
    return family()
