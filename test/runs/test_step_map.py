"""The velocity of a free runner over frequency, amplitude and load, as linear_drive.md says."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.sawtooth_run import run_drive
from stickslip_ros.runs.step_map import draw_step_map, step_map

PAGE = Path(__file__).parents[2] / 'docs' / 'explanation' / 'linear_drive.md'


@pytest.fixture
def damped() -> Parameters:
    return Parameters().updated({'runner.damping': 80.0})


def test_without_load_it_is_the_step_length_of_a_free_runner_times_the_frequency(damped):
    table = step_map(damped, frequency_hz=[200.0, -1000.0], amplitude_m=[90e-9, 160e-9])
    free = damped.updated({'load_cell.contact': 'absent'})
    for row in table.to_dict('records'):
        alone = run_drive(free, row['amplitude_m'], row['frequency_hz'], 120)
        assert row['step_length_m'] == alone.step_length_m
        assert row['velocity_m_per_s'] == alone.step_length_m * abs(row['frequency_hz'])
        assert np.sign(row['velocity_m_per_s']) == np.sign(row['frequency_hz'])
    assert table.attrs['parameters'] == free.flat()


def test_a_load_speeds_up_one_direction_as_it_slows_down_the_other(damped):
    table = step_map(
        damped, frequency_hz=[500.0, -500.0], amplitude_m=120e-9, load_n=[-0.05, 0.0, 0.05]
    )
    forwards, backwards = (
        table[table['frequency_hz'] == each]['velocity_m_per_s'].to_numpy()
        for each in (500.0, -500.0)
    )
    assert np.all(np.diff(forwards) > 0.0)
    np.testing.assert_allclose(forwards, -backwards[::-1], rtol=1e-2)


@pytest.mark.parametrize(('load_n', 'why'), [(0.43, 'that friction holds'), (11.0, 'load_limit')])
def test_a_load_that_friction_or_the_stand_does_not_hold_is_refused(load_n: float, why: str):
    with pytest.raises(OutOfRange, match=why):
        step_map(Parameters(), frequency_hz=100.0, amplitude_m=100e-9, load_n=load_n)


def test_a_map_is_drawn_with_a_panel_for_each_load_and_a_curve_for_each_frequency(damped):
    table = step_map(
        damped, frequency_hz=[100.0, 1000.0], amplitude_m=[0.0, 160e-9], load_n=[0.0, 0.05]
    )
    panels = draw_step_map(table).axes
    assert [len(axes.lines) for axes in panels] == [2, 2]
    fastest = np.asarray(panels[0].lines[1].get_ydata())[-1]
    assert fastest == pytest.approx(1e6 * table['velocity_m_per_s'].iloc[3])


def test_the_page_says_what_its_example_gives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    section = PAGE.read_text(encoding='utf-8').partition('## In steps')[2]
    example = re.search(r'```python\n(.*?)```', section, re.DOTALL)[1]
    names: dict[str, Any] = {}
    exec(compile(example, str(PAGE), 'exec'), names)
    table = names['table']
    full = table[table['amplitude_m'] == table['amplitude_m'].max()]
    onsets_nm = 1e9 * (full['amplitude_m'] - full['step_length_m'])
    said = re.findall(r'\| ([\d.]+) nm', section)
    by_load = onsets_nm.to_numpy().reshape(3, 3).T.ravel()
    assert [f'{each:.1f}' for each in by_load] == said
    assert Path('step_map.png').exists()
