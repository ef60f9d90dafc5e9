"""What jobs are found and sorted by, of all jobs at once; what has not changed is not read anew."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from functools import cached_property, lru_cache
from typing import Any, Final, TypeVar
from weakref import WeakKeyDictionary

from sqlalchemy import Connection, Dialect, Engine, Select, and_, bindparam, func, select, text

from gaitswarm.services.optimizer.store.rows.job_rows import reference_of
from gaitswarm.services.optimizer.store.rows.job_views import (
    LARGEST,
    RowMemory,
    as_stored,
    from_stored,
)
from gaitswarm.services.optimizer.store.rows.tables import jobs
from gaitswarm.services.optimizer.store.statements.job_list import Among
from gaitswarm.services.optimizer.store.statements.labels import spec_field

T = TypeVar("T")


@dataclass(frozen=True)
class JobEntry:
    """What a job is found and sorted by.

    Attributes:
        id: Of the job.
        created_at: When it was submitted.
        best_fitness: Of its best design.
        evaluations: Committed.
        state: As it is stored.
        labels: The document.
        iterations: Committed.
        priority: The higher, the sooner it is claimed.
        compute_seconds: Of the committed iterations [s].
        reference: The document.
        lineage: The document.
        spec_name: In its spec.
    """

    id: str
    created_at: datetime
    best_fitness: float | None = None
    evaluations: int = 0
    state: str = ""
    labels: Any = None
    iterations: int = 0
    priority: int = 0
    compute_seconds: float = 0.0
    reference: Any = None
    lineage: Any = None
    spec_name: str = ""

    @cached_property
    def name(self) -> str:
        """As it is shown, its user's or else its spec's, in one case."""
        return self._shown_name.casefold()

    @cached_property
    def words(self) -> str:
        """All that a search looks through, in one case."""
        note, tags = self._label("note") or "", self._label("tags") or ()
        return "\n".join((self._shown_name, self.id, note, *tags)).casefold()

    @property
    def gain(self) -> float | None:
        """Over its reference [1]."""
        known = reference_of(self.reference)
        return None if known is None else known.gain(self.best_fitness)

    @property
    def rate(self) -> float | None:
        """Evaluations of its own a second [1/s]."""
        own = self.evaluations - _taken_over(self.lineage)
        return own / self.compute_seconds if own > 0 and self.compute_seconds > 0.0 else None

    @property
    def _shown_name(self) -> str:
        return str(self._label("name") or self.spec_name)

    def _label(self, name: str) -> Any:
        return self.labels.get(name) if isinstance(self.labels, dict) else None


_COLUMNS: Final = tuple(
    jobs.c[column.name] for column in fields(JobEntry) if column.name != "spec_name"
)

_ENTRIES: Final = select(*map(as_stored, _COLUMNS))

_ENTRY_OF: Final = _ENTRIES.where(jobs.c.id == bindparam("job"))

_UNENDED: Final = "age(CAST(CAST(CAST(:unended AS text) AS xid8) AS xid))"

_SINCE: Final = text(f"(age(jobs.xmin) <= {_UNENDED} OR {_UNENDED} < 0)")
"""Whether a row is of no transaction before this one; of a server that was set back, any row."""

_known: Final = WeakKeyDictionary[Engine, RowMemory["JobEntry"]]()
"""By their rows, without the names in their specs."""

_names: Final = WeakKeyDictionary[Engine, RowMemory[str]]()
"""Of jobs in their specs, which never change in a database; by the id alone."""

_AT_ONCE: Final = 500
"""Jobs whose names are read by one statement."""

_QUESTIONS: Final = 8
"""Conditions on jobs for which the entries are remembered."""

_PATIENCE: Final = 1.0
"""Seconds that are waited for entries that another thread reads."""

_KEPT: Final = 64
"""Statements: to put one together takes as long as to find some changed jobs."""


@dataclass(frozen=True)
class JobEntries:
    """Of all jobs that were asked for.

    Attributes:
        by_id: The entries, in no order.
    """

    by_id: Mapping[str, JobEntry]
    _made: dict[Hashable, Any] = field(default_factory=dict, compare=False, repr=False)

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What follows from these entries alone, made once for all who ask. Thread-safe.

        Args:
            key: Tells what it is.
            make: Makes it; two that ask at the same time may both do so.

        Returns:
            What was made first.
        """
        found: T | None = self._made.get(key)
        return self._made.setdefault(key, make()) if found is None else found


@dataclass(frozen=True)
class _Answer:
    """Entries of this version of the database, or of a later one."""

    version: Hashable
    entries: JobEntries


class _Memory:
    """Entries by question. Whoever asks first reads for all."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.answers: dict[Hashable, _Answer] = {}


_memories: Final = WeakKeyDictionary[Engine, _Memory]()


def job_entries(
    connection: Connection, among: Among, kind: str | None, version: Hashable | None
) -> JobEntries:
    """Read what jobs are found and sorted by.

    It is remembered while nothing is committed: to the file on SQLite, to the server on PostgreSQL.
    Of a server only the jobs that have changed are read after that.

    Args:
        connection: An open transaction that has only read, and on SQLite nothing yet.
        among: Only jobs for which these hold.
        kind: Only jobs whose specs say that they are of this kind; None for any.
        version: Of the database, from before the transaction; None if nothing tells it, and then
            a PostgreSQL server is asked.

    Returns:
        The entries: the same object as before, if nothing was committed since.
    """
    where = among
    if kind is not None:
        where = (*among, spec_field(connection, "kind") == kind)
    if version is None:
        version = _seen(connection)
    if version is None:
        return _read_all(connection, where)
    memory = _memory(connection.engine)
    # Whoever reads may wait for a server that is out of reach; that is not passed on.
    if not memory.lock.acquire(timeout=_PATIENCE):
        return _read_all(connection, where)
    try:
        key = among, kind
        known = memory.answers.get(key)
        if known is None or known.version != version:
            known = _Answer(version, _read_anew(connection, where, known))
            if key not in memory.answers and len(memory.answers) >= _QUESTIONS:
                memory.answers.clear()
            memory.answers[key] = known
        return known.entries
    finally:
        memory.lock.release()


def _memory(engine: Engine) -> _Memory:
    return _memories.setdefault(engine, _Memory())


def _seen(connection: Connection) -> Hashable | None:
    """What is another after any commit to a server."""
    if connection.dialect.name != "postgresql":
        return None
    # The transactions that are seen; those that only read are none of them.
    return str(connection.exec_driver_sql("SELECT pg_current_snapshot()::text").scalar_one())


def _read_anew(connection: Connection, where: Among, known: _Answer | None) -> JobEntries:
    """Entries; of a server that has told of the others, only those of changed jobs are read.

    A row that was not seen then is of a transaction that had not ended, or of a later one. If there
    are as many jobs now as are known with these, none of the others is gone.
    """
    if known is not None and connection.dialect.name == "postgresql":
        unended = str(known.version).partition(":")[0]
        count = select(func.count().label("jobs")).select_from(jobs).where(*where).subquery()
        changed = and_(_SINCE.bindparams(unended=unended), *where)
        # The number comes with each row, and alone if nothing has changed.
        query = select(count.c.jobs, *_ENTRIES.selected_columns)
        query = query.select_from(count.outerjoin(jobs, changed))
        rows = connection.execute(query).all()
        read = entries_of(connection, [tuple(row[1:]) for row in rows if row[1] is not None])
        if not read and len(known.entries.by_id) == rows[0][0]:
            return known.entries
        entries = {**known.entries.by_id, **{entry.id: entry for entry in read}}
        if len(entries) == rows[0][0]:
            return JobEntries(entries)
    return _read_all(connection, where)


def job_entry(connection: Connection, job_id: str) -> JobEntry | None:
    """Read what a job is found and sorted by.

    Args:
        connection: An open transaction.
        job_id: Of the job.

    Returns:
        The entry; None if there is no such job.
    """
    rows = connection.execute(_ENTRY_OF, {"job": job_id}).all()
    found = entries_of(connection, list(map(tuple, rows)))
    return found[0] if found else None


def _read_all(connection: Connection, where: Among) -> JobEntries:
    """Entries of all jobs for which these conditions hold."""
    # All at once: the next row of many is asked for in a way that takes as long as to find it.
    rows = connection.execute(_entries_among(where)).all()
    return JobEntries({entry.id: entry for entry in entries_of(connection, list(map(tuple, rows)))})


@lru_cache(maxsize=_KEPT)
def _entries_among(where: Among) -> Select[Any]:
    return _ENTRIES.where(*where)


def entries_of(connection: Connection, rows: Sequence[tuple[Any, ...]]) -> list[JobEntry]:
    """Tell what rows say that hold what an entry is made of; what has not changed is known.

    Args:
        connection: An open transaction.
        rows: As they are stored, in the order of the columns of an entry.

    Returns:
        The entries, in the order of the rows.
    """
    memory = _known.setdefault(connection.engine, RowMemory(LARGEST))
    found = memory.find_all(rows)
    new = [row[0] for row, entry in zip(rows, found, strict=True) if entry is None]
    names = _spec_names(connection, new)
    return [
        memory.add(row, _read(row, names.get(row[0], ""), connection.dialect))
        if entry is None
        else entry
        for row, entry in zip(rows, found, strict=True)
    ]


def _read(row: tuple[Any, ...], name: str, dialect: Dialect) -> JobEntry:
    values = {
        column.name: from_stored(column, value, dialect)
        for column, value in zip(_COLUMNS, row, strict=True)
    }
    return JobEntry(**values, spec_name=name)


def _spec_names(connection: Connection, ids: Sequence[str]) -> dict[str, str]:
    """Names of jobs in their specs, by id; those that are known are not read anew."""
    memory = _names.setdefault(connection.engine, RowMemory(LARGEST))
    found: dict[str, str] = {}
    unknown: list[str] = []
    for job_id, name in zip(ids, memory.find_all([(job_id,) for job_id in ids]), strict=True):
        if name is None:
            unknown.append(job_id)
        else:
            found[job_id] = name
    if not unknown:
        return found
    names = select(jobs.c.id, spec_field(connection, "name"))
    for begin in range(0, len(unknown), _AT_ONCE):
        some = names.where(jobs.c.id.in_(unknown[begin : begin + _AT_ONCE]))
        for job_id, name in connection.execute(some):
            found[job_id] = memory.add((job_id,), name)
    return found


def _taken_over(lineage: Any) -> int:
    """Evaluations that a fork has of its parent."""
    try:
        return 0 if lineage is None else int(lineage["evaluations"])
    except (ValueError, TypeError, LookupError):
        return 0
