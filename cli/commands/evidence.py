"""`gaitswarm export`, `evidence` and `verify`: files of a job, and checks of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.tables import TableFormat
    from gaitswarm.views.verification import HistoryVerificationView, VerificationView


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(export)
    app.command()(evidence)
    app.command()(verify)


def export(
    job_id: JobId,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.csv or FILE.parquet.")
    ],
    server: Server = None,
    db: Db = None,
) -> None:
    """Write a table with one row per evaluated design: fitness, variables, results by scenario."""
    from gaitswarm.cli.files import replacing
    from gaitswarm.cli.output import note
    from gaitswarm.jobs.open import open_jobs

    file_format = _table_format(output)
    with open_jobs(server, db) as jobs:
        job = jobs.job(job_id)
        with replacing(output, "output") as file:
            for part in jobs.export(job_id, file_format):
                file.write(part)
    note(f"{job.evaluations} evaluations written to {output}")


def _table_format(path: Path) -> TableFormat:
    """Return the format of the file's suffix."""
    from gaitswarm.services.optimizer.errors import InvalidRequest

    match path.suffix:
        case ".csv":
            return "csv"
        case ".parquet":
            return "parquet"
        case _:
            raise InvalidRequest(f"{path} must end in .csv or .parquet", field="output")


def evidence(
    job_id: JobId,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.zip to write.")
    ],
    server: Server = None,
    db: Db = None,
) -> None:
    """Write a job's spec, history and results to one file that `verify` checks."""
    import hashlib

    from gaitswarm.cli.files import replacing
    from gaitswarm.cli.output import note
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        content = jobs.evidence(job_id)
    with replacing(output, "output") as file:
        file.write(content)
    note(f"{output}: SHA-256 {hashlib.sha256(content).hexdigest()}")
    note(f"to check it, run: gaitswarm verify {output} --replay 20")


def verify(
    source: Annotated[
        str,
        typer.Argument(metavar="FILE|ID", help="File of `evidence`, or a job's id or its prefix."),
    ],
    replay: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="N",
            help="Evaluations to sample and repeat, of the job and of each certificate, in"
            " addition to the best.",
        ),
    ] = 20,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="Seed of the sample. [default: unpredictable]"),
    ] = None,
    head: Annotated[
        str | None,
        typer.Option(
            metavar="DIGEST",
            help="Digest of an iteration, noted earlier, that the history must contain.",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Check evidence, or a job's stored history, to the bit; exit code 1 if anything differs.

    Checking a file needs neither database nor network, and never trusts the file. For a job, the
    digests of its iterations are recomputed, and the first that differs is named.
    """
    from gaitswarm.cli.exit_codes import CheckFailed
    from gaitswarm.cli.inputs.options import full_id
    from gaitswarm.cli.output import print_json
    from gaitswarm.evidence.verify import verify as verified
    from gaitswarm.jobs.open import open_jobs

    view: VerificationView | HistoryVerificationView
    if Path(source).exists() or Path(source).name != source or "." in source:
        view = verified(source, replay=replay, seed=seed, head=head)
    else:
        with open_jobs(server, db) as jobs:
            source = full_id(jobs, source)
            view = jobs.verify(source, head=head)
            if view.verified:
                view = _verify_evidence(jobs, source, view, replay=replay, seed=seed, head=head)
    if as_json:
        print_json(view)
    else:
        _print_verification(view)
    if not view.verified:
        raise CheckFailed(f"verification of {source} failed")


def _verify_evidence(
    jobs: Jobs,
    job_id: str,
    history: HistoryVerificationView,
    *,
    replay: int,
    seed: int | None,
    head: str | None,
) -> VerificationView | HistoryVerificationView:
    """Verify a job as evidence in this process."""
    from gaitswarm.errors import Conflict
    from gaitswarm.evidence.verify import verify as verified

    try:
        content = jobs.evidence(job_id)
    except Conflict:
        if not history.iterations:
            raise
        # The history is too large for a file: check it in the database.
        return jobs.verify(job_id, replay=replay, seed=seed, head=head)
    return verified(content, replay=replay, seed=seed, head=head)


def _print_verification(view: VerificationView | HistoryVerificationView) -> None:
    from rich.text import Text

    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import Table, number
    from gaitswarm.settings import place_of
    from gaitswarm.views.verification import VerificationView

    console = stdout_console()
    table = Table(box=None, show_header=False)
    states = {True: ("passed", "green"), False: ("FAILED", "red"), None: ("not checked", "yellow")}
    for check in view.checks:
        word, style = states[check.passed]
        whose = "" if check.certificate is None else f"certificate {check.certificate}: "
        table.add_row(Text(f"{whose}{check.name}"), Text(word, style=style), Text(check.detail))
    console.print(table)
    for difference in view.differences[:10]:
        values = (number(difference.stored, 17), number(difference.simulated, 17))
        whose = "" if difference.certificate is None else f"certificate {difference.certificate}, "
        console.print(
            f"{whose}design {place_of(difference.iteration, difference.particle)},"
            f" {difference.case}, {difference.what}: stored {values[0]}, simulated {values[1]}",
            markup=False,
        )
    if view.provenance:
        console.print("provenance differs on this machine:", markup=False)
    for line in view.provenance:
        console.print(f"  {line}", markup=False)
    if view.replayed:
        console.print(f"sampled by seed {view.seed}", markup=False)
    result = "verified" if view.verified else "NOT verified"
    what = f"SHA-256 {view.sha256}" if isinstance(view, VerificationView) else f"job {view.job}"
    console.print(f"{result}: {what}", markup=False)
