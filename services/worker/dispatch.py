"""Dispatch of requests to an engine: chunks submitted, answers collected, jobs sharing the slots"""

from __future__ import annotations

import math
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass, field, replace
from typing import Any, Final, Protocol, TypeVar

import numpy as np

from gaitswarm.services.optimizer.errors import KilledWorker, ProvenanceChanged
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    TaskReport,
)
from gaitswarm.services.worker.chunks import Chunk, Pace, cut
from gaitswarm.services.worker.tasks import Answer
from gaitswarm.sim import simulate
from gaitswarm.sim.case import Case, LongCase, WalkingCase
from gaitswarm.sim.outcome import Outcome

T = TypeVar("T")

MOST_KILLED: Final = 3
"""Workers that may die of one task."""

_LOOK_AHEAD: Final = 2
"""Submitted tasks per slot, so that a slot need not wait for its next one."""

_GLANCE: Final = 0.1
"""Poll interval of `should_stop` [s]."""

_PACES: Final = 64
"""Number of jobs whose pace is kept."""


class WorkerDied(Exception):
    """The process of a task ended with it, as often as it was tried."""


class TaskLost(Exception):
    """A task has no answer, through no fault of its own."""


class Engine(Protocol):
    """Runs tasks. Thread-safe."""

    @property
    def slots(self) -> int:
        """Number of tasks that run concurrently."""

    def submit(self, request: EvaluationRequest, chunk: Chunk, /) -> Any:
        """Submit a task and return a handle. It fails once `MOST_KILLED` processes died of it."""

    def wait(self, handles: Sequence[Any], seconds: float) -> Sequence[Any]:
        """Return the handles of finished tasks; wait for one up to a time [s]."""

    def answer(self, handle: Any) -> Answer:
        """Return a finished task's answer; raise WorkerDied, TaskLost, or its own error."""

    def abandon(self, handles: Sequence[Any]) -> None:
        """End tasks whose answers are not needed any more. Returns at once."""

    def check(self) -> None:
        """Raise EvaluatorUnavailable if tasks cannot be run."""


@dataclass(frozen=True, slots=True)
class Load:
    """Load of the workers: slots, slots in use, and tasks waiting for one."""

    slots: int = 0
    used: int = 0
    waiting: int = 0


@dataclass(frozen=True, slots=True)
class _Running:
    chunk: Chunk
    begun: float


@dataclass(slots=True, eq=False)
class _Iteration:
    """A request in progress."""

    request: EvaluationRequest
    pending: deque[Chunk]
    outcomes: tuple[Outcome, ...]
    running: dict[Any, _Running] = field(default_factory=dict)
    times: list[tuple[float, float, float]] = field(default_factory=list)

    @classmethod
    def of(cls, request: EvaluationRequest, chunks: Sequence[Chunk]) -> _Iteration:
        count = len(request.designs)
        empty = tuple(
            Outcome(np.empty((count, len(case.objectives))), np.empty(count, dtype=np.uint8))
            for case in request.cases
        )
        return cls(request, deque(chunks), empty)

    def put(self, chunk: Chunk, answer: Answer) -> None:
        """Copy an answer to its place."""
        if answer.outcomes is None:
            raise unlike(answer.host, answer.refusal)
        count = chunk.stop - chunk.start
        for case, outcome in zip(chunk.cases, answer.outcomes, strict=True):
            into = self.outcomes[case]
            if outcome.objectives.shape != (count, into.objectives.shape[1]):
                name = self.request.cases[case].name
                raise RuntimeError(
                    f"case {name!r} returned objectives of shape {outcome.objectives.shape} for"
                    f" {count} designs of {into.objectives.shape[1]} objectives"
                )
            into.objectives[chunk.start : chunk.stop] = outcome.objectives
            into.statuses[chunk.start : chunk.stop] = outcome.statuses
            if self.request.on_outcome is not None:
                self.request.on_outcome(case, chunk.start, outcome)

    def report(
        self, run: _Running, *, answer: Answer | None = None, error: str | None = None
    ) -> None:
        if self.request.on_task is None:
            return
        walks = len(run.chunk.cases) * (run.chunk.stop - run.chunk.start)
        report = TaskReport(walks, time.monotonic() - run.begun, error=error)
        if answer is not None:
            report = replace(
                report,
                compute_seconds=answer.seconds,
                kernel_time=answer.kernel_time,
                table_seconds=answer.table_seconds,
                host=answer.host,
            )
        self.request.on_task(report)


def unlike(host: str, refusal: str) -> ProvenanceChanged:
    """Return the error for a worker that computes something else."""
    return ProvenanceChanged(
        f"a worker on {host} does not compute what this job's results depend on: {refusal}. Its"
        " simulations were not used; install the same gaitswarm and a C compiler on all workers,"
        " and resume the job"
    )


def killed_workers(request: EvaluationRequest, chunk: Chunk) -> KilledWorker:
    """Return the error for a task of which workers die."""
    names = ", ".join(repr(request.cases[case].name) for case in chunk.cases)
    first, last = chunk.start, chunk.stop - 1
    designs = f"design {first}" if first == last else f"designs {first} to {last}"
    return KilledWorker(
        f"{MOST_KILLED} worker processes died, one after the other, of the same task: {designs}"
        f" of the iteration in {names}. If their simulation is"
        " not at fault, the workers may lack memory; resume the job to try again"
    )


class Dispatcher:
    """Requests in progress, from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._active: list[_Iteration] = []
        self._paces: OrderedDict[str, Pace] = OrderedDict()

    def evaluate(
        self, engine: Engine, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Run a request on an engine; see `Evaluator.evaluate`."""
        iteration = _Iteration.of(request, self._cut(request, engine.slots))
        with self._lock:
            self._active.append(iteration)
        try:
            while iteration.pending or iteration.running:
                if should_stop():
                    raise EvaluationStopped
                engine.check()
                self._submit(engine, iteration)
                for handle in engine.wait(list(iteration.running), _GLANCE):
                    self._settle(engine, iteration, handle)
        finally:
            with self._lock:
                self._active.remove(iteration)
            engine.abandon(list(iteration.running))
        with self._lock:
            pace = self._paces.pop(request.job_id, Pace())
            self._paces[request.job_id] = pace.after(iteration.times)
            while len(self._paces) > _PACES:
                self._paces.popitem(last=False)
        return iteration.outcomes

    def load(self, slots: int) -> Load:
        """Return the present load of an engine of some slots."""
        with self._lock:
            running = sum(len(each.running) for each in self._active)
            pending = sum(len(each.pending) for each in self._active)
        used = min(running, slots)
        return Load(slots, used, pending + running - used)

    def most_submitted(self, request: EvaluationRequest, slots: int) -> int:
        """Return how many tasks a job may have submitted: its share by weight of all slots."""
        with self._lock:
            total = sum(each.request.weight for each in self._active)
        share = request.weight / total if total else 1.0
        return max(1, math.ceil(_LOOK_AHEAD * slots * share - 1e-9))

    def _cut(self, request: EvaluationRequest, slots: int) -> tuple[Chunk, ...]:
        # The interpreter simulates designs one at a time, and a long case occupies a task.
        is_compiled = request.provenance.backend == "native"
        lanes = max(
            simulate.lanes(case.precision) if is_compiled and not isinstance(case, LongCase) else 1
            for case in request.cases
        )
        return cut(
            [case.duration for case in request.cases],
            len(request.designs),
            slots=max(slots, 1),
            lanes=lanes,
            pace=self._paces.get(request.job_id),
            together=all(isinstance(case, WalkingCase) for case in request.cases),
        )

    def _submit(self, engine: Engine, iteration: _Iteration) -> None:
        most = self.most_submitted(iteration.request, engine.slots)
        while iteration.pending and len(iteration.running) < most:
            chunk = iteration.pending.popleft()
            handle = engine.submit(iteration.request, chunk)
            iteration.running[handle] = _Running(chunk, time.monotonic())

    def _settle(self, engine: Engine, iteration: _Iteration, handle: Any) -> None:
        run = iteration.running.pop(handle)
        try:
            answer = engine.answer(handle)
        except TaskLost as error:
            iteration.report(run, error=f"lost: {error}")
            iteration.pending.appendleft(run.chunk)
            return
        except WorkerDied:
            iteration.report(run, error="its worker died")
            raise killed_workers(iteration.request, run.chunk) from None
        except Exception as error:
            iteration.report(run, error=f"{type(error).__name__}: {error}")
            raise
        iteration.report(run, answer=answer, error=answer.refusal or None)
        iteration.put(run.chunk, answer)
        overhead = time.monotonic() - run.begun - answer.seconds
        iteration.times.append((run.chunk.cost, answer.seconds, overhead))


def awaited(work: Future[T], should_stop: Callable[[], bool]) -> T:
    """Return the result of another thread's work, or raise EvaluationStopped."""
    while not wait([work], timeout=_GLANCE).done:
        if should_stop():
            raise EvaluationStopped
    return work.result()


def build_kernels(cases: Sequence[Case], should_stop: Callable[[], bool]) -> None:
    """Return when all robots' kernels are cached, for which workers would each wait."""
    work: Future[None] = Future()

    def build() -> None:
        try:
            for robot, precision in {(r, case.precision) for case in cases for r in case.robots}:
                simulate.prepare(robot, precision=precision)
        except BaseException as error:  # noqa: BLE001 - raised again in `awaited`
            work.set_exception(error)
        else:
            work.set_result(None)

    threading.Thread(target=build, name="kernel", daemon=True).start()
    awaited(work, should_stop)
