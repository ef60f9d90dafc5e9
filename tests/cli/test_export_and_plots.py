"""Files made of a job: tables and pictures."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from gaitswarm.sim.outcome import MEASUREMENT_NAMES, OBJECTIVE_NAMES
from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.commands import run_command


@pytest.fixture(scope="module")
def expected(finished: Finished) -> list[dict[str, Any]]:
    """Rows of the table, from the history."""
    history = run_command("history", finished.id, "--db", finished.db, "--json").json
    rows = []
    for evaluation in (e for i in history["iterations"] for e in i["evaluations"]):
        walk = evaluation["scenarios"]["short"]
        rows.append(
            {name: evaluation[name] for name in ("iteration", "particle", "fitness")}
            | {f"design.{name}": value for name, value in evaluation["design"].items()}
            | {"short.status": walk["status"], "short.utility": walk["utility"]}
            | {f"short.{name}": walk["objectives"][name] for name in OBJECTIVE_NAMES}
            | {f"short.{name}": walk["measurements"][name] for name in MEASUREMENT_NAMES}
        )
    return rows


@pytest.mark.slow
def test_parquet_holds_every_evaluation_exactly(
    gaitswarm: Gaitswarm,
    finished: Finished,
    expected: list[dict[str, Any]],
    place: Callable[[Path], list[str]],
    tmp_path: Path,
) -> None:
    path = tmp_path / "job.parquet"
    result = gaitswarm("export", finished.id, "-o", path, *place(finished.db))
    assert result.code == 0, result.err
    assert "6 evaluations" in result.err
    table = pq.read_table(path)
    assert table.to_pylist() == expected
    assert str(table.schema.field("particle").type) == "int64"


def test_csv_holds_every_evaluation_exactly(
    gaitswarm: Gaitswarm, finished: Finished, expected: list[dict[str, Any]], tmp_path: Path
) -> None:
    path = tmp_path / "job.csv"
    assert gaitswarm("export", finished.id, "-o", path, "--db", finished.db).code == 0
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [
        {name: text if name.endswith(".status") else float(text) for name, text in row.items()}
        for row in rows
    ] == expected


@pytest.mark.parametrize("name", ["job.xlsx", "missing/job.csv"])
def test_a_file_that_cannot_be_written_is_exit_code_2(
    gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path, name: str
) -> None:
    result = gaitswarm("export", finished.id, "-o", tmp_path / name, "--db", finished.db)
    assert result.code == 2
    assert name in result.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_convergence_is_drawn_with_named_axes(
    gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path
) -> None:
    path = tmp_path / "convergence.svg"
    drawn = gaitswarm("plot", "convergence", finished.id, "-o", path, "--db", finished.db)
    assert drawn.code == 0, drawn.err
    picture = path.read_text(encoding="utf-8")
    for label in ("best so far", "median of the iteration", "iteration", "fitness, minimized"):
        assert f"<!-- {label}" in picture
    assert "<!-- 0 -->" in picture, "iterations are numbered from 0"


@pytest.mark.slow
def test_the_surface_of_a_fuzzy_design_is_drawn_with_units_and_leaves_the_style_of_others(
    gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path
) -> None:
    before, surface, after = (tmp_path / name for name in ("before.png", "s.svg", "after.png"))
    for path, plotted in (
        (before, ("convergence", finished.id, "--db", finished.db)),
        (surface, ("surface", "--design", "published:A")),
        (after, ("convergence", finished.id, "--db", finished.db)),
    ):
        drawn = gaitswarm("plot", *plotted, "-o", path)
        assert drawn.code == 0, drawn.err
    picture = surface.read_text(encoding="utf-8")
    assert "angle error" in picture and "[PWM counts]" in picture
    assert before.read_bytes().startswith(b"\x89PNG")
    assert before.read_bytes() == after.read_bytes()


def test_pictures_are_png_svg_or_pdf(
    gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path
) -> None:
    gif = tmp_path / "c.gif"
    refused = gaitswarm("plot", "convergence", finished.id, "--db", finished.db, "-o", gif)
    assert refused.code == 2
    assert not gif.exists()
