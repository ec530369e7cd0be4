"""What is unknown: piezos that ring, a preload and a frame that swing; the screening of all."""

import json
import math

import numpy as np
import pytest

from stickslip_ros.cli.main import main
from stickslip_ros.paper import screening
from stickslip_ros.paper.figure import Table
from stickslip_ros.paper.frame import DAMPING_RATIO, FRAMES, Frame, swinging_rows
from stickslip_ros.paper.frame import _row as frame_row
from stickslip_ros.paper.normal_motion import modulated_ramps
from stickslip_ros.paper.readings import stand_at
from stickslip_ros.paper.ringing import RINGING
from stickslip_ros.paper.screening import FACTORS, LEVELS, READ, STEP, effects_of, trajectory
from stickslip_ros.paper.unknowns import UNKNOWNS, Unknown
from stickslip_ros.paper.unknowns import _row as unknown_row
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.journal import Row
from stickslip_ros.study.sawtooth_run import run_drive
from stickslip_ros.units import MN, NM

FULL_M, FORCE_HZ = 160e-9, 1000.0
BANK_ERROR = 2.5e-3
"""64 springs per group against the continuum."""
SLOPES = {factor.name: float(2 * number + 1) for number, factor in enumerate(FACTORS)}
"""Of a made-up drive that answers in proportion to each unknown."""


@pytest.mark.parametrize(('preload_n', 'known_mn'), [(0.5, 332.0), (1.0, 569.0)])
def test_piezos_that_ring_generate_the_known_force(preload_n, known_mn):
    """Known: 150 kHz, D = 0.1, from a simulation of every spring in C."""
    changes = {'actuator.resonance': 150e3, 'actuator.damping_ratio': 0.1}
    run = run_drive(stand_at(Parameters(), preload_n, changes), FULL_M, FORCE_HZ)
    assert run.force_mean_n * MN == pytest.approx(known_mn, rel=2e-3)


def test_the_figure_of_the_ringing_compares_with_a_massless_piezo():
    make_row = RINGING.cases(Parameters(), 2)[0]
    row = make_row()
    assert row['resonance_hz'] == 0.0
    plain = run_drive(stand_at(Parameters(), 0.1), FULL_M, FORCE_HZ)
    assert row['force_mean_n'] == plain.force_mean_n


def test_a_preload_that_does_not_swing_is_a_constant_one(stand):
    ramps = modulated_ramps(stand, FULL_M, 0.0)
    force_n = stand.load_cell.stiffness * ramps[-1, 1]
    wanted_n = run_drive(stand, FULL_M, FORCE_HZ, len(ramps)).force_mean_n
    assert force_n == pytest.approx(wanted_n, rel=BANK_ERROR)


def test_a_preload_that_swings_by_a_fifth_moves_the_force_by_a_few_per_cent():
    stand = stand_at(Parameters(), 0.1)
    lower, steady, higher = (
        modulated_ramps(stand, FULL_M, share)[-1, 1] for share in (-0.2, 0.0, 0.2)
    )
    assert lower / steady - 1.0 == pytest.approx(0.053, abs=0.005)
    assert higher / steady - 1.0 == pytest.approx(-0.059, abs=0.005)


def test_a_frame_swings_on_as_its_equation_says_and_the_cycle_joins():
    frame = Frame(10e3, 0.1)
    rows = swinging_rows(300.0, FORCE_HZ, 150e6, frame)
    straight = swinging_rows(300.0, FORCE_HZ, 150e6, Frame(10e3, 0.0))
    assert rows[0, 1] == pytest.approx(rows[-1, 1])
    on_ramp = slice(0, 1500)
    time_s, swing_v = rows[on_ramp, 0], (rows - straight)[on_ramp, 1]
    step_s, omega = time_s[1] - time_s[0], 2.0 * math.pi * frame.resonance_hz
    speed = np.gradient(swing_v, step_s)[2:-2]
    acceleration = (swing_v[2:] - 2.0 * swing_v[1:-1] + swing_v[:-2])[1:-1] / step_s**2
    left = acceleration + 2.0 * DAMPING_RATIO * omega * speed + omega**2 * swing_v[2:-2]
    assert np.abs(left).max() < 1e-3 * np.abs(acceleration).max()
    assert np.abs(swing_v).max() > 0.1 * frame.mass_ratio * 300.0


def test_a_rigid_frame_changes_nothing_and_one_in_tune_with_the_runner_takes_force(stand):
    plain = run_drive(stand, FULL_M, FORCE_HZ)
    rigid, _, in_tune = (frame_row(stand, frame) for frame in FRAMES[:3])
    assert rigid['force_mean_n'] == pytest.approx(plain.force_mean_n, rel=1e-3)
    assert in_tune['force_mean_n'] == pytest.approx(0.126, abs=0.002)


def test_a_guide_takes_its_part_of_the_force():
    default, guided = (
        unknown_row(Parameters(), Unknown('', '', {}, guide)) for guide in (0.0, 1e4)
    )
    assert default['force_at_0.5_n'] == run_drive(Parameters(), FULL_M, FORCE_HZ).force_mean_n
    share = float(guided['force_at_0.1_n']) / float(default['force_at_0.1_n'])
    assert share == pytest.approx(1.0 / 1.1, abs=0.01)
    assert UNKNOWNS[0].changes == {}


def test_a_trajectory_changes_every_unknown_once_by_a_large_step_within_its_range():
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(20):
        (first, no_step, before), *rest = trajectory(rng)
        assert (first, no_step) == ('', 0.0)
        assert sorted(changed for changed, _, _ in rest) == sorted(SLOPES)
        for changed, step, places in rest:
            (number,) = np.flatnonzero(places != before)
            assert FACTORS[number].name == changed
            assert places[number] - before[number] == pytest.approx(step)
            assert abs(step) == pytest.approx(STEP)
            assert ((places >= -1e-12) & (places <= 1.0 + 1e-12)).all()
            seen |= {round(float(place) * (LEVELS - 1)) for place in places}
            before = places
    assert seen == set(range(LEVELS))


def made_up(trajectories: int = 3) -> Table:
    """Return the runs of a drive that answers in proportion to each unknown."""
    rng, rows = np.random.default_rng(2), list[Row]()
    for number in range(trajectories):
        for changed, step, places in trajectory(rng):
            reading = float(np.dot(list(SLOPES.values()), places))
            row: Row = {'trajectory': number, 'changed': changed, 'change': step}
            rows.append(row | dict.fromkeys(READ, reading))
    return Table(rows)


def test_the_effects_of_a_drive_in_proportion_are_its_slopes_without_scatter():
    effects = effects_of(made_up())
    assert list(effects) == sorted(SLOPES, key=SLOPES.__getitem__, reverse=True)
    for factor, each in effects.items():
        for effect in each.values():
            assert effect.size == pytest.approx(SLOPES[factor])
            assert effect.scatter == pytest.approx(0.0, abs=1e-9)
            assert effect.error == pytest.approx(0.0, abs=1e-9)


def test_a_place_of_the_screening_is_a_run_of_the_drive():
    nothing = {'damping_n_s_per_m', 'guide_n_per_m', 'weight', 'hysteresis', 'creep'}
    places = np.array([0.0 if f.name in {*nothing, 'gain_tolerance'} else 1.0 for f in FACTORS])
    row = screening._row(Parameters(), 0, '', 0.0, places)
    stand = Parameters().updated(
        {f.sets: row[f.name] for f in FACTORS if '.' in f.sets and f.name != 'weight'}
    )
    run = run_drive(stand, FULL_M, 2000.0)
    assert row['force_mean_n'] == run.force_mean_n
    assert 0.0 < float(row['zero_onset_m']) * NM <= 160.0
    assert float(row['step_length_m']) > 0.0


def test_the_verb_ranks_what_matters_most_first(capsys, tmp_path, monkeypatch):
    table = made_up()
    asked = dict[str, object]()

    def given(figures, parameters, **rest):
        asked.update(rest, seed=parameters.sim.seed, preload_n=parameters.stand.preload)
        return {figures[0].name: table}

    monkeypatch.setattr('stickslip_ros.cli.sensitivity.make_tables', given)
    words = ['--trajectories', '3', '--set', 'sim.seed=7', '--preload', '0.2', '-o', str(tmp_path)]
    assert main(['sensitivity', *words, '--json']) == 0
    told = json.loads(capsys.readouterr().out)
    assert (asked['points'], asked['seed'], asked['preload_n']) == (3, 7, 0.2)
    assert next(iter(told['effects'])) == FACTORS[-1].name
    assert told['effects']['mass_kg']['force_mean_n']['size'] == pytest.approx(SLOPES['mass_kg'])
    names = {'screening.csv', 'screening.md', 'screening.png', 'screening.svg'}
    assert {path.name for path in tmp_path.iterdir()} == names
    assert main(['sensitivity', *words]) == 0
    shown = capsys.readouterr().out
    assert shown.index('threshold_n') < shown.index('damping_n_s_per_m')


def test_a_screening_without_trajectories_is_refused(capsys, tmp_path):
    assert main(['sensitivity', '--trajectories', '0', '-o', str(tmp_path)]) == 2
    assert '--trajectories 0 is below 2' in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
