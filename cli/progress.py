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
    from gaitswarm.services.optimizer.jobs.iteration import Iteration
    from gaitswarm.views.job import IterationView, JobSummaryView, StateView

_LINE_SECONDS: Final = 2.0
"""Minimum interval of lines; the last iteration is always printed."""


@dataclass(slots=True)
class Progress:
    """Display of committed iterations, as a bar on a terminal."""

    job: JobSummaryView  # after the iterations that were shown
    bar: Bar | None = None
    _seen: int = field(default=0, init=False)
    _seconds: float = field(default=0.0, init=False)
    _next_line: float = field(default=0.0, init=False)

    def show(self, iteration: Iteration | IterationView) -> None:
        known = (self.job.least_violation, iteration.least_violation)
        least_violation = min((value for value in known if value is not None), default=None)
        done = {
            "iterations": iteration.index + 1,
            "evaluations": self.job.evaluations + iteration.designs,
            "least_violation": least_violation,
        }
        job = self.job = self.job.model_copy(update=done)
        self._seen += iteration.designs
        self._seconds += iteration.evaluate_seconds
        rate = self._seen / max(self._seconds, 1e-9)
        left = duration(max(0, job.evaluations_planned - job.evaluations) / rate)
        spent, speed = job.spent, f"{rate:.1f} evaluations/s"
        best = f"best {number(iteration.best_so_far)}"
        if iteration.best_so_far is None and least_violation:
            best = f"no feasible design yet, least violation {least_violation:.3g}"
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
        if now < self._next_line and job.evaluations < job.evaluations_planned:
            return
        self._next_line = now + _LINE_SECONDS
        whole = "" if spent.unit == "iterations" else f"{job.iterations} iterations, "
        note(f"{whole}{spent.done}/{spent.planned} {spent.unit}: {best}, {speed}, {left} left")

    def remark(self, text: str) -> None:
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
    spent = progress.job.spent
    with progress.bar:
        unit = spent.unit.removesuffix("s")
        progress.bar.add_task(
            unit, total=spent.planned, completed=spent.done, best="", rate="", left=""
        )
        yield progress


def watch_with_progress(jobs: Jobs, job_id: str) -> None:
    """Follow a job until it ends; raise JobEnded unless it succeeds."""
    from gaitswarm.views.job import IterationView

    # All of its iterations follow.
    before = {"iterations": 0, "evaluations": 0, "least_violation": None}
    with show_progress(Progress(jobs.job(job_id).model_copy(update=before))) as progress:
        last: StateView | None = None
        for event in jobs.follow(job_id):
            if isinstance(event, IterationView):
                progress.show(event)
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
