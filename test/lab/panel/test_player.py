# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recorded run on the panel: dragged, played fast and slowly, as often as asked."""

from pathlib import Path

import numpy as np
import pytest
from test_model import opened

from stickslip_ros import open_run
from stickslip_ros.errors import RecordingError
from stickslip_ros.interface.cdr import pack_stamped
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.panel import player as panel_player
from stickslip_ros.lab.panel.player import SPEEDS, Player, samples_of
from stickslip_ros.message_types import POINT_STAMPED
from stickslip_ros.recording.recorder import Recorder


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the recording of 60 steps."""
    path = tmp_path_factory.mktemp('run') / 'run.mcap'
    words = ['--voltage', '300', '--frequency', '1000', '--steps', '60', '-o', str(path)]
    assert main(['simulate', *words]) == 0
    return path


class Clock:
    """The wall clock, as a test wants it."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(panel_player, 'monotonic', clock)
    return clock


def time_of(player: Player) -> float:
    frame = player.frame()
    assert frame is not None
    return float(opened(frame)[0]['time_s'])


def test_it_begins_at_the_start_and_shows_each_place_once(recording: Path, clock: Clock):
    player = Player(recording)
    assert time_of(player) == player.overview()['start_s']
    assert player.frame() is None
    player.do({'do': 'seek', 'time_s': 0.05})
    head, curves = opened(player.frame())
    assert head['time_s'] == 0.05
    assert head['scope']['period_s'] == pytest.approx(1e-3, rel=1e-3)
    assert head['figures']['position'] is not None
    assert curves['runner'].shape[1] > 100


def test_the_stand_is_drawn_in_the_cycles_before_the_place(recording: Path):
    player = Player(recording)
    still = player.drawing()
    player.do({'do': 'seek', 'time_s': 0.02})
    early = player.drawing()
    player.do({'do': 'seek', 'time_s': 0.05})
    assert '<animate' not in still
    assert '2 ms are shown in 8 s' in early
    assert early != player.drawing()
    player._stand = None  # as of a recording of another program
    assert player.drawing() == ''


@pytest.mark.parametrize('speed', [SPEEDS[0], 0.5, SPEEDS[-1]])
def test_it_plays_at_the_chosen_speed_to_the_end_and_again(recording, clock, speed):
    player = Player(recording)
    start_s = time_of(player)
    player.do({'do': 'speed', 'speed': speed})
    player.do({'do': 'play', 'wanted': True})
    clock.now_s += 1e-4
    assert time_of(player) - start_s == pytest.approx(1e-4 * speed, rel=1e-6)
    clock.now_s += 1e4
    assert time_of(player) == player.overview()['end_s']
    assert not player.state()['player']['plays']
    player.do({'do': 'play', 'wanted': True})
    assert time_of(player) == start_s
    player.do({'do': 'play', 'wanted': False})
    clock.now_s += 1.0
    assert time_of(player) == start_s


@pytest.mark.parametrize('time_s', [-5.0, 1e9, None, float('nan')])
def test_a_place_outside_of_the_run_is_its_end_and_none_is_passed_over(recording, clock, time_s):
    player = Player(recording)
    whole, first = player.overview(), player.state()['player']['speed']
    player.do({'do': 'seek', 'time_s': time_s})
    player.do({'do': 'speed', 'speed': 3})
    player.do({'do': 'command', 'name': 'voltage', 'values': [300]})
    assert time_of(player) == (whole['end_s'] if time_s == 1e9 else whole['start_s'])
    assert player.state()['player'] == {'plays': False, 'speed': first}


def test_events_and_bits_are_those_of_the_time(recording: Path, clock: Clock):
    player = Player(recording)
    assert player.state()['events'] == []
    player.do({'do': 'seek', 'time_s': 0.03})
    moving = player.state()
    player.do({'do': 'seek', 'time_s': 1e9})
    done = player.state()
    assert (moving['bits'] & 1, done['bits'] & 1) == (1, 0)
    assert (done['events'][-1]['result'], done['events'][-1]['steps']) == ('DONE', 60)


def test_the_overview_spans_the_run(recording: Path):
    samples, whole = samples_of(open_run(recording)), Player(recording).overview()
    heights = [point[1] for point in whole['points']]
    assert max(heights) - min(heights) == pytest.approx(np.ptp(samples[:, 3]), rel=1e-4)
    assert whole['name'] == 'run.mcap'


def test_the_overview_has_positions_where_they_are(recording: Path, tmp_path: Path):
    late = tmp_path / 'late.mcap'
    with Recorder(late, [Channel('/position', POINT_STAMPED, Qos(1))]) as recorder:
        for at_ms, x_m in enumerate((1634.8e-9, 1700e-9, 1650e-9)):
            stamp_ns = at_ms * 1_000_000
            point = pack_stamped(stamp_ns, '', (x_m, 0.0, 0.0))
            recorder.put('/position', stamp_ns, point, wait=True)
    heights = [point[1] for point in Player(late).overview()['points']]
    assert heights == pytest.approx([1634.8e-9, 1700e-9, 1650e-9], rel=1e-6)


@pytest.mark.parametrize('length_s', [0.0, 0.3, 3000.0, 1e6])
def test_a_run_is_played_in_about_ten_seconds_at_first(tmp_path: Path, length_s: float):
    path = tmp_path / 'run.mcap'
    with Recorder(path, [Channel('/position', POINT_STAMPED, Qos(1))]) as recorder:
        for at_ns in (0, round(1e9 * length_s)):
            recorder.put('/position', at_ns, pack_stamped(at_ns, '', (1e-6, 0.0, 0.0)), wait=True)
    speed = Player(path).state()['player']['speed']
    lasts_s = length_s / speed
    assert 6.0 < lasts_s < 16.0 or speed == (SPEEDS[0] if lasts_s < 6.0 else SPEEDS[-1])


def test_a_stretch_is_played_alone(recording: Path):
    played, whole = Player(recording, window_s=(0.01, 0.02)), Player(recording)
    assert (played.overview()['start_s'], played.overview()['end_s']) == (0.01, 0.02)
    assert whole.overview()['end_s'] > 0.05


def test_a_recording_without_position_is_refused(recording: Path):
    with pytest.raises(RecordingError, match=r'nor positions; .* --map position_m='):
        Player(recording, {'voltage_v': '/voltage.vector.x'})
