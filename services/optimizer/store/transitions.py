"""What a transition sets in a job's row. Pure: rows and arguments in, columns out."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from services.optimizer.job import Ask, CompletedIteration, JobState
from services.optimizer.store.rows import Row, best_particle


def entering(state: JobState, now: datetime) -> dict[str, Any]:
    """Columns that follow from a state; only a job under way keeps its lease.

    The token stays in any case, so that the next one is higher.
    """
    columns: dict[str, Any] = {
        "state": state,
        "updated_at": now,
        "finished_at": now if state.terminal else None,
    }
    if state not in (JobState.RUNNING, JobState.PAUSING):
        columns |= {"lease_owner": None, "lease_expires_at": None}
    return columns


def state_after_commit(state: JobState, following: Ask | None) -> JobState:
    """The end of the budget wins over a pause that was asked for in the last iteration."""
    if following is None:
        return JobState.SUCCEEDED
    return JobState.PAUSED if state is JobState.PAUSING else state


def state_after_release(state: JobState, wanted: JobState) -> JobState:
    """A job that was to pause is not queued again by a runner that shuts down."""
    if wanted is JobState.QUEUED and state is JobState.PAUSING:
        return JobState.PAUSED
    return wanted


def progress_after(job: Row, done: CompletedIteration) -> dict[str, Any]:
    """Progress with one more iteration; only a strictly lower fitness is a new best."""
    columns: dict[str, Any] = {
        "iterations": done.iteration + 1,
        "evaluations": job["evaluations"] + len(done.fitness),
        "compute_seconds": job["compute_seconds"] + done.evaluate_seconds,
    }
    particle = best_particle(done.fitness)
    if particle is not None:
        fitness = float(done.fitness[particle])
        if job["best_fitness"] is None or fitness < job["best_fitness"]:
            columns |= {
                "best_fitness": fitness,
                "best_iteration": done.iteration,
                "best_particle": particle,
            }
    return columns
