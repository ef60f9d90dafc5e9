"""`gaitswarm front`, `plot front` and `preferences --for`."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Finished, Gaitswarm, WriteJson
from tests.examples.jobs import SMALL_SPEC

pytestmark = pytest.mark.slow


def test_a_front_is_shown_with_its_marks_and_written_as_a_table(
    gaitswarm: Gaitswarm,
    finished: Finished,
    place: Callable[[Path], list[str]],
    tmp_path: Path,
) -> None:
    file = tmp_path / "front.csv"
    where = place(finished.db)
    result = gaitswarm("front", finished.id, *where, "--output", file, "--json")
    assert result.code == 0, result.err
    view = result.json
    rows = list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))
    assert len(rows) == view["size"] == len(view["designs"])
    for row, design in zip(rows, view["designs"], strict=True):
        assert row["marks"] == "; ".join(design["marks"])
        assert float(row["energy"]) == design["objectives"]["energy"]
        assert float(row["normalised.energy"]) == design["normalised"]["energy"]
        assert float(row["design.I"]) == design["design"]["I"]
    shown = gaitswarm("front", finished.id, *where)
    assert shown.code == 0, shown.err
    assert "least angular acceleration" in shown.out
    assert "best under the job's own" in shown.out
    assert f"{view['size']} of {view['designs_judged']} designs are not dominated" in shown.out
    assert f"hypervolume {view['hypervolume']:.4f}" in shown.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--most", "0"), "most: must be at least 1"),
        (("--output", "front.xlsx"), "output: front.xlsx must end in .csv"),
    ],
)
def test_invalid_input_is_named(
    gaitswarm: Gaitswarm, finished: Finished, options: tuple[str, str], said: str
) -> None:
    result = gaitswarm("front", finished.id, "--db", finished.db, *options)
    assert result.code == 2
    assert said in result.err


def test_a_front_is_drawn(gaitswarm: Gaitswarm, finished: Finished, tmp_path: Path) -> None:
    picture = tmp_path / "front.svg"
    result = gaitswarm("plot", "front", finished.id, "--db", finished.db, "--output", picture)
    assert result.code == 0, result.err
    assert "<svg" in picture.read_text(encoding="utf-8")


def test_the_reported_preference_makes_the_design_the_best_of_the_job(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    front = gaitswarm("front", finished.id, "--db", finished.db, "--json").json
    (under_c,) = [winner for winner in front["winners"] if winner["preference"] == "C"]
    iteration, particle = under_c["iteration"], under_c["particle"]
    asked = ("preferences", finished.id, "--db", finished.db, "--for")
    view = gaitswarm(*asked, f"{iteration}.{particle}", "--json").json
    assert view["wins"]
    preference = json.dumps(view["fits"][0]["preference"])
    ranking = ("rank", finished.id, "--db", finished.db, "--json", "--preference", preference)
    first, second = gaitswarm(*ranking).json["top"][:2]
    assert (first["iteration"], first["particle"]) == (iteration, particle)
    power = 1.0 / sum(view["fits"][0]["preference"]["exponent"])
    margin = (second["fitness"] / first["fitness"]) ** power - 1.0
    assert view["fits"][0]["margin"] == pytest.approx(margin)
    result = gaitswarm(*asked, f"{iteration}.{particle}")
    assert f"design {iteration}.{particle} wins by {100.0 * margin:.3g} %" in result.out


def test_a_design_that_cannot_win_names_a_better_one(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    ranking = gaitswarm(
        "rank", finished.id, "--db", finished.db, "--preference", "C", "--top", 1000, "--json"
    ).json
    front = gaitswarm("front", finished.id, "--db", finished.db, "--json").json
    on_front = {(design["iteration"], design["particle"]) for design in front["designs"]}
    worst = ranking["top"][-1]
    place = worst["iteration"], worst["particle"]
    assert place not in on_front
    result = gaitswarm(
        "preferences", finished.id, "--db", finished.db, "--for", f"{place[0]}.{place[1]}"
    )
    assert result.code == 0, result.err
    assert f"make design {place[0]}.{place[1]} win, which is dominated; under" in result.out


def test_a_job_in_worlds_has_a_front(gaitswarm: Gaitswarm, db: Path, write_json: WriteJson) -> None:
    spec = write_json(SMALL_SPEC | {"worlds": {"count": 2, "aggregate": "worst"}}, "spec.json")
    job = gaitswarm(
        "optimize", "--spec", spec, "--db", db, "--evaluator", "in-process", "--json"
    ).json
    front = gaitswarm("front", job["id"], "--db", db, "--json").json
    (own,) = [winner for winner in front["winners"] if winner["preference"] == "job"]
    assert own["fitness"] == job["best_fitness"]
    results = job["best"]["scenarios"].values()
    worst = max(result["objectives"]["energy"] for result in results)
    assert own["objectives"]["energy"] == pytest.approx(worst)
    view = gaitswarm(
        "preferences", job["id"], "--db", db, "--json",
        "--for", f"{own['iteration']}.{own['particle']}",
    ).json  # fmt: skip
    preference = json.dumps(view["fits"][0]["preference"])
    ranked = gaitswarm("rank", job["id"], "--db", db, "--json", "--preference", preference).json
    place = next(
        design["rank"]
        for design in ranked["top"]
        if (design["iteration"], design["particle"]) == (own["iteration"], own["particle"])
    )
    assert view["fits"][0]["rank"] == place
    assert view["certain"] == view["wins"]


@pytest.mark.parametrize(
    ("design", "code", "said"),
    [
        ("3", 2, "for: must be the iteration and the number of a design in it, such as 24.7"),
        ("3.x", 2, "for: must be"),
        ("999.0", 3, "has no design 999.0"),
    ],
)
def test_a_design_is_an_iteration_and_a_number(
    gaitswarm: Gaitswarm, finished: Finished, design: str, code: int, said: str
) -> None:
    result = gaitswarm("preferences", finished.id, "--db", finished.db, "--for", design)
    assert result.code == code
    assert said in result.err


def test_a_job_without_a_design_is_a_conflict(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    job = gaitswarm("submit", "--spec", small_spec, "--db", db, "--json").json
    refused = gaitswarm("front", job["id"], "--db", db)
    assert refused.code == 4
    assert "no design yet that succeeds in all scenarios" in refused.err
