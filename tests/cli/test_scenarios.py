"""`gaitswarm scenarios`: importance of a job's scenarios."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def two_scenarios(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """A job that walks on the level and uphill."""
    from tests.examples.commands import run_command

    folder = tmp_path_factory.mktemp("two")
    spec, db = folder / "spec.json", folder / "jobs.db"
    document = {"scenarios": [SHORT_WALK, UPHILL_WALK], "iterations": 5}
    spec.write_text(json.dumps(document | {"optimizer": {"particles": 6}}), encoding="utf-8")
    ran = run_command("optimize", "--spec", spec, "--db", db, "--evaluator", "in-process", "--json")
    assert ran.code == 0, ran.err
    return Finished(db, ran.json)


def test_each_scenario_is_left_out_in_its_turn(
    gaitswarm: Gaitswarm, two_scenarios: Finished, place: Callable[[Path], list[str]]
) -> None:
    result = gaitswarm("scenarios", two_scenarios.id, *place(two_scenarios.db), "--json")
    assert result.code == 0, result.err
    view = result.json
    assert view["designs"] + view["failed"] == 30
    assert [left["scenario"] for left in view["left_out"]] == ["short", "uphill"]
    assert [left["family"]["scenarios"] for left in view["left_out"]] == [["uphill"], ["short"]]
    assert [left["similar"] for left in view["left_out"]] == ["uphill", "short"]
    (size,) = view["sizes"]
    assert (size["size"], size["families"]) == (1, 2)

    # What the uphill walk alone would have taken for the best is a design of the job.
    history = gaitswarm("history", two_scenarios.id, "--db", two_scenarios.db, "--json").json
    evaluations = [e for i in history["iterations"] for e in i["evaluations"]]
    best = min(e["fitness"] for e in evaluations if e["fitness"] is not None)
    uphill = view["left_out"][0]["family"]
    (winner,) = [
        e for e in evaluations
        if (e["iteration"], e["particle"]) == (uphill["iteration"], uphill["particle"])
    ]  # fmt: skip
    utilities = [e["scenarios"]["uphill"]["utility"] for e in evaluations]
    assert winner["scenarios"]["uphill"]["utility"] == min(u for u in utilities if u is not None)
    if winner["fitness"] is not None:
        assert uphill["regret"]["value"] == pytest.approx(winner["fitness"] / best - 1.0)


def test_scenarios_are_printed_as_tables(gaitswarm: Gaitswarm, two_scenarios: Finished) -> None:
    result = gaitswarm("scenarios", two_scenarios.id, "--db", two_scenarios.db, "--tolerance", "10")
    assert result.code == 0, result.err
    assert "smallest family within 1000 %" in result.out


@pytest.mark.parametrize(("tolerance", "code"), [("-1", 2), ("nan", 2), ("0", 0)])
def test_a_tolerance_is_a_share(
    gaitswarm: Gaitswarm, two_scenarios: Finished, tolerance: str, code: int
) -> None:
    result = gaitswarm(
        "scenarios", two_scenarios.id, "--db", two_scenarios.db, "--tolerance", tolerance
    )
    assert result.code == code
    assert code == 0 or "tolerance: must be " in result.err


def test_a_job_without_a_design_is_a_conflict(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    job = gaitswarm("submit", "--spec", small_spec, "--db", db, "--json").json
    refused = gaitswarm("scenarios", job["id"], "--db", db)
    assert refused.code == 4
    assert "no design yet that succeeds in all scenarios" in refused.err
