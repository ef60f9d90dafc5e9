"""Runs a campaign: keeps jobs coming, injects what is planned, and judges the histories."""

from __future__ import annotations

import itertools
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import httpx2

from benchmarks.faults.deployment import Deployment
from benchmarks.faults.kinds import KINDS
from benchmarks.faults.plan import Planned
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.runtime import run_embedded
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from tests.examples.jobs import Bits, history
from tests.examples.walks import SHORT_WALK

_OPEN_JOBS: Final = 3
_GLANCE: Final = 0.2

Say = Callable[[str], None]


def specs(iterations: int) -> list[JobSpec]:
    """Jobs of several search methods; they come again and again."""
    methods = [
        {"name": "pso", "particles": 12},
        {"name": "cma-es", "population": 10},
        {"name": "hype", "population": 12},
    ]
    common = {"scenarios": [SHORT_WALK], "controller": "pi", "iterations": iterations}
    return [
        JobSpec.model_validate(
            common | {"name": f"faults-{seed}", "optimizer": method, "seed": seed}
        )
        for seed, method in enumerate(methods)
    ]


@dataclass
class Clients:
    """A client that keeps submitting jobs and follows them, in a thread of its own.

    Attributes:
        lost: Iterations that were reported as committed, and later were not.
        ended: State and error of jobs that have ended, by their ids.
        spec_of: Index of each job's spec, by its id.
    """

    url: str
    documents: list[dict[str, Any]]
    notify_url: str
    lost: int = 0
    ended: dict[str, tuple[str, str | None]] = field(default_factory=dict)
    spec_of: dict[str, int] = field(default_factory=dict)
    _seen: dict[str, int] = field(default_factory=dict)
    _enough: threading.Event = field(default_factory=threading.Event)

    def start(self) -> None:
        """Begin."""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def progress(self) -> int:
        """Iterations that were seen, of all jobs together."""
        return sum(self._seen.values())

    def finish(self, patience: float) -> list[str]:
        """Submit no more, and wait for the jobs under way.

        Args:
            patience: How long, without any progress [s].

        Returns:
            The jobs that have not ended.
        """
        self._enough.set()
        _wait(self._thread, self.progress, patience)
        return sorted(set(self.spec_of) - set(self.ended))

    def _run(self) -> None:
        numbers = itertools.count()
        with httpx2.Client(base_url=self.url, timeout=10.0) as client:
            while True:
                open_jobs = [job for job in self.spec_of if job not in self.ended]
                if self._enough.is_set() and not open_jobs:
                    return
                if len(open_jobs) < _OPEN_JOBS and not self._enough.is_set():
                    self._submit(client, next(numbers))
                for job in open_jobs:
                    with suppress(httpx2.HTTPError, ValueError, KeyError):
                        self._look(job, client.get(f"/v1/jobs/{job}").json())
                time.sleep(_GLANCE)

    def _submit(self, client: httpx2.Client, number: int) -> None:
        index = number % len(self.documents)
        # The same key until it is answered: a request whose answer was lost makes no second job.
        key = {"Idempotency-Key": f"campaign-{number}", "Notify-URL": self.notify_url}
        while not self._enough.is_set():
            with suppress(httpx2.HTTPError, ValueError, KeyError):
                answer = client.post("/v1/jobs", json=self.documents[index], headers=key)
                if answer.status_code in (200, 202):
                    self.spec_of[answer.json()["id"]] = index
                    return
            time.sleep(_GLANCE)

    def _look(self, job_id: str, job: dict[str, Any]) -> None:
        done = int(job["progress"]["iterations"] if "progress" in job else job["iterations"])
        before = self._seen.get(job_id, 0)
        self.lost += max(0, before - done)
        self._seen[job_id] = max(before, done)
        if job["state"] in ("succeeded", "failed", "cancelled", "paused"):
            self.ended[job_id] = (job["state"], job.get("error"))


def _wait(thread: threading.Thread, progress: Callable[[], int], patience: float) -> None:
    seen, since = progress(), time.monotonic()
    while thread.is_alive() and time.monotonic() - since < patience:
        thread.join(_GLANCE)
        if progress() != seen:
            seen, since = progress(), time.monotonic()


@dataclass
class Result:
    """What a campaign came to.

    Attributes:
        faults: Kind, duration and time until the next commit of each [s].
        jobs: How many were run to their end.
        iterations: How many these have.
        lost: Iterations that were reported as committed, and later were not.
        different: Jobs whose history is not that of the job alone.
        manual: What a person would have to do, a line each.
        seconds: Of the campaign.
        restarts: Of each service.
        loads: The machine's load average after each fault.
    """

    faults: list[tuple[str, float, float]] = field(default_factory=list)
    jobs: int = 0
    iterations: int = 0
    lost: int = 0
    different: list[str] = field(default_factory=list)
    manual: list[str] = field(default_factory=list)
    seconds: float = 0.0
    restarts: dict[str, int] = field(default_factory=dict)
    loads: list[float] = field(default_factory=list)


def run(
    deployment: Deployment,
    planned: Iterable[Planned],
    *,
    iterations: int = 60,
    patience: float = 180.0,
    enough: Callable[[], bool] = lambda: False,
    say: Say = lambda _: None,
) -> Result:
    """Run jobs, inject the faults one after the other, and compare the histories.

    After each fault it is waited until an iteration is committed, so that every fault hits a
    deployment at work.

    Args:
        deployment: As it was opened.
        planned: The faults.
        iterations: Of each job.
        patience: How long nothing may be committed after a fault, before that counts as a need for
            a person [s].
        enough: Asked before each fault whether no more are to be injected.
        say: Called with each fault.

    Returns:
        What came of it.
    """
    result, begun = Result(), time.monotonic()
    chosen = specs(iterations)
    documents = [spec.model_dump(mode="json") for spec in chosen]
    clients = Clients(deployment.api_url, documents, f"http://{deployment.receiver.host}/")
    clients.start()
    if not _commits(clients, 0, patience):
        result.manual.append("the deployment did not begin to work")
    for number, fault in enumerate(planned):
        if result.manual or enough():
            break
        time.sleep(fault.pause)
        while not all(service.alive for service in deployment.services):
            time.sleep(_GLANCE)
        _inject(deployment, fault, clients, result, patience)
        result.loads.append(os.getloadavg()[0])
        kind, lasted, recovery = result.faults[-1]
        say(f"{number + 1:4d} {kind:16} {lasted:5.1f} s, next commit after {recovery:5.1f} s")
    open_jobs = clients.finish(patience)
    result.manual += [f"job {job} stands still" for job in open_jobs]
    result.manual += [
        f"no notification of job {job} arrived" for job in _unnotified(deployment, clients)
    ]
    result.seconds = time.monotonic() - begun
    result.restarts = {service.name: service.restarts for service in deployment.services}
    _judge(deployment, clients, chosen, result)
    return result


def _inject(
    deployment: Deployment, planned: Planned, clients: Clients, result: Result, patience: float
) -> None:
    fault = KINDS[planned.kind](deployment, planned.draw)
    lasts = fault.shortest + planned.length * (fault.longest - fault.shortest)
    begun = time.monotonic()
    try:
        fault.inject()
        time.sleep(max(0.0, lasts - (time.monotonic() - begun)))
    finally:
        fault.heal()
    healed, before = time.monotonic(), clients.progress()
    if not _commits(clients, before, patience):
        result.manual.append(f"nothing was committed for {patience:g} s after {planned.kind}")
    result.faults.append((planned.kind, healed - begun, time.monotonic() - healed))


def _commits(clients: Clients, before: int, patience: float) -> bool:
    ends = time.monotonic() + patience
    while clients.progress() <= before:
        if time.monotonic() > ends:
            return False
        time.sleep(0.05)
    return True


def _unnotified(deployment: Deployment, clients: Clients) -> set[str]:
    """Jobs that have ended, of which the receiver took no notification in two minutes."""
    ends = time.monotonic() + 120.0
    while (missing := clients.ended.keys() - deployment.receiver.jobs) and time.monotonic() < ends:
        time.sleep(_GLANCE)
    return missing


def _judge(deployment: Deployment, clients: Clients, chosen: list[JobSpec], result: Result) -> None:
    alone = undisturbed(chosen)
    with closing(deployment.store()) as store:
        for job_id, (state, error) in clients.ended.items():
            if state != "succeeded":
                result.manual.append(f"job {job_id} is {state}: {error}")
                continue
            found = remembered(store, job_id)
            expected = alone[clients.spec_of[job_id]]
            result.jobs += 1
            result.iterations += len(found[0])
            clients.lost += max(0, len(expected[0]) - len(found[0]))
            if found != expected:
                result.different.append(job_id)
    result.lost = clients.lost


History = tuple[list[str | None], list[Bits]]
"""Of a job: the digest of every iteration, and every evaluation."""


def remembered(store: Store, job_id: str) -> History:
    """All that a database remembers of a job's search, to the bit."""
    digests: list[str | None] = []
    after: int | None = None
    while True:
        page = store.iterations(job_id, after=after)
        digests += [iteration.digest for iteration in page.items]
        if page.next is None:
            return digests, history(store, job_id)
        after = int(page.next)


def undisturbed(chosen: list[JobSpec]) -> list[History]:
    """The histories of jobs that run alone, one after the other, where nothing goes wrong."""
    found = []
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(open_store(str(Path(folder) / "alone.db"))) as store,
        closing(InProcessEvaluator(1)) as evaluator,
    ):
        for spec in chosen:
            job, _ = store.create_job(spec)
            ended = run_embedded(store, evaluator, job.id)
            assert ended.state == "succeeded", ended.error
            found.append(remembered(store, job.id))
    return found
