"""What answers take of a server's processors, by kind of request, and what event streams do.

    python -m benchmarks.load.cost [--store jobs.db] [--checkouts FOLDER ...] [--requests 150]
        [--streams 200] [--seconds 20] [--json]

Servers of one or more checkouts serve the same SQLite file, without a runner, and are asked in
turns: requests that come for the first time, the same ones again, and again with a commit before
each. Processor time hardly depends on what else a machine does; latencies would.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import httpx2
import numpy as np

from benchmarks.large_store import long_spec
from benchmarks.large_store import run as run_job
from benchmarks.load.client import Connection, Streams, Target
from benchmarks.load.filled import fill_with
from benchmarks.load.trial import computed, requests_to, waiting_jobs
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.services.runtime import open_store
from tests.examples.paths import ROOT
from tests.examples.processes import COMMAND_LINE, line_with, start_python

_ASKED: Final = ("first", "again", "committed")
"""How requests are asked: for the first time, again, and again after a commit."""

_FOLLOWED: Final = 40
"""Iterations of the job that streams follow."""


@dataclass(frozen=True)
class _Server:
    """A server's checkout, process, and where it listens."""

    checkout: Path
    pid: int
    url: str

    @property
    def target(self) -> Target:
        return Target.of(self.url)


def _serve(checkout: Path, store: str, opened: ExitStack) -> _Server:
    process = start_python(
        *(*COMMAND_LINE, "serve", "--db", store, "--port", "0", "--no-runner"),
        environment={"PYTHONPATH": str(checkout)},
        cwd=checkout,
        stdout=None,
    )
    opened.callback(process.wait)
    opened.callback(process.terminate)
    url = line_with(process.stderr, r"serves (http://[\d.:]+) and")[1]
    return _Server(checkout, process.pid, url)


def _asked(server: _Server, requests: Sequence[bytes], before: Any = lambda: None) -> float:
    """Processor time of a server for each of some requests, one after the other [ms]."""

    async def ask() -> None:
        connection = Connection(server.target)
        for request in requests:
            before()
            status, _ = await connection.ask(request)
            assert status == 200, request
        connection.close()

    begun = computed(server.pid)
    asyncio.run(ask())
    return 1e3 * (computed(server.pid) - begun) / len(requests)


def by_kind(servers: Sequence[_Server], store: Store, requests: int) -> list[dict[str, Any]]:
    """Milliseconds of a processor that requests take, by kind and server.

    Args:
        servers: That are asked in turns.
        store: That they serve.
        requests: Of each kind.

    Returns:
        Rows with `request` and, for each server, its times `first`, `again` and `committed`.
    """
    wanted = []
    for server in servers:
        with httpx2.Client(base_url=server.url, timeout=60.0) as client:
            wanted.append(requests_to(client, server.target, np.random.default_rng(1)))
    other = store.jobs(limit=1).items[0].id
    changes = iter(range(sys.maxsize))

    def commit() -> None:
        store.label(other, LabelsChange(note=f"change {next(changes)}"))

    rows = []
    for kind in dict.fromkeys(kind for kind, _ in wanted[0]):
        row: dict[str, Any] = {"request": kind, "servers": [dict[str, float]() for _ in servers]}
        # Code that is loaded with the first request of a kind is no part of it.
        texts = [[text for k, text in of_server if k == kind] for of_server in wanted]
        for server, some in zip(servers, texts, strict=True):
            _asked(server, some[-20:])
        for what, before in (("first", None), ("again", None), ("committed", commit)):
            for server, some, cell in zip(servers, texts, row["servers"], strict=True):
                cell[what] = _asked(server, some[:requests], before or (lambda: None))
        rows.append(row)
    return rows


def of_streams(server: _Server, store: Store, streams: int, seconds: float) -> dict[str, float]:
    """What event streams take of a server's processors.

    Args:
        server: That is asked.
        store: That it serves.
        streams: That are open.
        seconds: For how long nothing happens [s].

    Returns:
        `idle`: of a stream a second while nothing happens [ms]; `event`: of each event of a job
        that all of them follow [ms].
    """

    async def idle() -> float:
        with httpx2.Client(base_url=server.url, timeout=60.0) as client:
            jobs = waiting_jobs(client)
        opened = Streams()
        paths = [f"/v1/jobs/{jobs[n % len(jobs)]}/events?after=1000000" for n in range(streams)]
        await opened.open(server.target, paths)
        await asyncio.sleep(2.0)
        begun, clock = computed(server.pid), time.perf_counter()
        await asyncio.sleep(seconds)
        taken = (computed(server.pid) - begun) / (time.perf_counter() - clock)
        opened.close()
        return taken

    async def events() -> float:
        job, _ = store.create_job(long_spec(_FOLLOWED))
        opened = Streams()
        await opened.open(server.target, [f"/v1/jobs/{job.id}/events"] * streams)
        begun = computed(server.pid)
        await asyncio.to_thread(run_job, store, job)
        ends = time.monotonic() + 60.0
        while opened.iterations < _FOLLOWED * streams and time.monotonic() < ends:
            await asyncio.to_thread(time.sleep, 0.1)
        taken = (computed(server.pid) - begun) / opened.iterations
        opened.close()
        store.delete_job(job.id)
        return taken

    return {"idle": 1e3 * asyncio.run(idle()) / streams, "event": 1e3 * asyncio.run(events())}


def table(checkouts: Sequence[Path], found: dict[str, Any]) -> str:
    """What was found, in Markdown."""
    lines = [
        "| request, [ms] of a processor | "
        + " | ".join(f"{c.name}: first | again | after a commit" for c in checkouts)
        + " |",
        "| --- |" + " --- |" * (3 * len(checkouts)),
    ]
    for row in found["requests"]:
        cells = (
            f"{c['first']:.2f} | {c['again']:.2f} | {c['committed']:.2f}" for c in row["servers"]
        )
        lines.append(f"| {row['request']} | {' | '.join(cells)} |")
    means = (
        " | ".join(
            f"{np.mean([row['servers'][n][what] for row in found['requests']]):.2f}"
            for what in _ASKED
        )
        for n in range(len(checkouts))
    )
    lines.append(f"| mean | {' | '.join(means)} |")
    for checkout, streams in zip(checkouts, found["streams"], strict=True):
        lines.append(
            f"\n{checkout.name}: a silent stream takes {1e3 * streams['idle']:.0f} us a second, an"
            f" event {1e3 * streams['event']:.0f} us for each stream"
        )
    return "\n".join(lines)


def main() -> None:
    """Print a table, or JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--store", type=Path, help="an SQLite file; filled if it is not there")
    parser.add_argument("--evaluations", type=int, default=20_000, help="of one that is filled")
    parser.add_argument("--checkouts", type=Path, nargs="+", default=[ROOT])
    parser.add_argument("--requests", type=int, default=150, help="of each kind")
    parser.add_argument("--streams", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=20.0, help="of silent streams")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, ExitStack() as opened:
        path = options.store or Path(name) / "filled.db"
        new = not path.exists()
        store = opened.enter_context(closing(open_store(str(path))))
        if new:
            fill_with(store, options.evaluations, jobs=60)
        servers = [_serve(c.resolve(), str(path), opened) for c in options.checkouts]
        found = {
            "requests": by_kind(servers, store, options.requests),
            "streams": [of_streams(s, store, options.streams, options.seconds) for s in servers],
        }
    print(json.dumps(found, indent=2) if options.json else table(options.checkouts, found))


if __name__ == "__main__":
    main()
