"""The picture of a run."""

import matplotlib.image
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.recording.series import Series
from stickslip_ros.study.run_figure import (
    DOTS_PER_INCH,
    FIGURE_INCHES,
    PANELS,
    draw_run,
    step_window,
)

COLOUR_ERROR = 0.02
"""Eight bits per colour, and a pixel that a thin line fills."""
PIXELS_PER_LINE = 100
"""Least number of pixels in the colour of a curve: far fewer than its length."""


@pytest.fixture(scope='module')
def picture(recorded_run, tmp_path_factory):
    path = tmp_path_factory.mktemp('figure') / 'folder' / 'run.png'
    draw_run(recorded_run[1], path, 'A run')
    return path


def test_the_picture_has_the_declared_size(picture):
    height, width, _ = matplotlib.image.imread(picture).shape
    assert (width, height) == tuple(round(side * DOTS_PER_INCH) for side in FIGURE_INCHES)


def test_every_panel_shows_its_curve(picture):
    pixels = matplotlib.image.imread(picture)[:, :, :3]
    assert np.mean(pixels) < 0.99
    for *_, colour in PANELS:
        near = np.all(np.abs(pixels - to_rgb(colour)) < COLOUR_ERROR, axis=2)
        left, right = np.array_split(near, 2, axis=1)
        assert left.sum() > PIXELS_PER_LINE
        assert right.sum() > PIXELS_PER_LINE


def test_the_same_recording_gives_the_same_picture(picture, recorded_run, tmp_path):
    draw_run(recorded_run[1], tmp_path / 'again.png', 'A run')
    again = matplotlib.image.imread(tmp_path / 'again.png')
    np.testing.assert_array_equal(again, matplotlib.image.imread(picture))


def test_a_picture_can_be_drawn_as_svg(recorded_run, tmp_path):
    draw_run(recorded_run[1], tmp_path / 'run.svg')
    text = (tmp_path / 'run.svg').read_text(encoding='utf-8')
    assert '<svg' in text
    assert text.count('<path') > 10


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(RecordingError):
        draw_run(tmp_path / 'missing.mcap', tmp_path / 'run.png')
    assert not (tmp_path / 'run.png').exists()


def _voltage(values, rate_hz=1000.0):
    return Series(np.arange(len(values)) / rate_hz, np.array(values, dtype=float), 'V', 'test')


@pytest.mark.parametrize('sense', [1.0, -1.0])
def test_the_enlarged_step_is_the_third_of_the_run(sense):
    sawtooth = sense * np.tile(np.arange(10.0), 6)
    start_s, end_s = step_window(_voltage(sawtooth))
    # The third fall is between the samples 29 and 30, the period is ten samples.
    assert start_s == pytest.approx(0.029 - 0.8 * 0.010, rel=1e-9, abs=0.0)
    assert end_s == pytest.approx(0.029 + 0.8 * 0.010, rel=1e-9, abs=0.0)


@pytest.mark.parametrize(
    'values',
    [np.zeros(50), np.arange(50), np.tile(np.arange(10.0), 3)],
    ids=['0', 'ramp', '2 falls'],
)
def test_a_run_with_fewer_falls_is_shown_whole(values):
    assert step_window(_voltage(values)) == (0.0, (len(values) - 1) / 1000.0)


def test_a_recording_without_a_trace_is_refused(tmp_path, stand):
    path = tmp_path / 'empty.mcap'
    with RunWriter(path, stand):
        pass
    with pytest.raises(RecordingError, match='has no trace to draw; record a run'):
        draw_run(path, tmp_path / 'run.png')
    assert not (tmp_path / 'run.png').exists()


def test_a_picture_of_an_unknown_kind_is_refused(recorded_run, tmp_path):
    with pytest.raises(StickSlipError):
        draw_run(recorded_run[1], tmp_path / 'run.pictogram')
