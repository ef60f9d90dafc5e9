"""Program of processes that are forked for a command of `gaitswarm`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from multiprocessing.connection import Connection

# Commands import these when they run: here, in the process that is forked, once for all of them.
for _name in (
    "alembic.command",
    "gaitswarm.api.app",
    "gaitswarm.api.app",
    "gaitswarm.cli.commands.serve",
    "gaitswarm.cli.embedded",
    "gaitswarm.cli.inputs",
    "gaitswarm.cli.main",
    "gaitswarm.cli.tables",
    "gaitswarm.jobs.database",
    "numpy.random",
    "rich.console",
    "gaitswarm.services.monitoring.metrics",
    "gaitswarm.services.monitoring.metrics",
    "gaitswarm.services.monitoring.webhooks",
    "gaitswarm.services.runtime",
    "gaitswarm.sim.simulate",
    "tests.resume.job_process",
    "typer._adapters",
):
    import_module(_name)

# As in the process of the tests.
vars(import_module("gaitswarm.services.optimizer.store.engine"))["SYNCHRONOUS"] = "OFF"


def main(
    program: Callable[[], object],
    arguments: Sequence[str],
    environment: Mapping[str, str],
    streams: Mapping[int, Connection],
    new_session: bool,
) -> None:
    """Be the program. streams: standard ones, by number; output and error are among them."""
    if new_session:
        os.setsid()
    for number, stream in streams.items():
        os.dup2(stream.fileno(), number)
        stream.close()
    os.environ.clear()
    os.environ.update(environment)
    if 0 in streams:
        sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    # A line is written at once.
    sys.stdout, sys.stderr = (
        open(  # noqa: SIM115
            number, "w", encoding="utf-8", errors=errors, buffering=1, closefd=False
        )
        for number, errors in ((1, "strict"), (2, "backslashreplace"))
    )
    sys.argv = ["gaitswarm", *arguments]
    program()
