"""Processes of `gaitswarm` that are forked from one which has imported what commands need.

They are the command line in a process of its own: with its signals, streams and exit code; or
another program, as a test has it. What they leave out is the start of the interpreter with its
imports, a second each; so tests of how `gaitswarm` starts, or ends as an interpreter, start it as
users do (`COMMAND_LINE`).
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Any, Self

from gaitswarm.cli.main import main
from tests.examples import command_process
from tests.examples.processes import environment_of_process

PROCESSES = multiprocessing.get_context("forkserver")
"""Processes of one that has imported all that a job needs, and nothing else."""

PROCESSES.set_forkserver_preload([command_process.__name__])

Stream = IO[Any] | int | None
"""As of `subprocess.Popen`: a file, `subprocess.PIPE`, or None for this process's own."""


class ForkedCommand:
    """A command in a process, used as `subprocess.Popen` is.

    arguments: of `gaitswarm`; environment: added to this process's; program: a function of a module
    that a process runs in place of `gaitswarm`.
    """

    def __init__(
        self,
        *arguments: str | Path,
        environment: Mapping[str, str] | None = None,
        program: Callable[[], object] = main,
        stdin: Stream = None,
        stdout: Stream = subprocess.PIPE,
        stderr: Stream = subprocess.PIPE,
        start_new_session: bool = False,
    ) -> None:
        self.stdin: IO[str] | None = None
        streams = {}
        if stdin is not None:
            self.stdin, streams[0] = _stream(stdin, 0)
        self.stdout, streams[1] = _stream(stdout, 1)
        self.stderr, streams[2] = _stream(stderr, 2)
        self._process = PROCESSES.Process(
            target=command_process.main,
            args=(
                program,
                [str(argument) for argument in arguments],
                environment_of_process(environment),
                streams,
                start_new_session,
            ),
            # At the end of the tests nothing waits for it.
            daemon=True,
        )
        self._process.start()
        for stream in streams.values():
            stream.close()
        assert self._process.pid is not None
        self.pid = self._process.pid

    @property
    def returncode(self) -> int | None:
        """Exit code, or minus the number of a signal; None while it runs."""
        return self._process.exitcode

    def poll(self) -> int | None:
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired("gaitswarm", timeout or 0.0)
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """All that is left in pipes, once it has ended."""
        said = ["", ""]

        def read(index: int, stream: IO[str]) -> None:
            said[index] = stream.read()

        readers = [
            threading.Thread(target=read, args=(index, stream), daemon=True)
            for index, stream in enumerate((self.stdout, self.stderr))
            if stream is not None and not stream.closed
        ]
        for reader in readers:
            reader.start()
        self.wait(timeout)
        for reader in readers:
            reader.join(timeout)
        self._close()
        return said[0], said[1]

    def send_signal(self, number: int) -> None:
        # That it has ended is known here a moment after it is gone.
        with suppress(ProcessLookupError):
            if self.poll() is None:
                os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()
        self.wait()

    def _close(self) -> None:
        for stream in (self.stdin, self.stdout, self.stderr):
            if stream is not None:
                with suppress(OSError):
                    stream.close()


def run_forked(
    *arguments: str | Path,
    environment: Mapping[str, str] | None = None,
    stdout: Stream = subprocess.PIPE,
    stderr: Stream = subprocess.PIPE,
    timeout: float = 120.0,
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end. Arguments as of `ForkedCommand`."""
    process = ForkedCommand(*arguments, environment=environment, stdout=stdout, stderr=stderr)
    try:
        out, err = process.communicate(timeout)
    except BaseException:
        process.kill()
        raise
    return subprocess.CompletedProcess(["gaitswarm", *arguments], process.wait(), out, err)


def _stream(given: Stream, number: int) -> tuple[IO[str] | None, Connection]:
    """Where this process reads or writes, and what the other one has in its place."""
    if given != subprocess.PIPE:
        own = number if given is None else given if isinstance(given, int) else given.fileno()
        return None, Connection(os.dup(own), readable=False)
    reading, writing = os.pipe()
    if number == 0:
        return open(writing, "w", encoding="utf-8"), Connection(reading, writable=False)  # noqa: PTH123
    return open(reading, encoding="utf-8"), Connection(writing, readable=False)  # noqa: PTH123
