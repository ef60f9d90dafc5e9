"""Progress of a running job: a live bar on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from gaitswarm.cli.exit_codes import JobEnded
from gaitswarm.cli.output import note, stderr_console
from gaitswarm.cli.tables import duration, number

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from gaitswarm.jobs.base import Jobs
    from gaitswarm.views.job import Spent, StateView

_LINE_SECONDS: Final = 2.0
"""Minimum interval of lines; the last iteration is always printed."""


_LABELS: Final = {"iterations": "iteration", "designs": "design"}


class Progress(Protocol):
    """Display of committed iterations."""

    def iteration(
        self, index: int, designs: int, best_so_far: float | None, seconds: float
    ) -> None:
        """Show an iteration of so many designs, evaluated in so many seconds."""

    def remark(self, text: str) -> None:
        """Show a line of text."""


@contextmanager
def show_progress(
    *,
    particles: int,
    iterations_planned: int,
    evaluations_planned: int,
    iterations: int = 0,
    evaluations: int = 0,
) -> Iterator[Progress]:
    """Show progress of one job on stderr.

    particles: maximum of designs per iteration. iterations, evaluations: already committed.
    """
    pace = _Pace(particles, iterations_planned, evaluations_planned, iterations, evaluations)
    console = stderr_console()
    if not console.is_terminal:
        yield _Lines(pace)
        return

    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
    from rich.progress import Progress as RichProgress

    bar = RichProgress(
        TextColumn("{task.description}"),
        MofNCompleteColumn(),
        BarColumn(),
        TextColumn("best {task.fields[best]}"),
        TextColumn("{task.fields[rate]}"),
        TextColumn("{task.fields[left]}"),
        console=console,
    )
    with bar:
        spent = pace.spent
        task = bar.add_task(
            _LABELS[spent.unit],
            total=spent.planned,
            completed=spent.done,
            best="–",
            rate="",
            left="",
        )
        yield _Live(bar, task, pace)


def watch_with_progress(jobs: Jobs, job_id: str) -> None:
    """Follow a job until it ends; raise JobEnded unless it succeeds."""
    from gaitswarm.views.history import IterationView

    job = jobs.job(job_id)
    with show_progress(
        particles=job.spec.optimizer.particles,
        iterations_planned=job.iterations_planned,
        evaluations_planned=job.evaluations_planned,
    ) as progress:
        last: StateView | None = None
        for event in jobs.follow(job_id):
            if isinstance(event, IterationView):
                progress.iteration(
                    event.index, event.designs, event.best_so_far, event.evaluate_seconds
                )
            else:
                last = event
                reason = f", waiting: {event.waiting}" if event.waiting else ""
                progress.remark(f"job {event.id} is {event.state.value}{reason}")
    _check_success(last)


def watch_as_json(jobs: Jobs, job_id: str) -> None:
    """Follow a job as JSON lines: `{"event": "iteration"|"state", "data": {...}}`."""
    from gaitswarm.views.history import IterationView

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
    reason = f": {last.error}" if last.error else ""
    raise JobEnded(f"job {last.id} {last.state.value}{reason}")


@dataclass(slots=True)
class _Pace:
    """Budget spent, evaluation rate and remaining time."""

    particles: int
    iterations_planned: int
    evaluations_planned: int
    iterations: int
    evaluations: int
    seen: int = 0
    seconds: float = 0.0

    @property
    def spent(self) -> Spent:
        from gaitswarm.views.job import budget_spent

        return budget_spent(
            self.iterations,
            self.evaluations,
            particles=self.particles,
            iterations_planned=self.iterations_planned,
            evaluations_planned=self.evaluations_planned,
        )

    @property
    def ended(self) -> bool:
        return self.evaluations >= self.evaluations_planned

    def add(self, index: int, designs: int, seconds: float) -> tuple[float, float]:
        """Add an iteration; return evaluations per second and seconds left."""
        self.iterations = index + 1
        self.evaluations += designs
        self.seen += designs
        self.seconds += seconds
        rate = self.seen / max(self.seconds, 1e-9)
        return rate, max(0, self.evaluations_planned - self.evaluations) / rate


class _Live:
    def __init__(self, bar: Bar, task: TaskID, pace: _Pace) -> None:
        self._bar = bar
        self._task = task
        self._pace = pace

    def iteration(
        self, index: int, designs: int, best_so_far: float | None, seconds: float
    ) -> None:
        rate, left = self._pace.add(index, designs, seconds)
        spent = self._pace.spent
        self._bar.update(
            self._task,
            description=_LABELS[spent.unit],
            completed=spent.done,
            total=spent.planned,
            best=number(best_so_far),
            rate=f"{rate:.1f} evaluations/s",
            left=f"{duration(left)} left",
        )

    def remark(self, text: str) -> None:
        self._bar.console.print(text, markup=False)


class _Lines:
    def __init__(self, pace: _Pace) -> None:
        self._pace = pace
        self._next = 0.0

    def iteration(
        self, index: int, designs: int, best_so_far: float | None, seconds: float
    ) -> None:
        rate, left = self._pace.add(index, designs, seconds)
        now = time.monotonic()
        if now < self._next and not self._pace.ended:
            return
        self._next = now + _LINE_SECONDS
        spent = self._pace.spent
        done = f"{spent.done}/{spent.planned} {spent.unit}"
        if spent.unit != "iterations":
            done = f"{index + 1} iterations, {done}"
        note(f"{done}: best {number(best_so_far)}, {rate:.1f} evaluations/s, {duration(left)} left")

    def remark(self, text: str) -> None:
        note(text)
