"""All figures of the study; a new one needs a line here."""

from collections.abc import Sequence

from stickslip_ros.errors import UnknownName
from stickslip_ros.paper.force_curves import FIG2, FIG6A, FIG6B
from stickslip_ros.paper.presliding_curves import FIG7
from stickslip_ros.paper.rounded import ROUNDED
from stickslip_ros.paper.sensitivity import SENSITIVITY
from stickslip_ros.paper.slew import SLEW
from stickslip_ros.paper.study_figure import StudyFigure

FIGURES = {
    figure.name: figure for figure in (FIG2, FIG6A, FIG6B, FIG7, SENSITIVITY, SLEW, ROUNDED)
}


def chosen_figures(names: Sequence[str] | None = None) -> list[StudyFigure]:
    """
    Return the figures of these names; all for None.

    Raises
    ------
    UnknownName
        If there is no such figure.

    """
    chosen = dict.fromkeys(FIGURES if names is None else names)
    for name in chosen:
        if name not in FIGURES:
            raise UnknownName('figure', name, f'use {", ".join(FIGURES)}')
    return [FIGURES[name] for name in chosen]
