"""What can be read off a recorded run over time, wherever it is recorded best."""

from typing import NamedTuple

from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.recording.topics import TOPICS

TRACE_SAMPLES_MIN = 2


class RunQuantity(NamedTuple):
    """
    A quantity of a run.

    Attributes
    ----------
    name : str
        Name with its unit, as a column of an experiment file.
    column : str
        Column of the trace.
    topic : str
        Topic that carries it beside the trace; empty if none does.
    label : str
        In words.

    """

    name: str
    column: str
    topic: str
    label: str


RUN_QUANTITIES = (
    RunQuantity('position_m', 'position', 'position', 'runner position'),
    RunQuantity('force_n', 'force', 'force', 'load-cell force'),
    RunQuantity('voltage_v', 'voltage', 'voltage', 'piezo voltage'),
    RunQuantity('foot_m', 'foot', '', 'displacement of the feet'),
)


def recorded_series(recording: Recording) -> dict[str, Series]:
    """
    Return each quantity of a recording by its name: of the trace, else of its topic.

    A trace counts from two samples on. The topics have position and force at 1 kHz, the voltage
    once per ``trace.period``, and no displacement of the feet.

    """
    trace = recording.trace() if has_topic(recording, 'trace') else {}
    found = {}
    for quantity in RUN_QUANTITIES:
        series = trace.get(quantity.column)
        if series is None or len(series) < TRACE_SAMPLES_MIN:
            if not quantity.topic or not has_topic(recording, quantity.topic):
                continue
            series = recording.series(topic_name(recording, quantity.topic))
        if len(series):
            found[quantity.name] = series
    return found


def has_topic(recording: Recording, name: str) -> bool:
    """Tell whether a recording has a topic that the instrument publishes under this name."""
    return topic_name(recording, name) != ''


def topic_name(recording: Recording, name: str) -> str:
    """
    Return the full name of a published topic in a recording; empty if it is not there.

    ``position`` is neither ``command/position`` nor ``truth/position``.

    """
    kinds = {each.name: each.type_name for each in TOPICS if not each.name.startswith('command/')}
    key = name if name in kinds else f'~/{name}'
    found = [
        topic
        for topic, kind in recording.types.items()
        if topic.rpartition('/')[2] == name
        and kind == kinds.get(key)
        and topic.rpartition('/')[0].rpartition('/')[2] not in {'command', 'truth'}
    ]
    return min(found, key=lambda topic: topic.count('/'), default='')
