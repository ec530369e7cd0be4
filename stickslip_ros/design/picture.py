"""The picture of an answer: the wave, what it does in a cycle, and how it was found."""

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.design.objectives import COST_MAX, OBJECTIVES
from stickslip_ros.design.search import RIVAL, SearchResult
from stickslip_ros.design.steady_cycle import CONTACT
from stickslip_ros.drive.advance import FOOT, POSITION, TIME, VOLTAGE
from stickslip_ros.runs.courses import alone
from stickslip_ros.runs.plotting import GREY, curve_style, draw_legend, label_axes, new_figure
from stickslip_ros.units import NM, display_unit


def draw_search(result: SearchResult) -> Figure:
    """Draw best wave and best saw-tooth over a cycle, and the searches over their evaluations."""
    name = result.search.goal.objective
    objective = OBJECTIVES[name]
    figure = new_figure(11.0, 7.5, f'{name}: {result.best} and {RIVAL}')
    voltage, motion, contact, history = figure.subplots(2, 2).flat
    for number, shape in enumerate(dict.fromkeys((result.best, RIVAL))):
        style = curve_style(number).line
        wave, stand = result.shapes[shape].wave, result.search.stand
        [worth] = alone(result.search.worths(wave, [stand]))
        trace = worth.cycle.trace(contacts=True)
        time_ms = 1e3 * trace[:, TIME]
        voltage.plot(time_ms, trace[:, VOLTAGE], **style, label=shape)
        for column, width in ((FOOT, 0.7), (POSITION, 2.0)):
            moved_nm = (trace[:, column] - trace[0, column]) * NM
            motion.plot(time_ms, moved_nm, **style, linewidth=width)
        contact.plot(time_ms, trace[:, CONTACT], **style)
    for limit in (-1.0, 1.0):
        contact.axhline(limit, color=GREY, linestyle=':')
    factor, unit = display_unit(objective.unit)
    searched = [(shape, one) for shape, one in result.shapes.items() if one.history]
    for number, (shape, one) in enumerate(searched):
        costs = np.array(one.history)
        values = np.where(
            costs < COST_MAX, (-factor if objective.is_largest else factor) * costs, np.nan
        )
        evaluations = np.arange(1, len(costs) + 1)
        history.plot(evaluations, values, **curve_style(number).line, label=shape)
    if not objective.is_largest:
        history.set_yscale('log')
    label_axes(voltage, '', 'voltage (V)', 'the wave')
    label_axes(motion, '', 'displacement (nm)', 'runner (thick) and mean foot (thin)')
    label_axes(contact, 'time (ms)', 'force / friction limit', 'contacts: full slip at 1 and -1')
    label_axes(history, 'evaluations', f'{name} ({unit})' if unit else name, 'best so far')
    draw_legend(voltage)
    draw_legend(history)
    return figure
