"""The evidence: all checks, in the order of the table."""

from collections.abc import Callable, Sequence

from stickslip_ros.validation.checks import Family, Findings
from stickslip_ros.validation.drive import DRIVE
from stickslip_ros.validation.foreign import FOREIGN
from stickslip_ros.validation.friction_laws import FRICTION_LAWS
from stickslip_ros.validation.half_space import HALF_SPACE
from stickslip_ros.validation.load_curves import NORMAL_LOAD, TANGENTIAL_LOAD
from stickslip_ros.validation.memory import ENERGY, HYSTERESIS, RING_DOWN
from stickslip_ros.validation.published import CONTACT_CASE, REFERENCE_TABLE
from stickslip_ros.validation.roughness import ROUGHNESS, SPECTRA
from stickslip_ros.validation.spring_bank import SPRING_BANK
from stickslip_ros.validation.springs import ONE_BY_ONE

EVIDENCE: tuple[Family, ...] = (
    NORMAL_LOAD,
    ROUGHNESS,
    REFERENCE_TABLE,
    TANGENTIAL_LOAD,
    HYSTERESIS,
    ENERGY,
    ONE_BY_ONE,
    HALF_SPACE,
    CONTACT_CASE,
    FOREIGN,
    SPECTRA,
    RING_DOWN,
    SPRING_BANK,
    FRICTION_LAWS,
    DRIVE,
)
"""``stickslip validate``, the table of docs/validation.md and the tests read this list."""


def validate(
    families: Sequence[Family] | None = None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> tuple[Findings, ...]:
    """Run families of checks, all of EVIDENCE if None; tell how many are done, and of how many."""
    chosen = EVIDENCE if families is None else families
    findings: list[Findings] = []
    for family in chosen:
        progress(len(findings), len(chosen))
        findings.append(family.run())
    return tuple(findings)
