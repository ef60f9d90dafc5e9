"""Ids of jobs, as people shorten them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import typer

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs

_LENGTH: Final = 12
"""Characters of an id."""


def full_id(jobs: Jobs, given: str) -> str:
    """The id of the only job whose id begins so.

    Args:
        jobs: Where the job is.
        given: An id, or its beginning.

    Returns:
        The id; what was given where no job's id begins so, for it to be refused as any other.

    Raises:
        InvalidRequest: Several jobs' ids do; names them.
    """
    from services.optimizer.errors import InvalidRequest

    if not 0 < len(given) < _LENGTH:
        return given
    found = [job.id for job in jobs.jobs(search=given) if job.id.startswith(given)]
    if len(found) > 1:
        few = ", ".join(sorted(found)[:4]) + (", ..." if len(found) > 4 else "")
        raise InvalidRequest(f"{given!r} fits {few}; give more of it", field="id")
    return found[0] if found else given


def completed(context: typer.Context, given: str) -> str:
    """An id of the command line, in full.

    Args:
        context: Of the command; its options --server and --db are read already.
        given: As for `full_id`.

    Returns:
        As `full_id`, which raises the errors as well.
    """
    if context.resilient_parsing or not 0 < len(given) < _LENGTH:
        return given
    from gaitswarm.jobs.open import open_jobs

    options = context.params
    with open_jobs(options.get("server"), options.get("db")) as jobs:
        return full_id(jobs, given)
