"""Progress of a job while it runs: a live bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, Protocol

from cli.exit_codes import JobEnded
from cli.output import note, stderr_console
from cli.tables import duration, number

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from gaitswarm.jobs.port import Jobs
    from gaitswarm.views import StateView

_LINE_SECONDS: Final = 2.0
"""Plain lines come at most this often, and for the last iteration."""


class Progress(Protocol):
    """Told about every committed iteration."""

    def iteration(self, index: int, best_so_far: float | None, seconds: float) -> None:
        """index: from 0; seconds: spent on its evaluation."""

    def remark(self, text: str) -> None:
        """One line of news."""


@contextmanager
def show_progress(*, iterations: int, particles: int, done: int = 0) -> Iterator[Progress]:
    """Progress of one job on stderr.

    iterations: the job's budget; particles: evaluations in each; done: committed already.
    """
    console = stderr_console()
    if not console.is_terminal:
        yield _Lines(iterations, particles)
        return

    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
    from rich.progress import Progress as RichProgress

    bar = RichProgress(
        TextColumn("iteration"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("best {task.fields[best]}"),
        TextColumn("{task.fields[rate]}"),
        TextColumn("{task.fields[left]}"),
        console=console,
    )
    with bar:
        task = bar.add_task("", total=iterations, completed=done, best="–", rate="", left="")
        yield _Live(bar, task, _Pace(iterations, particles))


def watch_with_progress(jobs: Jobs, job_id: str) -> None:
    """Follow a job until it ends. Raises JobEnded unless it succeeds."""
    from gaitswarm.views import IterationView

    job = jobs.job(job_id)
    with show_progress(
        iterations=job.iterations_planned, particles=job.spec.optimizer.particles
    ) as progress:
        last: StateView | None = None
        for event in jobs.follow(job_id):
            if isinstance(event, IterationView):
                progress.iteration(event.index, event.best_so_far, event.evaluate_seconds)
            else:
                last = event
                progress.remark(f"job {event.id} is {event.state.value}")
    _check_success(last)


def watch_as_json(jobs: Jobs, job_id: str) -> None:
    """The same as JSON lines: `{"event": "iteration"|"state", "data": {...}}`."""
    from gaitswarm.views import IterationView

    last: StateView | None = None
    for event in jobs.follow(job_id):
        if not isinstance(event, IterationView):
            last = event
        name = "iteration" if isinstance(event, IterationView) else "state"
        sys.stdout.write(f'{{"event":"{name}","data":{event.model_dump_json()}}}\n')
        sys.stdout.flush()
    _check_success(last)


def _check_success(last: StateView | None) -> None:
    if last is None or last.state.value == "succeeded":
        return
    because = f": {last.error}" if last.error else ""
    raise JobEnded(f"job {last.id} {last.state.value}{because}")


class _Pace:
    """Rate and rest, from the iterations seen."""

    def __init__(self, iterations: int, particles: int) -> None:
        self.iterations = iterations
        self._particles = particles
        self._seen = 0
        self._seconds = 0.0

    def saw(self, index: int, seconds: float) -> tuple[float, float]:
        """(evaluations per second, seconds left) after this iteration."""
        self._seen += 1
        self._seconds += seconds
        each = max(self._seconds / self._seen, 1e-9)
        return self._particles / each, max(0, self.iterations - index - 1) * each


class _Live:
    def __init__(self, bar: Bar, task: TaskID, pace: _Pace) -> None:
        self._bar = bar
        self._task = task
        self._pace = pace

    def iteration(self, index: int, best_so_far: float | None, seconds: float) -> None:
        rate, left = self._pace.saw(index, seconds)
        self._bar.update(
            self._task,
            completed=index + 1,
            best=number(best_so_far),
            rate=f"{rate:.1f} evaluations/s",
            left=f"{duration(left)} left",
        )

    def remark(self, text: str) -> None:
        self._bar.console.print(text, markup=False)


class _Lines:
    def __init__(self, iterations: int, particles: int) -> None:
        self._pace = _Pace(iterations, particles)
        self._next = 0.0

    def iteration(self, index: int, best_so_far: float | None, seconds: float) -> None:
        rate, left = self._pace.saw(index, seconds)
        now = time.monotonic()
        last = index + 1 == self._pace.iterations
        if now < self._next and not last:
            return
        self._next = now + _LINE_SECONDS
        note(
            f"iteration {index + 1}/{self._pace.iterations}: best {number(best_so_far)},"
            f" {rate:.1f} evaluations/s, {duration(left)} left"
        )

    def remark(self, text: str) -> None:
        note(text)
