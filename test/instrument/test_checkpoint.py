# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A restored bench continues to the bit; foreign bytes are refused."""

import json
import pickle
from array import array
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from wrong_checkpoints import checkpoint_of, failures_of, with_content, with_value

from stickslip_ros.errors import StickSlipError, WrongKind
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.checkpoint import SIZE_MAX
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.state_tree import read_tree, to_tree
from stickslip_ros.kernels.record import FLOAT
from stickslip_ros.parameters import Parameters, load_yaml

REALISTIC = Path(__file__).parents[2] / 'config' / 'realistic.yaml'
WAVEFORM = array('d', (0.0, 0.0, 1.37e-3, 113.76725643485543, 7.7e-3, 20.0))
BLOCKS = 12

PROGRAMS: Mapping[str, tuple[Request, ...]] = {
    'at rest': (),
    'sawtooth': (Request('sawtooth', (113.76725643485543, 1153.3955451232346, 0.0)),),
    'steps under a load': (
        Request('load', (0.0123, 0.0, 0.0, 0.0, 0.0, 0.0)),
        Request('steps', (-7.0,)),
    ),
    'jog': (Request('jog', (333.3,)),),
    'waveform': (Request('waveform', WAVEFORM),),
    'closed loop': (Request('position', (271.828e-9, 0.0, 0.0)),),
    'joint': (Request('joint', joints=Joints((), (), (5e-5,))),),
    'preload': (Request('voltage', (77.7,)), Request('preload', (0.31415,))),
    'zero and tare': (
        Request('zero_position'),
        Request('tare_force'),
        Request('voltage', (50.0,)),
    ),
    'faults': (
        Request('fault', settings=(('fault.dead_foot', 2), ('fault.missed_steps', 0.3))),
        Request('sawtooth', (99.9, 800.0, 0.0)),
    ),
    'delayed': (
        Request('fault', settings=(('fault.command_delay', 5e-3),)),
        Request('sawtooth', (99.9, 800.0, 4.0)),
        Request('waveform', WAVEFORM),
        Request('joint', joints=Joints(('runner_joint',), (1e-6,))),
    ),
    'off': (Request('enable_amplifier', (0.0,)), Request('steps', (3.0,))),
}
STANDS: Mapping[str, Mapping[str, Any]] = {
    'ideal': {},
    'one-sided': {'load_cell.contact': 'one_sided', 'load_cell.gap': 3e-9},
    'lugre': {'contact.law': 'lugre'},
    'travelling': {'contact.profile': 'rough_line', 'contact.travel': 0.7},
    'ageing': {'contact.friction_rate': 0.01, 'contact.friction_ageing': 0.01},
    'walker': {'feet.count': (2, 2, 2), 'feet.share': 0.5, 'feet.delay': (0.0, 3.1e-4, 6.2e-4)},
    'drifting': {'interferometer.random_walk': 1e-9, 'interferometer.latency': 2.3e-3},
}


def stands() -> dict[str, Parameters]:
    """Give the stands of all tests by name."""
    return {
        'realistic': load_yaml(REALISTIC),
        **{name: Parameters().updated(values) for name, values in STANDS.items()},
    }


def further_output(bench: Bench) -> list[object]:
    """Return the further output of a bench."""
    outputs: list[object] = []
    for _ in range(BLOCKS):
        output = bench.update(bench.time_ns + bench.parameters.block_ns)
        outputs += [output.readings.trace.tobytes(), output.events, output.status]
        outputs.append(output.ramps.tobytes())
    return [*outputs, bench.ledger, bench.refused]


def busy_bench(parameters: Parameters, requests: tuple[Request, ...]) -> Bench:
    """Return a bench during a program."""
    bench = Bench(parameters)
    bench.update(parameters.block_ns)
    for request in requests:
        bench.accept(request)
    for _ in range(3):
        bench.update(bench.time_ns + parameters.block_ns)
    return bench


@pytest.mark.parametrize(
    ('stand', 'program'),
    [('realistic', program) for program in PROGRAMS]
    + [(stand, program) for stand in STANDS for program in ('closed loop', 'delayed', 'faults')],
)
def test_a_restored_bench_goes_on_as_the_saved_one_does(stand: str, program: str):
    bench = busy_bench(stands()[stand], PROGRAMS[program])
    saved = bench.save()
    assert bench.save() == saved
    again = Bench.restore(saved)
    assert again.save() == saved
    assert further_output(again) == further_output(bench)
    assert again.save() == bench.save()


def test_what_is_kept_beside_comes_back():
    bench = Bench(Parameters())
    trace = bench.update(1_000_000).readings.trace
    attached = Bench.restore(bench.save({'trace': trace, 'name': 'run 7'})).attached
    values = read_tree({'trace': (FLOAT, trace.shape), 'name': str}, attached, 'attached')
    assert values['trace'].tobytes() == trace.tobytes()
    assert values['name'] == 'run 7'
    assert Bench.restore(bench.save()).attached == {}


@pytest.mark.parametrize('order', [1, -1])
def test_the_plant_is_made_anew_to_the_bit_in_whatever_order_it_changed(order: int):
    requests = (Request('preload', (0.31415,)), *PROGRAMS['faults'])[::order]
    bench = busy_bench(stands()['realistic'], requests)
    again = Bench.restore(bench.save())
    assert bench.plant.separate
    assert to_tree(again.stand.plants) == to_tree(bench.stand.plants)


def test_a_reset_of_a_restored_bench_leads_to_rest():
    bench = busy_bench(Parameters(), PROGRAMS['sawtooth'])
    again = Bench.restore(bench.save())
    for each in (bench, again):
        each.accept(Request('reset'))
    assert further_output(again) == further_output(bench)


def test_from_one_state_it_can_go_on_otherwise():
    bench = busy_bench(Parameters(), PROGRAMS['sawtooth'])
    heavy = Bench.restore(bench.save(), {'runner.mass': 0.05, 'limits.soft_max': 1e-3})
    assert heavy.plant.mass_kg == 0.05
    assert heavy.parameters.limits.soft_max == 1e-3
    assert heavy.state.position_m == bench.state.position_m
    assert further_output(heavy)[0] != further_output(bench)[0]


def test_feet_that_are_moved_one_by_one_keep_their_springs_under_another_weight():
    stand = Parameters().updated({'stand.weight': True, 'runner.mass': 0.002})
    bench = busy_bench(stand, PROGRAMS['faults'])
    heavy = Bench.restore(bench.save(), {'runner.mass': 0.02})
    anew = busy_bench(stand.updated({'runner.mass': 0.02}), PROGRAMS['faults'])
    assert to_tree(heavy.stand.plants) == to_tree(anew.stand.plants)


@pytest.mark.parametrize('name', ['stand.preload', 'contact.friction', 'sim.block'])
def test_what_the_state_depends_on_cannot_change(name: str):
    saved = Bench(Parameters()).save()
    value = Parameters().flat()[name]
    with pytest.raises(WrongKind, match=rf'{name} .* as in the checkpoint.*start from rest'):
        Bench.restore(saved, {name: 2.0 * float(value)})
    assert Bench.restore(saved, {name: value}).parameters == Parameters()


@pytest.mark.parametrize('where', [0, 40, -1])
def test_a_damaged_checkpoint_is_refused(where: int):
    saved = bytearray(Bench(Parameters()).save())
    saved[where] ^= 1
    with pytest.raises(StickSlipError, match='checkpoint'):
        Bench.restore(bytes(saved))


@pytest.mark.parametrize('change', [{'kinds': 'other', 'version': '0.0.7'}, {'format': 3}])
def test_one_of_another_form_says_which_and_what_to_do(change: Mapping[str, object]):
    first, _, body = Bench(Parameters()).save().partition(b'\n')
    head = {**json.loads(first), **change}
    message = f'{head["format"]} of version {head["version"]}.*; use the version that'
    with pytest.raises(WrongKind, match=message):
        Bench.restore(json.dumps(head).encode() + b'\n' + body)


class Evil:
    """What is called when it is read."""

    def __reduce__(self):
        return print, ('harm is done',)


@pytest.mark.parametrize(
    'content',
    [
        pytest.param(pickle.dumps(Evil()), id='pickle'),
        pytest.param(bytes(SIZE_MAX + 1), id='bomb'),
        pytest.param(b'[' * 1_000_000, id='deep'),
        pytest.param(b'{"state": ' * 1_000_000, id='deep tables'),
        pytest.param(b'{"state": 0, "state": 0}', id='twice'),
        pytest.param(b'9' * 100_000, id='digits'),
        pytest.param(b'\xff\xfe', id='no text'),
        {'parameters': {}, 'state': {}},
        {'parameters': {}, 'state': {}, 'attached': {}},
        {'parameters': Parameters().flat(), 'state': [1], 'attached': {}},
        {'parameters': Parameters().flat(), 'state': {'time_ns': 0}, 'attached': {}},
        {'parameters': {**Parameters().flat(), 'sim.seed': -1}, 'state': {}, 'attached': {}},
    ],
)
def test_nothing_of_strangers_is_made(content: object, capsys: pytest.CaptureFixture[str]):
    with pytest.raises(StickSlipError, match=r'\A[^\n]*; [^\n]*\Z'):
        Bench.restore(with_content(Bench(Parameters()).save(), content))
    assert capsys.readouterr().out == ''


@pytest.mark.parametrize('size', [0, 1, 50, 200, -1])
def test_a_cut_checkpoint_is_refused(size: int):
    with pytest.raises(WrongKind, match='a checkpoint'):
        Bench.restore(Bench(Parameters()).save()[:size])


@pytest.mark.parametrize(
    ('place', 'value', 'message'),
    [
        ('stand.states.contacts[0].memory.depth', 1024, 'depth 1024 is not from 0 to 1023'),
        ('stand.states.contacts[12].memory.sense', 0.0, 'sense 0.0 is not 1 or -1'),
        (
            'stand.states.contacts[12].springs.ages_s[127]',
            -1.0,
            'ages_s -1.0 is not a finite number',
        ),
        ('stand.states.contacts[12].springs.last[11]', 128, 'last 128 is not from 0 to 127'),
        ('stand.states.contacts[0].on_springs', 2, 'on_springs 2 is not 0 or 1'),
        ('stand.states.clock.cycle', -1, 'cycle -1 is not from 0 to'),
        ('stand.states.velocity_m_per_s', 1e300, 'velocity_m_per_s 1e[+]300 is not a finite'),
        (
            'sensing.load_cell.memory.samples',
            2**63 - 1,
            'samples 9223372036854775807 is not from 0 to',
        ),
        ('sensing.interferometer.memory.lost', 255, 'lost 255 is not 0 or 1'),
        ('sensing.interferometer.noise.place', -1, 'place -1 is not from 0 to'),
        ('motion.wave.cycles', 2**63 - 1, 'cycles 9223372036854775807 is not from'),
        ('motion.is_new', 1, 'is_new 1 is not a bool'),
        ('motion._failed', 2**31, '_failed 2147483648 is not bits of'),
        ('faults.dead_foot', 2**31, 'fault.dead_foot 2147483648 is above the maximum 12'),
        ('time_ns', 1, 'time_ns 1 is not from 0 to .* in steps of 20000'),
        ('_requests', 10**400, '_requests 1000.* is not from'),
    ],
)
def test_what_would_index_or_count_beyond_is_refused_before_a_kernel_sees_it(
    place: str, value: object, message: str
):
    saved = checkpoint_of('feet apart')
    fresh = Bench(Parameters()).save()
    with pytest.raises(StickSlipError, match=rf'{message}[^\n]*; [^\n]*\Z'):
        Bench.restore(with_value(saved, f'state.{place}', value))
    assert Bench(Parameters()).save() == fresh


@pytest.mark.parametrize('drive', ['feet apart', 'delayed'])
def test_each_wrong_value_is_refused_in_a_line_or_runs_on(drive: str):
    assert not list(failures_of(drive, 0, 179))
