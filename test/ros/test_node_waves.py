"""A wave of the search, played to the node over topics."""

from collections.abc import Callable

import pytest

from stickslip_ros.design.objectives import WaveGoal, assess
from stickslip_ros.design.shapes import SHAPES
from stickslip_ros.design.waves import playable
from stickslip_ros.parameters import Parameters

SAME = 0.01
"""Share by which a step over topics may differ from that of the search."""


def test_over_topics_a_wave_makes_the_steps_that_it_made_in_the_search(start_drive: Callable):
    parameters = Parameters()
    shape = SHAPES['freeze-and-kick'].rows(rise=0.6, freeze=0.8)
    rows = playable(shape, parameters, 300.0, 1000.0)
    stand = start_drive({'load_cell.contact': 'absent'})
    operator, bench = stand.operator, stand.drive.session.bench
    ends_m = [0.0]
    for number, cycles in enumerate((100, 200)):
        operator.command('waveform', rows.tolist(), cycles=cycles)
        event = operator.wait_for_event('waveform', number)
        assert (event['result'], event['steps']) == ('DONE', cycles)
        ends_m.append(float(bench.state.position_m))
    start_m, first_m, second_m = ends_m
    step_m = (second_m - first_m) - (first_m - start_m)  # without what starting takes from both
    found = assess(WaveGoal('speed'), parameters, rows)
    assert step_m / 100.0 == pytest.approx(found.cycle.step_m, rel=SAME)
