"""Digest chain of a job's history

digest of      is the SHA-256 of
a job          ["gaitswarm job", 1, spec, lineage]
an ask         ["gaitswarm ask", 1, positions, the optimizer's state]
an iteration   ["gaitswarm iteration", 1, previous digest, index, positions, designs, objectives,
               statuses, fitness, digest of the ask, provenance in force, reevaluation]

The digest of the job precedes the first iteration. Contents are encoded as CBOR (RFC 8949) with the
choices listed in docs/reference/evidence-file.md, so that equal contents are equal bytes wherever
they were stored. A digest of another version than 1 is to begin with that version and a colon.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import cbor2
import numpy as np
from cbor2 import CBOREncoder, CBORTag
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns, Reevaluation
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.outcome import Status

VERSION: Final = 1
"""Of the encoding; part of every digest."""

_DIMENSIONS, _UINT8, _FLOAT64 = 40, 64, 86
"""Array tags of RFC 8746."""


class ChainDocuments(NamedTuple):
    """Documents other than iterations that a job's chain depends on, as stored in JSON."""

    spec: Any  # as submitted
    lineage: Any = None  # of a fork; None for other jobs
    # records, each with its `from_iteration`; None if there are none
    provenance: Sequence[Mapping[str, Any]] | None = None

    @property
    def digest(self) -> str:
        """Digest of the job, before its first iteration."""
        return _digest(["gaitswarm job", VERSION, self.spec, self.lineage])

    def provenance_of(self, iteration: int) -> Any:
        """Return the provenance in force at an iteration."""
        records = [r for r in self.provenance or () if r["from_iteration"] <= iteration]
        return records[-1] if records else None


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """What is stored of an iteration besides its evaluations."""

    iteration: int  # index, from 0
    positions: Floats  # (n, d) asked for by the search
    ask_digest: str | None  # of the positions and the optimizer's state; None if unknown
    digest: str | None = None  # of the iteration; None before it is committed
    committed: bool = True
    state: Any = None  # the optimizer's, empty once cleared
    summary: Mapping[str, Any] = field(default_factory=dict)  # by name of `SUMMARY`


def iteration_digest(
    before: str,
    documents: ChainDocuments,
    link: Link,
    columns: EvaluationColumns,
    reevaluation: Reevaluation | None,
) -> str:
    content = [
        "gaitswarm iteration",
        VERSION,
        before,
        link.iteration,
        link.positions,
        columns.designs,
        columns.objectives,
        _Statuses(columns.statuses),
        columns.fitness,
        link.ask_digest,
        documents.provenance_of(link.iteration),
        reevaluation
        and [
            reevaluation.particle,
            reevaluation.objectives,
            _Statuses(reevaluation.statuses),
            np.array([reevaluation.fitness]),
        ],
    ]
    return _digest(content)


def ask_digest(positions: Floats, state: Mapping[str, Any]) -> str:
    """Compute the digest of an ask; it outlives the state, which is cleared later."""
    return _digest(["gaitswarm ask", VERSION, positions, state])


@dataclass(frozen=True, slots=True, eq=False)
class _Statuses:
    """(...,) values of `Status`; hashed by label."""

    values: NDArray[np.uint8]


def _digest(value: Any) -> str:
    return hashlib.sha256(encoded(value)).hexdigest()


def encoded(value: Any) -> bytes:
    """Encode as CBOR; equal values are equal bytes."""
    return cbor2.dumps(value, encoders=_ENCODERS)


def _encode_map(encoder: CBOREncoder, value: dict[str, Any]) -> None:
    """Sorted by the encoded keys."""
    encoder.encode_map(dict(sorted(value.items(), key=lambda item: cbor2.dumps(item[0]))))


def _encode_floats(encoder: CBOREncoder, values: Floats) -> None:
    """All non-finite values become one NaN, as stored objectives are."""
    numbers = np.where(np.isfinite(values), values, np.nan).astype("<f8")
    encoder.encode(_array(numbers.shape, _FLOAT64, numbers.tobytes()))


def _encode_statuses(encoder: CBOREncoder, statuses: _Statuses) -> None:
    """The sorted labels that occur, and for each status its index among them."""
    values = statuses.values
    labels = {value: Status(value).label for value in np.unique(values).tolist()}
    ranked = sorted(labels.values())
    places = np.zeros(256, dtype=np.uint8)
    for value, label in labels.items():
        places[value] = ranked.index(label)
    encoder.encode([ranked, _array(values.shape, _UINT8, places[values].tobytes())])


def _array(shape: Sequence[int], tag: int, content: bytes) -> CBORTag:
    return CBORTag(_DIMENSIONS, [list(shape), CBORTag(tag, content)])


_ENCODERS: Final[Mapping[type, Callable[[CBOREncoder, Any], None]]] = {
    dict: _encode_map,
    np.ndarray: _encode_floats,
    _Statuses: _encode_statuses,
}
