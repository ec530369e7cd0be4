"""A request comes back from a recording as it was, and two recordings are told apart."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording import Channel, Qos, Recorder, Recording, cdr
from stickslip_ros.recording import messages as m
from stickslip_ros.recording.feed import Packed
from stickslip_ros.recording.fingerprint import compare_data, data_digest
from stickslip_ros.recording.request_log import recorded_requests
from stickslip_ros.recording.run import RunWriter, pack_effect

NUMBER = st.floats(allow_nan=False)


def numbers(count: int) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[NUMBER] * count)


REQUESTS = st.one_of(
    st.builds(Request, st.sampled_from(['voltage', 'preload', 'jog']), numbers(1)),
    st.builds(Request, st.just('steps'), st.integers(-(2**31), 2**31 - 1).map(lambda n: (n,))),
    st.builds(Request, st.just('sawtooth'), st.lists(NUMBER, max_size=5).map(tuple)),
    st.builds(Request, st.just('waveform'), st.lists(NUMBER, max_size=9).map(tuple)),
    st.builds(Request, st.just('position'), numbers(3)),
    st.builds(Request, st.just('load'), numbers(6)),
    st.sampled_from([Request('stop'), Request('reset'), Request('clear_faults')]),
    st.just(Request('fault', settings=(('fault.dead_foot', 2), ('fault.load_cell', 'freeze')))),
)


def written(path: Path, requests: list[Request], voltage_v: float = 0.0) -> Recording:
    with RunWriter(path, Parameters(), wait=True) as writer:
        writer.begin(0, Status(0))
        for tick, request in enumerate(requests):
            writer.write(pack_effect(request, tick))
        writer.write(Packed('piezo', len(requests), cdr.pack_float64(voltage_v)))
    return Recording(path)


@given(requests=st.lists(REQUESTS, max_size=6))
def test_requests_come_back_in_their_order_and_to_the_bit(tmp_path_factory, requests):
    recording = written(tmp_path_factory.mktemp('log') / 'run.mcap', requests)
    read = list(recorded_requests(recording))
    assert [each.time_ns for each in read] == list(range(len(requests)))
    back = [replace(each.request, values=tuple(each.request.values)) for each in read]
    assert back == requests


def test_a_recording_that_is_no_run_has_no_requests(tmp_path):
    path = tmp_path / 'other.mcap'
    with Recorder(path, [Channel('/voltage', m.FLOAT64, Qos(1))]):
        pass
    with pytest.raises(RecordingError, match='does not say which topic is which'):
        list(recorded_requests(Recording(path)))


def test_equal_recordings_are_equal_and_the_first_difference_is_named(tmp_path):
    requests = [Request('voltage', (1.0,)), Request('stop')]
    one = written(tmp_path / 'one.mcap', requests)
    same = written(tmp_path / 'same.mcap', requests)
    other = written(tmp_path / 'other.mcap', requests, voltage_v=2.0)
    short = written(tmp_path / 'short.mcap', requests[:1])
    assert compare_data(one, same) is None
    assert data_digest(one) == data_digest(same) != data_digest(other)
    difference = compare_data(one, other)
    assert difference is not None
    assert (difference.message, difference.topic, difference.what) == (4, '/voltage', 'data')
    assert compare_data(one, short) is not None
