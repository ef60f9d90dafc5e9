"""Walks as tasks of Ray, on this machine or on a cluster."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final

from services.optimizer.errors import EvaluatorUnavailable
from services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from services.worker.dispatch import Dispatcher, Load, Work
from services.worker.preparation import KernelBuilder, awaited
from services.worker.ray_session import RaySession, open_ray
from services.worker.tasks import Failure, TaskTotals, run_in_worker, warm_up
from sim import simulate
from sim.outcome import Outcome

_LOOK_AHEAD: Final = 2
"""Tasks with Ray per slot: one that runs, and one that is at hand when it ends."""

_GLANCE: Final = 0.02
"""Seconds between looks for new work, while a slot is free."""

_GLANCE_AHEAD: Final = 0.1
"""The same while all slots are taken, and new work would only lie at hand."""

_IDLE: Final = 0.5
"""Seconds between looks at whether it is time to end."""

PULSE_SECONDS: Final = 4.0
"""Seconds between looks at whether the cluster's head is alive; three misses count as lost."""

_PATIENCE: Final = 10.0
"""Seconds to wait for a connection that is to be closed, and may be busy being opened."""

_PATIENCE_EMBEDDED: Final = 30.0
"""The same for a cluster of our own, which opens sooner or later, however busy the machine is."""

_log = logging.getLogger(__name__)


class RayEvaluator:
    """`Evaluator` on Ray.

    Ray is opened in a thread from construction on. A cluster that was lost is opened again by the
    next `evaluate`, so that a caller who tries again later, as the runner does, outlives it.

    Args:
        address: As for `open_ray`.
        cpus: As for `open_ray`.
    """

    def __init__(self, address: str | None = None, *, cpus: int | None = None) -> None:
        self._address = address
        self._cpus = cpus
        self._changing = threading.Lock()
        self._closed = False
        self._kernels = KernelBuilder()
        self._link = _Link(address, cpus)

    @property
    def slots(self) -> int:
        """CPUs of the cluster; waits until it is open."""
        return self._link.opened.result().slots

    @property
    def totals(self) -> TaskTotals:
        """Of all tasks since the cluster was opened; waits until it is."""
        return self._link.opened.result().totals

    @property
    def loads(self) -> dict[str, Load]:
        """What the cluster has to do; no slots while it is not open."""
        opened = self._link.opened
        is_open = opened.done() and opened.exception() is None
        return {"ray": opened.result().load if is_open else Load()}

    @property
    def lost(self) -> bool:
        """Whether the connection was lost, or could not be opened."""
        return self._link.lost

    def trouble(self) -> str | None:
        """Whether Ray was lost, or could not be opened."""
        if not self.lost:
            return None
        return "Ray is out of reach; it is connected again for the next iteration"

    def wait_until_open(self, should_stop: Callable[[], bool]) -> None:
        """Return when Ray is open; if it cannot be, or need not be any more, this is closed.

        Args:
            should_stop: Polled several times a second.

        Raises:
            EvaluatorUnavailable: Ray cannot be opened; says what to do.
            EvaluationStopped: `should_stop` said so. What was begun ends by itself, at the latest
                with the process.
        """
        try:
            awaited(self._link.opened, should_stop)
        except EvaluationStopped:
            # Ray cannot be interrupted while it connects, and whoever stops it need not wait.
            threading.Thread(target=self.close, name="ray-closing", daemon=True).start()
            raise
        except BaseException:
            self.close()
            raise

    def is_warm(self) -> bool:
        """Whether Ray is open, and every slot had a process that has imported what walks need.

        A connection that was lost begins to be opened again.

        Raises:
            EvaluatorUnavailable: Ray cannot be opened; says what to do.
        """
        link = self._link
        if not link.opened.done():
            return False
        if link.opened.result().closed:
            self._living_link()
            return False
        return link.warm.is_set()

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Have the walks run by Ray's workers, on a new connection if the last was lost."""
        # Built here, the kernel lies in the cache when this machine's workers look for it.
        self._kernels.build(request.cases, should_stop)
        dispatcher = awaited(self._living_link().opened, should_stop)
        return dispatcher.evaluate(request, should_stop)

    def close(self) -> None:
        """Disconnect; an embedded cluster ends."""
        with self._changing:
            self._closed = True
        self._link.close()

    def _living_link(self) -> _Link:
        """A connection that is open, or about to be."""
        with self._changing:
            if self._closed:
                raise EvaluatorUnavailable("the evaluator was closed")
            if self._link.lost:
                self._link = _Link(self._address, self._cpus, after=self._link)
            return self._link


class _Link:
    """One connection to Ray, from opening to loss or closing.

    An embedded cluster dies with the thread that started it, so one thread does it all. A process
    has one connection at a time: a second is opened when the one before has been closed.

    opened: what takes the requests, or what kept it from being opened. warm: set when every slot's
    process has imported what walks need.
    """

    def __init__(
        self, address: str | None, cpus: int | None, *, after: _Link | None = None
    ) -> None:
        self.opened: Future[Dispatcher] = Future()
        self.warm = threading.Event()
        self._patience = _PATIENCE if address else _PATIENCE_EMBEDDED
        self._closing = threading.Event()
        self._thread = threading.Thread(
            target=self._live, args=(address, cpus, after), name="ray-link", daemon=True
        )
        self._thread.start()

    @property
    def lost(self) -> bool:
        """Whether it was lost or closed, or could not be opened. False while it is opened."""
        if not self.opened.done():
            return False
        return self.opened.exception() is not None or self.opened.result().closed

    def close(self) -> None:
        """Disconnect, and wait until that is done, within reason. Idempotent."""
        self._closing.set()
        self._end()
        self._thread.join(self._patience)
        if self._thread.is_alive():
            _log.warning("Ray did not let go within %.0f s", self._patience)

    def _end(self) -> None:
        """Let the pump end, if it is to and has begun."""
        is_open = self.opened.done() and self.opened.exception() is None
        if is_open and self._closing.is_set():
            self.opened.result().close("the evaluator was closed")

    def _live(self, address: str | None, cpus: int | None, after: _Link | None) -> None:
        try:
            if after is not None:
                after.close()
            session = open_ray(address, cpus=cpus)
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            self.opened.set_exception(error)
            return
        dispatcher = Dispatcher(session.slots, simulate.lanes)
        self.opened.set_result(dispatcher)
        self._end()
        try:
            _Pump(session, dispatcher, self.warm).run()
        except Exception as error:  # noqa: BLE001 - whatever Ray raises when it is going down
            _log.info("Ray was lost: %s", error)
            dispatcher.close(f"Ray was lost: {error}")
        finally:
            session.close()


class _Pump:
    """Keeps Ray supplied with tasks, and collects what comes back."""

    def __init__(self, session: RaySession, dispatcher: Dispatcher, warm: threading.Event) -> None:
        self._ray = session.ray
        self._dispatcher = dispatcher
        self._warm = warm
        # Ray's own retries would run a task again behind our accounts.
        options = {"num_cpus": 1, "max_retries": 0}
        self._walk = session.ray.remote(**options)(run_in_worker)
        self._warm_up = session.ray.remote(**options)(warm_up)
        self._most = session.slots * _LOOK_AHEAD
        self._flying: dict[Any, Work] = {}
        self._cancelled: set[Any] = set()
        self._session = session
        self._misses = 0
        self._next_pulse = time.monotonic() + PULSE_SECONDS

    def run(self) -> None:
        """Until the dispatcher is closed. Raises whatever Ray raises when it is lost."""
        # Processes start and import while the caller still does other things.
        starting = [self._warm_up.remote() for _ in range(self._dispatcher.slots)]
        while not self._dispatcher.closed:
            self._send()
            self._collect()
            self._cancel_dropped()
            self._feel_pulse()
            if not self._warm.is_set():
                self._note_warmth(starting)

    def _note_warmth(self, starting: list[Any]) -> None:
        done, _ = self._ray.wait(starting, num_returns=len(starting), timeout=0.0)
        if len(done) == len(starting):
            self._warm.set()

    def _send(self) -> None:
        while len(self._flying) < self._most:
            work = self._dispatcher.take(timeout=0.0 if self._flying else _IDLE)
            if work is None:
                break
            self._flying[self._walk.remote(work.task)] = work
        if len(self._flying) < self._dispatcher.slots:
            copy = self._dispatcher.copy()
            if copy is not None:
                self._flying[self._walk.remote(copy.task)] = copy

    def _collect(self) -> None:
        if not self._flying:
            return
        patience = _IDLE
        if len(self._flying) < self._most:
            all_run = len(self._flying) >= self._dispatcher.slots
            patience = _GLANCE_AHEAD if all_run else _GLANCE
        done, _ = self._ray.wait(list(self._flying), num_returns=1, timeout=patience)
        for reference in done:
            self._cancelled.discard(reference)
            self._settle(reference, self._flying.pop(reference))

    def _cancel_dropped(self) -> None:
        """What nobody waits for any more, or another worker was quicker with, takes no slot."""
        for reference, work in self._flying.items():
            if not work.batch.awaits(work.chunk) and reference not in self._cancelled:
                self._cancelled.add(reference)
                self._ray.cancel(reference, force=False)

    def _feel_pulse(self) -> None:
        if time.monotonic() < self._next_pulse:
            return
        self._next_pulse = time.monotonic() + PULSE_SECONDS
        self._misses = 0 if self._session.head_answers() else self._misses + 1
        if self._misses >= 3:
            raise EvaluatorUnavailable("the head of the cluster does not answer")
        if not self._misses:
            # Nodes come and go.
            self._dispatcher.slots = self._session.count_slots()
            self._most = self._dispatcher.slots * _LOOK_AHEAD

    def _settle(self, reference: Any, work: Work) -> None:
        exceptions = self._ray.exceptions
        try:
            result = self._ray.get(reference)
        except exceptions.TaskCancelledError:
            self._dispatcher.again(work, suspect=False)
        except exceptions.RayTaskError as error:
            self._dispatcher.fail(work, RuntimeError(f"a worker cannot run walks: {error}"))
        except (exceptions.WorkerCrashedError, exceptions.OutOfMemoryError):
            self._dispatcher.again(work)
        except (exceptions.NodeDiedError, exceptions.LocalRayletDiedError):
            self._dispatcher.again(work, suspect=False)
        else:
            if isinstance(result, Failure):
                self._dispatcher.fail(work, result.error)
            else:
                self._dispatcher.complete(work, result)
