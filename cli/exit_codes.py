"""Exit codes of `gaitswarm`, and the errors that cause them."""

from __future__ import annotations

import errno
import re
from enum import IntEnum
from typing import Final


class ExitCode(IntEnum):
    """Exit codes, documented in docs/reference/commands.md."""

    OK = 0
    JOB_FAILED = 1  # or was cancelled or paused, or a check failed
    BAD_INPUT = 2  # the message names the option, file or field
    NOT_FOUND = 3  # no such job, iteration, database or result
    CONFLICT = 4  # not possible in the job's current state
    UNAVAILABLE = 5  # server, database, workers, compiler, files, memory or standard output
    FORBIDDEN = 6  # the message names the required token
    BUG = 70  # the traceback shows where
    INTERRUPTED = 130


class JobEnded(Exception):
    """The job that a command waited for did not succeed."""


class CheckFailed(Exception):
    """A command ran, but its check failed."""


class OutputFailed(Exception):
    """Standard output cannot be written."""


_SYSTEM_ERRORS: Final = frozenset(
    {
        *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EISDIR, errno.ELOOP),
        *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENAMETOOLONG),
        *(errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN),
    }
)
"""Refusals of the file system or operating system that no program can avoid."""

_MEMORY: Final = re.compile(
    "failed to map segment|[Cc]annot allocate memory|can't start new thread|Unable to allocate"
)
"""What libraries report in place of a MemoryError."""


def _lacks_memory(error: BaseException | None) -> bool:
    while error is not None:
        if isinstance(error, MemoryError) or _MEMORY.search(str(error)):
            return True
        error = error.__cause__ or error.__context__
    return False


def exit_code(error: BaseException) -> ExitCode | None:
    """Return the exit code of an expected error; None for a bug."""
    if _lacks_memory(error):
        # Nothing more can be imported.
        return ExitCode.UNAVAILABLE
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
    if isinstance(error, OSError) and error.errno in _SYSTEM_ERRORS:
        return ExitCode.UNAVAILABLE
    return next((code for kind, code in kinds if isinstance(error, kind)), None)


def explanation(error: BaseException) -> str:
    """Return an error's message, followed by its notes with remedies."""
    if _lacks_memory(error):
        return "out of memory (or of threads): end other programs, or raise the limits"
    message = str(error)
    if isinstance(error, OSError):
        message = ": ".join(str(part) for part in (error.filename, error.strerror) if part)
    return "\n".join([message, *getattr(error, "__notes__", ())])
