"""A recorded run on the panel: dragged, played fast and slowly, as often as asked."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_model import opened

from stickslip_ros import open_run
from stickslip_ros.cli.main import main
from stickslip_ros.errors import RecordingError
from stickslip_ros.panel import player as panel_player
from stickslip_ros.panel.player import SPEEDS, Player, samples_of


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
    assert '2 ms in 8 s' in early
    assert early != player.drawing()
    player._stand = None  # as of a recording of another program
    assert player.drawing() == ''


@pytest.mark.parametrize('speed', [SPEEDS[0], 0.5, SPEEDS[-1]])
def test_it_plays_at_the_chosen_speed_to_the_end_and_again(
    recording: Path, clock: Clock, speed: float
):
    player = Player(recording)
    start_s = time_of(player)
    player.do({'do': 'speed', 'speed': speed})
    player.do({'do': 'play', 'wanted': True})
    clock.now_s += 1e-3
    assert time_of(player) - start_s == pytest.approx(1e-3 * speed, rel=1e-6)
    clock.now_s += 1e4
    assert time_of(player) == player.overview()['end_s']
    assert not player.state()['player']['plays']
    player.do({'do': 'play', 'wanted': True})
    assert time_of(player) == start_s
    player.do({'do': 'play', 'wanted': False})
    clock.now_s += 1.0
    assert time_of(player) == start_s


@pytest.mark.parametrize('time_s', [-5.0, 1e9, None, 'x', float('nan'), float('inf')])
def test_a_place_outside_of_the_run_is_its_end_and_none_is_passed_over(
    recording: Path, clock: Clock, time_s: Any
):
    player = Player(recording)
    whole = player.overview()
    player.do({'do': 'seek', 'time_s': time_s})
    player.do({'do': 'speed', 'speed': 3})
    player.do({'do': 'command', 'name': 'voltage', 'values': [300]})
    assert time_of(player) == (whole['end_s'] if time_s == 1e9 else whole['start_s'])
    assert player.state()['player'] == {'plays': False, 'speed': 1.0}


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


def test_a_recording_without_position_is_refused(recording: Path):
    with pytest.raises(RecordingError, match=r'nor positions; .* --map position_m='):
        Player(recording, {'voltage_v': '/voltage.data'})
