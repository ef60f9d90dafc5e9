"""Dispatch of requests: iterations cut into tasks, jobs that share the slots, and threads"""

from __future__ import annotations

import itertools
import math
import os
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, TypeVar

import numpy as np

from gaitswarm.services.optimizer import errors
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    TaskReport,
)
from gaitswarm.services.worker.tasks import Answer, run_task
from gaitswarm.sim import simulate
from gaitswarm.sim.case import Case, LongCase, WalkingCase
from gaitswarm.sim.outcome import Outcome

_TASKS_PER_SLOT: Final = 3
"""Chunks of single cases per slot, so that all slots finish at about the same time."""

_LONGEST_SECONDS: Final = 1.0
"""Of a task on few slots; other jobs and a stop wait for so long."""

_SECONDS_PER_SLOT: Final = 0.003
"""Length of tasks on many slots, per slot: the evaluator spends about 1 ms on each of its tasks
(docs/scale.md), and is to be idle for most of the time."""

_OVERHEAD_SHARE: Final = 0.05
"""Largest share of a task's time that sending it may take."""

_UNMEASURED: Final = (10.0, 256.0)
"""Smallest and largest cost of a job's first tasks [simulated s]."""

_WEIGHT: Final = 0.5
"""Of the last iteration in a pace, against all earlier ones."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """What one task simulates: designs `start` <= index < `stop` in some cases."""

    cases: tuple[int, ...]
    start: int
    stop: int
    cost: float  # simulated time that the kernel's lanes step through [s]


@dataclass(frozen=True, slots=True)
class Pace:
    """Speed of a job's tasks."""

    seconds: float | None = None  # per simulated second of cost [s]; None before any is measured
    overhead: float = 0.0  # time to send a task and its answer [s]

    def after(self, times: Sequence[tuple[float, float, float]]) -> Pace:
        """Return the pace after tasks of cost [simulated s], computing time and overhead [s]."""
        cost = sum(cost for cost, _, _ in times)
        if cost <= 0.0:
            return self
        seconds = sum(seconds for _, seconds, _ in times) / cost
        # Other tasks may have waited for a free worker.
        overhead = max(0.0, min(overhead for _, _, overhead in times))
        if self.seconds is None:
            return Pace(seconds, overhead)
        return Pace(
            (1.0 - _WEIGHT) * self.seconds + _WEIGHT * seconds,
            (1.0 - _WEIGHT) * self.overhead + _WEIGHT * overhead,
        )

    def bounds(self, slots: int) -> tuple[float, float]:
        """Return the smallest and largest cost of a task [simulated s]."""
        if not self.seconds:
            return _UNMEASURED
        longest = max(_LONGEST_SECONDS, _SECONDS_PER_SLOT * slots) / self.seconds
        return min(self.overhead / _OVERHEAD_SHARE / self.seconds, longest), longest


def cut(
    durations: Sequence[float],
    designs: int,
    *,
    slots: int,
    lanes: int,
    pace: Pace | None = None,
    together: bool = True,
) -> tuple[Chunk, ...]:
    """Cut an iteration into chunks, longest first, of one case that fill the kernel's lanes.

    With fewer slots than cases a chunk has some designs in all cases, which the kernel packs into
    its lanes without gaps. durations: of each case [s].
    """
    bounds = (pace or Pace()).bounds(slots)
    if together and slots < len(durations):
        # With one simulation per lane, the kernel cannot refill its lanes; with two, few are idle.
        filled = lanes * max(durations)
        longest = max(bounds[1], filled, min(2.0 * filled, _UNMEASURED[1]))
        return _by_designs(durations, designs, slots, longest)
    return _by_case(durations, designs, slots, lanes, bounds)


def _by_designs(
    durations: Sequence[float], designs: int, slots: int, longest: float
) -> tuple[Chunk, ...]:
    cases, duration = tuple(range(len(durations))), sum(durations)
    pieces = slots * math.ceil(designs * duration / (slots * longest))
    chunks = (Chunk(cases, a, b, (b - a) * duration) for a, b in _edges(designs, pieces))
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.start)))


def _by_case(
    durations: Sequence[float], designs: int, slots: int, lanes: int, bounds: tuple[float, float]
) -> tuple[Chunk, ...]:
    blocks = math.ceil(designs / lanes)
    shortest, longest = bounds
    even = sum(durations) * blocks * lanes / (_TASKS_PER_SLOT * slots)
    target = min(max(even, shortest), longest)
    chunks = [
        Chunk((case,), a * lanes, min(b * lanes, designs), (b - a) * lanes * duration)
        for case, duration in enumerate(durations)
        for a, b in _edges(blocks, math.ceil(blocks / max(1, round(target / (duration * lanes)))))
    ]
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.cases, chunk.start)))


def _edges(count: int, pieces: int) -> list[tuple[int, int]]:
    """Divide `count` into at most `pieces` equal ranges."""
    edges = [count * piece // pieces for piece in range(pieces + 1)]
    return [(a, b) for a, b in itertools.pairwise(edges) if b > a]


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
        seconds = time.monotonic() - run.begun
        answer = answer or Answer(None, self.request.provenance, host="")
        times = (answer.kernel_time, answer.table_seconds)
        report = TaskReport(walks, seconds, answer.seconds, answer.host, error, *times)
        self.request.on_task(report)


def unlike(host: str, refusal: str) -> errors.ProvenanceChanged:
    """Return the error for a worker that computes something else."""
    return errors.ProvenanceChanged(
        f"a worker on {host} does not compute what this job's results depend on: {refusal}. Its"
        " simulations were not used; install the same gaitswarm and a C compiler on all workers,"
        " and resume the job"
    )


def killed_workers(request: EvaluationRequest, chunk: Chunk) -> errors.KilledWorker:
    """Return the error for a task of which workers die."""
    names = ", ".join(repr(request.cases[case].name) for case in chunk.cases)
    first, last = chunk.start, chunk.stop - 1
    designs = f"design {first}" if first == last else f"designs {first} to {last}"
    return errors.KilledWorker(
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


def in_daemon(name: str, call: Callable[..., T], *args: Any, **kwargs: Any) -> Future[T]:
    """Call in a thread of its own, for which the end of the process does not wait."""
    future = Future[T]()
    future.set_running_or_notify_cancel()

    def run() -> None:
        try:
            future.set_result(call(*args, **kwargs))
        except BaseException as error:  # noqa: BLE001 - raised where the result is awaited
            future.set_exception(error)

    threading.Thread(target=run, name=name, daemon=True).start()
    return future


def awaited(work: Future[T], should_stop: Callable[[], bool]) -> T:
    """Return the result of another thread's work, or raise EvaluationStopped."""
    while not wait([work], timeout=_GLANCE).done:
        if should_stop():
            raise EvaluationStopped
    return work.result()


def build_kernels(cases: Sequence[Case], should_stop: Callable[[], bool]) -> None:
    """Return when all robots' kernels are cached, for which workers would each wait."""

    def build() -> None:
        for robot, precision in {(r, case.precision) for case in cases for r in case.robots}:
            simulate.prepare(robot, precision=precision)

    awaited(in_daemon("kernel", build), should_stop)


_Task = tuple[Future[Answer], threading.Event]
"""A task, and whether its answer is not needed any more."""


def available_cpus() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcessEvaluator:
    """`Evaluator` on threads, by default on all processors, and the `Engine` of its tasks."""

    def __init__(self, cpus: int | None = None) -> None:
        self.slots = cpus if cpus is not None else available_cpus()
        if self.slots < 1:
            raise ValueError(f"cpus must be at least 1, it is {self.slots}")
        self._dispatcher = Dispatcher()
        self._pool = ThreadPoolExecutor(self.slots, thread_name_prefix="walks")
        self._closed = threading.Event()

    @property
    def place(self) -> str:
        return f"threads: {self.slots}"

    @property
    def loads(self) -> dict[str, Load]:
        return {"threads": self._dispatcher.load(self.slots)}

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Simulate in the threads, once the robots' kernels are built."""
        build_kernels(request.cases, should_stop)
        return self._dispatcher.evaluate(self, request, should_stop)

    def close(self) -> None:
        """End the threads after their present chunks. Idempotent."""
        self._closed.set()
        self._pool.shutdown()

    def submit(self, request: EvaluationRequest, chunk: Chunk, /) -> _Task:
        abandoned = threading.Event()

        def in_vain() -> bool:
            return abandoned.is_set() or self._closed.is_set()

        def run() -> Answer:
            self.check()
            cases = [request.cases[case] for case in chunk.cases]
            designs = request.designs[chunk.start : chunk.stop]
            return run_task(cases, designs, request.provenance, in_vain)

        try:
            return self._pool.submit(run), abandoned
        except RuntimeError:
            # Closed meanwhile.
            self.check()
            raise

    def wait(self, handles: Sequence[_Task], seconds: float) -> Sequence[_Task]:
        futures = [future for future, _ in handles]
        done = wait(futures, timeout=seconds, return_when=FIRST_COMPLETED).done
        return [handle for handle in handles if handle[0] in done]

    def answer(self, handle: _Task) -> Answer:
        return handle[0].result()

    def abandon(self, handles: Sequence[_Task]) -> None:
        """Drop tasks that have not begun, and let the others end soon."""
        for future, abandoned in handles:
            abandoned.set()
            future.cancel()

    def check(self) -> None:
        """Raise EvaluatorUnavailable once closed."""
        if self._closed.is_set():
            raise errors.EvaluatorUnavailable("the evaluator was closed")
