# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A sensor that is enabled is in the recording, and wherever a recording is shown or compared."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from stickslip_ros.lab.comparison.compare import compare
from stickslip_ros.lab.measurements.recorded_run import open_run
from stickslip_ros.lab.measurements.run_figure import plot_run
from stickslip_ros.lab.panel.curves import SAMPLE_COLUMNS
from stickslip_ros.lab.panel.player import Player, samples_of
from stickslip_ros.lab.runs.sawtooth_run import simulate
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording

PROBE = 'foot_position_m'
LAG_M = 60e-9
"""The low-pass of the probe lets it be so far behind in a fall of 130 nm."""


@pytest.fixture(scope='module')
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    stand = Parameters().updated({'capacitive_probe.enabled': True, 'sim.publish_truth': True})
    run = simulate(stand, amplitude_m=130e-9, steps=20, record=True)
    return run.save(tmp_path_factory.mktemp('run') / 'probe.mcap')


def test_its_readings_are_a_column_of_the_run_and_a_topic_of_the_same_numbers(path: Path):
    frame, recording = open_run(path).frame, Recording(path)
    assert frame.attrs['units'][PROBE] == 'm'
    assert np.max(np.abs(frame[PROBE] - frame['foot_m'])) < LAG_M
    told, truth = recording.series('foot_position'), recording.series('truth/foot_position')
    at = np.searchsorted(frame.index, told.time_s - 1e-9)
    assert len(told) > 20
    np.testing.assert_array_equal(told.value, frame[PROBE].to_numpy()[at])
    np.testing.assert_array_equal(truth.value, frame['foot_m'].to_numpy()[at])


def test_its_unit_stays_with_it_in_xarray(path: Path):
    pytest.importorskip('xarray', reason='no xarray: pip install xarray')
    labelled = open_run(path).frame.to_xarray()
    assert labelled.attrs['source'] == str(path)
    units = {name: labelled[name].attrs['units'] for name in (PROBE, 'force_n', 'time_s')}
    assert units == {PROBE: 'm', 'force_n': 'N', 'time_s': 's'}


def test_a_picture_of_the_run_shows_it(path: Path, tmp_path: Path):
    plot = plot_run(Recording(path), tmp_path / 'run.png')
    assert PROBE in [each.name for each in plot.quantities]


def test_it_is_compared_with_a_run_and_with_a_measured_table(path: Path, tmp_path: Path):
    told = {each.name: each for each in compare(path, path).quantities}
    assert told[PROBE].agreement.rms == 0.0
    frame = open_run(path).frame
    table = tmp_path / 'measured.csv'
    rows = zip(frame.index, 1e9 * frame[PROBE] + 5.0, strict=True)
    table.write_text('time (s),foot position (nm)\n' + ''.join(f'{t},{y}\n' for t, y in rows))
    [measured] = compare(path, table).quantities
    assert measured.name == PROBE
    assert measured.agreement.rms == pytest.approx(5e-9, rel=1e-6)


def test_the_panel_shows_it_where_it_is_there(path: Path):
    samples, player = samples_of(open_run(path)), Player(path)
    player.do({'do': 'seek', 'time_s': 0.01})
    frame = player.frame()
    [size] = struct.unpack('<I', frame[:4])
    head = json.loads(frame[4 : 4 + size])
    assert np.isfinite(samples[:, SAMPLE_COLUMNS.index('foot_position')]).all()
    assert np.isfinite(head['figures']['foot_position'])
    assert 'foot_position' in [name for name, *_ in head['curves']]
