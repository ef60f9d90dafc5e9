"""Where a client goes on from a job: its resources, and the commands that it takes now."""

from __future__ import annotations

from typing import Final

from gaitswarm.services.optimizer.jobs.job import DELETABLE, TRANSITIONS, Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

PREFIX: Final = "/v1"
"""Version of the HTTP API, in every path."""

_RESOURCES: Final = ("iterations", "events")
_OF_A_BEST: Final = ("scenarios", "preferences", "firmware")

_RESOURCES_BY_SPEC: Final = ("best", "distribution", "particles", "export")
"""Those that only a job has whose spec can be read."""

_COMMANDS: Final = {
    state: [(c.value, after) for (before, c), after in TRANSITIONS.items() if before is state]
    for state in JobState
}
"""By state: what a user may ask for, and the state after."""


def job_links(job: Job) -> dict[str, str]:
    """Say where a client goes on from a job."""
    here = f"{PREFIX}/jobs/{job.id}"
    names = [*_RESOURCES, *(_RESOURCES_BY_SPEC if job.readable else ())]
    if isinstance(job.stored_spec, JobSpec):
        names += ["ranking", *(_OF_A_BEST if job.progress.best_fitness is not None else ())]
    resources = {name: f"{here}/{name}" for name in names}
    commands = {
        command: f"{here}/{command}"
        for command, after in _COMMANDS[job.state]
        if job.readable or after is not JobState.QUEUED
    }
    if job.readable and job.state is not JobState.CANCELLED:
        commands["extend"] = f"{here}/extend"
    if job.readable and job.progress.iterations:
        resources["evidence"] = f"{here}/evidence"
        resources["verify"] = f"{here}/verify"
        commands["fork"] = f"{here}/fork"
    commands["keep"] = f"{here}/keep"
    if not job.state.terminal:
        commands["priority"] = f"{here}/priority"
    if job.state in DELETABLE and not job.kept:
        commands["delete"] = here
    if job.lineage is not None:
        resources["parent"] = f"{PREFIX}/jobs/{job.lineage.parent}"
    return {"self": here, **resources, **commands}
