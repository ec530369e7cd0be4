# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The picture of a run: windows as they are typed, enlarged steps, commands and events."""

import itertools
import math
import re

import matplotlib.image
import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.colors import to_rgb
from mcap_records import rewritten

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, UnknownName
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Event, Result
from stickslip_ros.interface.cdr import pack_float64, pack_string
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.lab.figures.plotting import style_of
from stickslip_ros.lab.measurements.recorded import (
    TimeWindow,
    check_window,
    events_within,
    parse_window,
    recorded_commands,
    recorded_series,
    topic_name,
)
from stickslip_ros.lab.measurements.run_figure import (
    COLOURS,
    PIXELS,
    draw_run,
    fall_times_s,
    plot_run,
)
from stickslip_ros.lab.runs.sawtooth_run import simulate
from stickslip_ros.message_types import FLOAT64, STRING
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.series import Series

ROUNDING = 1e-12
MS_NS = 1_000_000
COLOUR_ERROR = 0.02
"""Eight bits per colour, and a pixel that a thin line fills."""
PIXELS_PER_LINE = 100
"""Least number of pixels in the colour of a curve: far fewer than its length."""


@pytest.mark.parametrize(
    ('text', 'start_s', 'length_s'),
    [
        ('2ms@0.3s', 0.3, 2e-3),
        ('500us@10ms', 10e-3, 500e-6),
        ('500µs@0', 0.0, 500e-6),
        ('0.5@1', 1.0, 0.5),
        (' 1e-3 s @ -2 ms ', -2e-3, 1e-3),
    ],
)
def test_a_window_is_taken_as_it_is_typed(text, start_s, length_s):
    window = parse_window(text)
    assert window.start_s == pytest.approx(start_s, rel=ROUNDING, abs=0.0)
    assert window.end_s - window.start_s == pytest.approx(length_s, rel=1e-9)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('2ms', "window '2ms' is not LENGTH@START; write it as 2ms@0.3s"),
        ('2ms@', "window '' is not a number in us, ms or s"),
        ('2 min@0', "window '2 min' is not a number in us, ms or s"),
        ('2ms@1@2', "window '1@2' is not a number in us, ms or s"),
        ('0ms@0', 'length of the window 0 s is not above 0 s; raise it'),
    ],
)
def test_a_malformed_window_is_refused(text, message):
    with pytest.raises(StickSlipError, match=re.escape(message)):
        parse_window(text)


def test_a_window_is_cut_to_the_run_or_refused_outside_of_it():
    run = TimeWindow(1.0, 2.0)
    assert check_window(TimeWindow(0.5, 1.5), run) == (1.0, 1.5)
    for outside in (TimeWindow(0.0, 0.5), TimeWindow(2.5, 3.0)):
        with pytest.raises(OutOfRange, match='outside of the run, 1 s to 2 s; move it'):
            check_window(outside, run)


def test_the_trace_is_drawn_where_it_is_recorded(recorded_run, tmp_path):
    plot = plot_run(Recording(recorded_run[1]), tmp_path / 'run.png')
    trace = Recording(recorded_run[1]).trace()
    names = [each.name for each in plot.quantities]
    assert names == ['position_m', 'force_n', 'voltage_v', 'foot_m']
    position = plot.quantities[0]
    assert position.samples == len(trace['position'])
    assert position.largest == trace['position'].value.max()
    assert position.smallest == trace['position'].value.min()
    assert [(each.command, each.result) for each in plot.events] == [('sawtooth', 'DONE')]
    picture = matplotlib.image.imread(tmp_path / 'run.png')
    assert picture.shape[1] == PIXELS
    assert all(shows(picture, COLOURS[each.name]) for each in plot.quantities)


def test_a_window_shows_its_samples_only(recorded_run, tmp_path):
    window = parse_window('2ms@5ms')
    plot = plot_run(Recording(recorded_run[1]), tmp_path / 'run.png', window)
    trace = Recording(recorded_run[1]).trace()['voltage'].window(*window)
    assert (plot.start_s, plot.end_s) == window
    assert plot.quantities[2].samples == len(trace)
    assert plot.quantities[2].largest == trace.value.max()
    assert (plot.commands, plot.events) == ((), ())


def test_a_window_without_a_sample_is_refused(recorded_run, tmp_path):
    with pytest.raises(OutOfRange, match='too short: no sample lies in it; raise it'):
        plot_run(Recording(recorded_run[1]), tmp_path / 'run.png', parse_window('1us@5.005ms'))
    with pytest.raises(OutOfRange, match='outside of the run'):
        plot_run(Recording(recorded_run[1]), tmp_path / 'run.png', parse_window('1s@5s'))
    with pytest.raises(UnknownName, match='kind of picture'):
        plot_run(Recording(recorded_run[1]), tmp_path / 'run.gif')
    assert list(tmp_path.iterdir()) == []


def shows(picture, colour):
    """Return whether a picture has a curve of a colour."""
    with rc_context(style_of()):
        rgb = to_rgb(colour)
    near = np.all(np.abs(picture[:, :, :3] - rgb) < COLOUR_ERROR, axis=2)
    return near.sum() > PIXELS_PER_LINE


def words_in(picture):
    """Return the texts of a picture in SVG."""
    return re.findall('<!-- (.*?) -->', picture.read_text(encoding='utf-8'))


def free_run(folder, voltage_v):
    """Record steps of a free runner; return the recording."""
    path = folder / 'free.mcap'
    simulate(
        Parameters().updated({'load_cell.contact': 'absent'}),
        voltage_v=voltage_v,
        frequency_hz=100.0,
        steps=6,
        record=path,
    )
    return path


def test_the_first_steps_of_runner_and_feet_are_enlarged_above_the_run(tmp_path):
    path = free_run(tmp_path, 300.0)
    plot_run(Recording(path), tmp_path / 'run.png', with_steps=True)
    above, below = np.array_split(matplotlib.image.imread(tmp_path / 'run.png'), [440], axis=0)
    shown = [{name for name in COLOURS if shows(part, COLOURS[name])} for part in (above, below)]
    assert shown == [{'position_m', 'foot_m'}, {'position_m', 'force_n', 'voltage_v'}]
    plot_run(Recording(path), tmp_path / 'run.svg', title='A run', with_steps=True)
    words = words_in(tmp_path / 'run.svg')
    assert {'A run', 'runner', 'feet', 'stick', 'slip'} <= set(words)
    # The known 0-amplitude at 0.5 N is 66 nm of the 160 nm of a stroke.
    assert 'first steps, enlarged: 94 nm each; the feet move by 160 nm' in words


def test_where_the_runner_only_follows_there_is_no_word_of_slip(tmp_path):
    plot_run(Recording(free_run(tmp_path, 75.0)), tmp_path / 'run.svg', with_steps=True)
    words = words_in(tmp_path / 'run.svg')
    assert {'runner', 'feet'} <= set(words)
    assert not {'stick', 'slip'} & set(words)


def test_commands_are_named_with_their_numbers(recorded_run, tmp_path):
    plot = plot_run(Recording(recorded_run[1]), tmp_path / 'run.svg')
    assert plot.commands == ((0.0, 'sawtooth', '300 V, 1000 Hz, 20 steps'),)
    words = words_in(tmp_path / 'run.svg')
    assert {'sawtooth', '300 V, 1000 Hz, 20 steps'} <= set(words)
    assert 'DONE' not in words


@pytest.mark.parametrize(
    ('name', 'values', 'numbers'),
    [
        ('voltage', (7.5,), '7.5 V'),
        ('load', (-0.1, 0.0, 0.0, 0.0, 0.0, 0.0), '-100 mN'),
        ('position', (1e-6, 0.0, 0.0), '1000 nm'),
        ('steps', (-3.0,), '-3 steps'),
        ('waveform', (0.0, 0.0, 0.001, 5.0), '2 rows'),
        ('stop', (), ''),
        ('joint', Joints((), (1e-6,)), '1000 nm'),
        ('joint', Joints(('runner_joint',), (math.nan,), (2e-5,)), '20 um/s'),
        ('joint', Joints(('arm', 'runner_joint'), (1.0, 1e-6)), '2 joints'),
        ('joint', Joints(), ''),
    ],
)
def test_the_numbers_of_a_command_are_written_as_people_read_them(tmp_path, name, values, numbers):
    asked = {'joints': values} if isinstance(values, Joints) else {'values': values}
    path = tmp_path / 'run.mcap'
    with RunWriter(path, Parameters(), wait=True) as writer:
        run = ReportingBench(Parameters(), writer=writer)
        run.update(MS_NS)
        run.update(2 * MS_NS, [Request(name, **asked)])
    assert recorded_commands(Recording(path)) == [(0.001, name, numbers)]


@pytest.mark.parametrize('times_ms', [(10, 60, 97), (10, 75, 88), (10, 20, 21, 22, 90)])
def test_labels_of_commands_give_way_to_each_other_to_marks_and_to_the_edge(tmp_path, times_ms):
    parameters = Parameters().updated({'load_cell.contact': 'absent'})
    path = tmp_path / 'run.mcap'
    with RunWriter(path, parameters, wait=True) as writer:
        run = ReportingBench(parameters, writer=writer)
        for time_ms in range(1, 101):
            burst = Request('sawtooth', (150.0, 500.0, 1.0))
            level = Request('voltage', (10.0,))
            run.update(time_ms * MS_NS, [burst, level] if time_ms in times_ms else [])
    figure, _ = draw_run(Recording(path))
    figure.draw_without_rendering()
    axes = figure.axes[-1]
    labels = [label.get_window_extent() for label in axes.texts]
    marks = [axes.transData.transform(line.get_xydata()) for line in axes.lines]
    assert len(labels) >= len(times_ms)
    assert all(axes.bbox.x0 < each.x0 and each.x1 < axes.bbox.x1 for each in labels)
    assert not any(one.overlaps(other) for one, other in itertools.combinations(labels, 2))
    assert not any(each.contains(*mark) for each in labels for mark in np.concatenate(marks))


def _voltage(values, rate_hz=1000.0):
    return Series(np.arange(len(values)) / rate_hz, np.array(values, dtype=float), 'V', 'test')


@pytest.mark.parametrize('sense', [1.0, -1.0])
def test_falls_are_found_in_either_direction_and_not_in_a_ramp(sense):
    falls_s = fall_times_s(_voltage(sense * np.tile(np.arange(10.0), 4)))
    assert falls_s == pytest.approx([0.009, 0.019, 0.029], rel=ROUNDING)
    assert fall_times_s(_voltage(sense * np.arange(50.0))) == []
    assert fall_times_s(_voltage(np.zeros(50))) == []


@pytest.fixture
def recorded(tmp_path):
    """Give a recording without trace: voltage, events, in a namespace, and strangers."""
    path = tmp_path / 'run.mcap'
    channels = [
        Channel('/left/voltage', FLOAT64, Qos(1)),
        Channel('/left/command/voltage', FLOAT64, Qos(1)),
        Channel('/left/truth/voltage', FLOAT64, Qos(1)),
        Channel('/left/position', FLOAT64, Qos(1)),
        Channel('/left/stickslip_drive/event', STRING, Qos(1)),
    ]
    with Recorder(path, channels) as recorder:

        def put(topic, at_ms, data):
            recorder.put(f'/left/{topic}', at_ms * MS_NS, data, wait=True)

        put('command/voltage', 0, pack_float64(300.0))
        put('truth/voltage', 0, pack_float64(400.0))
        put('position', 0, pack_float64(1.0))
        for at_ms in (1, 2, 4, 6):
            put('voltage', at_ms, pack_float64(10.0 * at_ms))
        event = Event(7 * MS_NS, 3, 'steps', Result.ABORTED)
        for text in (event.to_json(), 'no JSON', '[]', '{"other": 1}'):
            put('stickslip_drive/event', 7, pack_string(text))
        put('voltage', 8, pack_float64(80.0))
    return path


def test_topics_are_found_in_a_namespace_and_never_mistaken(recorded):
    recording = Recording(recorded)
    assert topic_name(recording, 'voltage') == '/left/voltage'
    assert topic_name(recording, 'position') == ''
    assert list(recorded_series(recording)) == ['voltage_v']
    assert recorded_commands(recording) == []


def test_events_of_a_stretch_are_read(recorded):
    recording = Recording(recorded)
    [event] = events_within(recording, TimeWindow(0.0, 8e-3))
    assert (event.command, event.result) == ('steps', 'ABORTED')
    assert events_within(recording, TimeWindow(0.0, 6e-3)) == []


def test_topics_are_drawn_without_a_trace(recorded, tmp_path):
    plot = plot_run(Recording(recorded), tmp_path / 'run.svg')
    [voltage] = plot.quantities
    assert (voltage.samples, voltage.smallest, voltage.largest) == (5, 10.0, 80.0)
    words = words_in(tmp_path / 'run.svg')
    assert words.count('steps') == words.count('ABORTED') == 1
    plot_run(Recording(recorded), tmp_path / 'steps.svg', with_steps=True)
    assert words_in(tmp_path / 'steps.svg') == words


def test_a_recording_of_nothing_is_refused(tmp_path):
    with Recorder(tmp_path / 'run.mcap', [Channel('/voltage', FLOAT64, Qos(1))]):
        pass
    with pytest.raises(RecordingError, match='has neither position, force nor voltage'):
        plot_run(Recording(tmp_path / 'run.mcap'), tmp_path / 'run.png')


@pytest.mark.parametrize('window', [None, parse_window('3ms@1ms')])
def test_a_long_recording_is_drawn_stretch_by_stretch_with_the_same_extents(
    recorded_run, monkeypatch, window, tmp_path
):
    path = rewritten(recorded_run[1], tmp_path / 'run.mcap', chunk_size=9000)
    told, drawn = [], []
    for size_bytes in (1 << 30, 20_000):
        monkeypatch.setattr('stickslip_ros.lab.measurements.recorded.STRETCH_BYTES', size_bytes)
        figure, plot = draw_run(Recording(path), window)
        told.append(plot)
        drawn.append([line.get_ydata() for axes in figure.axes for line in axes.lines[:1]])
    assert told[0] == told[1]
    for short, long in zip(*drawn, strict=True):
        assert (short.min(), short.max()) == (long.min(), long.max())
