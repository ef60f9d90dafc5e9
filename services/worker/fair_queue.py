"""Which task is next, when several jobs want the same workers. Pure: no threads, no clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(slots=True)
class _Flow(Generic[T]):
    served: float
    waiting: deque[tuple[float, T]] = field(default_factory=deque)


@dataclass(slots=True)
class FairQueue(Generic[T]):
    """Start-time fair queuing: flows share the workers equally by cost, whatever their length.

    A flow whose costs are divided by a weight gets that many times the share of one of weight 1.

    Each flow has a clock that advances by the cost of its tasks; the flow that is least advanced
    is next, the one that came first among equals. A flow that was idle starts at the present, so
    that waiting earns no credit. Within a flow, tasks leave in the order they came in.

    push(a, 9, x) push(a, 9, y) push(b, 3, u) push(b, 3, v)  ->  pops x, u, v, y
    """

    _flows: dict[Hashable, _Flow[T]] = field(default_factory=dict)
    _now: float = 0.0

    def __len__(self) -> int:
        return sum(len(flow.waiting) for flow in self._flows.values())

    def push(self, flow: Hashable, cost: float, task: T) -> None:
        """Add a task of a flow.

        Args:
            flow: Of all tasks that share one claim to the workers.
            cost: In any unit that all flows share, >= 0.
            task: What is popped in its turn.
        """
        found = self._flows.get(flow)
        if found is None:
            found = self._flows[flow] = _Flow(self._now)
        elif not found.waiting:
            found.served = max(found.served, self._now)
        found.waiting.append((cost, task))

    def pop(self) -> T | None:
        """Take out the next task, None if there is none."""
        waiting = [flow for flow in self._flows.values() if flow.waiting]
        if not waiting:
            return None
        least = min(waiting, key=lambda flow: flow.served)
        self._now = least.served
        cost, task = least.waiting.popleft()
        least.served += cost
        self._forget_idle()
        return task

    def discard(self, unwanted: Callable[[T], bool]) -> None:
        """Take out the tasks that are unwanted; their flows are not charged for them.

        Args:
            unwanted: Whether a task is.
        """
        for flow in self._flows.values():
            kept = [entry for entry in flow.waiting if not unwanted(entry[1])]
            flow.waiting = deque(kept)
        self._forget_idle()

    def _forget_idle(self) -> None:
        """An idle flow matters only as long as it is ahead of the present."""
        self._flows = {
            key: flow
            for key, flow in self._flows.items()
            if flow.waiting or flow.served > self._now
        }
