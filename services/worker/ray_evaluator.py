"""Walks as tasks of Ray, on this machine or on a cluster."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.worker.cluster.nodes import Nodes, OwnNode
from gaitswarm.services.worker.cluster.pump import Pump
from gaitswarm.services.worker.cluster.ray_nodes import ClusterNodes
from gaitswarm.services.worker.dispatch import Dispatcher
from gaitswarm.services.worker.preparation import KernelBuilder, awaited
from gaitswarm.services.worker.ray_session import open_ray
from gaitswarm.services.worker.tasks import Load, TaskTotals
from gaitswarm.sim import simulate
from gaitswarm.sim.outcome import Outcome

_PATIENCE: Final = 10.0
"""Seconds to wait for a connection that is to be closed, and may be busy being opened."""

_PATIENCE_EMBEDDED: Final = 30.0
"""The same for a cluster of our own, which opens sooner or later, however busy the machine is."""

_RECONNECT_SECONDS: Final = 5.0
"""Between attempts to connect to a cluster that is away, while no job wants walks of it."""

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
        self._closing = threading.Event()
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
        """Whether Ray was lost, or could not be opened; says why."""
        link = self._link
        if not link.lost:
            return None
        error = link.opened.exception()
        if error is not None:
            return f"it is tried again and again: {error}"
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

    def stay_connected(self, should_stop: Callable[[], bool]) -> None:
        """Return when Ray is open, or known to be away; then it is tried again until it is there.

        Args:
            should_stop: As for `wait_until_open`.

        Raises:
            EvaluationStopped: As `wait_until_open`.
        """
        try:
            awaited(self._link.opened, should_stop)
        except EvaluationStopped:
            threading.Thread(target=self.close, name="ray-closing", daemon=True).start()
            raise
        except EvaluatorUnavailable as error:
            _log.warning("jobs wait until there are workers: %s", error)
        threading.Thread(target=self._connect_again, name="ray-reconnect", daemon=True).start()

    def _connect_again(self) -> None:
        """Until this is closed, whether a job wants walks or not."""
        was_away = self.lost
        while not self._closing.wait(_RECONNECT_SECONDS):
            if self.lost:
                was_away = True
                with suppress(EvaluatorUnavailable):
                    self._living_link()
            elif was_away and self._link.opened.done():
                was_away = False
                _log.info("Ray is open, with %d slots", self.slots)

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
        link = self._living_link()
        dispatcher = awaited(link.opened, should_stop)
        with link.nodes.result().wanted(request) as ready:
            awaited(ready, should_stop)
            return dispatcher.evaluate(request, should_stop)

    def close(self) -> None:
        """Disconnect; an embedded cluster ends."""
        with self._changing:
            self._closed = True
        self._closing.set()
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

    opened: what takes the requests, or what kept it from being opened. nodes: to which these go,
    known when it is open. warm: set when every slot's
    process has imported what walks need.
    """

    def __init__(
        self, address: str | None, cpus: int | None, *, after: _Link | None = None
    ) -> None:
        self.opened: Future[Dispatcher] = Future()
        self.nodes: Future[Nodes] = Future()
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
        is_embedded = session.directory is not None
        nodes: Nodes = OwnNode(session.slots) if is_embedded else ClusterNodes(session)
        dispatcher = Dispatcher(session.slots, simulate.lanes)
        self.nodes.set_result(nodes)
        self.opened.set_result(dispatcher)
        self._end()
        try:
            Pump(session, dispatcher, nodes, self.warm).run()
        except Exception as error:  # noqa: BLE001 - whatever Ray raises when it is going down
            _log.info("Ray was lost: %s", error)
            dispatcher.close(f"Ray was lost: {error}")
        finally:
            nodes.close("the connection to Ray was closed")
            session.close()
