"""Keeps a process running, as systemd's `Restart=always` does: started again when it has ended."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

RESTART_SECONDS: Final = 0.5
"""Before a process that has ended is started again [s]."""

_MARK: Final = "FAULT_CAMPAIGN_SERVICE"
"""Variable by which whatever a service has started is found."""


class Service:
    """A process that is started again whenever it ends.

    Args:
        name: Of the service; of its log, too.
        command: Of the process.
        environment: Its variables.
        logs: Folder of the logs.
        group: Control group of its processes; None for none.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        logs: Path,
        group: Path | None = None,
    ) -> None:
        self.name, self.group = name, group
        self.restarts = 0
        self._command = list(command)
        self._mark = f"{os.getpid()}-{name}"
        self._environment = {**environment, _MARK: self._mark}
        self._log = (logs / f"{name}.log").open("ab")
        self._may_run, self._ended = threading.Event(), threading.Event()
        self._may_run.set()
        self._process = self._start()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int:
        """Of the process as it was last started."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it runs now."""
        return self._process.poll() is None

    def send(self, number: signal.Signals) -> None:
        """Send the process a signal, if it runs."""
        if self.alive:
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def below(self, *titles: str) -> list[int]:
        """Processes below it whose command line contains one of some words."""
        return [pid for pid in descendants(self.pid) if any(word in title(pid) for word in titles)]

    def take_away(self) -> None:
        """End it and all that it has started, and keep it so."""
        self._may_run.clear()
        self._kill_all()
        self._process.wait()

    def bring_back(self) -> None:
        """Let it be started again."""
        self._may_run.set()

    def close(self) -> None:
        """End it for good, politely first."""
        self._ended.set()
        self._may_run.set()
        self.send(signal.SIGCONT)
        self.send(signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=20.0)
        self._kill_all()
        self._process.wait()
        self._thread.join(timeout=10.0)
        self._log.close()

    def _start(self) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            self._command,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=self._log,
            cwd="/",
            start_new_session=True,
        )
        if self.group is not None:
            with suppress(OSError):
                (self.group / "cgroup.procs").write_text(str(process.pid), encoding="ascii")
        return process

    def _watch(self) -> None:
        while True:
            self._process.wait()
            self._may_run.wait()
            if self._ended.wait(RESTART_SECONDS):
                return
            self._kill_all()
            if self._may_run.is_set():
                self._process = self._start()
                self.restarts += 1

    def _kill_all(self) -> None:
        """Kill the process, what is below it, and what outlived its parents."""
        marked = f"{_MARK}={self._mark}".encode()
        found = {*descendants(self.pid), *([self.pid] if self.alive else [])}
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit():
                with suppress(OSError):
                    if marked in (entry / "environ").read_bytes().split(b"\0"):
                        found.add(int(entry.name))
        for pid in found:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def descendants(root: int) -> list[int]:
    """Processes below one, those below these included."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                status = (entry / "stat").read_text(encoding="utf-8", errors="replace")
                children.setdefault(int(status.rpartition(")")[2].split()[1]), []).append(
                    int(entry.name)
                )
    found, ahead = [], list(children.get(root, ()))
    while ahead:
        pid = ahead.pop()
        found.append(pid)
        ahead += children.get(pid, ())
    return found


def title(pid: int) -> str:
    """Command line of a process; "" if it has ended."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8", errors="replace")
    return ""
