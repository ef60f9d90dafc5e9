"""What several runners on one cluster owe each other: a share each, by the jobs that they run."""

from __future__ import annotations

import logging
import math
import time
import uuid
from typing import Any, Final

from gaitswarm.services.worker.ray_session import RaySession

REPORT_SECONDS: Final = 1.0
"""Between reports of a runner."""

_FORGOTTEN_SECONDS: Final = 10.0
"""A runner that has not reported for so long has no share."""

_NAMESPACE: Final = "gaitswarm"

_NAME: Final = "shares-1"
"""Of the actor; another number when what it is told changes."""

_log = logging.getLogger(__name__)


def ledger() -> type[Any]:
    """The class of the actor that all runners of a cluster report to.

    Returns:
        A class that is sent by value, so that runners of several versions can share one actor. It
        keeps nothing: after a restart it knows all runners when each has reported once.
    """

    class Ledger:
        """Weights that runners have reported of late."""

        def __init__(self, forgotten_seconds: float) -> None:
            self._forgotten_seconds = forgotten_seconds
            self._reports: dict[str, tuple[float, float]] = {}

        def report(self, runner: str, weight: float, now: float | None = None) -> float:
            """A runner wants so much; the sum of what all want."""
            import time as clock  # noqa: PLC0415 - what it needs travels with it

            now = clock.monotonic() if now is None else now
            self._reports[runner] = (weight, now)
            self._reports = {
                name: (wanted, at)
                for name, (wanted, at) in self._reports.items()
                if now - at < self._forgotten_seconds
            }
            return sum(wanted for wanted, _ in self._reports.values())

    return Ledger


def share(slots: int, own: float, total: float) -> int:
    """Slots that a runner fills.

    Args:
        slots: Of the cluster.
        own: What the runner wants, in any unit.
        total: What all want, its own included.

    Returns:
        In proportion, rounded up, so that none is left idle and nobody has none.
    """
    if own <= 0.0 or total <= own:
        return slots
    return max(1, min(slots, math.ceil(slots * own / total - 1e-9)))


class Shares:
    """This runner's share of a cluster.

    Each runner reports to one small actor the weights of the jobs that want walks of it, and hears
    what those of all runners come to. While the actor cannot be reached, shares stay as they are.

    Args:
        session: The connection.
    """

    def __init__(self, session: RaySession) -> None:
        self._session = session
        self._ray = session.ray
        self._options = {
            "name": _NAME,
            "namespace": _NAMESPACE,
            "lifetime": "detached",
            "get_if_exists": True,
            "num_cpus": 0,
            "max_restarts": -1,
            "scheduling_strategy": session.near_head(),
        }
        self._runner = uuid.uuid4().hex
        self._actor: Any = None
        self._asked: tuple[Any, float] | None = None
        self._own = self._total = 0.0
        self._next = 0.0

    def of(self, slots: int, demand: float) -> int:
        """Report, from time to time, and tell the share. Never waits for an answer.

        Args:
            slots: Of the cluster.
            demand: Sum of the weights of the jobs that want walks of this runner now.

        Returns:
            How many slots it fills.
        """
        try:
            self._hear()
            if self._asked is None and (time.monotonic() >= self._next or demand != self._own):
                self._report(demand)
        except self._ray.exceptions.RayError as error:
            _log.info("shares of the cluster stay as they are: %s", error)
            self._actor = self._asked = None
            self._next = time.monotonic() + REPORT_SECONDS
        return share(slots, self._own, self._total)

    def _report(self, demand: float) -> None:
        if self._actor is None:
            # Ray would wait for a head that is away, and end the process for that.
            if not self._session.head_answers():
                self._next = time.monotonic() + REPORT_SECONDS
                return
            remote = self._ray.remote(**self._options)(ledger())
            self._actor = remote.remote(_FORGOTTEN_SECONDS)
        self._asked = (self._actor.report.remote(self._runner, demand), demand)
        self._next = time.monotonic() + REPORT_SECONDS

    def _hear(self) -> None:
        if self._asked is None:
            return
        reference, reported = self._asked
        done, _ = self._ray.wait([reference], timeout=0.0)
        if done:
            self._asked = None
            self._total = float(self._ray.get(reference))
            self._own = reported
