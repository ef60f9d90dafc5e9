"""Categorical variables by the names of their choices, wherever designs are read or written."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from gaitswarm.cli.inputs import read_design
from tests.examples.walks import SHORT_WALK
from tests.library.conftest import Reach

PI = {"P": 0.45, "I": 0.1}
SPEC: dict[str, Any] = {
    "controller": "pi",
    "scenarios": [SHORT_WALK],
    "variables": ["P", "I", "fir_window"],
    "fixed": {"duty_phase": "swing", "duty_factor": 0.45},
    "optimizer": {"particles": 6},
    "iterations": 1,
}


def test_a_job_shows_names_and_keeps_numbers(reach: Reach, db: Path) -> None:
    run = gaitswarm.optimize(SPEC, db=db, evaluator="in-process")
    jobs = reach(db)
    assert jobs.job(run.job.id).spec.fixed["duty_phase"] == "swing"
    best = jobs.best(run.job.id)
    assert best.design["duty_phase"] == "swing"
    assert best.design["fir_window"] in ("moving_average", "hamming")

    table = jobs.evaluations(run.job.id)
    assert set(table["design.fir_window"].tolist()) == {"moving_average", "hamming"}
    windows = table.designs[:, table.variables.index("fir_window")]
    assert set(windows.tolist()) == {0.0, 1.0}
    assert np.all((windows == 1.0) == (table["design.fir_window"] == "hamming"))

    exported = b"".join(jobs.export(run.job.id, "csv")).decode()
    row = next(csv.DictReader(io.StringIO(exported)))
    assert row["design.duty_phase"] == "swing"


def test_a_best_design_walks_again_as_it_is_written(db: Path) -> None:
    run = gaitswarm.optimize(SPEC, db=db, evaluator="in-process")
    again = gaitswarm.simulate(run.best.design, controller="pi", scenarios=[SHORT_WALK])
    assert again.fitness[0] == run.best.fitness


def test_a_choice_is_taken_by_name_or_index() -> None:
    many_designs: tuple[Any, ...] = (
        {**PI, "fir_window": ["moving_average", "hamming"]},
        [{**PI, "fir_window": "moving_average"}, {**PI, "fir_window": "hamming"}],
    )
    for designs in many_designs:
        many = gaitswarm.simulate(designs, controller="pi", scenarios=[SHORT_WALK])
        for index, name in enumerate(("moving_average", "hamming")):
            for value in (name, index):
                design: dict[str, float | str] = {**PI, "fir_window": value}
                one = gaitswarm.simulate(design, controller="pi", scenarios=[SHORT_WALK])
                np.testing.assert_array_equal(one.objectives[0], many.objectives[index])
        assert not np.array_equal(many.objectives[0], many.objectives[1])


def test_a_choice_that_does_not_exist_is_refused_with_the_existing_ones() -> None:
    with pytest.raises(
        gaitswarm.InvalidRequest, match="not one of its choices moving_average, hamm"
    ):
        gaitswarm.simulate({**PI, "fir_window": "boxcar"}, controller="pi", scenarios="1")


def test_a_design_file_may_name_choices(tmp_path: Path) -> None:
    path = tmp_path / "design.json"
    path.write_text(json.dumps({**PI, "fir_window": "hamming"}))
    assert read_design(str(path), "pi") == {**PI, "fir_window": 1.0}
    path.write_text(json.dumps({**PI, "fir_window": "boxcar"}))
    with pytest.raises(gaitswarm.InvalidRequest, match="not one of its choices") as refused:
        read_design(str(path), "pi")
    assert refused.value.field == "design.fir_window"


def test_a_boolean_in_place_of_a_number_is_refused() -> None:
    document = {**SPEC, "optimizer": {"name": "pso", "particles": True}}
    with pytest.raises(gaitswarm.InvalidRequest, match="must be a number") as refused:
        gaitswarm.job_spec(document)
    assert refused.value.field == "optimizer.particles"
    with pytest.raises(gaitswarm.InvalidRequest, match="iterations: must be a number"):
        gaitswarm.job_spec(SPEC, iterations=True)
