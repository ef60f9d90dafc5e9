"""Evaluations of a job as one flat table, in CSV or Parquet, written as it is read.

Columns: iteration, particle, fitness; `design.<variable>`; and for every scenario
`<scenario>.status`, `<scenario>.utility` and `<scenario>.<objective>`. What does not exist is null
(empty in CSV); floats are exact to the bit.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.spec import Spec
from sim.outcome import Status

if TYPE_CHECKING:
    import pyarrow as pa

TableFormat = Literal["csv", "parquet"]

MEDIA_TYPES: Final[dict[TableFormat, str]] = {
    "csv": "text/csv",
    "parquet": "application/vnd.apache.parquet",
}


def encoded_table(
    file_format: TableFormat, spec: Spec, pieces: Iterable[EvaluationColumns]
) -> Iterator[bytes]:
    """The file in parts. pieces: evaluations of a job of this spec, in order."""
    schema = _schema(spec)
    batches = (_batch(schema, spec, piece) for piece in pieces)
    return (_csv if file_format == "csv" else _parquet)(schema, batches)


def _schema(spec: Spec) -> pa.Schema:
    # Loaded with the first table: arrow takes longer to import than a short one to write.
    import pyarrow as pa

    results = [("status", pa.string()), ("utility", pa.float64())]
    results += [(objective.name, pa.float64()) for objective in spec.objectives]
    return pa.schema(
        [
            ("iteration", pa.int64()),
            ("particle", pa.int64()),
            ("fitness", pa.float64()),
            *((f"design.{name}", pa.float64()) for name in spec.design_space().names),
            *((f"{case}.{result}", kind) for case in spec.case_names for result, kind in results),
        ]
    )


def _batch(schema: pa.Schema, spec: Spec, rows: EvaluationColumns) -> pa.RecordBatch:
    import pyarrow as pa

    def numbers(column: NDArray[np.float64]) -> pa.Array:
        values = np.ascontiguousarray(column)
        return pa.array(values, mask=~np.isfinite(values))

    utilities = spec.judge(rows.objectives, rows.failed).utilities
    labels = {status.value: status.label for status in Status}
    arrays = [pa.array(rows.iteration), pa.array(rows.particle), numbers(rows.fitness)]
    arrays += [numbers(column) for column in rows.designs.T]
    for case in range(len(spec.case_names)):
        arrays.append(pa.array([labels[status] for status in rows.statuses[:, case].tolist()]))
        arrays.append(numbers(utilities[:, case]))
        arrays += [numbers(column) for column in rows.objectives[:, case].T]
    return pa.record_batch(arrays, schema=schema)


def _csv(schema: pa.Schema, batches: Iterable[pa.RecordBatch]) -> Iterator[bytes]:
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(schema.names)
    for batch in batches:
        writer.writerows(zip(*(column.to_pylist() for column in batch.columns), strict=True))
        yield text.getvalue().encode()
        text.seek(0)
        text.truncate()
    yield text.getvalue().encode()


def _parquet(schema: pa.Schema, batches: Iterable[pa.RecordBatch]) -> Iterator[bytes]:
    import pyarrow.parquet as pq

    sink = _Sink()
    with pq.ParquetWriter(sink, schema) as writer:
        for batch in batches:
            writer.write_batch(batch)
            yield sink.take()
    yield sink.take()


class _Sink(io.RawIOBase):
    """A file that is read while it is written; what has been taken is forgotten."""

    def __init__(self) -> None:
        super().__init__()
        self._parts: list[bytes] = []
        self._length = 0

    def writable(self) -> bool:
        """It is for writing."""
        return True

    def tell(self) -> int:
        """Length of all that was written."""
        return self._length

    def write(self, data: Any, /) -> int:
        """Keep a part, bytes or a view of some, until it is taken."""
        part = bytes(data)
        self._parts.append(part)
        self._length += len(part)
        return len(part)

    def take(self) -> bytes:
        """What was written since the last time."""
        taken = b"".join(self._parts)
        self._parts.clear()
        return taken
