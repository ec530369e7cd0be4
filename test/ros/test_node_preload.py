"""The preload is changed over topics; laws and profiles are chosen by parameters of the node."""

from collections.abc import Callable

import pytest

from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import specs

IDLE = Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
PRELOAD_N = 0.8
BURST = (300.0, 1000.0, 50.0)


def test_a_preload_command_is_carried_out_at_its_rate_and_told_by_status_and_event(
    start_drive: Callable,
):
    stand = start_drive({'stand.preload': 0.5, 'stand.preload_rate': 0.6})
    stand.operator.command('preload', PRELOAD_N)
    stand.operator.spin_until(
        lambda: stand.operator.status == IDLE | Status.PRELOADING, 'the preloading bit'
    )
    event = stand.operator.wait_for_event('preload', 0)
    assert event['result'] == 'DONE'
    stand.operator.spin_until(lambda: stand.operator.status == IDLE, 'the end of the preloading')
    assert stand.drive.session.bench.state.preload_n == PRELOAD_N


def test_a_second_preload_command_replaces_the_first(start_drive: Callable):
    stand = start_drive({'stand.preload': 0.5, 'stand.preload_rate': 0.2})
    stand.operator.command('preload', PRELOAD_N)
    stand.operator.spin_until(
        lambda: stand.operator.status == IDLE | Status.PRELOADING, 'the preloading bit'
    )
    stand.operator.command('preload', 0.45)
    event = stand.operator.wait_for_event('preload', 0)
    assert (event['result'], event['number']) == ('DONE', 2)
    assert stand.drive.session.bench.replaced == 1


@pytest.mark.parametrize('law', specs()['contact.law'].choices)
@pytest.mark.parametrize('profile', specs()['contact.profile'].choices)
def test_the_node_steps_with_every_law_and_every_profile(
    start_drive: Callable, law: str, profile: str
):
    stand = start_drive({'contact.law': law, 'contact.profile': profile, 'stand.preload': 0.1})
    stand.operator.command('sawtooth', BURST)
    event = stand.operator.wait_for_event('sawtooth', 0)
    assert (event['result'], event['steps']) == ('DONE', BURST[2])
    # Ten times the stroke: every law steps at this preload.
    assert stand.drive.session.bench.state.position_m > 3e-7
