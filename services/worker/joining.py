"""A node without CPUs, for a process that uses a cluster which has no node on its machine.

    python -m gaitswarm.services.worker.joining 6379

ends with 0 if a node runs here of a cluster whose head listens at that port, else with 1.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import IO, Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable

_STORE_BYTES: Final = 80 * 1024 * 1024
"""Of the node's object store, in which cases are put."""

_START_SECONDS: Final = 60.0

_END_SECONDS: Final = 10.0

_LATE_SECONDS: Final = 20.0
"""After a head has begun to listen, within which its own node comes on a busy machine."""

_STARTED: Final = "Ray runtime started"

_START: Final = """
import ctypes, runpy, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGTERM)
sys.argv = ["ray", "start", "--block", *sys.argv[1:]]
runpy.run_module("ray.scripts.scripts", run_name="__main__")
"""
"""`ray start`, which ends when the thread that has started it does (PR_SET_PDEATHSIG), however."""


def runs_here(port: int) -> bool:
    """Whether a node runs on this machine, of a cluster whose head listens at a port.

    Args:
        port: Of the head's control service.

    Returns:
        True also where the system does not list its processes, so that none is started there.
    """
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
    """Whether a node runs on this machine, or its cluster's head does, whose own node may be late.

    A head listens a second or more before it is a node. Whoever joined in between would keep the
    head from being started again once it is lost: Ray finds the cluster running here.

    Args:
        host: Of the head.
        port: Of the head's control service.

    Returns:
        Whether a node runs here; of a head here, once it does or has not come for long.
    """
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
    """A node of a cluster, which this process starts and ends; the thread that does so stays.

    Args:
        address: Of the cluster's head, `host:port`.

    Raises:
        EvaluatorUnavailable: It cannot be started; with what Ray says.
    """

    def __init__(self, address: str) -> None:
        self._said: IO[str] = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-c", _START, f"--address={address}"),
                *("--num-cpus=0", "--num-gpus=0"),
                f"--object-store-memory={_STORE_BYTES}",
            ],
            stdin=subprocess.DEVNULL,
            stdout=self._said,
            stderr=subprocess.STDOUT,
            # Ctrl-C is for this process, which lets go of its jobs before its node ends.
            start_new_session=True,
        )
        until = time.monotonic() + _START_SECONDS
        while _STARTED not in (said := self._output()):
            if self._process.poll() is not None or time.monotonic() > until:
                self.close()
                last = (said.strip() or "no reason was given").splitlines()[-1]
                raise EvaluatorUnavailable(
                    f"this machine cannot join the Ray cluster at {address!r}: {last}"
                )
            time.sleep(0.1)

    def close(self) -> None:
        """End the node, with all of its processes. Idempotent."""
        self._process.terminate()
        try:
            self._process.wait(_END_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._said.close()

    def _output(self) -> str:
        self._said.seek(0)
        return self._said.read()


if __name__ == "__main__":
    sys.exit(not runs_here(int(sys.argv[1])))
