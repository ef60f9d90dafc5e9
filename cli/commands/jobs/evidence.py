"""`gaitswarm evidence`: one file that proves a run; `verify` checks it, anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.views.verification import VerificationView


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(evidence)
    app.command()(verify)


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

    from cli.atomic_file import replacing
    from cli.output import note
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
        typer.Argument(metavar="FILE|ID", help="File of `evidence`, or a job's id to check it by."),
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
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Check evidence: hashes, what follows from what, and walks, to the bit; 1 if any differs.

    It needs neither database nor network, and never trusts the file.
    """
    from cli.exit_codes import CheckFailed
    from cli.output import print_json
    from gaitswarm.evidence.verify import verify as verified
    from gaitswarm.jobs.open import open_jobs

    if Path(source).exists() or Path(source).name != source or "." in source:
        found = verified(source, replay=replay, seed=seed)
    else:
        with open_jobs(server, db) as jobs:
            content = jobs.evidence(source)
        found = verified(content, replay=replay, seed=seed)
    if as_json:
        print_json(found)
    else:
        _print(found)
    if not found.verified:
        raise CheckFailed(f"{source} is not what it says to be")


def _print(found: VerificationView) -> None:
    from rich.table import Table
    from rich.text import Text

    from cli.output import stdout_console
    from cli.tables import number

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
            f"{whose}iteration {difference.iteration}, particle {difference.particle},"
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
    console.print(f"{result}: SHA-256 {found.sha256}", markup=False)
