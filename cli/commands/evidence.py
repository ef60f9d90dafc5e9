"""`gaitswarm export`, `evidence` and `verify`: files of a job, and checks of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs
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
    """Write one row per evaluated design: fitness, variables, and results by scenario."""
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
    """As the file's suffix says. Raises InvalidRequest for another."""
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
        Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.zip, to be written.")
    ],
    server: Server = None,
    db: Db = None,
) -> None:
    """Write one file with all that a job is and found, for `verify` and for people."""
    import hashlib

    from gaitswarm.cli.files import replacing
    from gaitswarm.cli.output import note
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        content = jobs.evidence(job_id)
    with replacing(output, "output") as file:
        file.write(content)
    note(f"{output}: SHA-256 {hashlib.sha256(content).hexdigest()}")
    note(f"check it: gaitswarm verify {output} --replay 20")


def verify(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FILE|ID", help="File of `evidence`, or a job's id or its beginning."
        ),
    ],
    replay: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="N",
            help="Evaluations to draw and simulate anew, of the job and of each certificate,"
            " besides the best one.",
        ),
    ] = 20,
    seed: Annotated[
        int | None,
        typer.Option(min=0, help="By which they are drawn. [default: one that is not foreseen]"),
    ] = None,
    head: Annotated[
        str | None,
        typer.Option(
            metavar="DIGEST",
            help="Of an iteration, noted down earlier: the history has to be the one it was of.",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Check evidence, or the stored history of a job, to the bit; 1 if anything differs.

    A file needs neither database nor network, and is never trusted. Of a job the digests of its
    iterations are computed again from what is stored, and the first that differs is named.
    """
    from gaitswarm.cli.exit_codes import CheckFailed
    from gaitswarm.cli.inputs.options import full_id
    from gaitswarm.cli.output import print_json
    from gaitswarm.evidence.verify import verify as verified
    from gaitswarm.jobs.open import open_jobs

    found: VerificationView | HistoryVerificationView
    if Path(source).exists() or Path(source).name != source or "." in source:
        found = verified(source, replay=replay, seed=seed, head=head)
    else:
        with open_jobs(server, db) as jobs:
            source = full_id(jobs, source)
            found = jobs.verify(source, head=head)
            if found.verified:
                found = _verify_evidence(jobs, source, found, replay=replay, seed=seed, head=head)
    if as_json:
        print_json(found)
    else:
        _print_verification(found)
    if not found.verified:
        raise CheckFailed(f"{source} is not what it says to be")


def _verify_evidence(
    jobs: Jobs,
    job_id: str,
    found: HistoryVerificationView,
    *,
    replay: int,
    seed: int | None,
    head: str | None,
) -> VerificationView | HistoryVerificationView:
    """What is stored of a job as it was committed, checked here as evidence."""
    from gaitswarm.errors import Conflict
    from gaitswarm.evidence.verify import verify as verified

    try:
        content = jobs.evidence(job_id)
    except Conflict:
        if not found.iterations:
            raise
        # A history that is too large for a file: only drawn evaluations of it are in memory.
        return jobs.verify(job_id, replay=replay, seed=seed, head=head)
    return verified(content, replay=replay, seed=seed, head=head)


def _print_verification(found: VerificationView | HistoryVerificationView) -> None:
    from rich.text import Text

    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import Table, number
    from gaitswarm.settings import place_of
    from gaitswarm.views.verification import VerificationView

    console = stdout_console()
    table = Table(box=None, show_header=False)
    said = {True: ("passed", "green"), False: ("FAILED", "red"), None: ("not checked", "yellow")}
    for check in found.checks:
        word, style = said[check.passed]
        whose = "" if check.certificate is None else f"certificate {check.certificate}: "
        table.add_row(Text(f"{whose}{check.name}"), Text(word, style=style), Text(check.detail))
    console.print(table)
    for difference in found.differences[:10]:
        values = (number(difference.stored, 17), number(difference.simulated, 17))
        whose = "" if difference.certificate is None else f"certificate {difference.certificate}, "
        console.print(
            f"{whose}design {place_of(difference.iteration, difference.particle)},"
            f" {difference.case}, {difference.what}: stored {values[0]}, simulated {values[1]}",
            markup=False,
        )
    if found.provenance:
        console.print("what numbers depend on is not the same here:", markup=False)
    for line in found.provenance:
        console.print(f"  {line}", markup=False)
    if found.replayed:
        console.print(f"drawn by seed {found.seed}", markup=False)
    result = "verified" if found.verified else "NOT verified"
    if isinstance(found, VerificationView):
        what = f"SHA-256 {found.sha256}"
    else:
        what = f"job {found.job}"
    console.print(f"{result}: {what}", markup=False)
