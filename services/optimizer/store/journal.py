"""The journal: outcomes of finished tasks of open asks"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from sqlalchemy import Connection, delete, insert, select

from gaitswarm.services.optimizer.jobs.iteration import JournalEntry
from gaitswarm.services.optimizer.store.tables import Row, journal
from gaitswarm.sim.outcome import Outcome

_FLOAT: Final = np.dtype("<f8")


def insert_entries(connection: Connection, job: Row, entries: Sequence[JournalEntry]) -> None:
    """Add outcomes of the open ask of a locked job."""
    rows = [
        {
            "job_id": job["id"],
            "iteration": job["iterations"],
            "case_index": entry.case,
            "keys": b"".join(entry.keys),
            "objectives": entry.outcome.objectives.astype(_FLOAT).tobytes(),
            "statuses": entry.outcome.statuses.astype(np.uint8).tobytes(),
        }
        for entry in entries
    ]
    connection.execute(insert(journal), rows)


def journal_of(connection: Connection, job: Row) -> tuple[JournalEntry, ...]:
    """Return the entries of a job's open ask, in the order of their writing."""
    of_ask = (journal.c.job_id == job["id"]) & (journal.c.iteration == job["iterations"])
    query = select(journal).where(of_ask).order_by(journal.c.id)
    return tuple(_entry(row) for row in connection.execute(query).mappings())


def clear_journal(connection: Connection, job: Row) -> None:
    """Remove all entries of a job."""
    connection.execute(delete(journal).where(journal.c.job_id == job["id"]))


def _entry(row: Row) -> JournalEntry:
    statuses = np.frombuffer(row["statuses"], dtype=np.uint8)
    objectives = np.frombuffer(row["objectives"], dtype=_FLOAT).reshape(len(statuses), -1)
    size = len(row["keys"]) // len(statuses)
    keys = tuple(row["keys"][k * size : (k + 1) * size] for k in range(len(statuses)))
    return JournalEntry(row["case_index"], keys, Outcome(objectives, statuses))
