"""A server with a job under way, by itself and under load in turns."""

from __future__ import annotations

import asyncio
import gc
import os
import time
from bisect import bisect_right
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, TypeVar

import httpx2
import numpy as np

from benchmarks.load.client import Answer, Streams, Target, ask_at_rate
from gaitswarm.services.worker import EvaluatorKind
from tests.examples.processes import COMMAND_LINE, line_with, start_python
from tests.examples.servers import ServerProcess

T = TypeVar("T")

_JOB: Final = {"name": "measured", "iterations": 1_000_000, "optimizer": "pso-thesis"}
"""The thesis's swarm: 25 designs an iteration in six scenarios."""

_BEGUN: Final[dict[EvaluatorKind, int]] = {"in-process": 10, "ray": 40}
"""Iterations of the job before anything is measured: then Ray has long taken over."""

_SETTLE: Final = 2.0
"""Between windows [s]."""

_DIFFERENT: Final = 500
"""Requests of each kind; then they come again."""

_PAGE: Final = 50


@dataclass(frozen=True, slots=True)
class Load:
    """How much is asked of a server.

    Attributes:
        per_second: Requests that are due a second [1/s].
        streams: Event streams that are open; half of them follow the job.
        seconds: Length of a window [s].
        pairs: Windows under load, and as many without.
        slots: Walks that are computed at once; 0: no job is run.
        apart: Whether a runner in a process of its own runs the job, in place of the server's.
        evaluator: Where it walks: in threads of that process, or on Ray once it has begun there.
        seed: Of what is asked for.
    """

    per_second: float = 100.0
    streams: int = 200
    seconds: float = 20.0
    pairs: int = 8
    slots: int = 2
    apart: bool = False
    evaluator: EvaluatorKind = "ray"
    seed: int = 1


@dataclass
class Found:
    """What came of a trial.

    Attributes:
        answers: To all requests.
        alone: Evaluations a second of the job alone, by pair of windows [1/s].
        under_load: The same under load.
        client: Processors that the client took, by window under load [1].
        server: The same of the server's process, which may run the job as well; alone, and under
            load.
        events: Events of iterations that came.
        ended: Streams that ended by themselves.
    """

    answers: list[Answer] = field(default_factory=list)
    alone: list[float] = field(default_factory=list)
    under_load: list[float] = field(default_factory=list)
    client: list[float] = field(default_factory=list)
    server: list[tuple[float, float]] = field(default_factory=list)
    events: int = 0
    ended: int = 0


@dataclass(frozen=True, slots=True)
class _Window:
    """Its ends, UTC, and the processors that the server's process took [1]."""

    begun: datetime
    ended: datetime
    server: float


def run(database: str, load: Load, say: Callable[[str], None] = lambda _: None) -> Found:
    """Serve a store that was filled, run a job on it, and ask.

    Args:
        database: File or URL.
        load: How much is asked.
        say: Told how far it is.

    Returns:
        What came of it.
    """
    with ExitStack() as opened:
        server = _serve(database, load, opened)
        target = Target.of(server.url)
        wanted = requests_to(server.client, target, np.random.default_rng(load.seed))
        job, idle = server.submit(_JOB), waiting_jobs(server.client)
        if load.slots:
            _wait_for_iterations(server, job, _BEGUN[load.evaluator])
        trial = _Trial(server, target, wanted, [job, *idle] if load.slots else idle, load)
        # Python's search for garbage among all that is loaded here would look like slow answers.
        gc.disable()
        opened.callback(gc.enable)
        # Code that is loaded with the first request of a kind is no part of it.
        asyncio.run(ask_at_rate(target, wanted, per_second=load.per_second, seconds=_SETTLE))
        windows = []
        for pair in range(load.pairs):
            order = (False, True) if pair % 2 == 0 else (True, False)
            windows.append({loaded: trial.window(loaded) for loaded in order})
            say(f"pair {pair + 1} of {load.pairs}")
        server.client.post(f"/v1/jobs/{job}/cancel").raise_for_status()
        commits = _commits(server.client, job)
        found = trial.found
        for windows_of_pair in windows:
            alone, loaded = windows_of_pair[False], windows_of_pair[True]
            found.server.append((alone.server, loaded.server))
            if load.slots:
                found.alone.append(_rate(commits, alone))
                found.under_load.append(_rate(commits, loaded))
        server.client.delete(f"/v1/jobs/{job}").raise_for_status()
        return found


def _serve(database: str, load: Load, opened: ExitStack) -> ServerProcess:
    environment = {"GAITSWARM_CPUS": str(load.slots or 1), "GAITSWARM_CONCURRENT_JOBS": "1"}
    runs = ("--evaluator", load.evaluator)
    alone = load.apart or not load.slots
    options = ("--no-runner",) if alone else runs
    server = ServerProcess(database, *options, environment=environment)
    opened.callback(server.close)
    if load.apart and load.slots:
        log = {"GAITSWARM_LOG_LEVEL": "INFO"}
        command = (*COMMAND_LINE, "runner", "--db", database, *runs)
        runner = start_python(*command, environment=environment | log, stdout=None)
        opened.callback(runner.wait)
        opened.callback(runner.terminate)
        line_with(runner.stderr, "ready")
    return server


@dataclass
class _Trial:
    server: ServerProcess
    target: Target
    wanted: Sequence[tuple[str, bytes]]
    followed: Sequence[str]
    load: Load
    found: Found = field(default_factory=Found)

    def window(self, loaded: bool) -> _Window:
        """Let the job run for a while, and ask meanwhile or not."""
        return asyncio.run(self._window(loaded))

    async def _window(self, loaded: bool) -> _Window:
        streams = Streams()
        if loaded:
            await streams.open(self.target, self._paths())
        await asyncio.sleep(_SETTLE)
        pid = self.server.process.pid
        streams.iterations = 0
        client, server, clock = time.process_time(), computed(pid), time.perf_counter()
        begun = datetime.now(UTC)
        if loaded:
            rate, seconds = self.load.per_second, self.load.seconds
            asked = ask_at_rate(self.target, self.wanted, per_second=rate, seconds=seconds)
            self.found.answers += await asked
        else:
            await asyncio.sleep(self.load.seconds)
        elapsed = time.perf_counter() - clock
        window = _Window(begun, datetime.now(UTC), (computed(pid) - server) / elapsed)
        if loaded:
            self.found.client.append((time.process_time() - client) / elapsed)
            self.found.events += streams.iterations
            self.found.ended += streams.ended
            streams.close()
        return window

    def _paths(self) -> list[str]:
        """Of the streams: half of them follow the first job, the others one each."""
        first, *others = self.followed
        jobs = [
            first if n % 2 == 0 or not others else others[n // 2 % len(others)]
            for n in range(self.load.streams)
        ]
        done = {job: self.server.job(job)["iterations"] for job in set(jobs)}
        return [
            f"/v1/jobs/{job}/events" + (f"?after={done[job] - 1}" if done[job] else "")
            for job in jobs
        ]


def requests_to(
    client: httpx2.Client, target: Target, draw: np.random.Generator
) -> list[tuple[str, bytes]]:
    """Kinds and texts of requests, the kinds in turn."""
    pages = _pages(client)
    jobs = [job for _, items in pages for job in items]
    begun = [job for job in jobs if job["best_fitness"] is not None]
    long = [job for job in begun if not job["name"].startswith("short")]
    cursors = [cursor for cursor, _ in pages]

    def pick(choices: Sequence[T]) -> T:
        return choices[int(draw.integers(len(choices)))]

    def jobs_path(**query: str) -> str:
        after = pick(cursors)
        parts = {"limit": str(_PAGE), **query, **({"after": after} if after and not query else {})}
        return "/v1/jobs?" + "&".join(f"{name}={value}" for name, value in parts.items())

    def of(job: dict[str, Any], rest: str = "") -> str:
        return f"/v1/jobs/{job['id']}{rest}"

    def iterations() -> str:
        job = pick(long)
        return of(job, f"/iterations?after={draw.integers(job['iterations'])}")

    def evaluations() -> str:
        job = pick(long)
        return of(job, f"/iterations/{draw.integers(job['iterations'])}/evaluations")

    kinds: dict[str, Callable[[], str]] = {
        "jobs": jobs_path,
        "jobs by fitness or name": lambda: jobs_path(order=pick(["fitness", "name"])),
        "jobs found by name": lambda: jobs_path(search=f"{draw.integers(1000):03d}"),
        "job": lambda: of(pick(begun)),
        "iterations": iterations,
        "evaluations": evaluations,
        "best": lambda: of(pick(begun), "/best"),
    }
    return [
        (kind, target.request(path())) for _ in range(_DIFFERENT) for kind, path in kinds.items()
    ]


def _pages(client: httpx2.Client) -> list[tuple[str | None, list[dict[str, Any]]]]:
    """All pages of the list of jobs: what each comes after, and its jobs."""
    pages: list[tuple[str | None, list[dict[str, Any]]]] = []
    after: str | None = None
    while True:
        query = {"limit": str(_PAGE)} | ({"after": after} if after else {})
        page = client.get("/v1/jobs", params=query).raise_for_status().json()
        pages.append((after, page["items"]))
        after = page["next"]
        if after is None:
            return pages


def waiting_jobs(client: httpx2.Client) -> list[str]:
    """Jobs that have not ended and do not run: their streams stay open."""
    page = client.get("/v1/jobs", params={"state": "paused", "limit": 200}).raise_for_status()
    return [job["id"] for job in page.json()["items"]]


def _wait_for_iterations(server: ServerProcess, job: str, iterations: int) -> None:
    ends = time.monotonic() + 180.0
    while server.job(job)["iterations"] < iterations:
        assert time.monotonic() < ends, f"the job does not begin: {server.job(job)['error']}"
        time.sleep(0.2)


def _commits(client: httpx2.Client, job: str) -> list[tuple[datetime, int]]:
    """When iterations were committed, and designs judged until then."""
    commits: list[tuple[datetime, int]] = []
    query: dict[str, str] = {"limit": "1000"}
    while True:
        page = client.get(f"/v1/jobs/{job}/iterations", params=query).raise_for_status().json()
        for item in page["items"]:
            before = commits[-1][1] if commits else 0
            commits.append((datetime.fromisoformat(item["committed_at"]), before + item["designs"]))
        if page["next"] is None:
            return commits
        query["after"] = page["next"]


def _rate(commits: Sequence[tuple[datetime, int]], window: _Window) -> float:
    """Evaluations a second between the first and the last commit in a window [1/s]."""
    times = [at for at, _ in commits]
    first, last = bisect_right(times, window.begun), bisect_right(times, window.ended) - 1
    assert last > first, "the job commits less than twice in a window; make it longer"
    (begun, before), (ended, after) = commits[first], commits[last]
    return (after - before) / (ended - begun).total_seconds()


def computed(pid: int) -> float:
    """Time of processors that a process has had [s]."""
    after_name = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(after_name[11]) + int(after_name[12])) / os.sysconf("SC_CLK_TCK")
