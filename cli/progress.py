"""Progress of a running job: a live bar on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from gaitswarm.cli.exit_codes import JobEnded
from gaitswarm.cli.output import note, stderr_console
from gaitswarm.cli.tables import duration, number

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from gaitswarm.jobs.base import Jobs
    from gaitswarm.views.job import Spent, StateView

_LINE_SECONDS: Final = 2.0
"""Minimum interval of lines; the last iteration is always printed."""


@dataclass(slots=True)
class Progress:
    """Display of committed iterations, as a bar on a terminal."""

    particles: int
    iterations_planned: int
    evaluations_planned: int
    iterations: int = 0
    evaluations: int = 0
    least_violation: float | None = None
    bar: Bar | None = None
    _seen: int = field(default=0, init=False)
    _seconds: float = field(default=0.0, init=False)
    _next_line: float = field(default=0.0, init=False)

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

    def iteration(
        self,
        index: int,
        designs: int,
        best_so_far: float | None,
        seconds: float,
        least_violation: float | None,
    ) -> None:
        """Show an iteration of so many designs, evaluated in so many seconds."""
        known = [v for v in (self.least_violation, least_violation) if v is not None]
        self.least_violation = min(known, default=None)
        self.iterations = index + 1
        self.evaluations += designs
        self._seen += designs
        self._seconds += seconds
        rate = self._seen / max(self._seconds, 1e-9)
        left = duration(max(0, self.evaluations_planned - self.evaluations) / rate)
        spent, best, speed = self.spent, f"best {number(best_so_far)}", f"{rate:.1f} evaluations/s"
        if best_so_far is None and self.least_violation:
            best = f"no feasible design yet, least violation {self.least_violation:.3g}"
        if self.bar is not None:
            self.bar.update(
                self.bar.task_ids[0],
                description=spent.unit.removesuffix("s"),
                completed=spent.done,
                total=spent.planned,
                best=best,
                rate=speed,
                left=f"{left} left",
            )
            return
        now = time.monotonic()
        if now < self._next_line and self.evaluations < self.evaluations_planned:
            return
        self._next_line = now + _LINE_SECONDS
        done = f"{spent.done}/{spent.planned} {spent.unit}"
        if spent.unit != "iterations":
            done = f"{index + 1} iterations, {done}"
        note(f"{done}: {best}, {speed}, {left} left")

    def remark(self, text: str) -> None:
        """Show a line of text."""
        if self.bar is None:
            note(text)
        else:
            self.bar.console.print(text, markup=False)


@contextmanager
def show_progress(progress: Progress) -> Iterator[Progress]:
    """Show progress of one job on stderr inside the block."""
    console = stderr_console()
    if not console.is_terminal:
        yield progress
        return

    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn
    from rich.progress import Progress as RichProgress

    progress.bar = RichProgress(
        TextColumn("{task.description}"),
        MofNCompleteColumn(),
        BarColumn(),
        *(TextColumn(f"{{task.fields[{name}]}}") for name in ("best", "rate", "left")),
        console=console,
    )
    spent = progress.spent
    with progress.bar:
        unit = spent.unit.removesuffix("s")
        progress.bar.add_task(
            unit, total=spent.planned, completed=spent.done, best="", rate="", left=""
        )
        yield progress


def watch_with_progress(jobs: Jobs, job_id: str) -> None:
    """Follow a job until it ends; raise JobEnded unless it succeeds."""
    from gaitswarm.views.job import IterationView

    job = jobs.job(job_id)
    with show_progress(
        Progress(job.spec.optimizer.particles, job.iterations_planned, job.evaluations_planned)
    ) as progress:
        last: StateView | None = None
        for event in jobs.follow(job_id):
            if isinstance(event, IterationView):
                progress.iteration(
                    event.index,
                    event.designs,
                    event.best_so_far,
                    event.evaluate_seconds,
                    event.least_violation,
                )
            else:
                last = event
                reason = f", waiting: {event.waiting}" if event.waiting else ""
                progress.remark(f"job {event.id} is {event.state.value}{reason}")
    _check_success(last)


def watch_as_json(jobs: Jobs, job_id: str) -> None:
    """Follow a job as JSON lines: `{"event": "iteration"|"state", "data": {...}}`."""
    from gaitswarm.views.job import IterationView

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
