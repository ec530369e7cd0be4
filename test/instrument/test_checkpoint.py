"""A bench that is saved and restored goes on to the bit; bytes of strangers make nothing else."""

import hashlib
import json
import pickle
import zlib
from array import array
from collections.abc import Mapping
from pathlib import Path

import pytest

from stickslip_ros.errors import StickSlipError, WrongKind
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.parameters import Parameters, Scalar, load_yaml

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
STANDS: Mapping[str, Mapping[str, Scalar]] = {
    'ideal': {},
    'one-sided': {'load_cell.contact': 'one_sided', 'load_cell.gap': 3e-9},
    'lugre': {'contact.law': 'lugre'},
    'drifting': {'interferometer.random_walk': 1e-9, 'interferometer.latency': 2.3e-3},
}


def stands() -> dict[str, Parameters]:
    """Give the stands of all tests by name."""
    return {
        'realistic': load_yaml(REALISTIC),
        **{name: Parameters().updated(values) for name, values in STANDS.items()},
    }


def went_on(bench: Bench) -> list[object]:
    """Give what a bench says from now on."""
    told: list[object] = []
    for _ in range(BLOCKS):
        output = bench.update(bench.time_ns + bench.parameters.block_ns)
        told += [output.readings.trace.tobytes(), output.events, output.status]
        told.append(output.ramps.tobytes())
    return [*told, bench.ledger, bench.refused]


def begun(parameters: Parameters, requests: tuple[Request, ...]) -> Bench:
    """Give a bench in the midst of a program."""
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
    bench = begun(stands()[stand], PROGRAMS[program])
    saved = bench.save()
    assert bench.save() == saved
    again = Bench.restore(saved)
    assert went_on(again) == went_on(bench)


def test_what_is_kept_beside_comes_back():
    bench = Bench(Parameters())
    trace = bench.update(1_000_000).readings.trace
    told = {'trace': trace, 'name': 'run 7'}
    beside = Bench.restore(bench.save(told)).beside
    assert beside['trace'].tobytes() == trace.tobytes()
    assert beside['name'] == 'run 7'
    assert Bench.restore(bench.save()).beside == {}


def test_a_reset_of_a_restored_bench_leads_to_rest():
    bench = begun(Parameters(), PROGRAMS['sawtooth'])
    again = Bench.restore(bench.save())
    for each in (bench, again):
        each.accept(Request('reset'))
    assert went_on(again) == went_on(bench)


def test_from_one_state_it_can_go_on_otherwise():
    bench = begun(Parameters(), PROGRAMS['sawtooth'])
    heavy = Bench.restore(bench.save(), {'runner.mass': 0.05, 'limits.soft_max': 1e-3})
    assert heavy.plant.mass_kg == 0.05
    assert heavy.parameters.limits.soft_max == 1e-3
    assert heavy.state.position_m == bench.state.position_m
    assert went_on(heavy)[0] != went_on(bench)[0]


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


def test_one_of_another_version_says_which():
    first, _, body = Bench(Parameters()).save().partition(b'\n')
    head = {**json.loads(first), 'kinds': 'other', 'version': '0.0.7'}
    with pytest.raises(WrongKind, match=r'use stickslip_ros 0\.0\.7, which has saved it'):
        Bench.restore(json.dumps(head).encode() + b'\n' + body)


class Evil:
    """What is called when it is read."""

    def __reduce__(self):
        return print, ('harm is done',)


@pytest.mark.parametrize('content', [Evil(), {'refused': Evil()}, [1], {'stand': Path()}])
def test_nothing_of_strangers_is_made(content: object, capsys: pytest.CaptureFixture[str]):
    head = json.loads(Bench(Parameters()).save().partition(b'\n')[0])
    body = zlib.compress(pickle.dumps(content))
    head['sha256'] = hashlib.sha256(body).hexdigest()
    with pytest.raises(WrongKind, match='give one that a bench has saved'):
        Bench.restore(json.dumps(head).encode() + b'\n' + body)
    assert capsys.readouterr().out == ''
