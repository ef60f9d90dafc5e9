"""Nodes of a Ray cluster that others run: introduced, prepared, lost, and back."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.cluster.demand import Demand
from gaitswarm.services.worker.cluster.handshake import Introduction, introducer
from gaitswarm.services.worker.cluster.nodes import PATIENCE_SECONDS, Node, Wanted, chosen
from gaitswarm.services.worker.ray_session import RaySession, listens
from gaitswarm.sim import simulate
from gaitswarm.sim.provenance import Provenance, provenance_of

LOOK_SECONDS: Final = 1.0
"""Between looks at which nodes there are."""

_PROBE_SECONDS: Final = 0.5
"""So long a node may take to accept a connection."""

_PROBES: Final = 16
"""Nodes that are probed at once."""

_FIRST_LOOK_SECONDS: Final = 0.1
"""Until the next look while a new node is probed."""

_KEPT: Final = 64
"""What a node is known to be prepared for, beyond what is wanted."""

_FORGIVEN_SECONDS: Final = 60.0
"""After so long a node that could not be prepared for a job is asked again."""

_log = logging.getLogger(__name__)


def prepare_node(wanted: Wanted) -> str:
    """The body of a task that builds kernels, once a node: its other processes find them.

    Args:
        wanted: What is to be prepared for.

    Returns:
        "" when all is ready; else why this node may not walk for it.
    """
    expected = Provenance.model_validate_json(wanted.provenance)
    try:
        for robots, precision in wanted.robots:
            libraries = tuple(expected.libraries)
            here = provenance_of(*robots, precision=precision, libraries=libraries)
            if here != expected:
                return "; ".join(expected.changes(here))
            for robot in robots:
                simulate.prepare(robot, precision=precision)
    except Exception as error:  # noqa: BLE001 - told where nodes are chosen
        return f"{type(error).__name__}: {error}"
    return ""


def _place(entry: Mapping[str, Any]) -> tuple[str, int]:
    return str(entry["NodeManagerAddress"]), int(entry["NodeManagerPort"])


class ClusterNodes:
    """`Nodes` of a cluster that others run, as they come and go.

    A node introduces itself when it comes, and is refused if its numbers would not be ours. For
    what is wanted, each node builds its kernels once, in a task that takes no slot; then it is
    given walks.

    Args:
        session: The connection.
    """

    def __init__(self, session: RaySession) -> None:
        self._session = session
        self._ray = session.ray
        self._here = Introduction.of(introducer()())
        self._introduce = session.ray.remote(num_cpus=0, max_retries=0)(introducer())
        self._prepare = session.ray.remote(num_cpus=0, max_retries=0)(prepare_node)
        self._demand = Demand(session.ray)
        self._needs: dict[Wanted, Any] = {}
        self._nodes: dict[str, Node] = {}
        self._probes = ThreadPoolExecutor(_PROBES, thread_name_prefix="ray-probe")
        self._listening: dict[str, Future[bool]] = {}
        self._next_look = 0.0
        self._changing = threading.Lock()
        self._closed: str | None = None
        self._count: Counter[Wanted] = Counter()
        self._weights: dict[Future[None], float] = {}
        self._waiting: dict[Future[None], tuple[Wanted, float]] = {}

    @property
    def slots(self) -> int:
        """CPUs of the nodes that were accepted."""
        return sum(node.cpus for node in self._nodes.values() if node.accepted)

    @property
    def demand(self) -> float:
        """Sum of the weights of those who want walks at present."""
        with self._changing:
            return sum(self._weights.values())

    @contextmanager
    def wanted(self, request: EvaluationRequest) -> Iterator[Future[None]]:
        """Nodes are prepared, those that are here and those that come."""
        wanted, ready = Wanted.by(request), Future[None]()
        with self._changing:
            self._count[wanted] += 1
            self._weights[ready] = request.weight
            self._waiting[ready] = (wanted, time.monotonic() + PATIENCE_SECONDS)
            if self._closed is not None:
                ready.set_exception(EvaluatorUnavailable(self._closed))
                del self._waiting[ready]
        try:
            yield ready
        finally:
            with self._changing:
                self._waiting.pop(ready, None)
                self._weights.pop(ready, None)
                self._count -= Counter([wanted])

    def close(self, reason: str) -> None:
        """Those who wait are told."""
        with self._changing:
            self._closed = reason
            self._probes.shutdown(wait=False)
            waiting, self._waiting = self._waiting, {}
        for ready in waiting:
            ready.set_exception(EvaluatorUnavailable(reason))

    def tend(self) -> tuple[Node, ...]:
        """Look which nodes there are; ask new ones; note what was answered."""
        lost = self._look() if time.monotonic() >= self._next_look else ()
        self._collect()
        with self._changing:
            wanted = tuple(self._count)
        self._needs = {need: ref for need, ref in self._needs.items() if need in wanted}
        for node in self._nodes.values():
            self._ask(node, wanted)
        self._let_go()
        all_run = not any(node.room > 0.0 for node in self._nodes.values())
        self._demand.show(max(self.slots, 1) if wanted and all_run else 0)
        return lost

    def suspect(self, node: Node) -> bool:
        """Whether its raylet listens no more."""
        if listens(*node.place, timeout=_PROBE_SECONDS):
            return False
        known: Future[bool] = Future()
        known.set_result(False)
        self._listening[node.id] = known
        self._next_look = 0.0
        return True

    def place(self, wanted: Wanted, avoid: frozenset[str]) -> Node | None:
        """Of those that are prepared."""
        return chosen(self._nodes.values(), wanted, avoid)

    def can_serve(self, wanted: Wanted) -> bool:
        """Whether one of them can."""
        return any(node.can_serve(wanted) for node in self._nodes.values())

    def refuse(self, node: Node, wanted: Wanted, reason: str) -> bool:
        """It is asked again after a minute, by when its disk may be cleared."""
        node.prepared.discard(wanted)
        node.unfit[wanted] = (time.monotonic() + _FORGIVEN_SECONDS, reason)
        self._tell(node, reason)
        return True

    def absence(self, wanted: Wanted) -> str:
        """Names the first nodes, with what is wrong."""
        nodes = [node for node in self._nodes.values() if node.refused or wanted in node.unfit]
        if not nodes:
            return "no node of the Ray cluster has a CPU for walks now; they go on when one comes"
        reasons = "; ".join(
            f"{node.name}: {node.refused or node.unfit[wanted][1]}" for node in nodes[:4]
        )
        more = f"; and {len(nodes) - 4} more" if len(nodes) > 4 else ""
        return f"no node of the Ray cluster may walk for this job. {reasons}{more}"

    def _look(self) -> tuple[Node, ...]:
        self._next_look = time.monotonic() + LOOK_SECONDS
        if not self._session.head_answers():
            return ()
        try:
            found = {str(entry["NodeID"]): entry for entry in self._session.nodes()}
        except EvaluatorUnavailable:
            return ()
        listening = {node_id: self._probe(node_id, _place(found[node_id])) for node_id in found}
        lost = []
        for node_id, node in tuple(self._nodes.items()):
            # Ray takes a quarter of a minute to notice that a machine is gone.
            if node_id not in found or listening[node_id] is False:
                lost.append(self._nodes.pop(node_id))
                _log.warning("Ray node %s was lost", node.name)
        for node_id, entry in found.items():
            cpus = int(entry["Resources"].get("CPU", 0))
            if not cpus or node_id in self._nodes:
                continue
            if listening[node_id]:
                name = f"{entry['NodeManagerHostname']} ({node_id[:8]})"
                self._nodes[node_id] = Node(node_id, name, cpus, _place(entry))
            elif listening[node_id] is None:
                self._next_look = time.monotonic() + _FIRST_LOOK_SECONDS
        self._listening = {n: probe for n, probe in self._listening.items() if n in found}
        return tuple(lost)

    def _probe(self, node_id: str, place: tuple[str, int]) -> bool | None:
        """Whether a node listened when it was last tried; None if that is not known yet."""
        last = self._listening.get(node_id)
        if last is not None and not last.done():
            return None
        self._listening[node_id] = self._probes.submit(listens, *place, timeout=_PROBE_SECONDS)
        return None if last is None else last.result()

    def _ask(self, node: Node, wanted: Iterable[Wanted]) -> None:
        """For its introduction; or to be prepared for what it is not."""
        if node.refused:
            return
        if not node.accepted:
            if not node.asked:
                node.asked[self.on(node, self._introduce).remote()] = None
            return
        if len(node.prepared) > _KEPT:
            node.prepared.intersection_update(wanted)
        now = time.monotonic()
        node.unfit = {need: told for need, told in node.unfit.items() if told[0] > now}
        for need in wanted:
            if need not in {*node.prepared, *node.unfit, *node.asked.values()}:
                if need not in self._needs:
                    self._needs[need] = self._ray.put(need)
                node.asked[self.on(node, self._prepare).remote(self._needs[need])] = need

    def on(self, node: Node, function: Any) -> Any:
        """By affinity."""
        return function.options(scheduling_strategy=self._session.only_on(node.id))

    def _collect(self) -> None:
        asked = {ref: node for node in self._nodes.values() for ref in node.asked}
        if not asked:
            return
        done, _ = self._ray.wait(list(asked), num_returns=len(asked), timeout=0.0)
        for ref in done:
            node = asked[ref]
            need = node.asked.pop(ref)
            try:
                said = self._ray.get(ref)
            except self._ray.exceptions.RayTaskError as error:
                self._note(node, need, f"it cannot run gaitswarm: {error.cause!r}")
            except self._ray.exceptions.RayError as error:
                # Its process was killed, or the node: it is asked again, or soon gone.
                _log.info("Ray node %s did not answer: %s", node.name, error)
            else:
                self._note(node, need, said)

    def _note(self, node: Node, need: Wanted | None, said: Any) -> None:
        """What a node has answered, to what it was asked for."""
        if need is not None:
            if said:
                self.refuse(node, need, str(said))
            else:
                node.prepared.add(need)
            return
        refusal = said if isinstance(said, str) else Introduction.of(said).refusal(self._here)
        if refusal is None:
            node.accepted = True
        else:
            node.refused = refusal
            self._tell(node, refusal)

    def _tell(self, node: Node, reason: str) -> None:
        if reason not in node.told:
            node.told.add(reason)
            _log.warning("Ray node %s is not given walks: %s", node.name, reason)

    def _let_go(self) -> None:
        """Those who wait for a node, when there is one, or there has been none for long."""
        now = time.monotonic()
        with self._changing:
            waiting = tuple(self._waiting.items())
        for ready, (wanted, until) in waiting:
            error: EvaluatorUnavailable | None = None
            if not any(wanted in node.prepared for node in self._nodes.values()):
                if now < until or self.can_serve(wanted):
                    continue
                error = EvaluatorUnavailable(self.absence(wanted))
            with self._changing:
                if self._waiting.pop(ready, None) is None:
                    continue
            if error is None:
                ready.set_result(None)
            else:
                ready.set_exception(error)
