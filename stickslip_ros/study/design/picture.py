"""The picture of an answer: the wave, what it does in a cycle, and how it was found."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.drive.advance import FOOT, FORCE, POSITION, TIME, VOLTAGE
from stickslip_ros.study.design.answer import RIVAL, Answer, Entry
from stickslip_ros.study.design.front import FrontOrder, Point
from stickslip_ros.study.design.objectives import OBJECTIVES, WORTHLESS, assess
from stickslip_ros.study.design.steady_cycle import SteadyCycle
from stickslip_ros.study.plotting import GREY, curve_style, draw_legend, label_axes, new_figure
from stickslip_ros.units import NM, display_unit

CONTACT = FORCE + 1
MS = 1e3
COLOURS = colormaps['viridis']
"""From one end of a front to the other."""


def draw_answer(answer: Answer) -> Figure:
    """Draw best wave and best saw-tooth over a cycle, and the searches over their evaluations."""
    title = f'{answer.order.goal.objective}: {answer.best} and {RIVAL}'
    figure = new_figure(11.0, 7.5, title)
    panels = figure.subplots(2, 2)
    for number, name in enumerate(dict.fromkeys((answer.best, RIVAL))):
        _draw_cycle(panels.flat[:3], number, name, _look(answer, answer.entries[name]))
    voltage, motion, contact, history = panels.flat
    label_axes(voltage, '', 'voltage (V)', 'the wave')
    label_axes(motion, '', 'displacement (nm)', 'runner (thick) and mean foot (thin)')
    label_axes(contact, 'time (ms)', 'force / friction limit', 'contacts: full slip at 1 and -1')
    for limit in (-1.0, 1.0):
        contact.axhline(limit, color=GREY, linestyle=':')
    draw_legend(voltage)
    _draw_history(history, answer)
    return figure


def draw_fronts(order: FrontOrder, fronts: Mapping[str, Sequence[Point]]) -> Figure:
    """Draw the fronts of two objectives, and the waves of the last one from end to end."""
    first, second = (goal.objective for goal in order.goals)
    figure = new_figure(11.0, 4.6, f'{first} and {second}: no wave of its shape is better in both')
    front, wave = figure.subplots(1, 2)
    scales = [_scale(name) for name in (first, second)]
    for number, (shape, points) in enumerate(fronts.items()):
        x, y = np.array([point.values for point in points]).T * [[f] for f, _ in scales]
        front.plot(x, y, **curve_style(number).line_and_points, label=shape)
    shape, last = list(fronts.items())[-1]
    for number, point in enumerate(last):
        rows = point.wave.rows(order.first.stand, backwards=order.first.goal.backwards)
        colour = COLOURS(number / max(1, len(last) - 1))
        wave.plot(rows[:, TIME] / rows[-1, TIME], rows[:, VOLTAGE], color=colour)
        x, y = (value * f for value, (f, _) in zip(point.values, scales, strict=True))
        front.plot(x, y, 'o', color=colour, zorder=3)
    labels = (
        f'{name}{unit}, {"more" if OBJECTIVES[name].is_largest else "less"} is better'
        for name, (_, unit) in zip((first, second), scales, strict=True)
    )
    label_axes(front, *labels)
    label_axes(wave, 'time / period', 'voltage (V)', f'{shape}: its waves, best {first} darkest')
    draw_legend(front)
    return figure


def _look(answer: Answer, entry: Entry) -> SteadyCycle:
    """Play a wave once more, and look at its contacts."""
    order = answer.order
    rows = entry.wave.rows(order.stand, backwards=order.goal.backwards)
    return assess(order.goal, entry.wave.under(order.stand), rows, looks=True).cycle


def _draw_cycle(panels: Sequence[Axes], number: int, name: str, cycle: SteadyCycle) -> None:
    style = curve_style(number).line
    trace = cycle.trace
    time_ms = trace[:, TIME] * MS
    voltage, motion, contact = panels
    voltage.plot(time_ms, trace[:, VOLTAGE], **style, label=name)
    feet_nm = (trace[:, FOOT] - trace[0, FOOT]) * NM
    motion.plot(time_ms, feet_nm, **style, linewidth=0.7)
    motion.plot(time_ms, (trace[:, POSITION] - trace[0, POSITION]) * NM, **style, linewidth=2.0)
    contact.plot(time_ms, trace[:, CONTACT], **style)


def _draw_history(axes: Axes, answer: Answer) -> None:
    objective = OBJECTIVES[answer.order.goal.objective]
    factor, unit = _scale(answer.order.goal.objective)
    sign = -1.0 if objective.is_largest else 1.0
    searched = [(name, entry) for name, entry in answer.entries.items() if entry.history]
    for number, (name, entry) in enumerate(searched):
        costs = np.array(entry.history)
        known = (
            np.flatnonzero(costs < costs[0]) if costs[0] >= WORTHLESS else np.arange(len(costs))
        )
        axes.plot(known + 1, sign * factor * costs[known], **curve_style(number).line, label=name)
    if not objective.is_largest:
        axes.set_yscale('log')
    label_axes(axes, 'evaluations', f'{answer.order.goal.objective}{unit}', 'best so far')
    draw_legend(axes)


def _scale(objective: str) -> tuple[float, str]:
    """Return the factor of an objective's values, and their unit in brackets if they have one."""
    factor, unit = display_unit(OBJECTIVES[objective].unit)
    return factor, f' ({unit})' if unit else ''
