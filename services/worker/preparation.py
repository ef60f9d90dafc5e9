"""What takes seconds before anything can walk, done in threads that nobody has to wait for."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, wait
from typing import Final, TypeVar

from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped
from gaitswarm.sim import simulate
from gaitswarm.sim.case import Case
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import RobotSource

T = TypeVar("T")

_GLANCE: Final = 0.1
"""Seconds between looks at `should_stop`."""


def awaited(work: Future[T], should_stop: Callable[[], bool]) -> T:
    """Wait for work that another thread does; it goes on there if it is not waited for.

    Args:
        work: What is waited for.
        should_stop: Polled until the work is done.

    Returns:
        The work's result; its error is raised.

    Raises:
        EvaluationStopped: `should_stop` said so.
    """
    while not wait([work], timeout=_GLANCE).done:
        if should_stop():
            raise EvaluationStopped
    return work.result()


class KernelBuilder:
    """Builds robots' kernels, each in a thread of its own, for all who need it at the same time.

    Workers that met a robot without a kernel would all wait for it, and so would every other job.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._under_way: dict[tuple[RobotSource, Precision], Future[None]] = {}

    def build(self, cases: Iterable[Case], should_stop: Callable[[], bool]) -> None:
        """Return when all kernels are in the cache.

        Args:
            cases: Those that are going to be run.
            should_stop: Polled several times a second; what is being built is built to its end
                even so, and found by whoever needs it next.

        Raises:
            EvaluationStopped: `should_stop` said so.
            KernelBuildError: The compiler refuses a kernel.
        """
        wanted = {(robot, case.precision) for case in cases for robot in case.robots}
        for work in [self._building(robot, precision) for robot, precision in wanted]:
            awaited(work, should_stop)

    def _building(self, robot: RobotSource, precision: Precision) -> Future[None]:
        with self._lock:
            work = self._under_way.get((robot, precision))
            if work is None:
                work = Future()
                threading.Thread(
                    target=self._build, args=(robot, precision, work), name="kernel", daemon=True
                ).start()
                # After a start that may be refused; the thread waits for the lock before it ends.
                self._under_way[robot, precision] = work
            return work

    def _build(self, robot: RobotSource, precision: Precision, work: Future[None]) -> None:
        failure: BaseException | None = None
        try:
            simulate.prepare(robot, precision=precision)
        except BaseException as error:  # noqa: BLE001 - raised again where it is waited for
            failure = error
        with self._lock:
            del self._under_way[robot, precision]
        if failure is None:
            work.set_result(None)
        else:
            work.set_exception(failure)
