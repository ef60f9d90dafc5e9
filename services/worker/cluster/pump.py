"""Keeps a cluster supplied with tasks: sent to nodes, collected, sent again, cancelled."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from typing import Any, Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.worker.cluster.nodes import (
    LOOK_AHEAD,
    PATIENCE_SECONDS,
    Node,
    Nodes,
    Wanted,
)
from gaitswarm.services.worker.cluster.shared_cases import CaseShelf, run_sent, sent
from gaitswarm.services.worker.cluster.shares import Shares
from gaitswarm.services.worker.dispatch import Dispatcher, Work
from gaitswarm.services.worker.ray_session import RaySession
from gaitswarm.services.worker.tasks import Answer, Failure, warm_up

_GLANCE: Final = 0.02
"""Seconds between looks for new work, while a slot is free."""

_GLANCE_AHEAD: Final = 0.1
"""The same while all slots are taken, and new work would only lie at hand."""

_IDLE: Final = 0.5
"""Seconds between looks at whether it is time to end."""

GRACE_SECONDS: Final = 1.0
"""That a task which nobody waits for any more has to end by itself, before it is cancelled.

Ray ends the process that cancels a task in the instant in which its answer comes. Tasks of a batch
that fails, fail together, so that those which remain must not be cancelled at once. Most end in
this time.
"""

PULSE_SECONDS: Final = 4.0
"""Seconds between looks at whether the cluster's head is alive; three misses count as lost."""


class Pump:
    """Keeps nodes supplied with tasks, and collects what comes back.

    Args:
        session: The connection.
        dispatcher: Whose tasks are sent.
        nodes: To which they are sent.
        warm: Set when every slot of an embedded cluster has a process that has imported what walks
            need.
    """

    def __init__(
        self, session: RaySession, dispatcher: Dispatcher, nodes: Nodes, warm: threading.Event
    ) -> None:
        self._ray = session.ray
        self._dispatcher = dispatcher
        self._nodes = nodes
        self._warm = warm
        # Ray's own retries would run a task again behind our accounts.
        options = {"num_cpus": 1, "max_retries": 0}
        self._walk = session.ray.remote(**options, name="run_in_worker")(run_sent)
        self._warm_up = session.ray.remote(**options)(warm_up)
        self._shelf = CaseShelf(session.ray)
        self._shares = None if session.directory is not None else Shares(session)
        self._held: deque[tuple[Work, Wanted]] = deque()
        self._flying: dict[Any, tuple[Work, Node]] = {}
        # When tasks that nobody waits for are cancelled; never again once they were.
        self._cancelled_at: dict[Any, float] = {}
        self._absent: dict[Wanted, float] = {}
        self._session = session
        self._misses = 0
        self._next_pulse = time.monotonic() + PULSE_SECONDS

    def run(self) -> None:
        """Until the dispatcher is closed. Raises whatever Ray raises when it is lost."""
        starting: list[Any] = []
        if self._shares is None:
            # Processes start and import while the caller still does other things.
            starting = [self._warm_up.remote() for _ in range(self._dispatcher.slots)]
        while not self._dispatcher.closed:
            self._send()
            # After that, nodes with room have it because there is no more work.
            self._tend()
            self._collect()
            self._cancel_dropped()
            self._feel_pulse()
            if not self._warm.is_set():
                self._note_warmth(starting)

    def _note_warmth(self, starting: list[Any]) -> None:
        done, _ = self._ray.wait(starting, num_returns=len(starting), timeout=0.0)
        if len(done) == len(starting):
            self._warm.set()

    def _tend(self) -> None:
        for lost in self._nodes.tend():
            gone = [ref for ref, (_, node) in self._flying.items() if node is lost]
            for reference in gone:
                work, _ = self._flying.pop(reference)
                self._cancelled_at.pop(reference, None)
                self._dispatcher.again(work, suspect=False)
        slots = self._nodes.slots
        if self._shares is not None:
            slots = self._shares.of(slots, self._nodes.demand)
        self._dispatcher.slots = max(slots, 1)

    @property
    def _room(self) -> int:
        """Further tasks that Ray is to be given."""
        most = self._dispatcher.slots * LOOK_AHEAD
        return most - len(self._flying) - len(self._held)

    def _send(self) -> None:
        patience = _GLANCE if self._nodes.demand else _IDLE
        while self._room > 0:
            work = self._dispatcher.take(0.0 if self._flying or self._held else patience)
            if work is None:
                break
            self._hold(work)
        if len(self._flying) + len(self._held) < self._dispatcher.slots:
            copy = self._dispatcher.copy()
            if copy is not None:
                self._hold(copy)
        for _ in range(len(self._held)):
            work, wanted = self._held.popleft()
            if work.batch.awaits(work.chunk) and not self._sent(work, wanted):
                self._held.append((work, wanted))
        if not self._held:
            self._absent.clear()

    def _hold(self, work: Work) -> None:
        self._held.append((work, Wanted.by(work.batch.request)))

    def _sent(self, work: Work, wanted: Wanted) -> bool:
        """Send a task to a node; false if none has room for it now."""
        request = work.batch.request
        # Others may be busy for hours, with walks that are whole searches.
        is_patient = time.monotonic() - work.taken < PATIENCE_SECONDS
        node = self._nodes.place(wanted, work.avoid if is_patient else frozenset())
        if node is None:
            self._note_absence(work, wanted)
            return False
        self._absent.pop(wanted, None)
        work.node = node.id
        chosen = [part.case for part in work.chunk.parts]
        task = sent(work.task, chosen, self._shelf.shared(request.cases))
        self._flying[self._nodes.on(node, self._walk).remote(task)] = (work, node)
        node.flying += 1
        return True

    def _note_absence(self, work: Work, wanted: Wanted) -> None:
        """Tell those who want walks, once there has been nobody for long who could walk them."""
        if self._nodes.can_serve(wanted):
            self._absent.pop(wanted, None)
            return
        since = self._absent.setdefault(wanted, time.monotonic())
        if time.monotonic() - since > PATIENCE_SECONDS:
            self._dispatcher.fail(work, EvaluatorUnavailable(self._nodes.absence(wanted)))

    def _collect(self) -> None:
        if not self._flying:
            if self._held:
                time.sleep(_GLANCE)
            return
        patience = _IDLE
        if self._held:
            patience = _GLANCE
        elif self._room > 0:
            all_run = len(self._flying) >= self._dispatcher.slots
            patience = _GLANCE_AHEAD if all_run else _GLANCE
        done, _ = self._ray.wait(list(self._flying), num_returns=1, timeout=patience)
        for reference in done:
            work, node = self._flying.pop(reference)
            node.flying -= 1
            self._cancelled_at.pop(reference, None)
            self._settle(reference, work, node)

    def _cancel_dropped(self) -> None:
        """What nobody waits for any more, or another worker was quicker with, takes no slot."""
        now = time.monotonic()
        for reference, (work, _) in self._flying.items():
            if work.batch.awaits(work.chunk):
                continue
            if now >= self._cancelled_at.setdefault(reference, now + GRACE_SECONDS):
                self._cancelled_at[reference] = math.inf
                self._ray.cancel(reference, force=False)

    def _feel_pulse(self) -> None:
        if time.monotonic() < self._next_pulse:
            return
        self._next_pulse = time.monotonic() + PULSE_SECONDS
        self._misses = 0 if self._session.head_answers() else self._misses + 1
        if self._misses >= 3:
            raise EvaluatorUnavailable("the head of the cluster does not answer")

    def _settle(self, reference: Any, work: Work, node: Node) -> None:
        exceptions = self._ray.exceptions
        try:
            result = self._ray.get(reference)
        except exceptions.TaskCancelledError:
            self._dispatcher.again(work, suspect=False)
        except exceptions.ObjectLostError:
            # The cases, or the answer, lay on a node that is gone.
            self._shelf.forget()
            self._dispatcher.again(work, suspect=False)
        except exceptions.RayTaskError as error:
            if not self._refused(work, node, f"it cannot run walks: {error.cause!r}"):
                self._dispatcher.fail(work, RuntimeError(f"a worker cannot run walks: {error}"))
        except (
            exceptions.NodeDiedError,
            exceptions.LocalRayletDiedError,
            exceptions.TaskUnschedulableError,
        ):
            self._nodes.suspect(node)
            self._dispatcher.again(work, suspect=False)
        except (exceptions.WorkerCrashedError, exceptions.OutOfMemoryError):
            # With its node, or of the walks.
            self._dispatcher.again(work, suspect=not self._nodes.suspect(node))
        else:
            self._take(result, work, node)

    def _take(self, result: Answer | Failure, work: Work, node: Node) -> None:
        if isinstance(result, Failure):
            is_its_own = isinstance(result.error, EvaluatorUnavailable)
            if not (is_its_own and self._refused(work, node, str(result.error))):
                self._dispatcher.fail(work, result.error)
            return
        expected = work.batch.request.provenance
        if result.provenance != expected:
            changes = "; ".join(expected.changes(result.provenance))
            if self._refused(work, node, changes):
                return
        self._dispatcher.complete(work, result)

    def _refused(self, work: Work, node: Node, reason: str) -> bool:
        """Have another node run it, if there may be one."""
        if not self._nodes.refuse(node, Wanted.by(work.batch.request), reason):
            return False
        self._dispatcher.again(work, suspect=False)
        return True
