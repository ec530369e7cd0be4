# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Friction loops of one sphere against closed forms, 20,000 springs, and a fit of a table."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from stickslip_ros import Parameters, SpringContact, compare, load_yaml
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.experiments.friction_loop import FrictionLoop, loop_forces

SMOOTH = Parameters().updated({'contact.profile': 'smooth', 'contact.radius': 2e-3})
E_STAR_PA, G_STAR_PA, MU, RADIUS_M = 147.2149e9, 121.2358e9, 0.3, 2e-3
NORMAL_N = 0.8
DEPTH_M = (3.0 * NORMAL_N / (4.0 * E_STAR_PA * RADIUS_M**0.5)) ** (2.0 / 3.0)
RANGE_M = MU * E_STAR_PA / G_STAR_PA * DEPTH_M
OWN = 3e-4
"""Largest error, of the force of full slip."""


def forces_of(ways_m: Any, normals_n: Any, *, rig: float = 0.0, closed: bool = False) -> Any:
    normal_n = np.broadcast_to(normals_n, np.shape(ways_m)).astype(float)
    return loop_forces(SMOOTH, FrictionLoop(np.asarray(ways_m), normal_n, rig, closed))


def virgin_n(way_m: Any, normal_n: float = NORMAL_N) -> Any:
    """Return the force of Cattaneo and Mindlin, N."""
    range_m = RANGE_M * (normal_n / NORMAL_N) ** (2.0 / 3.0)
    return MU * normal_n * (1.0 - np.maximum(1.0 - np.asarray(way_m) / range_m, 0.0) ** 1.5)


def there_and_back(amplitude_m: float, rows: int = 90) -> Any:
    up, down = np.linspace(0.0, amplitude_m, rows), np.linspace(amplitude_m, -amplitude_m, rows)
    return np.concatenate((up, down[1:], -down[1:]))


@pytest.mark.parametrize('share', [0.3, 0.8, 1.4])
def test_a_loop_is_that_of_cattaneo_and_mindlin(share: float):
    amplitude_m = share * RANGE_M
    ways_m = there_and_back(amplitude_m)
    most_n = virgin_n(amplitude_m)
    wanted_n = np.concatenate((
        virgin_n(ways_m[:90]),
        most_n - 2.0 * virgin_n(0.5 * (amplitude_m - ways_m[90:179])),
        -most_n + 2.0 * virgin_n(0.5 * (amplitude_m + ways_m[179:])),
    ))  # fmt: skip
    found_n = forces_of(ways_m, NORMAL_N)
    np.testing.assert_allclose(found_n, wanted_n, rtol=0.0, atol=OWN * MU * NORMAL_N)


def test_a_loop_that_begins_under_a_force_was_passed_before():
    whole_m = there_and_back(0.8 * RANGE_M)
    found_n = forces_of(np.roll(whole_m[90:], 50), NORMAL_N, closed=True)
    wanted_n = np.roll(forces_of(whole_m, NORMAL_N)[90:], 50)
    np.testing.assert_allclose(found_n, wanted_n, rtol=0.0, atol=OWN * MU * NORMAL_N)


def test_under_oblique_loading_nothing_slips_and_more_force_follows_jaeger():
    """
    Way and depth grow in proportion, then the way alone.

    A spring that meets the plane at the depth g is pulled by beta (d - g), so that the force is
    beta F_n G*/E*. Further on a spring slips where the way since then exceeds
    (mu C_M - beta) (d - g), which is the virgin curve of a friction lower by beta/C_M.

    """
    softness = E_STAR_PA / G_STAR_PA
    beta = 0.6 * MU * softness
    depths_m = np.linspace(0.0, DEPTH_M, 4000)
    normals_n = 4.0 / 3.0 * E_STAR_PA * RADIUS_M**0.5 * depths_m**1.5
    more_m = np.linspace(0.0, 1.2 * RANGE_M, 200)[1:]
    ways_m = np.concatenate((beta * depths_m, beta * DEPTH_M + more_m))
    found_n = forces_of(ways_m, np.concatenate((normals_n, np.full(199, normals_n[-1]))))
    first_n, less = 0.6 * MU * NORMAL_N, 1.0 - 0.6
    wanted_n = first_n + less * virgin_n(more_m / less)
    np.testing.assert_allclose(
        found_n,
        np.concatenate((0.6 * MU * normals_n, wanted_n)),
        rtol=0.0,
        atol=OWN * MU * NORMAL_N,
    )


def of_springs(ways_m: Any, normals_n: Any, rig: float, count: int = 20_000) -> Any:
    """Return the forces of springs at equal distances, each with its memory."""
    contact = Parameters().contact
    edge_m = 3.0 * np.sqrt(RADIUS_M * DEPTH_M)
    x_m = edge_m * (np.arange(count) + 0.5) / count
    heights_m = x_m**2 / RADIUS_M + contact.prefactor * x_m**contact.hurst
    shear, normal = (2.0 * pa * edge_m / count for pa in (G_STAR_PA, E_STAR_PA))
    forces_n, at_m, found = np.zeros(count), 0.0, []  # of the springs; place of the sphere

    def pressed_n(depth_m: float) -> Any:
        return normal * np.maximum(depth_m - heights_m, 0.0)

    def pulled(way_m: float, before_n: Any, limits_n: Any) -> Any:
        return np.clip(before_n + shear * way_m, -limits_n, limits_n)

    def missed_m(moved_m: float, wanted_m: float, before_n: Any, limits_n: Any) -> float:
        return moved_m + pulled(moved_m, before_n, limits_n).sum() / rig - wanted_m

    for way_m, normal_n in zip(ways_m, normals_n, strict=True):
        depth_m = brentq(lambda d, n: pressed_n(d).sum() - n, 0.0, 1e-4, (normal_n,), xtol=1e-16)
        given = forces_n, MU * pressed_n(depth_m)
        moved_m = way_m - at_m
        if rig:
            ends_m = moved_m - 1e-6, moved_m + 1e-6
            moved_m = brentq(missed_m, *ends_m, (moved_m, *given), xtol=1e-17)
        forces_n, at_m = pulled(moved_m, *given), at_m + moved_m
        found.append(forces_n.sum())
    return np.array(found)


@pytest.mark.parametrize('rig', [0.0, 1.5e6])
@pytest.mark.parametrize('varies', [False, True])
def test_random_reversals_are_those_of_20000_springs(rig: float, varies: bool):
    rng = np.random.default_rng(7)
    turns_m = RANGE_M * np.cumsum(rng.uniform(-1.3, 1.3, 14)).clip(-2.0, 2.0)
    ways_m = np.interp(np.arange(0.0, 14.0, 0.2), np.arange(15), np.append(0.0, turns_m))
    normals_n = NORMAL_N * (1.0 - 0.35 * varies * np.sin(0.37 * np.arange(len(ways_m))) ** 2)
    stand = Parameters().updated({'contact.radius': RADIUS_M})
    found_n = loop_forces(stand, FrictionLoop(ways_m, normals_n, rig, is_closed=False))
    wanted_n = of_springs(ways_m, normals_n, rig)
    np.testing.assert_allclose(found_n, wanted_n, rtol=0.0, atol=OWN * MU * NORMAL_N)


def test_a_compliant_rig_takes_the_force_per_stiffness_of_the_displacement():
    rig = 8e5
    sphere_m = np.linspace(0.0, 1.2 * RANGE_M, 60)
    found_n = forces_of(sphere_m + virgin_n(sphere_m) / rig, NORMAL_N, rig=rig)
    np.testing.assert_allclose(found_n, virgin_n(sphere_m), rtol=0.0, atol=OWN * MU * NORMAL_N)


TRUTH = {'contact.friction': 0.21, 'contact.young_sphere': 310e9, 'contact.prefactor': 6e-4}


@pytest.fixture(scope='module')
def tables(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Write loops of a sphere of 2 mm, one in a compliant rig, in units of a laboratory."""
    folder, stand = (
        tmp_path_factory.mktemp('loops'),
        Parameters().updated({**TRUTH, 'contact.radius': 2e-3}),
    )
    files = []
    for normal_n, rig in ((0.5, 2e6), (2.0, 0.0)):
        ways_m = there_and_back(1.1e-7 * normal_n**0.5 + 1e-7, rows=25)
        loop = FrictionLoop(ways_m, np.full(len(ways_m), normal_n), rig, is_closed=False)
        lines = [
            'time (s),displacement (nm),friction force (mN),normal force (mN),rig stiffness (N/m)'
        ]
        lines += [
            f'{0.1 * k},{1e9 * way},{1e3 * force},{1e3 * normal_n},{rig}'
            for k, (way, force) in enumerate(zip(ways_m, loop_forces(stand, loop), strict=True))
        ]
        files.append(folder / f'{normal_n}.csv')
        files[-1].write_text('\n'.join(lines))
    return [str(each) for each in files]


def test_loops_are_fitted_and_the_same_file_runs_the_stage(tables, tmp_path, capsys):
    given = ['--set', 'contact.radius=2mm', '--assume', 'contact.radius=+-1%']
    saved, told = tmp_path / 'sphere.yaml', tmp_path / 'fit.json'
    words = ['fit', *tables, '--free', ','.join(TRUTH), '--starts', '1', *given]
    assert main([*words, '-o', str(told)]) == 0
    found = {each['name']: each['value'] for each in json.loads(told.read_text())['estimates']}
    assert found == pytest.approx(TRUTH, rel=2e-3)
    assert json.loads(told.read_text())['assumed'].keys() == {
        'contact.radius',
        'contact.young_runner',
    }
    capsys.readouterr()
    settings = [word for name, value in found.items() for word in ('--set', f'{name}={value!r}')]
    assert main(['parameters', *given[:2], *settings]) == 0
    saved.write_text(capsys.readouterr().out)
    assert load_yaml(saved).contact.radius == 2e-3
    capsys.readouterr()
    assert main(['compare', tables[0], 'model', '--params', str(saved), '--json']) == 0
    [quantity] = json.loads(capsys.readouterr().out)['quantities']
    assert quantity['agreement']['rms'] < 1e-4
    assert main(['simulate', '--params', str(saved), '--amplitude', '150nm', '--steps', '3']) == 0


def test_loops_of_one_load_stay_apart_and_are_drawn_over_the_displacement(tables, tmp_path):
    header, *rows = Path(tables[0]).read_text().splitlines()
    wider = tmp_path / 'wider.csv'
    cells = [row.split(',') for row in rows]
    lines = [','.join([row[0], str(1.5 * float(row[1])), *row[2:]]) for row in cells]
    wider.write_text('\n'.join([header, *lines]))
    stand = Parameters().updated({**TRUTH, 'contact.radius': 2e-3})
    report = compare([tables[0], wider], stand)
    [quantity] = report.quantities
    assert [part.at for part in quantity.parts] == [
        {'preload_n': 0.5, 'loop': number} for number in (1, 2)
    ]
    right, wrong = (part.agreement.rms for part in quantity.parts)
    assert right < 1e-4 < wrong
    shown_nm = [line.get_xdata() for line in report.plot().axes[0].lines]
    for factor in (1.0, 1.5):
        ways_nm = np.array([factor * float(row[1]) for row in cells])
        assert any(np.allclose(each, ways_nm, rtol=1e-9) for each in shown_nm)


def test_a_loss_is_said_to_do_nothing_in_loops(tables: list[str], capsys):
    words = ['compare', tables[0], 'model', '--set', 'contact.radius=2mm', '--json']
    for lossy, notes in (
        ([], []),
        (
            ['--set', 'contact.loss_factor=0.1'],
            ['contact.loss_factor 0.1 has no effect: loops have no time'],
        ),
    ):
        assert main([*words, *lossy]) == 0
        assert json.loads(capsys.readouterr().out)['b']['notes'] == notes


def test_a_force_that_drives_the_motion_is_refused_and_its_remedy_works(tables, tmp_path, capsys):
    header, *rows = Path(tables[0]).read_text().splitlines()
    cells = [row.split(',') for row in rows]
    turned = tmp_path / 'turned.csv'
    lines = [','.join([*row[:2], str(-float(row[2])), *row[3:]]) for row in cells]
    turned.write_text('\n'.join([header, *lines]))
    assert main(['compare', str(turned), 'model']) == 2
    told = capsys.readouterr().err
    assert 'work along the loop -' in told
    assert '--map tangential_n="NAME (-1 N)"' in told
    named = 'tangential_n=friction force (-0.001 N)'
    assert main(['compare', str(turned), 'model', '--map', named]) == 0


def test_a_loop_without_a_normal_force_is_refused(tables: list[str], tmp_path: Path, capsys):
    bare = tmp_path / 'bare.csv'
    bare.write_text('displacement_m,tangential_n\n0,0\n1e-7,0.1\n')
    assert main(['compare', str(bare), 'model']) == 2
    assert 'there is no normal_n' in capsys.readouterr().err


def test_an_impossible_rig_is_refused():
    with pytest.raises(OutOfRange, match='rig -1 N/m is below 0; give that of the rig, or 0'):
        SpringContact(SMOOTH, 1.0, rig_n_per_m=-1.0)
