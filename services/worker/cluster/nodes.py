"""Where tasks are sent: the port, and this machine as the only node of an embedded cluster."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import RobotSource

LOOK_AHEAD: Final = 2
"""Tasks with Ray per slot: one that runs, and one that is at hand when it ends."""

PATIENCE_SECONDS: Final = 20.0
"""So long work waits for a node to come, before whoever wants it is told."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a node is prepared for: requests that want the same share it.

    Attributes:
        robots: Those of each case, whose kernels are needed in its precision.
        provenance: What the outcomes are to have, as JSON.
    """

    robots: frozenset[tuple[tuple[RobotSource, ...], Precision]]
    provenance: str

    @classmethod
    def by(cls, request: EvaluationRequest) -> Wanted:
        """What a request needs of a node.

        Args:
            request: The request.

        Returns:
            Equal values for requests that need the same.
        """
        robots = frozenset((case.robots, case.precision) for case in request.cases)
        return cls(robots, request.provenance.model_dump_json())


@dataclass(slots=True, eq=False)
class Node:
    """One node that is alive, as far as is known.

    Attributes:
        id: Ray's.
        name: For people.
        cpus: Its slots.
        place: Where its raylet listens.
        flying: Tasks that it was sent and that have not come back.
        accepted: Whether it has introduced itself, and computes what this process does.
        refused: Why it may not walk at all; "" if it may.
        prepared: What it is ready for.
        unfit: What it may not walk for: until when, and why.
        asked: Tasks to which it has not answered; to prepare it for what, or to introduce itself.
        told: What was logged of it.
    """

    id: str
    name: str
    cpus: int
    place: tuple[str, int]
    flying: int = 0
    accepted: bool = False
    refused: str = ""
    prepared: set[Wanted] = field(default_factory=set)
    unfit: dict[Wanted, tuple[float, str]] = field(default_factory=dict)
    asked: dict[Any, Wanted | None] = field(default_factory=dict)
    told: set[str] = field(default_factory=set)

    @property
    def room(self) -> float:
        """Further tasks per slot that it may be sent."""
        return LOOK_AHEAD - self.flying / self.cpus

    def can_serve(self, wanted: Wanted) -> bool:
        """Whether it is ready for some tasks, busy or not, or may be soon.

        Args:
            wanted: What they need.

        Returns:
            True if it was prepared, or was asked to be, or to introduce itself.
        """
        return wanted in self.prepared or not {wanted, None}.isdisjoint(self.asked.values())


def chosen(nodes: Iterable[Node], wanted: Wanted, avoid: frozenset[str]) -> Node | None:
    """The node that a task is sent to.

    Args:
        nodes: That there are.
        wanted: What it needs.
        avoid: Ids of nodes that get it only if no other can serve it. One that can, and is busy or
            being prepared, is waited for.

    Returns:
        Of those that are ready, the one with most room for its size; None if none has any.
    """
    serving = [node for node in nodes if node.can_serve(wanted)]
    others = [node for node in serving if node.id not in avoid] or serving
    free = [node for node in others if wanted in node.prepared and node.room > 0.0]
    return max(free, key=lambda node: node.room, default=None)


class Nodes(Protocol):
    """Where tasks are sent. All but `wanted` is called by one thread."""

    @property
    def slots(self) -> int:
        """Tasks that run at the same time."""

    @property
    def demand(self) -> float:
        """Sum of the weights of those who want walks of nodes that others use, too; 0 for none."""

    def wanted(self, request: EvaluationRequest, /) -> AbstractContextManager[Future[None]]:
        """Have nodes prepared as long as the block lasts. For any thread.

        Args:
            request: What is to be walked.

        Returns:
            Of a future that is done when a node is ready for it, and fails with
            EvaluatorUnavailable when none was for `PATIENCE_SECONDS`.
        """

    def tend(self) -> tuple[Node, ...]:
        """Look after the nodes; to be called several times a second.

        Returns:
            Nodes that were lost: what they were sent will not come back.
        """

    def place(self, wanted: Wanted, avoid: frozenset[str], /) -> Node | None:
        """The node that a task is sent to.

        Args:
            wanted: What it needs.
            avoid: As for `chosen`.

        Returns:
            The node that is `chosen`; None if one has to be waited for.
        """

    def can_serve(self, wanted: Wanted, /) -> bool:
        """Whether a node is ready for some tasks, busy or not, or is being prepared for them.

        Args:
            wanted: What they need.
        """

    def on(self, node: Node, function: Any, /) -> Any:
        """A remote function that runs on one node, or not at all.

        Args:
            node: The node.
            function: The remote function.
        """

    def suspect(self, node: Node, /) -> bool:
        """Whether a node is gone, of which a task has died.

        Args:
            node: The node.

        Returns:
            True if it does not listen; the next `tend` then returns it.
        """

    def refuse(self, node: Node, wanted: Wanted, reason: str, /) -> bool:
        """Send a node no more tasks that need the same.

        Args:
            node: The node, which could not run one.
            wanted: What that needed.
            reason: For people.

        Returns:
            Whether another node may run it.
        """

    def absence(self, wanted: Wanted, /) -> str:
        """Why no node walks.

        Args:
            wanted: What is to be walked.

        Returns:
            A sentence that names the nodes and what is wrong with each.
        """

    def close(self, reason: str, /) -> None:
        """Nobody waits any more.

        Args:
            reason: What those are told who wait for a node.
        """


class OwnNode:
    """`Nodes` of an embedded cluster: this machine, of whom nothing need be asked.

    Args:
        slots: Its CPUs.
    """

    def __init__(self, slots: int) -> None:
        self._node = Node("", "this machine", slots, ("", 0), accepted=True)

    @property
    def slots(self) -> int:
        """Its CPUs."""
        return self._node.cpus

    @property
    def demand(self) -> float:
        """None: nobody else uses it."""
        return 0.0

    @contextmanager
    def wanted(self, _request: EvaluationRequest) -> Iterator[Future[None]]:
        """It is ready."""
        ready = Future[None]()
        ready.set_result(None)
        yield ready

    def tend(self) -> tuple[Node, ...]:
        """It is not lost before its cluster is."""
        return ()

    def place(self, _wanted: Wanted, _avoid: frozenset[str]) -> Node | None:
        """This machine, if it has room."""
        return self._node if self._node.room > 0.0 else None

    def can_serve(self, _wanted: Wanted) -> bool:
        """It is ready for all."""
        return True

    def on(self, _node: Node, function: Any) -> Any:
        """There is no other node."""
        return function

    def suspect(self, _node: Node) -> bool:
        """A worker has died, not this machine."""
        return False

    def refuse(self, _node: Node, _wanted: Wanted, _reason: str) -> bool:
        """There is no other node."""
        return False

    def absence(self, _wanted: Wanted) -> str:
        """It is never away."""
        return ""

    def close(self, _reason: str) -> None:
        """Nobody waits."""
