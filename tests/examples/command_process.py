"""What a process runs that is forked for a command of `gaitswarm`."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from multiprocessing.connection import Connection

import cli.main

# Commands import these when they run: here, in the process that is forked, once for all of them.
for _name in (
    "alembic.command",
    "api.app",
    "api.server",
    "cli.commands.jobs.serve",
    "cli.embedded",
    "cli.inputs.robots",
    "cli.inputs.spec_file",
    "cli.tables.views",
    "gaitswarm.jobs.database.jobs",
    "numpy.random",
    "rich.console",
    "services.monitoring.collectors",
    "services.monitoring.measured_store",
    "services.monitoring.webhooks",
    "services.runtime",
    "sim.simulate",
    "tests.resume.job_process",
    "typer._adapters",
):
    import_module(_name)


def main(
    arguments: Sequence[str],
    environment: Mapping[str, str],
    streams: tuple[Connection, Connection],
    new_session: bool,
) -> None:
    """Be the command. streams: standard output and error."""
    if new_session:
        os.setsid()
    for number, stream in enumerate(streams, start=1):
        os.dup2(stream.fileno(), number)
        stream.close()
    os.environ.clear()
    os.environ.update(environment)
    # A line is written at once.
    sys.stdout, sys.stderr = (
        open(  # noqa: SIM115
            number, "w", encoding="utf-8", errors=errors, buffering=1, closefd=False
        )
        for number, errors in ((1, "strict"), (2, "backslashreplace"))
    )
    sys.argv = ["gaitswarm", *arguments]
    cli.main.main()
