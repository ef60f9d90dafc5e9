"""Jobs as they are shown: their documents, which never change, are read once and not every time."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from typing import Any, Final

from sqlalchemy import Text, cast

from services.optimizer.jobs.job import Job
from services.optimizer.store.rows.evaluation_rows import Row
from services.optimizer.store.rows.job_rows import JobDocuments, read_documents, to_job
from services.optimizer.store.rows.tables import UnparsedText, jobs

_DOCUMENTS: Final = ("spec", "provenance", "lineage")

SHOWN: Final = (
    *(column for column in jobs.c if column.name not in _DOCUMENTS),
    # As text: both databases keep the JSON as it was written.
    *(cast(jobs.c[name], Text).label(f"{name}_text") for name in _DOCUMENTS),
)
"""Columns of a job that is shown and not changed."""

_LARGEST: Final = 8 << 20
"""Characters of all documents that are remembered; what they are read to takes some times that."""

Texts = tuple[str | None, ...]
"""Of a job's spec, provenance and lineage."""


class DocumentMemory:
    """Documents by their texts; of too many, those that were asked for longest ago go. Thread-safe.

    A text that another program puts in a row's place is another key: nothing has to be told.

    Args:
        largest: Characters of all texts together.
    """

    def __init__(self, largest: int) -> None:
        self._largest = largest
        self._size = 0
        self._known: OrderedDict[Texts, JobDocuments] = OrderedDict()
        self._lock = threading.Lock()

    def find(self, texts: Texts) -> JobDocuments | None:
        """Look for what documents say.

        Args:
            texts: Of a job's documents.

        Returns:
            What they say; None if it is not remembered.
        """
        with self._lock:
            found = self._known.get(texts)
            if found is not None:
                self._known.move_to_end(texts)
            return found

    def add(self, texts: Texts, documents: JobDocuments) -> None:
        """Remember what documents say.

        Args:
            texts: Of a job's documents.
            documents: What they say.
        """
        with self._lock:
            if texts not in self._known:
                self._known[texts] = documents
                self._size += _length(texts)
            while self._size > self._largest:
                oldest, _ = self._known.popitem(last=False)
                self._size -= _length(oldest)


def _length(texts: Texts) -> int:
    return sum(len(text) for text in texts if text is not None)


_memory: Final = DocumentMemory(_LARGEST)


def shown_job(row: Row) -> Job:
    """A job from its row, as `to_job` has it.

    Args:
        row: The columns `SHOWN`.

    Returns:
        The job; one of the same documents may share its spec.
    """
    texts = tuple(row[f"{name}_text"] for name in _DOCUMENTS)
    documents = _memory.find(texts)
    if documents is None:
        documents = read_documents(dict(zip(_DOCUMENTS, map(_parsed, texts), strict=True)))
        # What cannot be read may be so for a reason that passes.
        if documents.readable:
            _memory.add(texts, documents)
    return to_job(row, documents)


def _parsed(text: str | None) -> Any:
    """As the column's type `Document` does it."""
    try:
        return None if text is None else json.loads(text)
    except (ValueError, RecursionError):
        return UnparsedText(text)
