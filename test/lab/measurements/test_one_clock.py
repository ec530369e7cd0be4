# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Whether quantities share a clock, for bags and tables alike."""

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from stickslip_ros import Parameters, StickSlipError, compare, simulate
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.mapped import mapped_series
from stickslip_ros.recording.reader import Recording

STORE = get_typestore(Stores.ROS2_JAZZY)
FLOAT, POINT = 'std_msgs/msg/Float64', 'geometry_msgs/msg/PointStamped'
DAY_NS = 1_760_000_000 * 10**9
SAMPLES, RATE_HZ, WAVE_HZ = 2000, 1e4, 50.0
TOPICS = {'voltage_v': '/rig/amplifier.data', 'position_m': '/rig/encoder.point.x'}
MAPS = [word for each in TOPICS.items() for word in ('--map', '='.join(each))]


def bag(folder: Path, log_ns: Any, stamp_ns: Any) -> Path:
    """Write a voltage without and a position with stamps, of one wave."""
    types = STORE.types
    header, time = types['std_msgs/msg/Header'], types['builtin_interfaces/msg/Time']
    wave = 2.0 * np.pi * WAVE_HZ * np.arange(SAMPLES) / RATE_HZ
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        amplifier = writer.add_connection('/rig/amplifier', FLOAT, typestore=STORE)
        encoder = writer.add_connection('/rig/encoder', POINT, typestore=STORE)
        for at_ns, said_ns, phase in zip(log_ns, stamp_ns, wave.tolist(), strict=True):
            volts = types[FLOAT](data=100.0 + 100.0 * np.sin(phase))
            place = types['geometry_msgs/msg/Point'](x=1e-7 * np.sin(phase), y=0.0, z=0.0)
            stamp = time(*divmod(int(said_ns), 10**9))
            point = types[POINT](header(stamp, 'rig'), place)
            for connection, message, kind in ((amplifier, volts, FLOAT), (encoder, point, POINT)):
                writer.write(connection, int(at_ns), STORE.serialize_cdr(message, kind))
    return folder


def times_ns(start_ns: int = DAY_NS) -> Any:
    return start_ns + np.round(np.arange(SAMPLES) * 1e9 / RATE_HZ).astype(np.int64)


def lag_of(table: Path) -> float:
    """Return how late the position is behind the voltage, s, by the phase of the wave."""
    frame = pd.read_csv(table)
    phases = []
    for name in TOPICS:
        known = frame[['time_s', name]].dropna()
        wave = np.exp(2j * np.pi * WAVE_HZ * known.time_s)
        phases.append(np.angle(np.sum((known[name] - known[name].mean()) * wave)))
    return float((phases[1] - phases[0]) / (2.0 * np.pi * WAVE_HZ))


@pytest.mark.parametrize('start_ns', [10**9, DAY_NS - 86_400 * 10**9, DAY_NS + 5 * 10**9])
def test_two_clocks_are_refused_and_the_remedy_puts_both_on_one(tmp_path, capsys, start_ns):
    path = bag(tmp_path / 'a bag', times_ns(), times_ns(start_ns))
    table = tmp_path / 'table.csv'
    words = [
        ['export', path, *MAPS, '-o', table],
        ['compare', path, 'model', *MAPS],
        ['plot', path, *MAPS],
        ['fit', path, *MAPS, '--preload', '0.35', '--free', 'actuator.gain'],
    ]
    for each in words:
        assert main([*map(str, each)]) == 2
        said = capsys.readouterr().err
        assert '/rig/amplifier.data' in said
        assert '/rig/encoder.point.x' in said
    remedy = shlex.split(re.sub('^.*?(?=--map)', '', said.strip().replace('\n', ' ')))
    assert main(['export', str(path), *remedy, '-o', str(table)]) == 0
    assert abs(lag_of(table)) < 1e-6


def test_samples_that_share_the_time_of_a_simulated_clock_are_spread_and_told(tmp_path, capsys):
    coarse_ns = times_ns() // 10**7 * 10**7
    path = bag(tmp_path / 'bag', coarse_ns, times_ns() // 10**7 * 10**7)
    table = tmp_path / 'table.csv'
    assert main(['export', str(path), *MAPS, '-o', str(table)]) == 0
    said = capsys.readouterr().out
    assert all(said.count(topic) == 1 for topic in TOPICS.values())
    frame = pd.read_csv(table)
    assert len(frame) == SAMPLES
    np.testing.assert_allclose(np.diff(frame.time_s), 1.0 / RATE_HZ, rtol=1e-6)


def test_a_time_of_a_simulated_clock_is_the_last_that_it_has_reached(tmp_path: Path):
    """Beside exact stamps, times centred on the ticks were early by half of one."""
    path, table = (
        bag(tmp_path / 'bag', times_ns() // 10**7 * 10**7, times_ns()),
        tmp_path / 't.csv',
    )
    assert main(['export', str(path), *MAPS, '-o', str(table)]) == 0
    assert abs(lag_of(table)) < 1.0 / RATE_HZ


def test_gaps_and_steps_back_are_told_with_their_place(tmp_path: Path):
    stamp_ns = times_ns()
    stamp_ns[1000:] += 50 * 10**6
    log_ns = stamp_ns.copy()
    stamp_ns[[300, 301]] = stamp_ns[[301, 300]]
    path = bag(tmp_path / 'bag', log_ns, stamp_ns)
    notes = mapped_series(Recording(path), {'position_m': TOPICS['position_m']})[1]
    [gap] = [each for each in notes if 'gap' in each]
    found = re.search(r'of ([0-9.]+) s after ([0-9.]+) s', gap)
    assert found
    assert [float(each) for each in found.groups()] == pytest.approx([0.0501, 0.0999], abs=1e-6)
    [back] = [each for each in notes if 'goes back' in each]
    assert '0.0001 s' in back
    assert '1 of 2000' in back


def test_uneven_blocks_of_a_simulated_clock_keep_their_pauses(tmp_path: Path):
    chance = np.random.default_rng(1)
    block = np.sort(chance.integers(0, 40, SAMPLES))
    block[block >= 20] += 100  # a pause of one second
    log_ns = DAY_NS + block.astype(np.int64) * 10**7
    path = bag(tmp_path / 'bag', log_ns, np.zeros(SAMPLES, np.int64))
    series, notes = mapped_series(Recording(path), TOPICS)
    steps_s = np.diff(series['position_m'].time_s)
    assert steps_s.min() > 0.0
    assert np.sort(steps_s)[-1] == pytest.approx(1.0, abs=0.02)
    assert np.sort(steps_s)[-2] < 5e-4
    assert len(notes) == len(TOPICS)


def test_the_remedy_holds_where_one_of_the_topics_is_by_log_time_already(tmp_path: Path):
    recording = Recording(bag(tmp_path / 'bag', times_ns(), times_ns(10**9)))
    mixed = TOPICS | {'voltage_v': f'{TOPICS["voltage_v"]} by log time'}
    with pytest.raises(StickSlipError) as refused:
        mapped_series(recording, mixed)
    named = dict(re.findall('--map (\\w+)="([^"]*)"', str(refused.value)))
    assert set(mapped_series(recording, named)[0]) == set(TOPICS)


def test_a_clock_that_was_set_back_is_refused(tmp_path: Path):
    stamp_ns = times_ns()
    stamp_ns[1200:] -= 3 * 10**9
    path = bag(tmp_path / 'bag', times_ns(), stamp_ns)
    with pytest.raises(StickSlipError, match=r'set back by .* /rig/encoder') as refused:
        mapped_series(Recording(path), TOPICS)
    assert 'by log time' in str(refused.value)


def test_a_drift_is_told_and_its_size_is_right(tmp_path: Path):
    stamp_ns = times_ns() + np.round(np.linspace(0.0, 8e6, SAMPLES)).astype(np.int64)
    path = bag(tmp_path / 'a', times_ns(), stamp_ns)
    [note] = mapped_series(Recording(path), TOPICS)[1]
    found = re.search(r'encoder.* drifts by \+([0-9.]+) ms', note)
    assert found
    assert float(found[1]) == pytest.approx(6.0, rel=0.05)  # between the means of outer quarters
    chance = np.random.default_rng(1)
    late_ns = times_ns() + chance.integers(0, 3 * 10**6, SAMPLES)
    assert (
        mapped_series(Recording(bag(tmp_path / 'b', np.sort(late_ns), times_ns())), TOPICS)[1]
        == []
    )


def test_columns_on_two_clocks_are_refused_and_one_of_them_can_be_chosen(tmp_path, capsys):
    path, table, rows = tmp_path / 'two.csv', tmp_path / 'table.csv', np.arange(200) / RATE_HZ
    columns = np.column_stack((rows, 100.0 + rows, 1.7e9 + rows, 1e9 * rows))
    head = 'Time (s),Voltage (V),Time (s),Position (nm)'
    np.savetxt(path, columns, '%.4f', ',', header=head, comments='')
    assert main(['import', str(path), '-o', str(table)]) == 2
    said = capsys.readouterr().err
    for each in ('voltage_v', 'position_m', "column 1 'Time (s)'", "column 3 'Time (s)'", '1 s'):
        assert each in said
    remedy = shlex.split(re.findall('--map [^"]*"[^"]*"', said)[0])
    assert main(['import', str(path), *remedy, '-o', str(table)]) == 0
    read = pd.read_csv(table, comment='#')
    np.testing.assert_allclose(read.time_s, rows, atol=1e-12)
    np.testing.assert_allclose(read.position_m, rows, atol=1e-12)


def test_a_recording_beside_the_model_is_opened_once(tmp_path, monkeypatch):
    path = simulate(Parameters(), amplitude_m=100e-9, steps=5, record=tmp_path / 'a.mcap').path
    opened, begin = list[str](), Recording.__init__

    def counted(self: Recording, path: Any, *given: Any, **named: Any) -> None:
        opened.append(str(path))
        begin(self, path, *given, **named)

    monkeypatch.setattr(Recording, '__init__', counted)
    compare(path, Parameters())
    assert len(opened) == 1
