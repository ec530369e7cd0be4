# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Progress bar for long work, on a terminal or in a notebook."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

Show = Callable[..., None]
"""Receives the amount done, the total (0 if unknown), and a note where one is given."""


@contextmanager
def shown_progress(what: str, *, quiet: bool, resumes: bool = False) -> Iterator[Show]:
    """
    Show a progress bar; yield the function that updates it.

    ``what`` names the counted things, as ``runs``. If the work ``resumes``, the amount of the
    first call was done earlier and does not count towards the rate.

    """
    try:
        from rich import progress as r  # noqa: PLC0415 - most work shows none, and it takes long
        from rich.console import Console  # noqa: PLC0415

        console = Console(file=sys.stderr)
        is_shown = not quiet and (sys.stderr.isatty() or console.is_jupyter)
    except ImportError:  # of a robot
        is_shown = False
    if not is_shown:
        yield lambda *_: None
        return

    class RateColumn(r.ProgressColumn):
        """Units per second."""

        def render(self, task: r.Task) -> str:
            """Return the rate as text, empty until it is known."""
            return f'{task.speed:.3g}/s' if task.speed else ''

    bar = r.Progress(
        r.TextColumn('{task.description}'),
        r.BarColumn(20),  # of 80 characters in all
        r.MofNCompleteColumn(),
        RateColumn(),
        r.TimeRemainingColumn(),
        console=console,
        transient=True,
    )
    with bar:
        task = bar.add_task(what, total=None, start=not resumes)

        def show(done: int, total: int, note: str = '') -> None:
            if not bar.tasks[task].started:
                bar.reset(task, total=total or None, completed=done)
            text = f'{what}, {note}' if note else what
            bar.tasks[task].total = total or None  # by `update`, a new total begins a new rate
            bar.update(task, description=text, completed=done)

        yield show


def progress_of(wanted: bool | Show, what: str) -> AbstractContextManager[Show]:
    """Return the caller's own function, a progress bar if ``wanted`` is true, or neither."""
    if callable(wanted):
        return nullcontext(lambda done, total, _note='': wanted(done, total))
    return shown_progress(what, quiet=False) if wanted else nullcontext(lambda *_: None)
