"""
Kernel: feet with a mass, each on the stiffness of its own stack, which the contact bends.

m z'' = -k (z - d) - 2 D w m z' + F - m y'', k = m w^2: z is the displacement of the foot against
the frame, d that which its voltage wants, F the force with which its contact drags it along, y the
displacement of the frame. A load is to the foot another d, by F/k: both move it as an exact
oscillator does, along a straight line.

"""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.feet import Path, bends, moving, ratio_of, way_on
from stickslip_ros.drive.frame import holding_force
from stickslip_ros.drive.oscillator import SIXTH
from stickslip_ros.drive.piezo import Ring, free_ring, swing_along


@kernel
def feet_ahead(
    plant: Record, state: Record, path: Path, recoil: float, past_speed: float, h_s: float
) -> Ring:
    """
    Let the feet go ahead in a step; return what half of it rings.

    The frame has an acceleration, and loads grow as the stiffness of the contacts says with which
    the runner goes past the frame at a speed.

    """
    piezo, half_s = plant.piezo, 0.5 * h_s
    ring = free_ring(piezo.omega_per_s, piezo.damping_ratio, half_s)
    inert_m = recoil / (piezo.omega_per_s * piezo.omega_per_s)
    for k in moving(plant):
        foot, start_m, ratio = state.feet[k], state.places_m[k], ratio_of(plant, k)
        bent_m = state.contacts[k].memory.force_n / piezo.stack_n_per_m - inert_m
        foot.n_per_s = foot.stiffness * (past_speed - foot.speed)
        grows_m = foot.n_per_s / piezo.stack_n_per_m
        drive_0 = state.offsets_m[k] + ratio * state.foot_m + bent_m
        drive_1 = drive_0 + ratio * way_on(path, half_s) + grows_m * half_s
        drive_2 = drive_0 + ratio * way_on(path, h_s) + grows_m * h_s
        speed = foot.m_per_s
        foot.before_n = state.contacts[k].memory.force_n
        foot.middle_m, foot.middle_m_per_s = swing_along(
            piezo, start_m, speed, drive_0, drive_1, ring, half_s
        )
        foot.end_m, foot.end_m_per_s = swing_along(
            piezo, foot.middle_m, foot.middle_m_per_s, drive_1, drive_2, ring, half_s
        )
        bow_m = (foot.end_m - foot.middle_m) - (foot.middle_m - start_m)
        foot.speeding = bow_m / (half_s * half_s)
        foot.speed = (foot.end_m - start_m) / h_s - half_s * foot.speeding
    return ring


@kernel
def recoil_of(
    plant: Record, state: Record, part: int, foot_m: float, frame_m: float, centre_w: float
) -> float:
    """
    Return the acceleration of the frame, m/s^2, at the start, middle or end of a step: 0, 1, 2.

    What the frame gets from its feet it gives them back: both follow from one equation.

    """
    piezo, frame, pull, mean_speed = plant.piezo, plant.frame, 0.0, 0.0
    for k in moving(plant):
        foot = state.feet[k]
        speed = foot.m_per_s
        if part > 0:
            speed = foot.middle_m_per_s if part == 1 else foot.end_m_per_s
        bent_m = state.places_m[k] - state.offsets_m[k] - ratio_of(plant, k) * foot_m
        force_n = foot.load_n - piezo.stack_n_per_m * bent_m
        pull += force_n / piezo.foot_kg - 2.0 * piezo.damping_ratio * piezo.omega_per_s * speed
        mean_speed += speed / len(moving(plant))
    share = frame.feet_share
    held_n = holding_force(frame, frame_m, centre_w - share * mean_speed)
    own = (state.contact_n - held_n) * frame.per_kg
    return (own - share * pull / len(moving(plant))) / (1.0 - share)


@kernel
def pulled_by_feet(plant: Record, state: Record) -> Path:
    """Return how all feet pull, N/s and N/s^2."""
    n_per_s, n_per_s2 = 0.0, 0.0
    for k in moving(plant):
        foot = state.feet[k]
        n_per_s += foot.stiffness * foot.speed
        n_per_s2 += foot.stiffness * foot.speeding
    return Path(n_per_s, n_per_s2)


@kernel
def place_at_end(plant: Record, state: Record, ring: Ring, recoil: float, h_s: float) -> None:
    """Bring the feet to the end of the step, with what loads and recoil in its middle add."""
    for k in moving(plant):
        foot = state.feet[k]
        missed = foot.load_n - foot.before_n - 0.5 * h_s * foot.n_per_s
        foot.missed = missed / plant.piezo.foot_kg - recoil
        foot.middle_m_per_s += SIXTH * h_s * foot.missed
        state.places_m[k] = foot.end_m + 4.0 * SIXTH * h_s * ring.m_per_m_per_s * foot.missed


@kernel
def end_of_feet(plant: Record, state: Record, ring: Ring, recoil: float, h_s: float) -> None:
    """Add what loads and recoil at the end add to the velocities, and book their damping."""
    piezo = plant.piezo
    square = 0.0
    for k in moving(plant):
        foot = state.feet[k]
        missed = foot.load_n - foot.before_n - h_s * foot.n_per_s
        kick = 4.0 * ring.m_per_s_per_m_per_s * foot.missed + missed / piezo.foot_kg - recoil
        speed = foot.end_m_per_s + SIXTH * h_s * kick
        square += foot.m_per_s * foot.m_per_s + speed * speed
        square += 4.0 * foot.middle_m_per_s * foot.middle_m_per_s
        foot.m_per_s = speed
    lost_w = 2.0 * piezo.damping_ratio * piezo.omega_per_s * piezo.foot_kg * square
    state.sums.stand_lost_j += SIXTH * h_s * lost_w


@kernel
def note_ringing(plant: Record, state: Record) -> None:
    """Let the piezo remember the largest ringing of a foot: the length of steps follows it."""
    ring_m = ring_m_per_s = 0.0
    for k in moving(plant):
        wanted_m = state.offsets_m[k] + ratio_of(plant, k) * state.foot_m
        bent_m = state.contacts[k].memory.force_n / plant.piezo.stack_n_per_m
        ring_m = max(ring_m, abs(state.places_m[k] - wanted_m - bent_m))
        ring_m_per_s = max(ring_m_per_s, abs(state.feet[k].m_per_s))
    state.piezo.ring_m = state.piezo.driving_m + ring_m
    state.piezo.ring_m_per_s = ring_m_per_s


@kernel
def stacks_energy(plant: Record, state: Record) -> float:
    """Return the energy of bent stacks, and of the motion of feet against their centre of mass."""
    if not bends(plant):
        return 0.0
    doubled_j, momentum = 0.0, 0.0
    for k in moving(plant):
        speed = state.feet[k].m_per_s
        wanted_m = state.offsets_m[k] + ratio_of(plant, k) * state.foot_m
        bent_m = state.places_m[k] - wanted_m
        doubled_j += plant.piezo.foot_kg * speed * speed
        doubled_j += plant.piezo.stack_n_per_m * bent_m * bent_m
        momentum += plant.piezo.foot_kg * speed
    return 0.5 * (doubled_j - momentum * momentum * plant.frame.per_kg)
