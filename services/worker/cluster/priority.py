"""Workers that stand back behind all other programs of their machine."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Final

_AUTOGROUP: Final = Path("/proc/self/autogroup")
"""Niceness of this process's session."""


class Priority:
    """What a worker's niceness counts for: in its own session alone, or on the whole machine.

    Linux shares processors between sessions evenly, however nice their processes are, and goes by
    niceness only among the processes of one (`man 7 sched`, autogroups). A worker that Ray has made
    nice would still take as much as the server that answers in another terminal or service.
    """

    def __init__(self) -> None:
        self._is_settled = False

    def stand_back(self) -> None:
        """Give this process a session of its own, which is as nice as the process.

        Its process group keeps its number. Nothing is done where a process is not nice, where
        there are no such groups, or where they are not to be changed. The kernel changes few of
        them a second; then it is tried again with the next call.
        """
        niceness = 0 if self._is_settled else os.nice(0)
        if niceness <= 0 or not _AUTOGROUP.exists():
            return
        try:
            if os.getsid(0) != os.getpid():
                # Who leads a process group, as Ray's workers do, may begin no session.
                os.setpgid(0, os.getpgid(os.getppid()))
                os.setsid()
            _AUTOGROUP.write_text(str(niceness), encoding="ascii")
        except OSError as error:
            self._is_settled = error.errno != errno.EAGAIN
        else:
            self._is_settled = True
