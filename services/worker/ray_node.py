"""Nodes of a Ray cluster

    python -m gaitswarm.services.worker.ray_node --head --port=6379

is `ray start --block`, but ends when the node's raylet ends, so that a supervisor restarts it.

    python -m gaitswarm.services.worker.ray_node --check 6379

exits with 0 if a node of the cluster whose head listens at that port runs on this machine, else 1.
"""

from __future__ import annotations

import os
import runpy
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any, Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable

OBJECT_STORE_BYTES: Final = 80 * 1024 * 1024
"""Ray's minimum is 75 MiB; designs and results take kilobytes."""

_START_SECONDS: Final = 60.0

_END_SECONDS: Final = 10.0

_LATE_SECONDS: Final = 20.0
"""Time between the start of a head and that of its own node on a busy machine, at most."""

_STARTED: Final = "Ray runtime started"

_START: Final = """
import ctypes, runpy, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGTERM)
sys.argv = ["ray", "start", "--block", *sys.argv[1:]]
runpy.run_module("ray.scripts.scripts", run_name="__main__")
"""
"""`ray start`, ended by the system with the thread that has started it (PR_SET_PDEATHSIG)."""


def runs_here(port: int) -> bool:
    """Return whether a node of a cluster runs on this machine; True if processes are not listed."""
    processes = Path("/proc")
    if not processes.exists():
        return True
    for entry in processes.glob("[0-9]*/cmdline"):
        try:
            words = entry.read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        heads = [word for word in words if word.startswith("--gcs-address=")]
        if words[0].endswith("/raylet") and any(head.endswith(f":{port}") for head in heads):
            return True
    return False


def comes_here(host: str, port: int) -> bool:
    """Return whether a node runs on this machine; wait for one whose head has just started."""
    until = time.monotonic() + (_LATE_SECONDS if _is_here(host) else 0.0)
    while not runs_here(port):
        if time.monotonic() >= until:
            return False
        time.sleep(0.1)
    return True


def _is_here(host: str) -> bool:
    """Whether an address is one of this machine: others cannot be bound."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(address)
    except OSError:
        return False
    return True


class JoinedNode:
    """A node without CPUs for a process on a machine that has no node of a cluster."""

    def __init__(self, address: str) -> None:
        self._output: IO[str] = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-c", _START, f"--address={address}"),
                *("--num-cpus=0", "--num-gpus=0"),
                f"--object-store-memory={OBJECT_STORE_BYTES}",
            ],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            # Ctrl-C is for this process, which ends its jobs before its node.
            start_new_session=True,
        )
        until = time.monotonic() + _START_SECONDS
        while _STARTED not in (text := self._read()):
            if self._process.poll() is not None or time.monotonic() > until:
                self.close()
                last = (text.strip() or "no reason was given").splitlines()[-1]
                raise EvaluatorUnavailable(
                    f"this machine cannot join the Ray cluster at {address!r}: {last}"
                )
            time.sleep(0.1)

    def close(self) -> None:
        """End the node. Idempotent."""
        self._process.terminate()
        try:
            self._process.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._output.close()

    def _read(self) -> str:
        self._output.seek(0)
        return self._output.read()


def start(arguments: Sequence[str]) -> None:
    """Run a node until it ends. arguments: options of `ray start`, without `--block`."""
    from ray._private.node import Node  # noqa: PLC0415 - takes a second

    dead_processes: Callable[[Any], Any] = Node.dead_processes

    def dead_processes_or_end(node: Any) -> Any:
        """Called by `ray start --block` every second."""
        dead = dead_processes(node)
        if any(kind == "raylet" for kind, _ in dead):
            sys.stderr.write("the raylet has ended, and the node with it\n")
            sys.stderr.flush()
            node.kill_all_processes(check_alive=False, allow_graceful=False)
            os._exit(1)
        return dead

    Node.dead_processes = dead_processes_or_end  # type: ignore[method-assign]
    sys.argv = ["ray", "start", "--block", *arguments]
    runpy.run_module("ray.scripts.scripts", run_name="__main__")


def main(arguments: Sequence[str]) -> None:
    if arguments[:1] == ["--check"]:
        sys.exit(not runs_here(int(arguments[1])))
    start(arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
