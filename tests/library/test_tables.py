"""Evaluations as a table: the same numbers as arrays, in Arrow, CSV and Parquet."""

from __future__ import annotations

import csv
import io
import sys

import numpy as np
import pyarrow as pa
import pytest

from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, OBJECTIVE_NAMES, Status
from gaitswarm.tables import EvaluationTable, Table, decoded_table, encoded_table

SPEC = JobSpec(controller="pi", scenarios=("normal-fast", "2"), preference="C")
CASES = ("normal-fast", "normal-slow")
NASTY = (5e-324, 1.7976931348623157e308, 1e22, 1e23, 0.1 + 0.2, -0.0, 123456789012345680.0, 1e-7)


@pytest.fixture
def columns() -> EvaluationColumns:
    """Ten designs of any bits; the third fell in the second scenario."""
    generator = np.random.default_rng(3)
    objectives = generator.random((10, 2, len(SPEC.columns)))
    objectives[2, 1] = np.nan
    statuses = np.zeros((10, 2), dtype=np.uint8)
    statuses[2, 1] = Status.FELL
    bits = generator.integers(0, 0x7FE0000000000000, (10, 2))
    designs = bits.view(np.float64) * generator.choice([1.0, -1.0], (10, 2))
    designs[: len(NASTY), 0] = NASTY
    return EvaluationColumns(
        iteration=np.repeat([0, 1], 5),
        particle=np.tile(np.arange(5), 2),
        designs=designs,
        objectives=objectives,
        statuses=statuses,
        fitness=SPEC.judge(objectives, statuses != Status.OK).fitness,
    )


@pytest.fixture
def table(columns: EvaluationColumns) -> EvaluationTable:
    return EvaluationTable(SPEC, columns)


def same_bits(left: np.ndarray, right: np.ndarray) -> bool:
    return bool((left.view(np.int64) == right.view(np.int64)).all())


def test_its_arrays_are_those_of_the_evaluations(
    table: EvaluationTable, columns: EvaluationColumns
) -> None:
    assert table.variables == ("P", "I")
    assert table.cases == CASES
    assert same_bits(table.designs, columns.designs)
    assert np.array_equal(table.objectives, columns.objectives[:, :, :6], equal_nan=True)
    assert np.array_equal(table.measurements, columns.objectives[:, :, 6:], equal_nan=True)
    assert table.objective_names == OBJECTIVE_NAMES
    assert table.measurement_names == MEASUREMENT_NAMES
    assert np.array_equal(table.iteration, columns.iteration)
    assert np.array_equal(table.particle, columns.particle)
    assert table.statuses[2].tolist() == ["ok", "fell"]
    assert np.array_equal(table["design.I"], columns.designs[:, 1])


def test_what_does_not_exist_is_nan_and_never_infinite(table: EvaluationTable) -> None:
    assert np.flatnonzero(np.isnan(table.fitness)).tolist() == [2]
    assert np.argwhere(np.isnan(table.utilities)).tolist() == [[2, 1]]
    assert table.utilities[0] == pytest.approx(table.objectives[0, :, :5].prod(axis=1))


def test_pieces_make_one_table(table: EvaluationTable, columns: EvaluationColumns) -> None:
    pieces = [columns.rows(slice(0, 5)), columns.rows(slice(5, 10))]
    assert EvaluationTable(SPEC, *pieces).to_arrow().equals(table.to_arrow())


def test_a_job_without_evaluations_has_the_same_columns_without_rows(
    table: EvaluationTable,
) -> None:
    empty = EvaluationTable(SPEC)
    assert len(empty) == 0
    assert empty.keys() == table.keys()
    assert empty.to_arrow().schema == table.to_arrow().schema
    assert empty.objectives.shape == (0, 2, 6)


def test_it_counts_rows_and_lists_names_as_a_data_frame_does(table: EvaluationTable) -> None:
    assert len(table) == 10
    assert list(table) == list(table.keys()) == list(dict(table))
    assert "fitness" in table and "best" not in table
    columns = 3 + len(table.variables) + 2 * (2 + len(SPEC.columns))
    assert repr(table) == f"<EvaluationTable: 10 rows, {columns} columns>"


def test_arrow_has_null_where_an_array_has_nan(table: EvaluationTable) -> None:
    arrow = table.to_arrow()
    assert arrow.column("fitness").null_count == 1
    assert arrow.column("normal-slow.energy").null_count == 1
    assert pa.types.is_int64(arrow.schema.field("iteration").type)
    assert pa.types.is_string(arrow.schema.field("normal-fast.status").type)


def test_libraries_that_know_the_arrow_interface_take_it_as_it_is(table: EvaluationTable) -> None:
    assert pa.table(table).equals(table.to_arrow())


def test_parquet_brings_the_same_table_back(
    table: EvaluationTable, columns: EvaluationColumns
) -> None:
    content = b"".join(encoded_table("parquet", SPEC, [columns]))
    read = EvaluationTable(SPEC, decoded_table(SPEC, content))
    assert read.to_arrow().equals(table.to_arrow())
    assert same_bits(read.designs, columns.designs)


def test_numbers_in_csv_are_exact_to_the_bit_and_what_is_missing_is_empty(
    columns: EvaluationColumns, table: EvaluationTable
) -> None:
    text = b"".join(encoded_table("csv", SPEC, [columns])).decode()
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert tuple(rows[0]) == table.keys()
    for k, name in enumerate(("design.P", "design.I")):
        read = np.array([float(row[name]) for row in rows])
        assert same_bits(read, np.ascontiguousarray(columns.designs[:, k]))
    assert rows[2]["fitness"] == rows[2]["normal-slow.utility"] == rows[2]["normal-slow.torque"]
    assert rows[2]["fitness"] == ""
    assert rows[2]["normal-slow.status"] == "fell"


def test_columns_of_different_length_are_no_table() -> None:
    with pytest.raises(ValueError, match="one length"):
        Table({"a": np.zeros(2), "b": np.zeros(3)})


def test_without_pandas_the_error_says_what_to_install(
    table: EvaluationTable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas") as raised:
        table.to_pandas()
    assert raised.value.name == "pandas"


def test_pandas_has_the_same_rows(table: EvaluationTable) -> None:
    frame = table.to_pandas()
    assert tuple(frame.columns) == table.keys()
    assert frame["fitness"].isna().sum() == 1
    assert frame["iteration"].dtype == np.int64
