"""Results as tables: by column as numpy arrays, and as files in CSV or Parquet.

A table of evaluations has the columns iteration, particle, fitness; of a job with constraints
violation, 0 for a feasible design; `design.<variable>`, a number, or the name of a categorical
variable's choice; and for every case `<case>.status`,
`<case>.utility`, `<case>.<objective>` and `<case>.<measurement>`. What does not exist is NaN in an
array, null in Arrow, Parquet and pandas, and empty in CSV; floats are exact to the bit.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.history import no_rows
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.variables import Variable

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

TableFormat = Literal["csv", "parquet"]

MEDIA_TYPES: Final[dict[TableFormat, str]] = {
    "csv": "text/csv",
    "parquet": "application/vnd.apache.parquet",
}

Column = NDArray[Any]


class Table:
    """Columns of equal length, by name; `len` counts the rows.

    Polars, DuckDB and other libraries that know the Arrow PyCapsule interface take a table as it
    is: `polars.DataFrame(table)`.
    """

    def __init__(self, columns: Mapping[str, Column]) -> None:
        """Make a table of arrays."""
        lengths = {len(column) for column in columns.values()}
        if len(lengths) > 1:
            raise ValueError(f"columns of a table have one length, not {sorted(lengths)}")
        self._columns = dict(columns)
        self._length = lengths.pop() if lengths else 0

    def keys(self) -> tuple[str, ...]:
        """Names of the columns, in order."""
        return tuple(self._columns)

    def __getitem__(self, name: str) -> Column:
        """One column, (r,)."""
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __len__(self) -> int:
        return self._length

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {len(self)} rows, {len(self._columns)} columns>"

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self.to_arrow().__arrow_c_stream__(requested_schema)

    def to_arrow(self) -> pa.Table:
        """The table as `pyarrow.Table`; NaN becomes null."""
        # Imported here: arrow takes longer to import than a short table to write.
        import pyarrow as pa

        return pa.table({name: _arrow(column) for name, column in self._columns.items()})

    def to_pandas(self) -> pd.DataFrame:
        """The table as `pandas.DataFrame`.

        Raises:
            ImportError: pandas is not installed; gaitswarm does not need it otherwise.
        """
        try:
            # Checked here: whether Arrow raises this depends on earlier imports.
            import pandas  # noqa: F401, ICN001
        except ImportError as error:
            raise ImportError(
                "to_pandas() needs pandas, which is not installed: `pip install pandas`, or use"
                " to_arrow() or the columns as numpy arrays",
                name="pandas",
            ) from error
        return self.to_arrow().to_pandas()


class EvaluationTable(Table):
    """Every evaluation of a job, one row each, in order of iteration and particle.

    Attributes:
        variables: Names of the v variables, searched and fixed, in the order of `designs`.
        cases: Names of the K cases: scenarios, or recordings' short ids.
        objective_names: Names of the m objectives of a case.
        measurement_names: Names of the q further quantities that were measured in a case.
    """

    def __init__(self, spec: Spec, *pieces: EvaluationColumns) -> None:
        """Make a table of a job's evaluations, in one or several pieces."""
        # Without any piece the columns still exist.
        evaluations = joined([no_rows(spec), *pieces])
        super().__init__(_flat(spec, evaluations))
        self.evaluations = evaluations
        self.variables = tuple(variable.name for variable in spec.design_space().columns)
        self.cases = spec.case_names
        self.objective_names = tuple(objective.name for objective in spec.objectives)
        self.measurement_names = tuple(quantity.name for quantity in spec.measurements)

    @property
    def iteration(self) -> NDArray[np.int64]:
        """(r,) index of the iteration, from 0."""
        return self.evaluations.iteration

    @property
    def particle(self) -> NDArray[np.int64]:
        """(r,) number of the design in its iteration, from 0."""
        return self.evaluations.particle

    @property
    def fitness(self) -> Floats:
        """(r,) fitness, to be minimized; NaN where the design failed in any case."""
        return self["fitness"]

    @property
    def designs(self) -> Floats:
        """(r, v) values of the variables, in their units; of categorical ones the indices."""
        return self.evaluations.designs

    @property
    def objectives(self) -> Floats:
        """(r, K, m) raw objectives, to be minimized, in their units; NaN where there is none."""
        return _finite(self.evaluations.objectives[:, :, : len(self.objective_names)])

    @property
    def measurements(self) -> Floats:
        """(r, K, q) measurements, in their units; NaN where there is none."""
        return _finite(self.evaluations.objectives[:, :, len(self.objective_names) :])

    @property
    def utilities(self) -> Floats:
        """(r, K) utilities, to be minimized; NaN where a design failed."""
        return np.stack([self[f"{case}.utility"] for case in self.cases], axis=1)

    @property
    def statuses(self) -> NDArray[np.str_]:
        """(r, K) statuses: `ok`, or the kind of failure."""
        return _LABELS[self.evaluations.statuses]


def joined(pieces: Sequence[EvaluationColumns]) -> EvaluationColumns:
    arrays = zip(*(piece.arrays for piece in pieces), strict=True)
    return EvaluationColumns(*(np.concatenate(parts) for parts in arrays))


def decoded_table(spec: Spec, content: bytes) -> EvaluationColumns:
    """Read the Parquet file that `encoded_table` writes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(pa.BufferReader(content))

    def whole(name: str) -> NDArray[np.int64]:
        return np.asarray(table.column(name).to_numpy().astype(np.int64, casting="safe"))

    def numbers(name: str) -> Floats:
        # Null becomes NaN.
        return np.asarray(table.column(name).to_numpy(), dtype=np.float64)

    def design(variable: Variable) -> Floats:
        name = f"design.{variable.name}"
        if variable.kind != "categorical":
            return numbers(name)
        return np.array([variable.number(c) for c in table.column(name).to_pylist()], np.float64)

    def statuses(case: str) -> list[Status]:
        return [Status.from_label(label) for label in table.column(f"{case}.status").to_pylist()]

    cases, fitness = spec.case_names, numbers("fitness")
    objectives = [numbers(f"{case}.{o.name}") for case in cases for o in spec.columns]
    return EvaluationColumns(
        iteration=whole("iteration"),
        particle=whole("particle"),
        designs=np.stack([design(variable) for variable in spec.design_space().columns], axis=1),
        objectives=np.stack(objectives, axis=1).reshape(len(fitness), len(cases), -1),
        statuses=np.stack([np.array(statuses(case), np.uint8) for case in cases], axis=1),
        fitness=np.where(np.isnan(fitness), np.inf, fitness),
    )


def encoded_table(
    file_format: TableFormat, spec: Spec, pieces: Iterable[EvaluationColumns]
) -> Iterator[bytes]:
    """Encode evaluations of a job as a file, piece by piece."""
    import pyarrow as pa
    import pyarrow.csv as pc
    import pyarrow.parquet as pq

    empty = {name: _arrow(column) for name, column in _flat(spec, no_rows(spec)).items()}
    schema = pa.schema([(name, array.type) for name, array in empty.items()])
    # Names of columns and statuses have no character that would need quotes.
    options = pc.WriteOptions(quoting_style="none", quoting_header="none", eol="\r\n")
    sink = _Sink()
    with (
        pc.CSVWriter(sink, schema, write_options=options)
        if file_format == "csv"
        else pq.ParquetWriter(sink, schema)
    ) as writer:
        for piece in pieces:
            arrays = [_arrow(column) for column in _flat(spec, piece).values()]
            writer.write_batch(pa.record_batch(arrays, schema=schema))
            yield sink.take()
    yield sink.take()


def _flat(spec: Spec, rows: EvaluationColumns) -> dict[str, Column]:
    """The columns of the module's docstring; NaN for values that are not finite."""
    columns: dict[str, Column] = {
        "iteration": rows.iteration,
        "particle": rows.particle,
        "fitness": _finite(rows.fitness),
    }
    violations = spec.violations(rows.objectives, rows.failed)
    if violations is not None:
        columns["violation"] = _finite(violations)
    for variable, design in zip(spec.design_space().columns, rows.designs.T, strict=True):
        columns[f"design.{variable.name}"] = (
            np.array(variable.choices)[design.astype(np.intp)]
            if variable.kind == "categorical"
            else _finite(design)
        )
    utilities = spec.judge(rows.objectives, rows.failed).utilities
    for k, case in enumerate(spec.case_names):
        columns[f"{case}.status"] = _LABELS[rows.statuses[:, k]]
        columns[f"{case}.utility"] = _finite(utilities[:, k])
        for column, values in zip(spec.columns, rows.objectives[:, k].T, strict=True):
            columns[f"{case}.{column.name}"] = _finite(values)
    return columns


_LABELS: Final = np.array([status.label for status in sorted(Status)])
"""Labels of statuses, by number."""


def _finite(column: Floats) -> Floats:
    return np.where(np.isfinite(column), column, np.nan)


def _arrow(column: Column) -> pa.Array:
    import pyarrow as pa

    if column.dtype.kind == "U":
        return pa.array(column.tolist(), type=pa.string())
    return pa.array(column, mask=np.isnan(column) if column.dtype.kind == "f" else None)


class _Sink(io.BytesIO):
    """A buffer that is emptied while it is written; its position counts what was taken."""

    taken = 0

    def tell(self) -> int:
        return self.taken + super().tell()

    def take(self) -> bytes:
        """Return and drop what was written since the last call."""
        content = self.getvalue()
        self.seek(0)
        self.truncate()
        self.taken += len(content)
        return content
