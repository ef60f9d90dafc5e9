"""`gaitswarm optimize`: a job in this process."""

from __future__ import annotations

from contextlib import closing
from typing import Annotated

import typer

from gaitswarm.cli.options import AcceptChanges, Json, SpecOptions, WorkerOptions, completed
from gaitswarm.cli.output import note
from gaitswarm.services.optimizer.errors import InvalidRequest


def optimize(
    options: SpecOptions,
    *,
    resume: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            callback=completed,
            help="Resume this job; results equal those of an uninterrupted run to the bit.",
        ),
    ] = None,
    accept_changes: AcceptChanges = False,
    compare_optimizer: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Also run the job with another search method, and compare the results.",
        ),
    ] = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Run a job in this process. Ctrl-C stops it; --resume continues it."""
    from gaitswarm.cli.embedded import Embedded, finish
    from gaitswarm.cli.inputs import build_spec, by_other_optimizer, check_optimizer_name

    if as_json and compare_optimizer is not None:
        raise InvalidRequest("cannot be combined with --json", field="compare-optimizer")
    if accept_changes and resume is None:
        raise InvalidRequest("requires --resume", field="accept-changes")
    spec = build_spec(options) if resume is None or options.given else None
    if compare_optimizer is not None:
        check_optimizer_name(compare_optimizer, "compare-optimizer")
    with closing(Embedded(workers, accepts_changes=accept_changes)) as embedded:
        jobs, claim = embedded.jobs, None
        if spec is not None and resume is None:
            claim = embedded.service.submit_embedded(spec)
            job = claim.job
        else:
            job = embedded.resumed(resume or "", spec)
        note(f"job {job.id} in database {embedded.database}")
        interrupted = embedded.run(job, claim)
        others = {}
        if compare_optimizer is not None and not interrupted:
            other = embedded.run_to_end(by_other_optimizer(job.spec, compare_optimizer))
            others[compare_optimizer] = jobs.job(other.id)
        finish(jobs, job.id, interrupted, as_json=as_json, others=others)
