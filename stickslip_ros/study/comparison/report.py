"""The report of a comparison: one page of HTML that needs nothing else, to read or to print."""

import base64
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

import stickslip_ros
from stickslip_ros.errors import RecordingError
from stickslip_ros.study.comparison.agreement import AMPLITUDE
from stickslip_ros.study.comparison.figure import draw_quantity
from stickslip_ros.study.comparison.result import Compared, Comparison
from stickslip_ros.study.comparison.words import sections, sentences, title

PAGES = Environment(
    loader=PackageLoader('stickslip_ros.study'),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def write_report(comparison: Comparison, path: Path, command: str = '') -> None:
    """
    Write the report of a comparison, and the command that made it, in place of an older one.

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
    """Return the report as HTML: the same text for the same comparison and typed command."""
    return PAGES.get_template('comparison.html').render(
        comparison=comparison,
        sides=(('A', comparison.a), ('B', comparison.b)),
        sentences=sentences(comparison),
        pictures=[_picture(comparison, quantity) for quantity in comparison.quantities],
        sections=list(sections(comparison)),
        command=command,
        version=stickslip_ros.__version__,
    )


def _picture(comparison: Comparison, quantity: Compared) -> dict[str, str]:
    """Return heading, what the figure shows in words, and the figure as a data URL."""
    by_amplitude = comparison.axis == AMPLITUDE
    axis = 'stroke of the feet' if by_amplitude else 'time'
    marks = 'points are A, lines B' if by_amplitude else 'solid A, dashed B'
    svg = draw_quantity(comparison, quantity).encode()
    return {
        'title': title(quantity),
        'text': f'Above: {title(quantity)} against {axis}, {marks}. Below: B − A.',
        'url': f'data:image/svg+xml;base64,{base64.b64encode(svg).decode()}',
    }
