"""Ids of jobs, as people shorten them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import typer

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs

_LENGTH: Final = 12
"""Characters of an id."""


def full_id(jobs: Jobs, given: str) -> str:
    """The id of the only job whose id begins so."""
    from gaitswarm.services.optimizer.errors import InvalidRequest

    if not 0 < len(given) < _LENGTH:
        return given
    found = [job.id for job in jobs.jobs(search=given) if job.id.startswith(given)]
    if len(found) > 1:
        few = ", ".join(sorted(found)[:4]) + (", ..." if len(found) > 4 else "")
        raise InvalidRequest(f"{given!r} fits {few}; give more of it", field="id")
    return found[0] if found else given


def completed_all(context: typer.Context, given: list[str]) -> list[str]:
    """Ids of the command line, in full."""
    if context.resilient_parsing or all(len(one) >= _LENGTH for one in given):
        return given
    from gaitswarm.jobs.open import open_jobs

    options = context.params
    with open_jobs(options.get("server"), options.get("db")) as jobs:
        return [full_id(jobs, one) for one in given]


def completed(context: typer.Context, given: str | None) -> str | None:
    """An id of the command line, in full."""
    return None if given is None else completed_all(context, [given])[0]


def completed_start(context: typer.Context, given: str | None) -> str | None:
    """What a job begins with: ids of jobs in full, or the name of a file as it is."""
    if given is None or given.lower().endswith(".csv"):
        return given
    from gaitswarm.services.optimizer.errors import NotFound

    ids = [one.strip() for one in given.split(",") if one.strip()]
    try:
        return ",".join(completed_all(context, ids))
    except NotFound:
        # A database that is made with the job has none of them: the spec is refused by its place.
        return given
