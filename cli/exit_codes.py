"""Exit codes of `gaitswarm`, and which error ends in which.

0    done
1    the job that was waited for failed or was cancelled
2    usage, or input that makes no sense; the message names the option, file or field
3    no such job, iteration, database or result
4    the job's present state does not allow it
5    server, database, workers or compiler cannot be reached or used now
70   a bug; the traceback says where
130  interrupted
"""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """What the shell sees; a contract, documented in docs/cli.md."""

    OK = 0
    JOB_FAILED = 1
    BAD_INPUT = 2
    NOT_FOUND = 3
    CONFLICT = 4
    UNAVAILABLE = 5
    BUG = 70
    INTERRUPTED = 130


class JobEnded(Exception):
    """A command did its work, but the job that it waited for did not succeed."""


def exit_code(error: BaseException) -> ExitCode | None:
    """Code of an error that gaitswarm raises on purpose; None for any other."""
    from services.optimizer import errors
    from sim.errors import SimulationError, SimulationInputError

    kinds: tuple[tuple[type[BaseException], ExitCode], ...] = (
        (JobEnded, ExitCode.JOB_FAILED),
        (errors.InvalidRequest, ExitCode.BAD_INPUT),
        (SimulationInputError, ExitCode.BAD_INPUT),
        (errors.NotFound, ExitCode.NOT_FOUND),
        (errors.Conflict, ExitCode.CONFLICT),
        (errors.LeaseLost, ExitCode.CONFLICT),
        (errors.EvaluatorUnavailable, ExitCode.UNAVAILABLE),
        (errors.StoreUnavailable, ExitCode.UNAVAILABLE),
        (SimulationError, ExitCode.UNAVAILABLE),
    )
    return next((code for kind, code in kinds if isinstance(error, kind)), None)
