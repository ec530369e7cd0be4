"""The report of a comparison: one page of HTML that needs nothing else, to read or to print."""

import base64

from jinja2 import Environment, PackageLoader, StrictUndefined

import stickslip_ros
from stickslip_ros.comparison.agreement import AMPLITUDE
from stickslip_ros.comparison.figure import draw_quantity
from stickslip_ros.comparison.result import Compared, ComparisonReport
from stickslip_ros.comparison.words import sections, sentences, title

PAGES = Environment(
    loader=PackageLoader('stickslip_ros.comparison'),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def report_page(comparison: ComparisonReport, command: str) -> str:
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


def _picture(comparison: ComparisonReport, quantity: Compared) -> dict[str, str]:
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
