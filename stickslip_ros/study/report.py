"""The report of a comparison: one page of HTML that needs nothing else, to read or to print."""

import base64
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

import stickslip_ros
from stickslip_ros.errors import RecordingError
from stickslip_ros.study.comparison.figure import draw_quantity
from stickslip_ros.study.comparison.result import AMPLITUDE, Comparison
from stickslip_ros.study.comparison.words import Section, sections, sentences, title

TEMPLATE = 'comparison.html'
PAGES = Environment(
    loader=PackageLoader('stickslip_ros.study'),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


@dataclass(frozen=True)
class Picture:
    """A figure of the page: heading, what it shows in words, and itself as a data URL."""

    title: str
    text: str
    url: str


def write_report(comparison: Comparison, path: Path, command: str) -> None:
    """
    Write the report of a comparison, in place of an older one.

    Parameters
    ----------
    comparison : Comparison
        The numbers.
    path : Path
        HTML file; folders are made.
    command : str
        How it was made, as it is typed.

    Raises
    ------
    RecordingError
        If it cannot be written.

    """
    page = report_page(comparison, command)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page, encoding='utf-8')
    except OSError as error:
        problem = f'cannot be written ({error.strerror})'
        raise RecordingError(path, problem, 'choose another place') from None


def report_page(comparison: Comparison, command: str) -> str:
    """Return the report as HTML: the same text for the same comparison and command."""
    found: list[Section] = list(sections(comparison))
    return PAGES.get_template(TEMPLATE).render(
        comparison=comparison,
        sides=(('A', comparison.a), ('B', comparison.b)),
        sentences=sentences(comparison),
        pictures=[_picture(comparison, index) for index in range(len(comparison.quantities))],
        sections=found,
        command=command,
        version=stickslip_ros.__version__,
    )


def _picture(comparison: Comparison, index: int) -> Picture:
    quantity = comparison.quantities[index]
    axis = 'stroke of the feet' if comparison.axis == AMPLITUDE else 'time'
    marks = 'points are A, lines B' if comparison.axis == AMPLITUDE else 'solid A, dashed B'
    text = f'Above: {title(quantity)} against {axis}, {marks}. Below: B − A.'
    svg = draw_quantity(comparison, quantity).encode()
    url = f'data:image/svg+xml;base64,{base64.b64encode(svg).decode()}'
    return Picture(title(quantity), text, url)
