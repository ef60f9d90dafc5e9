"""Processes of NOMAD that can be ended and made again at any time."""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any, Final

_SCRIPT: Final = Path(__file__).with_name("nomad_process.py")

MOST_PROCESSES: Final = 4
"""Idle processes of NOMAD, at most, that this process keeps."""

Block = list[list[float]]


class Nomad:
    """A conversation with NOMAD, whose process is a mere convenience.

    NOMAD says the same again where it is told the same again. So of all conversations the least
    recently used ones lose their process, and have another one when they go on.
    """

    def __init__(self) -> None:
        """Begin a conversation; the process starts with the first message."""
        self._said: list[str] = []
        self._process: subprocess.Popen[str] | None = None
        # Its own reference: a conversation may be closed when this module's names are gone.
        self._idle = _IDLE

    def begin(
        self, x0: list[float], lower: list[float], upper: list[float], parameters: list[str]
    ) -> Block | None:
        """Begin a run, where none is under way."""
        run = {"x0": x0, "lower": lower, "upper": upper, "parameters": parameters}
        return self._exchange(json.dumps(run))

    def tell(self, values: list[float | None]) -> Block | None:
        """Give what the last points are worth."""
        return self._exchange(json.dumps({"values": values}))

    def close(self) -> None:
        """End the process, if there is one, and wait until it is gone."""
        self._idle.remove(self)
        self.sleep()

    def sleep(self) -> None:
        """End the process; the conversation can go on with another one."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.communicate()

    def _exchange(self, message: str) -> Block | None:
        self._idle.remove(self)
        if self._process is None:
            self._process = _start()
            for said in self._said:
                _answer(self._process, said)
        block = _answer(self._process, message)
        self._said.append(message)
        self._idle.add(self)
        return block


class _Idle:
    """Conversations that have a process and are not waited for, the least recently used first."""

    def __init__(self) -> None:
        self._order: OrderedDict[int, Nomad] = OrderedDict()
        # Reentrant: collecting garbage may close a conversation wherever memory is asked for.
        self._lock = threading.RLock()

    def add(self, nomad: Nomad) -> None:
        with self._lock:
            self._order[id(nomad)] = nomad
            while len(self._order) > MOST_PROCESSES:
                self._order.popitem(last=False)[1].sleep()

    def remove(self, nomad: Nomad) -> None:
        with self._lock:
            self._order.pop(id(nomad), None)

    def sleep(self) -> None:
        """End the processes of all."""
        with self._lock:
            while self._order:
                self._order.popitem()[1].sleep()


_IDLE: Final = _Idle()
# Searches that are never closed are collected when this process ends, too late to wait for others.
atexit.register(_IDLE.sleep)


def _start() -> subprocess.Popen[str]:
    """A process that ends with this one, as its stdin does."""
    return subprocess.Popen(
        [sys.executable, "-P", str(_SCRIPT)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        # More threads wait for each other most of the time.
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )


def _answer(process: subprocess.Popen[str], message: str) -> Block | None:
    assert process.stdin is not None  # noqa: S101
    assert process.stdout is not None  # noqa: S101
    process.stdin.write(message + "\n")
    process.stdin.flush()
    line = process.stdout.readline()
    if not line:
        raise RuntimeError(f"NOMAD's process ended with status {process.wait()}")
    answer: dict[str, Any] = json.loads(line)
    block: Block | None = answer["block"]
    return block
