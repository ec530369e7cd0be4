# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Force curves against each other: sweeps, experiments, the model."""

import numpy as np
import pandas as pd
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.comparison.compare import CompareOptions, compare
from stickslip_ros.lab.experiments import predict as predict_module
from stickslip_ros.lab.measurements.sweep_table import write_table
from stickslip_ros.lab.measurements.tables import read_experiment, read_joined
from stickslip_ros.lab.runs.batch import Interrupted
from stickslip_ros.lab.runs.sawtooth_run import run_drive
from stickslip_ros.lab.runs.sweep import Axis, Sweep, run_sweep
from stickslip_ros.parameters import Parameters

AMPLITUDES_M = tuple(float(each) for each in np.linspace(0.0, 160e-9, 17))
PRELOADS_N = (0.1, 0.5)
STEPS = 40
ROUNDING = 1e-9
"""Relative; of sums over a few dozen points."""
SIGMA_N = 2e-3


def sweep_rows(parameters, preloads_n=PRELOADS_N, amplitudes_m=AMPLITUDES_M, **other):
    axes = [Axis(name.replace('__', '.'), values) for name, values in other.items()]
    axes.append(Axis('stand.preload', tuple(preloads_n)))
    return run_sweep(Sweep(parameters, tuple(axes), (1000.0,), tuple(amplitudes_m), STEPS))


@pytest.fixture(scope='module')
def tables(tmp_path_factory):
    """Give a rough and a smooth sweep: paths and rows of both."""
    folder = tmp_path_factory.mktemp('sweeps')
    made = {}
    for profile in ('rough', 'smooth'):
        parameters = Parameters().updated({'contact.profile': profile})
        rows = sweep_rows(parameters)
        for suffix in ('.csv', '.parquet'):
            write_table(rows, folder / f'{profile}{suffix}', parameters)
        made[profile] = rows
    return folder, made


def write_points(path, rows, columns):
    pd.DataFrame(rows, columns=columns).to_csv(path, index=False)
    return str(path)


def compared(a, b, **options):
    is_model = isinstance(b, str) and b == 'model'
    b = Parameters() if is_model else b
    return compare(a, b, options=CompareOptions(steps=STEPS, **options))


def force_of(comparison):
    [force] = [each for each in comparison.quantities if each.name == 'force_n']
    return force


@pytest.mark.parametrize('suffix', ['.csv', '.parquet'])
def test_smooth_against_rough_is_what_a_direct_calculation_gives(tables, suffix):
    folder, made = tables
    comparison = compared(folder / f'rough{suffix}', folder / f'smooth{suffix}')
    a, b = (np.array([row['force_mean_n'] for row in made[name]]) for name in ('rough', 'smooth'))
    told = force_of(comparison).agreement
    assert told.points == 34
    assert told.bias == pytest.approx(np.mean(b - a), rel=ROUNDING)
    assert told.rms == pytest.approx(np.sqrt(np.mean((b - a) ** 2)), rel=ROUNDING)
    assert told.relative_rms == pytest.approx(told.rms / (a.max() - a.min()), rel=ROUNDING)
    assert told.correlation == pytest.approx(np.corrcoef(a, b)[0, 1], rel=ROUNDING)
    worst = int(np.argmax(np.abs(b - a)))
    assert told.largest == pytest.approx((b - a)[worst], rel=ROUNDING)
    assert told.largest_at['amplitude_m'] == made['rough'][worst]['amplitude_m']
    assert told.largest_at['preload_n'] == made['rough'][worst]['preload_n']
    parts = force_of(comparison).parts
    assert [part.at for part in parts] == [{'preload_n': each} for each in PRELOADS_N]
    for part, preload_n in zip(parts, PRELOADS_N, strict=True):
        for name, threshold in (('rough', part.threshold_a), ('smooth', part.threshold_b)):
            forces = [r['force_mean_n'] for r in made[name] if r['preload_n'] == preload_n]
            assert threshold.saturation == max(forces)
            assert threshold.saturation_at_m == AMPLITUDES_M[int(np.argmax(forces))]
        # A smooth sphere slips earlier than a rough one under the same load.
        assert part.threshold_b.zero_amplitude_m < part.threshold_a.zero_amplitude_m
    [differing] = comparison.differences
    assert (differing.name, differing.a, differing.b) == ('contact.profile', 'rough', 'smooth')
    assert comparison.b.changed == {'contact.profile': 'smooth'}
    assert comparison.a.notes == ('32 of 34 runs were not steady',)


@pytest.mark.parametrize('way', ['frame', 'to_csv', 'to_parquet', 'read again'])
def test_the_table_of_a_sweep_is_one_in_every_form_that_pandas_gives_it(tables, tmp_path, way):
    folder, made = tables
    frame = pd.DataFrame(made['smooth'])
    given, path = frame, tmp_path / 'frame.csv'
    if way == 'to_parquet':
        given = path.with_suffix('.parquet')
        frame.to_parquet(given)
    elif way != 'frame':
        frame.to_csv(path)
        given = path if way == 'to_csv' else pd.read_csv(path, float_precision='round_trip')
    told = force_of(compared(folder / 'rough.csv', given)).agreement
    assert told == force_of(compared(folder / 'rough.csv', folder / 'smooth.csv')).agreement
    assert compared(given, folder / 'rough.csv').a.kind == 'sweep'


def test_a_frame_is_compared_and_fitted_as_its_file_is(tmp_path):
    frame = pd.DataFrame(
        {
            'Preload (N)': [0.1, 0.5, 0.5],
            'Stroke (nm)': [60.0, 80.0, 90.0],
            'Force (mN)': [41.4, np.nan, 70.0],
            'force_err_mN': [2.0, 2.0, 4.0],
        }
    )
    path = tmp_path / 'points.csv'
    frame.to_csv(path, index=False)
    told = force_of(compared(frame, 'model')).agreement
    assert told == force_of(compared(path, 'model')).agreement
    assert told.points == 2
    assert told.chi_square.degrees_of_freedom == 2
    of_frame, of_file = read_experiment(frame).columns, read_experiment(path).columns
    np.testing.assert_array_equal(of_frame['force_n'], of_file['force_n'])
    assert of_frame['force_sigma_n'].tolist() == [2e-3, 4e-3]
    assert len(read_joined([frame, path]).columns['force_n']) == 4


def test_a_table_without_parameters_says_nothing_of_them(tables, tmp_path):
    folder, _ = tables
    lines = (folder / 'rough.csv').read_text(encoding='utf-8').splitlines(keepends=True)
    (tmp_path / 'old.csv').write_text(''.join(lines[2:]), encoding='utf-8')
    comparison = compared(tmp_path / 'old.csv', folder / 'smooth.csv')
    assert comparison.differences == ()
    assert comparison.a.changed is None


def test_a_varied_preload_is_no_difference_of_the_stands(tmp_path, stand):
    for name, preload_n in (('a', 0.3), ('b', 0.4)):
        parameters = stand.updated({'stand.preload': preload_n})
        write_table(sweep_rows(stand, (0.5,), (60e-9,)), tmp_path / f'{name}.parquet', parameters)
    comparison = compared(tmp_path / 'a.parquet', tmp_path / 'b.parquet')
    assert comparison.differences == ()
    assert comparison.a.changed == {}


def test_the_model_stops_at_ctrl_c_and_says_how_far_it_came(noisy):
    def interrupt(done, total):
        raise KeyboardInterrupt

    predict_module._numbers_kept.cache_clear()  # runs that were made before are no cases
    with pytest.raises(Interrupted, match='stopped after 0 of 34 cases'):
        compare(noisy[0], Parameters(), progress=interrupt)


def test_a_table_equals_itself(tables):
    folder, _ = tables
    for quantity in compared(folder / 'rough.csv', folder / 'rough.parquet').quantities:
        assert quantity.agreement.rms == quantity.agreement.largest == 0.0
        assert quantity.left_out == 0


def test_a_finer_table_is_interpolated_and_what_lies_outside_is_left_out(tmp_path):
    columns = ('preload_n', 'amplitude_m', 'force_n')
    a = write_points(tmp_path / 'a.csv', [(0.5, x * 1e-9, 0.0) for x in (5, 15, 30, 50)], columns)
    b = write_points(
        tmp_path / 'b.csv', [(0.5, x * 1e-9, x * 1e-3) for x in (40, 20, 10)], columns
    )
    force = force_of(compared(a, b))
    np.testing.assert_allclose(force.parts[0].x, [15e-9, 30e-9])
    np.testing.assert_allclose(force.parts[0].b, [15e-3, 30e-3])
    assert force.left_out == 2


def test_repeated_measurements_count_in_a_and_are_averaged_in_b(tmp_path):
    columns = ('preload_n', 'amplitude_m', 'force_n')
    rows = [(0.5, 60e-9, 0.02), (0.5, 60e-9, 0.04), (0.5, 80e-9, 0.05)]
    twice = write_points(tmp_path / 'twice.csv', rows, columns)
    once = write_points(tmp_path / 'once.csv', [rows[0], rows[2]], columns)
    force = force_of(compared(twice, once))
    np.testing.assert_allclose(force.parts[0].difference, [0.0, -0.02, 0.0], atol=1e-15)
    back = force_of(compared(once, twice))
    np.testing.assert_allclose(back.parts[0].difference, [0.01, 0.0], atol=1e-15)


@pytest.fixture(scope='module')
def noisy(tmp_path_factory):
    """Give an experiment that is the model with known noise: path and noise."""
    rng = np.random.default_rng(11)
    noise_n = rng.normal(scale=SIGMA_N, size=(len(PRELOADS_N), len(AMPLITUDES_M)))
    stands = [Parameters().updated({'stand.preload': each}) for each in PRELOADS_N]
    true_n = np.array(
        [[run_drive(s, x, 1000.0, STEPS).force_mean_n for x in AMPLITUDES_M] for s in stands]
    )
    rows = [
        (preload_n, amplitude_m, true_n[i, j] + noise_n[i, j], SIGMA_N)
        for i, preload_n in enumerate(PRELOADS_N)
        for j, amplitude_m in enumerate(AMPLITUDES_M)
    ]
    columns = ('preload_n', 'amplitude_m', 'force_n', 'force_sigma_n')
    path = write_points(tmp_path_factory.mktemp('noisy') / 'exp.csv', rows, columns)
    return path, noise_n


def test_the_model_beside_a_noisy_copy_of_itself_leaves_the_noise(noisy):
    path, noise_n = noisy
    comparison = compared(path, 'model')
    told = force_of(comparison).agreement
    assert comparison.b.origin == 'model'
    assert told.bias == pytest.approx(-noise_n.mean(), rel=1e-6)
    assert told.rms == pytest.approx(np.sqrt(np.mean(noise_n**2)), rel=1e-6)
    expected = np.sum((noise_n / SIGMA_N) ** 2)
    assert told.chi_square.chi_square == pytest.approx(expected, rel=1e-6)
    assert told.chi_square.degrees_of_freedom == 34
    # Noise of the stated size: neither suspiciously small nor large.
    assert 0.01 < told.chi_square.p_value < 0.99


def test_the_uncertainty_of_an_amplitude_counts_by_the_slope(tmp_path):
    amplitudes = [40e-9, 60e-9, 80e-9]
    b = write_points(
        tmp_path / 'b.csv',
        [(0.5, x, 1e6 * x) for x in amplitudes],
        ('preload_n', 'amplitude_m', 'force_n'),
    )
    a = write_points(
        tmp_path / 'a.csv',
        [(0.5, x, 1e6 * x + 5e-3, 3e-3, 4e-9) for x in amplitudes],
        ('preload_n', 'amplitude_m', 'force_n', 'force_sigma_n', 'amplitude_sigma_m'),
    )
    # 3 mN and 1 mN/nm times 4 nm make 5 mN.
    chi = force_of(compared(a, b)).agreement.chi_square
    assert chi.chi_square == pytest.approx(3.0, rel=ROUNDING)
    back = force_of(compared(b, a)).agreement.chi_square
    assert back.chi_square == pytest.approx(3.0, rel=ROUNDING)


def test_the_model_runs_at_the_frequency_and_parameters_of_the_table(tmp_path, stand):
    rows = sweep_rows(stand, (0.5,), AMPLITUDES_M[-2:], contact__friction=(0.2, 0.3))
    write_table(rows, tmp_path / 'sweep.csv', stand)
    options = CompareOptions(frequency_hz=50.0, steps=STEPS)
    comparison = compare(tmp_path / 'sweep.csv', stand, options=options)
    force = force_of(comparison)
    assert force.agreement.points == 4
    assert force.agreement.largest == 0.0
    assert [part.at['contact.friction'] for part in force.parts] == [0.2, 0.3]
    changed = stand.updated({'contact.friction': 0.25})
    with pytest.raises(StickSlipError, match=r'contact\.friction is set, but'):
        compare(tmp_path / 'sweep.csv', changed)


def test_a_free_runner_is_compared_by_its_steps(tmp_path):
    free = Parameters().updated({'load_cell.contact': 'absent'})
    rows = sweep_rows(free, (0.1,), (120e-9, 160e-9))
    columns = ('preload_n', 'amplitude_m', 'step_length_m', 'frequency_hz')
    points = [
        (row['preload_n'], row['amplitude_m'], row['step_length_m'] + 1e-9, 1000.0) for row in rows
    ]
    path = write_points(tmp_path / 'steps.csv', points, columns)
    for stand in (free, Parameters()):  # whose runner is taken to be free, as a fit does
        comparison = compare(path, stand, options=CompareOptions(steps=STEPS))
        [steps] = comparison.quantities
        assert steps.name == 'step_length_m'
        assert steps.agreement.bias == pytest.approx(-1e-9, rel=1e-6, abs=0.0)
        assert comparison.b.changed == {'load_cell.contact': 'absent'}
    forces = write_points(tmp_path / 'forces.csv', [(0.1, 1e-7, 0.02)], (*columns[:2], 'force_n'))
    refused(forces, path, 'compare two with a force (held runner)')
    with pytest.raises(StickSlipError, match='without the measured force'):
        compare(forces, free)


def refused(a, b, message, **options):
    with pytest.raises(StickSlipError) as caught:
        compared(a, b, **options)
    assert message in str(caught.value)


def test_what_does_not_fit_is_refused(tables, tmp_path, stand):
    folder, _ = tables
    columns = ('preload_n', 'amplitude_m', 'force_n')
    other = write_points(tmp_path / 'other.csv', [(0.3, 60e-9, 0.1)], columns)
    way = f'compute its points with: stickslip compare {other} model'
    refused(other, folder / 'rough.csv', way)
    for moved in ({'shift_s': 1.0}, {'align': True}):
        refused(other, 'model', 'is by amplitude and has no times; leave out --shift', **moved)
    why = 'is by amplitude: no voltage drove it; leave out --commands'
    refused(other, 'model', why, commands=other)
    two = sweep_rows(stand, (0.3,), (60e-9,), contact__friction=(0.2, 0.3))
    write_table(two, tmp_path / 'two.csv', stand)
    refused(other, tmp_path / 'two.csv', 'two.csv varies contact.friction, which')
    (tmp_path / 'runs.txt').write_text('hello')
    refused(tmp_path / 'runs.txt', other, 'runs.txt: line 1: has no rows of numbers')
    refused(tmp_path / 'none.csv', other, 'cannot be read (No such file')
    refused(other, None, 'has no B and is no recording')


@pytest.mark.parametrize(
    ('old', 'new', 'message'),
    [
        ('force_mean_n,', 'force_mean_mn,', 'line 4: column force_mean_n has no value'),
        (',1e-08', ',10 mN', "line 5, column amplitude_m: '10 mN' is not a number in nm"),
        ('False', '', 'column steady has no value'),
    ],
)
def test_a_damaged_sweep_is_refused(tables, tmp_path, old, new, message):
    folder, _ = tables
    text = (folder / 'rough.csv').read_text(encoding='utf-8')
    assert old in text
    (tmp_path / 'damaged.csv').write_text(text.replace(old, new))
    refused(tmp_path / 'damaged.csv', folder / 'rough.csv', message)
