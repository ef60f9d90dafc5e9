"""`gaitswarm export`, `evidence` and `verify`: files of a job, and checks of them."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from gaitswarm.cli.exit_codes import CheckFailed
from gaitswarm.cli.options import JobId, Json, Place, full_id
from gaitswarm.cli.output import Parts, note, replacing, show
from gaitswarm.cli.tables import number, table
from gaitswarm.cli.tables import place as place_of
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.tables import TableFormat
    from gaitswarm.views.verification import HistoryVerificationView, VerificationView


def export(
    job_id: JobId,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.csv or FILE.parquet.")
    ],
    *,
    jobs: Jobs,
) -> None:
    """Write a table with one row per evaluated design: fitness, variables, results by scenario."""
    if output.suffix not in (".csv", ".parquet"):
        raise InvalidRequest(f"{output} must end in .csv or .parquet", field="output")
    job, file_format = jobs.job(job_id), cast("TableFormat", output.suffix[1:])
    with replacing(output, "output") as file:
        file.writelines(jobs.export(job_id, file_format))
    note(f"{job.evaluations} evaluations written to {output}")


def evidence(
    job_id: JobId,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.zip to write.")
    ],
    *,
    jobs: Jobs,
) -> None:
    """Write a job's spec, history and results to one file that `verify` checks."""
    content = jobs.evidence(job_id)
    with replacing(output, "output") as file:
        file.write(content)
    note(f"{output}: SHA-256 {hashlib.sha256(content).hexdigest()}")
    note(f"to check it, run: gaitswarm verify {output} --replay 20")


def verify(
    source: Annotated[str, typer.Argument(metavar="FILE|ID")],
    replay: Annotated[int, typer.Option(min=0, metavar="N")] = 20,
    seed: Annotated[int | None, typer.Option(min=0)] = None,
    head: Annotated[str | None, typer.Option(metavar="DIGEST")] = None,
    *,
    place: Place,
    as_json: Json = False,
) -> None:
    """Check evidence, or a job's stored history, to the bit; exit code 1 if anything differs.

    Checking a file needs neither database nor network, and never trusts the file. For a job, the
    digests of its iterations are recomputed, and the first that differs is named.

    Args:
        source: File of `evidence`, or a job's id or its prefix.
        replay: Evaluations to sample and repeat, of the job and of each certificate, in addition to
            the best.
        seed: Seed of the sample. [default: unpredictable]
        head: Digest of an iteration, noted earlier, that the history must contain.
    """
    from gaitswarm.evidence.verify import verify as verified

    view: VerificationView | HistoryVerificationView
    if Path(source).exists() or Path(source).name != source or "." in source:
        view = verified(source, replay=replay, seed=seed, head=head)
    else:
        with place.open() as jobs:
            source = full_id(jobs, source)
            view = jobs.verify(source, head=head)
            if view.verified:
                try:
                    content = jobs.evidence(source)
                except Conflict:
                    if not view.iterations:
                        raise
                    # The history is too large for a file: check it in the database.
                    view = jobs.verify(source, replay=replay, seed=seed, head=head)
                else:
                    view = verified(content, replay=replay, seed=seed, head=head)
    show(view, _verification(view), as_json=as_json)
    if not view.verified:
        raise CheckFailed(f"verification of {source} failed")


def _verification(view: VerificationView | HistoryVerificationView) -> Parts:
    states = {True: ("passed", "green"), False: ("FAILED", "red"), None: ("not checked", "yellow")}

    def whose(certificate: str | None, end: str) -> str:
        return "" if certificate is None else f"certificate {certificate}{end}"

    yield table(
        None,
        (
            (f"{whose(check.certificate, ': ')}{check.name}", states[check.passed], check.detail)
            for check in view.checks
        ),
    )
    for difference in view.differences[:10]:
        stored, simulated = number(difference.stored, 17), number(difference.simulated, 17)
        yield (
            f"{whose(difference.certificate, ', ')}design {place_of(difference)},"
            f" {difference.case}, {difference.what}: stored {stored}, simulated {simulated}"
        )
    if view.provenance:
        yield "provenance differs on this machine:"
        yield from (f"  {line}" for line in view.provenance)
    if view.replayed:
        yield f"sampled by seed {view.seed}"
    unproved = getattr(view, "unproved", ())
    if unproved:
        yield f"not proved by the file: {', '.join(unproved)} of the job"
    result = "verified" if view.verified else "NOT verified"
    digest = getattr(view, "sha256", None)
    what = f"job {view.job}" if digest is None else f"SHA-256 {digest}"
    yield f"{result}: {what}"
