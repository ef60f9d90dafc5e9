"""Processes with this checkout on their path, and what can be waited for."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from tests.examples.paths import ROOT

COMMAND_LINE = ("-u", "-c", "from gaitswarm.cli.main import main; main()")
"""Arguments of Python that make it `gaitswarm`."""


def python(
    *arguments: str | Path, environment: Mapping[str, str] | None = None, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Run Python to its end. environment: added to this process's; options: of `subprocess.run`."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env=environment_of_process(environment),
        check=False,
        text=True,
        **{"capture_output": True, "timeout": 120, **options},
    )


def start_python(
    *arguments: str | Path, environment: Mapping[str, str] | None = None, **options: Any
) -> subprocess.Popen[str]:
    """Start Python. Arguments as of `python`; options: of `subprocess.Popen`, pipes by default."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        env=environment_of_process(environment),
        text=True,
        **(pipes | options),
    )


def environment_of_process(changes: Mapping[str, str] | None) -> dict[str, str]:
    """This process's environment with some changes, and with this checkout on Python's path."""
    return os.environ | {"PYTHONPATH": str(ROOT)} | dict(changes or {})


def loaded_by(statements: str, packages: Sequence[str]) -> set[str]:
    """Which of these packages a process has imported that runs some statements."""
    program = f"{statements}\nimport sys; print(*{set(packages)!r} & set(sys.modules))"
    done = python("-c", program)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split())


def output(stream: IO[str] | None) -> IO[str]:
    """A process's stream that was asked for as a pipe."""
    assert stream is not None
    return stream


def line_with(stream: IO[str] | None, pattern: str) -> re.Match[str]:
    """The first line that a pattern is found in, as it comes."""
    seen = []
    for line in output(stream):
        seen.append(line)
        found = re.search(pattern, line)
        if found:
            return found
    raise AssertionError(f"{pattern} did not come: {seen}")


def within(seconds: float, condition: Callable[[], bool]) -> bool:
    """Whether something comes true in time; asked again and again, some ten times a second.

    A condition that takes long, as a request to a server, would otherwise keep a processor
    from what is waited for.
    """
    begun = asked = time.monotonic()
    while not condition():
        answered = time.monotonic()
        if answered > begun + seconds:
            return False
        time.sleep(min(max(0.01, 7.0 * (answered - asked)), 0.1))
        asked = time.monotonic()
    return True


def eventually(condition: Callable[[], bool], *, seconds: float = 60.0) -> None:
    """Wait until something comes true, and fail if it does not in time."""
    assert within(seconds, condition), f"it did not happen within {seconds:g} s"
