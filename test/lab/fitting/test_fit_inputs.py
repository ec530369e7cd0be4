# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Free parameters, starts, bounds and files of a fit, its natural coordinates, its refusals."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment, SawtoothSteps
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.fitting.fit import fit
from stickslip_ros.lab.fitting.free import FITTED, Coordinate, Free, Natural, choose_free
from stickslip_ros.lab.fitting.report import _row
from stickslip_ros.lab.fitting.statistics import Estimate
from stickslip_ros.parameters import Parameters, specs

ROUNDING = 1e-12
STAND = Parameters().updated({'stand.preload': 0.4, 'runner.damping': 20.0})
MOVED = 'contact.friction contact.prefactor runner.mass runner.damping'
SETS = (
    f'{MOVED} actuator.gain actuator.hysteresis',
    'contact.friction runner.mass runner.damping',
    'contact.friction contact.rms_height runner.damping',
    'contact.radius contact.young_runner contact.friction',
    'runner.damping actuator.gain',
)
HEADER = 'preload_n,amplitude_m,force_n'
ROWS = '0.1,60e-9,0.03\n0.4,120e-9,0.2\n'


def written(folder: Path, text: str) -> Path:
    path = folder / 'points.csv'
    path.write_text(text, encoding='utf-8')
    return path


def test_a_start_gets_a_factor_of_1000_to_both_sides_inside_what_is_allowed():
    _, (mass, poisson, damping), notes = choose_free(
        Parameters(), ['runner.mass', 'contact.poisson_runner', 'runner.damping']
    )
    assert (mass.lower, mass.upper) == pytest.approx((3e-6, 3.0), rel=ROUNDING, abs=0.0)
    assert poisson.upper == 0.5
    assert mass.is_log
    assert damping.lower == 0.0
    assert not damping.is_log
    assert notes == ()


def test_a_piezo_that_rings_beside_an_amplifier_without_a_bandwidth_is_told():
    names = ['contact.friction', 'actuator.resonance', 'actuator.damping_ratio']
    _, _, [note] = choose_free(Parameters(), names)
    assert note.startswith('amplifier.bandwidth not modelled')
    assert choose_free(Parameters(), [*names, 'amplifier.bandwidth'])[2] == ()
    known = Parameters().updated({'amplifier.bandwidth': 2e5})
    assert choose_free(known, names)[2] == ()


def test_start_and_bounds_as_typed_are_taken():
    stand, (free,), _ = choose_free(
        Parameters(), Free('runner.damping', start='50', low='0', high='200')
    )
    assert free == Coordinate('runner.damping', 'N s/m', 50.0, 0.0, 200.0)
    assert not free.is_log
    assert stand.runner.damping == 50.0


@given(st.floats(0.0, 1.0), st.sampled_from(['runner.damping', 'runner.mass']))
def test_a_coordinate_and_its_value_belong_to_each_other(share, name):
    free = Coordinate(name, '', 1.0, 0.01, 100.0)
    lower, upper = (free.to_coordinate(bound) for bound in (free.lower, free.upper))
    place = lower + share * (upper - lower)
    value = free.to_value(place)
    assert free.lower <= value <= free.upper
    assert free.to_value(free.to_coordinate(value)) == pytest.approx(value, rel=1e-9, abs=ROUNDING)
    if 0.001 < share < 0.999:
        assert free.excess(place) == 0.0
    assert free.excess(upper + 0.1) == pytest.approx(0.1, rel=1e-9)
    assert free.excess(lower - 0.1) == pytest.approx(-0.1, rel=1e-9)


def test_only_quantities_of_the_drive_can_be_freed():
    freed = set()
    for name, spec in specs().items():
        try:
            choose_free(Parameters(), [Free(name, low=spec.minimum, high=spec.maximum)])
        except StickSlipError:
            continue
        freed.add(name)
    groups = {name if name in FITTED else name.partition('.')[0] for name in freed}
    assert groups == set(FITTED)
    assert all(specs()[name].kind is float for name in freed)
    assert {'contact.friction', 'runner.mass', 'load_cell.stiffness'} <= freed


@pytest.mark.parametrize(
    ('free', 'message'),
    [
        ('contact.fricton', 'did you mean contact.friction'),
        ('contact.law', "free parameter 'contact.law' is not a quantity"),
        ('contact.line_points', 'is not a quantity'),
        ('feet.share', 'name an element, feet.share[0]'),
        ('feet.share[2]', "'feet.share[2]' is not one of its elements, 0 to 1"),
        ('runner.mass[0]', 'write runner.mass'),
        ('feet.count[0]', 'is not a quantity'),
        ('sim.dt', "'sim.dt' is not a property of the drive"),
        ('stand.preload', "'stand.preload' is not a property of the drive"),
        ('trace.period', 'free quantities of contact, friction_law, runner'),
        ([], 'is not a list of parameters'),
        (['runner.mass', Free('runner.mass')], "'runner.mass' is freed twice"),
        (
            'friction_law.viscous',
            'friction_law.viscous 0 N s/m is not above 0, and gives no scale',
        ),
        (Free('runner.mass', start='much'), "'much' is not a number in kg"),
        (Free('runner.mass', low='2e-3', high='1e-3'), 'is not below the upper one'),
        (Free('runner.mass', low='1e-3', high=11.0), 'above the maximum 10 kg'),
        (
            Free('runner.mass', low='4e-3', high='5e-3'),
            'start of runner.mass 0.003 kg is outside of its bounds, 0.004 to 0.005 kg',
        ),
        (
            ['contact.rms_height', 'contact.prefactor'],
            "'contact.rms_height' is without effect while contact.prefactor is free",
        ),
    ],
)
def test_what_does_not_fit_is_refused(free, message):
    with pytest.raises(StickSlipError) as refusal:
        choose_free(Parameters(), free)
    assert message in str(refusal.value)


def test_one_bound_alone_leaves_the_other_where_it_is():
    _, (mass,), _ = choose_free(Parameters(), Free('runner.mass', high='4g'))
    assert (mass.lower, mass.upper) == pytest.approx((3e-6, 4e-3), rel=ROUNDING, abs=0.0)


@pytest.mark.parametrize(
    ('free', 'message'),
    [
        ('friction', 'friction'),
        (Free('runner.mass', known='3g'), "'3g' is not VALUE+-SHARE%; write runner.mass=VALUE+"),
        (Free('runner.mass', known='3g+-0%'), 'is not above 0'),
        (Free('runner.mass', known=(-3e-3, 0.01)), 'below the minimum'),
    ],
)
def test_names_and_known_values_are_refused_before_anything_is_read(free, message):
    with pytest.raises(StickSlipError) as refusal:
        fit('there_is_no.mcap', free)
    assert message in str(refusal.value)
    assert 'there_is_no' not in str(refusal.value)


def test_a_chosen_prefactor_does_not_give_way_silently():
    stand = Parameters().updated({'contact.prefactor': 5e-4})
    with pytest.raises(StickSlipError, match=r'set contact.prefactor=0, or free'):
        choose_free(stand, ['contact.rms_height'])


def read(path: Path, **options: Any) -> list[Experiment]:
    return read_experiments(path, Parameters(), ReadingOptions(**options))


def test_a_file_is_read_with_and_without_its_optional_columns(tmp_path):
    points = read(written(tmp_path, f'{HEADER}\n{ROWS}'), frequency_hz=500.0)
    assert [one.settings for one in points] == [{'stand.preload': 0.1}, {'stand.preload': 0.4}]
    drives = [SawtoothSteps(60e-9, 500.0), SawtoothSteps(120e-9, 500.0)]
    assert [one.drive for one in points] == drives
    assert [one.observed[0].values.tolist() for one in points] == [[0.03], [0.2]]
    assert points[0].observed[0].sigma is None
    full = f'\ufeff# stand 7\n{HEADER},frequency_hz,force_sigma_n\n0.1,60e-9,0.03,200,1e-3\n'
    [point] = read(written(tmp_path, full))
    assert point.drive == SawtoothSteps(60e-9, 200.0)
    assert point.observed[0].sigma == 1e-3


def test_step_lengths_are_those_of_a_free_runner(tmp_path):
    text = 'preload_n,amplitude_m,step_length_m\n0.1,60e-9,1e-8\n'
    [point] = read(written(tmp_path, text))
    assert point.settings == {'stand.preload': 0.1, 'load_cell.contact': 'absent'}
    assert point.observed[0].quantity == 'step_length_m'


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (
            'preload_n,amplitude_m,energy_j\n0.1,60e-9,1e-8\n',
            'line 1: there is no force_n or step_length_m',
        ),
        (f'{HEADER}\n0.1,60e-9,0\n', 'has only 0 as force_n'),
        (f'{HEADER}\n0.1,60 nm,0.03\n', "column 'amplitude_m' has text, '60 nm'"),
    ],
)
def test_a_file_without_usable_numbers_is_refused(text, message, tmp_path):
    with pytest.raises(StickSlipError) as refusal:
        read(written(tmp_path, text))
    assert message in str(refusal.value)


def test_an_interval_has_the_digits_of_its_error():
    free = vars(Coordinate('contact.friction', '', 2841.02, 1.0, 9e3))
    flags: dict[str, Any] = dict.fromkeys(('at_bound', 'inert', 'undetermined'), False)
    one = Estimate(**free, **flags, value=2841.02, standard_error=0.26, low=2840.51, high=2841.53)
    assert _row(one, holds=True)[1:5] == ('2841.02', '0.26', '2840.51', '2841.53')
    wide = replace(one, standard_error=300.0, low=2253.0, high=3429.0)
    assert _row(wide, holds=True)[1:5] == ('2841', '3e+02', '2253', '3429')


def natural_of(names: str, damping: float = 1.0) -> tuple[Natural, np.ndarray]:
    """Give a map and the coordinates of a place beside the start, with a share of the damping."""
    stand, free, _ = choose_free(STAND, names.split())
    z = np.array([one.to_coordinate(one.start) for one in free])
    z += np.random.default_rng(len(names)).uniform(-0.4, 0.4, len(free))
    return Natural(stand, free), z * [damping if 'damping' in one.name else 1.0 for one in free]


@pytest.mark.parametrize('names', SETS)
@pytest.mark.parametrize('damping', [0.0, 1.0])
def test_there_and_back_again_is_where_it_began_by_its_slopes_too(names: str, damping: float):
    natural, z = natural_of(names, damping)
    assert natural.back(natural.to(z)) == pytest.approx(z, rel=1e-12, abs=1e-12)
    place, way = natural.to(z), 1e-4 * np.random.default_rng(1).normal(size=len(z))
    moved = 0.5 * (natural.back(place + way) - natural.back(place - way))
    assert natural.slopes(place) @ way == pytest.approx(moved, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize('rougher', [0.3, 3.0])
def test_where_all_forces_grow_alike_only_the_roughness_moves(rougher: float):
    natural, _ = natural_of(MOVED)
    begin = {one.name: one.start for one in natural.free}
    prefactor = {'contact.prefactor': rougher * begin['contact.prefactor']}
    soft, stiff = (
        sum(each.stick_stiffness_n_per_m for each in contacts_of(on))
        for on in (STAND, STAND.updated(prefactor))
    )
    alike = {name: stiff / soft * value for name, value in begin.items()} | prefactor
    assert abs(stiff / soft - 1.0) > 0.1, 'else nothing is tested'
    there, here = (
        natural.to(np.array([one.to_coordinate(each[one.name]) for one in natural.free]))
        for each in (alike, begin)
    )
    stays = [one.name != 'contact.prefactor' for one in natural.free]
    assert there[stays] == pytest.approx(here[stays], rel=1e-9, abs=1e-9)
    assert abs(there - here).max() > 0.5
