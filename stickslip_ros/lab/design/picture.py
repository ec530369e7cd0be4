# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The picture of a search: wave, motion over a cycle, costs."""

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.drive.records import FOOT, POSITION, TIME, VOLTAGE
from stickslip_ros.lab.design.objectives import COST_MAX, OBJECTIVES
from stickslip_ros.lab.design.search import COMPARED_SHAPE, SearchResult
from stickslip_ros.lab.design.steady_cycle import CONTACT_SHARE
from stickslip_ros.lab.figures.plotting import GREY, curve_style, new_figure, styled
from stickslip_ros.lab.runs.courses import run_course
from stickslip_ros.units import NM, display_unit


@styled()
def draw_search(result: SearchResult) -> Figure:
    """Draw the best wave and the best saw-tooth over a cycle, and the course of the searches."""
    name = result.search.goal.objective
    objective = OBJECTIVES[name]
    figure = new_figure(11.0, 7.5, f'{name}: {result.best} and {COMPARED_SHAPE}')
    voltage, motion, contact, history = figure.subplots(2, 2).flat
    for number, shape in enumerate(dict.fromkeys((result.best, COMPARED_SHAPE))):
        style = curve_style(number)
        wave, stand = result.shapes[shape].wave, result.search.stand
        [worth] = run_course(result.search.worths(wave, [stand]))
        trace = worth.cycle.trace(contacts=True)
        time_ms = 1e3 * trace[:, TIME]
        voltage.plot(time_ms, trace[:, VOLTAGE], **style, label=shape)
        for column, width in ((FOOT, 0.7), (POSITION, 2.0)):
            moved_nm = (trace[:, column] - trace[0, column]) * NM
            motion.plot(time_ms, moved_nm, **style, linewidth=width)
        contact.plot(time_ms, trace[:, CONTACT_SHARE], **style)
    for limit in (-1.0, 1.0):
        contact.axhline(limit, color=GREY, linestyle=':')
    factor, unit = display_unit(objective.unit)
    factor = -factor if objective.is_largest else factor
    for shape, one in result.shapes.items():
        if not one.history:
            continue
        costs = np.array(one.history)
        values = np.where(costs < COST_MAX, factor * costs, np.nan)
        history.plot(np.arange(1, len(costs) + 1), values, label=shape)
    voltage.set(title='the wave', ylabel='voltage (V)')
    motion.set(title='runner (thick) and mean foot (thin)', ylabel='displacement (nm)')
    contact.set(title='contacts: full slip at 1 and -1', ylabel='force / friction limit')
    contact.set_xlabel('time (ms)')
    history.set(title='best so far', ylabel=f'{name} ({unit})' if unit else name)
    history.set(xlabel='evaluations', yscale='linear' if objective.is_largest else 'log')
    voltage.legend()
    history.legend()
    return figure
