"""Processes with limits, for work on untrusted input, which comes and goes as lines of JSON"""

from __future__ import annotations

import atexit
import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from gaitswarm.sim.errors import ProcessEnded, SimulationError, SimulationInputError

Document = Mapping[str, Any]

_ROOT: Final = Path(__file__).parents[2]

_LONGEST_ANSWER: Final = 64 << 20
"""Largest answer [characters]; C text of a kernel takes a tenth of it."""


class LimitedProcesses:
    """Processes of one program with an address space of `memory` [B]. Thread-safe."""

    def __init__(
        self,
        program: str,
        *,
        count: int,
        seconds: float,
        cpu_seconds: int,
        memory: int,
        kept: bool = True,
    ) -> None:
        self._program = program
        self._seconds = seconds
        self._limits = (cpu_seconds, memory)
        self._kept = kept
        self._idle: queue.LifoQueue[subprocess.Popen[str] | None] = queue.LifoQueue()
        for _ in range(count):
            self._idle.put(None)
        atexit.register(self.close)

    def ask(self, request: Document) -> dict[str, Any]:
        """Answer a request in a process; raise ProcessEnded if it exceeds a limit."""
        process = self._idle.get()
        try:
            if process is None or process.poll() is not None:
                process = self._started()
            answer = self._exchange(process, json.dumps(request))
            if not self._kept or "ended" in answer:
                _end(process)
        except BaseException:
            if process is not None:
                _end(process)
                process = None
            raise
        finally:
            self._idle.put(process)
        if "refused" in answer:
            raise SimulationInputError(answer["refused"])
        if "ended" in answer:
            raise ProcessEnded(answer["ended"])
        return answer

    def close(self) -> None:
        # Taken together, as a process that is put back is the next to be taken.
        idle = [self._idle.get() for _ in range(self._idle.qsize())]
        for process in idle:
            if process is not None:
                _end(process)
            self._idle.put(None)

    def _started(self) -> subprocess.Popen[str]:
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        # Threads of linear algebra would only take address space.
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        try:
            return subprocess.Popen(
                [sys.executable, "-P", "-B", "-m", self._program, *map(str, self._limits)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                encoding="utf-8",
                env=os.environ | {"PYTHONPATH": path} | threads,
                # Ctrl-C must reach this process only: a job must not fail by it.
                start_new_session=True,
            )
        except OSError as error:
            raise SimulationError(f"no process can be started: {error}") from error

    def _exchange(self, process: subprocess.Popen[str], line: str) -> dict[str, Any]:
        assert process.stdin is not None  # noqa: S101
        assert process.stdout is not None  # noqa: S101
        late = threading.Event()

        def end() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(self._seconds, end)
        timer.daemon = True
        timer.start()
        try:
            with suppress(BrokenPipeError):
                process.stdin.write(line + "\n")
                process.stdin.flush()
            answer = process.stdout.readline(_LONGEST_ANSWER)
        finally:
            timer.cancel()
        if not answer.endswith("\n"):
            process.kill()
            raise ProcessEnded(self._reason(process.wait(), late=late.is_set()))
        document: dict[str, Any] = json.loads(answer)
        return document

    def _reason(self, status: int, *, late: bool) -> str:
        if late:
            return f"took more than {self._seconds:g} s"
        if hasattr(signal, "SIGXCPU") and status == -signal.SIGXCPU:
            return f"took more than {self._limits[0]} s of a processor"
        with suppress(ValueError):
            return f"was ended by {signal.Signals(-status).name}"
        return f"ended with status {status}"


def serve(answer: Callable[[Document], Document]) -> None:
    """Answer requests until stdin ends, with the limits of the command line."""
    cpu_seconds, memory = map(int, sys.argv[1:3])
    # Libraries may print to stdout; answers use a copy of it.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    _limit("RLIMIT_AS", memory)
    _limit("RLIMIT_CORE", 0)
    _limit("RLIMIT_FSIZE", 0)
    for line in sys.stdin:
        _limit("RLIMIT_CPU", int(sum(os.times()[:2])) + 1 + cpu_seconds)
        try:
            response = answer(json.loads(line))
        except SimulationInputError as error:
            response = {"refused": str(error)}
        except MemoryError:
            response = {"ended": f"took more than {memory >> 20} MiB of memory"}
        except Exception as error:  # noqa: BLE001 - the calling process must survive any error
            response = {"ended": f"failed: {type(error).__name__}: {error}"[:1000]}
        answers.write(json.dumps(response) + "\n")
        answers.flush()


def _limit(name: str, value: int) -> None:
    with suppress(ImportError, AttributeError, ValueError, OSError):
        import resource  # noqa: PLC0415  not on every system

        kind = getattr(resource, name)
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (value, hard))


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with suppress(OSError):
                stream.close()
    process.wait()
