"""The piezo: voltage in, displacement of the contact points out."""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.drive.records import Plant


@kernel
def foot_displacement(plant: Plant, voltage_v: float) -> float:
    """Return the displacement x_s of the feet from their place at rest, m; linear."""
    return plant.gain_m_per_v * (voltage_v - plant.rest_v)
