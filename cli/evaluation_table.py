"""Evaluations of a job as one flat table, in CSV or Parquet.

Columns: iteration, particle, fitness; `design.<variable>`; and for every scenario
`<scenario>.status`, `<scenario>.utility` and `<scenario>.<objective>`. What does not exist is null
(empty in CSV); floats are exact to the bit.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final

from cli.atomic_file import replacing
from services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    import pyarrow as pa

    from api.views import EvaluationView, HistoryIterationView
    from services.optimizer.spec import Spec

Value = int | float | str | None

_INTEGERS: Final = ("iteration", "particle")


def write_evaluations(path: Path, spec: Spec, iterations: Iterable[HistoryIterationView]) -> int:
    """Write as the file's suffix says; returns the number of rows.

    Read and written by iterations. Raises InvalidRequest for another suffix or a file that cannot
    be written.
    """
    columns = _columns(spec)
    batches = ([_row(e) for e in iteration.evaluations] for iteration in iterations)
    if path.suffix == ".csv":
        write = _write_csv
    elif path.suffix == ".parquet":
        write = _write_parquet
    else:
        raise InvalidRequest(f"{path} must end in .csv or .parquet", field="output")
    with replacing(path, "output") as file:
        return write(file, columns, batches)


def _columns(spec: Spec) -> list[str]:
    results = ("status", "utility", *(objective.name for objective in spec.objectives))
    return [
        *_INTEGERS,
        "fitness",
        *(f"design.{name}" for name in spec.design_space().names),
        *(f"{trial}.{result}" for trial in spec.trial_names for result in results),
    ]


def _row(evaluation: EvaluationView) -> list[Value]:
    """In the order of `_columns`: designs and scenarios keep theirs in every view."""
    row: list[Value] = [evaluation.iteration, evaluation.particle, evaluation.fitness]
    row += evaluation.design.values()
    for result in evaluation.scenarios.values():
        row += [result.status, result.utility, *result.objectives.values()]
    return row


def _write_csv(file: IO[bytes], columns: list[str], batches: Iterator[list[list[Value]]]) -> int:
    text = io.TextIOWrapper(file, encoding="utf-8", newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    rows = 0
    for batch in batches:
        writer.writerows(batch)
        rows += len(batch)
    text.detach()
    return rows


def _write_parquet(
    file: IO[bytes], columns: list[str], batches: Iterator[list[list[Value]]]
) -> int:
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([(name, _type(name)) for name in columns])
    rows = 0
    with pq.ParquetWriter(file, schema) as writer:
        for batch in batches:
            by_column = zip(*batch, strict=True)
            arrays = [pa.array(c, f.type) for c, f in zip(by_column, schema, strict=True)]
            writer.write_batch(pa.record_batch(arrays, schema=schema))
            rows += len(batch)
    return rows


def _type(column: str) -> pa.DataType:
    import pyarrow as pa

    if column in _INTEGERS:
        return pa.int64()
    return pa.string() if column.endswith(".status") else pa.float64()
