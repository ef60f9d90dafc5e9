"""Exit codes of `gaitswarm`, and which error ends in which.

0    done
1    the job that was waited for failed, was cancelled or was paused; or what was checked differs
2    usage, or input that makes no sense; the message names the option, file or field
3    no such job, iteration, database or result
4    the job's present state does not allow it
5    server, database, workers, compiler, files or standard output cannot be reached or used now
6    the server does not let whoever asks do that; the message says which token it takes
70   a bug; the traceback says where
130  interrupted
"""

from __future__ import annotations

import errno
from enum import IntEnum
from typing import Final


class ExitCode(IntEnum):
    """What the shell sees; a contract, documented in docs/reference/commands.md."""

    OK = 0
    JOB_FAILED = 1
    BAD_INPUT = 2
    NOT_FOUND = 3
    CONFLICT = 4
    UNAVAILABLE = 5
    FORBIDDEN = 6
    BUG = 70
    INTERRUPTED = 130


class JobEnded(Exception):
    """A command did its work, but the job that it waited for did not succeed."""


class CheckFailed(Exception):
    """A command did its work, but what it checked is not as it should be."""


class OutputFailed(Exception):
    """Standard output cannot be written."""


_OF_THE_MACHINE: Final = frozenset(
    {
        *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EISDIR, errno.ELOOP),
        *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENAMETOOLONG),
        *(errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN),
    }
)
"""What a file system or the operating system refuses, whatever a program does."""


def exit_code(error: BaseException) -> ExitCode | None:
    """Code of an error that is no bug of gaitswarm; None for any other."""
    from gaitswarm.services.optimizer import errors
    from gaitswarm.sim.errors import SimulationError, SimulationInputError

    kinds: tuple[tuple[type[BaseException], ExitCode], ...] = (
        (JobEnded, ExitCode.JOB_FAILED),
        (CheckFailed, ExitCode.JOB_FAILED),
        (errors.KilledWorker, ExitCode.JOB_FAILED),
        (OutputFailed, ExitCode.UNAVAILABLE),
        (errors.InvalidRequest, ExitCode.BAD_INPUT),
        (SimulationInputError, ExitCode.BAD_INPUT),
        (errors.NotFound, ExitCode.NOT_FOUND),
        (errors.Conflict, ExitCode.CONFLICT),
        (errors.LeaseLost, ExitCode.CONFLICT),
        (errors.Forbidden, ExitCode.FORBIDDEN),
        (errors.EvaluatorUnavailable, ExitCode.UNAVAILABLE),
        (errors.StoreUnavailable, ExitCode.UNAVAILABLE),
        (errors.TooManyRequests, ExitCode.UNAVAILABLE),
        (SimulationError, ExitCode.UNAVAILABLE),
    )
    if isinstance(error, OSError) and error.errno in _OF_THE_MACHINE:
        return ExitCode.UNAVAILABLE
    return next((code for kind, code in kinds if isinstance(error, kind)), None)


def explanation(error: BaseException) -> str:
    """An error for people: what went wrong, and below it what they can do, if that is known."""
    said = str(error)
    if isinstance(error, OSError):
        said = ": ".join(str(part) for part in (error.filename, error.strerror) if part)
    return "\n".join([said, *getattr(error, "__notes__", ())])
