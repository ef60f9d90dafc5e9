"""Cases as they travel: put into the object store once, read once by each process."""

from __future__ import annotations

import os
import re
import sys
import uuid
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any, Final

from gaitswarm.services.worker.cluster.interrupts import interrupted_outside_imports
from gaitswarm.services.worker.tasks import Answer, Failure, Task, run_in_worker
from gaitswarm.sim.case import Case

_KEPT: Final = 32
"""Lists of cases, of as many jobs: those that were used last."""

_MISSING_IN_MODULE: Final = re.compile(r"module '[\w.]+' has no attribute")

_received: Final[OrderedDict[str, tuple[Case, ...]]] = OrderedDict()
"""In a worker, by key."""


def _shorten(kept: OrderedDict[Any, Any]) -> None:
    while len(kept) > _KEPT:
        kept.popitem(last=False)


@dataclass(frozen=True, slots=True)
class SharedCases:
    """A job's cases, in the object store.

    Attributes:
        key: A name that no others have.
        place: The object reference, in a tuple: Ray would fetch and read a bare one for every task.
    """

    key: str
    place: tuple[Any]

    def receive(self) -> tuple[Case, ...]:
        """The cases; read from the store at the first call in a process."""
        known = _received.pop(self.key, None)
        if known is None:
            import ray  # noqa: PLC0415 - only ever called in a process of Ray's

            known = ray.get(self.place[0])
        _received[self.key] = known
        _shorten(_received)
        return known


@dataclass(frozen=True, slots=True)
class SentTask:
    """A task whose cases lie in the object store.

    Attributes:
        task: Without its cases.
        shared: All cases of the job.
        chosen: Those of the task, by their indices.
    """

    task: Task
    shared: SharedCases
    chosen: tuple[int, ...]


class CaseShelf:
    """What of a driver's cases lies in the object store.

    A job's cases are equal in every iteration, so that they are put there once.

    Args:
        ray: The module, connected.
    """

    def __init__(self, ray: ModuleType) -> None:
        self._ray = ray
        # By identity, and kept, so that no other list takes an id.
        self._known: OrderedDict[int, tuple[tuple[Case, ...], SharedCases]] = OrderedDict()

    def shared(self, cases: tuple[Case, ...]) -> SharedCases:
        """Put cases into the store, unless equal ones are there.

        Args:
            cases: All of a request.

        Returns:
            Where they are.
        """
        known = self._known.pop(id(cases), None) or (cases, self._equal(cases) or self._put(cases))
        self._known[id(cases)] = known
        # Tasks under way have references of their own.
        _shorten(self._known)
        return known[1]

    def forget(self) -> None:
        """What lies in the store may be lost: put everything there anew."""
        self._known.clear()

    def _equal(self, cases: tuple[Case, ...]) -> SharedCases | None:
        for known, shared in reversed(self._known.values()):
            # Of arrays it is not clear what equal means.
            with suppress(ValueError):
                if known == cases:
                    return shared
        return None

    def _put(self, cases: tuple[Case, ...]) -> SharedCases:
        return SharedCases(uuid.uuid4().hex, (self._ray.put(cases),))


def sent(task: Task, chosen: Sequence[int], shared: SharedCases) -> SentTask:
    """A task as it is sent.

    Args:
        task: The task.
        chosen: Its cases, by their indices in the request.
        shared: All cases of the request.

    Returns:
        The same task, without what its worker may have already.
    """
    return SentTask(replace(task, cases=()), shared, tuple(chosen))


def run_sent(sent_task: SentTask) -> Answer | Failure:
    """Run a task as it was sent. What Ray raises of the store is not caught: it is no result.

    Args:
        sent_task: What is to be run.

    Returns:
        As of `run_in_worker`; nothing where the process has to end, as one does in which a module
        is half imported all the same. Ray then reports that the worker has died.
    """
    with interrupted_outside_imports():
        cases = sent_task.shared.receive()
        chosen = tuple(cases[index] for index in sent_task.chosen)
        answer = run_in_worker(replace(sent_task.task, cases=chosen))
    if isinstance(answer, Failure) and is_half_imported(answer.error):
        note = f"gaitswarm: this worker ends, since a module is half imported: {answer.error}\n"
        sys.stderr.write(note)
        sys.stderr.flush()
        os._exit(1)
    return answer


def is_half_imported(error: Exception) -> bool:
    """Whether an error is what code says of a module whose import was interrupted.

    Args:
        error: What a task has raised.

    Returns:
        Whether a name that the module ought to have is missing in it.
    """
    said = str(error)
    return isinstance(error, AttributeError | ImportError) and (
        "partially initialized module" in said or _MISSING_IN_MODULE.match(said) is not None
    )
