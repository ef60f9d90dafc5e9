"""`gaitswarm optimize` runs a job in this process, from a spec and options."""

from __future__ import annotations

import json
import re
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.cli.exit_codes import ExitCode
from gaitswarm.cli.inputs import LARGEST_FILE
from gaitswarm.services.runtime import open_store
from tests.cli.conftest import Finished, Gaitswarm, WriteJson
from tests.examples.jobs import SMALL_SPEC
from tests.examples.paths import CHAPTER_3

pytestmark = pytest.mark.slow


def test_it_prints_the_finished_job_as_one_json_document(finished: Finished) -> None:
    job = finished.job
    assert job["state"] == "succeeded"
    assert job["iterations"] == 2
    assert job["evaluations"] == 6
    best = job["best"]
    assert best["fitness"] > 0
    assert set(best["design"]) == {
        "I", "FI1R", "FI2R", "FOR", "FOMF", "FW1", "FW23", "FW4", "FW56",
    }  # fmt: skip
    (walk,) = best["scenarios"].values()
    assert walk["status"] == "ok"
    assert walk["utility"] == pytest.approx(best["fitness"])


def test_options_go_before_the_spec(gaitswarm: Gaitswarm, small_spec: Path, db: Path) -> None:
    options = "--iterations 1 --particles 2 --seed 3 --preference C --controller pi --name other"
    result = gaitswarm(
        "optimize", "--spec", small_spec, *options.split(),
        "--db", db, "--evaluator", "in-process", "--json",
    )  # fmt: skip
    assert result.code == 0, result.err
    spec = result.json["spec"]
    assert (spec["iterations"], spec["seed"], spec["name"]) == (1, 3, "other")
    assert (spec["controller"], spec["optimizer"]["particles"]) == ("pi", 2)
    assert spec["preference"]["exponent"] == [1.0] * 5
    assert set(result.json["best"]["design"]) == {"P", "I"}


def test_a_search_in_single_precision_reports_its_best_in_double_with_the_difference(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    run = ("optimize", "--spec", small_spec, "--db", db, "--evaluator", "in-process")
    shown = gaitswarm(*run, "--precision", "single")
    assert shown.code == 0, shown.err
    (job,) = gaitswarm("list", "--db", db, "--json").json
    best = gaitswarm("best", job["id"], "--db", db, "--json").json
    assert (job["precision"], job["best_fitness"]) == ("single", best["fitness"])
    design = db.with_name("best.json")
    design.write_text(json.dumps(best), encoding="utf-8")
    scenario = db.with_name("scenario.json")
    scenario.write_text(json.dumps(SMALL_SPEC["scenarios"][0]), encoding="utf-8")
    walk = ("simulate", "--design", design, "--scenario", scenario, "--json")
    assert gaitswarm(*walk).json["fitness"] == best["fitness"]
    assert gaitswarm(*walk, "--precision", "single").json["fitness"] == best["search"]["fitness"]
    line = "evaluated in double precision; in single precision of the search, its fitness is"
    status, text = (
        gaitswarm("status", job["id"], "--db", db),
        gaitswarm("best", job["id"], "--db", db),
    )
    for printed in (shown.out, status.out, text.out):
        assert line in " ".join(printed.split())
    assert "single precision" in status.out


@pytest.mark.parametrize("command", ["optimize", "simulate"])
def test_a_precision_that_does_not_exist_is_refused_by_name(
    gaitswarm: Gaitswarm, command: str, new_db: Path
) -> None:
    given = ("--db", new_db) if command == "optimize" else ("--design", "published:A")
    refused = gaitswarm(command, *given, "--precision", "half")
    assert refused.code == 2
    assert "precision" in refused.err and "'single' or 'double'" in refused.err
    assert not new_db.exists()


@pytest.mark.variants("pi-7")
@pytest.mark.parametrize(("controller", "searched"), [("fuzzy-pi-3", 17), ("pi", 7)])
def test_controller_and_gait_are_searched_together(
    gaitswarm: Gaitswarm, db: Path, controller: str, searched: int
) -> None:
    """The example has the size of chapter 3's job; the options ask for the same one."""
    where = ("--db", db, "--evaluator", "in-process", "--json")
    spec = ("--spec", CHAPTER_3 / f"{controller}.json")
    small = ("--iterations", "2", "--particles", "4")
    job = gaitswarm("optimize", *spec, *small, *where).json
    optimizer = gaitswarm("submit", *spec, "--db", db, "--json").json["spec"]["optimizer"]
    assert (optimizer["particles"], optimizer["inertia_end"]) == (40, 0.9)

    gait = {"cycle_time", "stride", "height", "duty_factor", "fir_ms"}
    assert len(job["best"]["design"]) == searched and gait < set(job["best"]["design"])
    assert job["best"]["figure_of_merit"] == pytest.approx(1e5 / job["best"]["fitness"])

    options = "--with-gait --scenarios straight --preference chapter-3 --optimizer pso"
    asked = ("optimize", "--controller", controller, *options.split(), *small)
    assert gaitswarm(*asked, *where).json["best"] == job["best"]


def test_a_fixed_gait_stays_fixed(gaitswarm: Gaitswarm, write_json: WriteJson, db: Path) -> None:
    spec = write_json({"controller": "pi", "fixed": {"stride": 0.12}, "scenarios": ["straight"]})
    asked = gaitswarm("submit", "--spec", spec, "--with-gait", "--db", db, "--json").json["spec"]
    assert [v["name"] for v in asked["variables"]] == [
        "P", "I", "cycle_time", "height", "duty_factor", "fir_ms",
    ]  # fmt: skip
    assert asked["fixed"] == {"stride": 0.12}


def test_a_robot_is_fitted_without_a_gait(gaitswarm: Gaitswarm, write_json: WriteJson) -> None:
    spec = write_json({"kind": "identification", "recordings": ["0" * 32]})
    refused = gaitswarm("submit", "--spec", spec, "--with-gait")
    assert refused.code == 2
    assert "with-gait: only jobs that tune a drive have a gait" in refused.err


def test_an_optimizer_is_named_and_its_settings_are_written_out(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    named = (
        "submit",
        "--spec",
        small_spec,
        "--db",
        db,
        "--optimizer",
        "pso-falling-inertia",
        "--json",
    )
    whole = gaitswarm(*named).json["spec"]["optimizer"]
    assert (whole["inertia_start"], whole["inertia_end"], whole["particles"]) == (0.9, 0.7, 25)
    assert gaitswarm(*named, "--particles", "4").json["spec"]["optimizer"] == {
        **whole,
        "particles": 4,
    }


def test_the_report_ends_with_a_verdict_against_the_published_optimum(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    result = gaitswarm(
        "optimize", "--spec", small_spec, "--db", db, "--evaluator", "in-process",
    )  # fmt: skip
    assert result.code == 0, result.err
    assert "fitness of best: " in result.out
    assert re.search(r"Compared with published A, [\d.]+ % (better|worse) by fitness: ", result.out)
    assert "2/2 iterations: best" in result.err
    assert f"gaitswarm serve --db {db}" in result.err
    assert re.search(r"simulated on threads: \d+ \(--evaluator ray runs it on Ray\)", result.err)


def test_resuming_a_finished_job_prints_it_again(gaitswarm: Gaitswarm, finished: Finished) -> None:
    result = gaitswarm("optimize", "--resume", finished.id, "--db", finished.db, "--json")
    assert result.code == 0
    assert result.json == finished.job


def test_resuming_takes_the_same_spec_but_no_other(
    gaitswarm: Gaitswarm, finished: Finished, small_spec: Path
) -> None:
    resume = ("optimize", "--resume", finished.id, "--db", finished.db, "--json")
    assert gaitswarm(*resume, "--spec", small_spec).code == 0
    other = gaitswarm(*resume, "--spec", small_spec, "--seed", "9")
    assert other.code == 4
    assert "another seed" in other.err


def test_resuming_continues_a_paused_job_and_refuses_a_cancelled_one(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, finished: Finished
) -> None:
    where = ("--db", db)
    job_id = gaitswarm("submit", "--spec", small_spec, *where).out.strip()
    gaitswarm("pause", job_id, *where)
    resumed = gaitswarm(
        "optimize", "--resume", job_id, *where, "--evaluator", "in-process", "--json"
    )
    assert resumed.code == 0, resumed.err
    assert resumed.json["best"] == finished.job["best"]
    cancelled = gaitswarm("submit", "--spec", small_spec, *where).out.strip()
    gaitswarm("cancel", cancelled, *where)
    refused = gaitswarm("optimize", "--resume", cancelled, *where)
    assert refused.code == 4
    assert "cancelled" in refused.err


def test_resuming_an_unknown_job_is_exit_code_3(gaitswarm: Gaitswarm, finished: Finished) -> None:
    assert gaitswarm("optimize", "--resume", "nosuchjob", "--db", finished.db).code == 3


BAD_SPECS: dict[str, tuple[dict[str, Any], str]] = {
    "unknown scenario": ({"scenarios": ["moon-walk"]}, "moon-walk"),
    "no scenario": ({"scenarios": []}, "scenarios"),
    "inverted bounds": (
        {"variables": ["FI1R", {"name": "I", "low": 1.0, "high": 0.1}]},
        "variables.1",
    ),
    "NaN": ({"fixed": {"FW1": float("nan")}}, "fixed.FW1"),
    "no iterations": ({"iterations": 0}, "iterations"),
    "no particles": ({"optimizer": {"name": "pso", "particles": 0}}, "optimizer.particles"),
    "optimizer that is a number": ({"optimizer": 3}, "optimizer"),
    "unknown optimizer": (
        {"optimizer": "pos"},
        "optimizer: unknown optimizer 'pos'",
    ),
    "negative seed": ({"seed": -1}, "seed"),
    "unknown field": ({"budget": 5}, "budget"),
    "unknown preference": ({"preference": "Z"}, "preference"),
    "unreachable pose": (
        {"scenarios": [{"name": "giant", "cycle_time": 1.5, "radius": 0.9, "hip_height": 0.15}]},
        "giant",
    ),
}


@pytest.mark.parametrize(("change", "field"), BAD_SPECS.values(), ids=BAD_SPECS)
def test_a_bad_spec_is_exit_code_2_that_names_the_field_and_leaves_nothing(
    gaitswarm: Gaitswarm, write_json: WriteJson, new_db: Path, change: dict[str, Any], field: str
) -> None:
    result = gaitswarm(
        "optimize", "--spec", write_json(SMALL_SPEC | change), "--db", new_db, "--json"
    )
    assert result.code == 2
    assert field in result.err
    assert result.out == ""
    assert not new_db.exists()


BAD_FILES = {
    "no JSON": (b"{iterations: 3}", "not valid JSON"),
    "no object": (b"[1, 2]", "one JSON object"),
    "no text": (b"\xff\xfe\x00", "not valid JSON"),
    "a name twice": (b'{"seed": 1, "seed": 2}', "'seed' occurs twice"),
    "nested too deeply": (b"[" * 200_000 + b"]" * 200_000, "nested too deeply"),
    "too large": (b'{"name": "' + b"x" * 10 * LARGEST_FILE + b'"}', "larger than 1 MiB"),
}


@pytest.mark.parametrize(("content", "why"), BAD_FILES.values(), ids=BAD_FILES)
def test_an_invalid_spec_file_is_exit_code_2(
    gaitswarm: Gaitswarm, tmp_path: Path, new_db: Path, content: bytes, why: str
) -> None:
    path = tmp_path / "spec.json"
    path.write_bytes(content)
    result = gaitswarm("optimize", "--spec", path, "--db", new_db)
    assert result.code == 2
    assert result.err.startswith("gaitswarm: spec: ")
    assert why in result.err
    assert not new_db.exists()


def test_a_missing_spec_file_is_exit_code_2(gaitswarm: Gaitswarm, db: Path) -> None:
    result = gaitswarm("optimize", "--spec", "no-such-file.json", "--db", db)
    assert result.code == 2
    assert "no-such-file.json" in result.err


@pytest.mark.parametrize(
    "options",
    [["--evaluator", "abacus"], ["--cpus", "0"], ["--iterations", "many"], ["--no-such-option"]],
)
def test_an_option_that_makes_no_sense_is_exit_code_2(
    gaitswarm: Gaitswarm, small_spec: Path, new_db: Path, options: list[str]
) -> None:
    result = gaitswarm("optimize", "--spec", small_spec, "--db", new_db, *options)
    assert result.code == 2
    assert options[0].removeprefix("--") in result.err
    assert not new_db.exists()


def test_a_missing_directory_is_exit_code_5_and_named(
    gaitswarm: Gaitswarm, small_spec: Path, tmp_path: Path
) -> None:
    missing = tmp_path / "missing" / "jobs.db"
    result = gaitswarm("optimize", "--spec", small_spec, "--db", missing)
    assert result.code == 5
    assert str(missing) in result.err


def test_json_has_every_bit_of_stored_values(finished: Finished, gaitswarm: Gaitswarm) -> None:
    result = gaitswarm("history", finished.id, "--db", finished.db, "--json").json
    with closing(open_store(str(finished.db))) as store:
        stored = store.evaluations_between(finished.id, 0, 2)
    shown = [evaluation for i in result["iterations"] for evaluation in i["evaluations"]]
    assert [e["fitness"] for e in shown] == [e.fitness for e in stored]
    assert [list(e["design"].values()) for e in shown] == [e.design.tolist() for e in stored]
    walks = [e["scenarios"]["short"] for e in shown]
    results = [[*w["objectives"].values(), *w["measurements"].values()] for w in walks]
    assert results == [e.objectives[0].tolist() for e in stored]


def test_a_repeated_job_simulates_only_without_the_cache(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("GAITSWARM_CACHE")
    run = ("optimize", "--spec", small_spec, "--db", db, "--evaluator", "in-process", "--json")
    first, again, uncached = (
        gaitswarm(*run).json,
        gaitswarm(*run).json,
        gaitswarm(*run, "--no-cache").json,
    )
    assert [job["evaluations_saved"] for job in (first, again, uncached)] == [0, 6, 0]
    assert first["evaluated_on"].startswith("threads: ")
    assert first["best"] == again["best"] == uncached["best"]


def test_a_job_starts_from_the_best_of_another_or_from_a_file(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    run = ("optimize", "--spec", small_spec, "--db", db, "--evaluator", "in-process", "--json")
    first = gaitswarm(*run).json
    started = gaitswarm(*run, "--seed", "8", "--start-from", first["id"], "--start-count", "1")
    assert started.code == 0, started.err
    assert started.json["spec"]["start"] == [first["best"]["design"]]
    assert started.json["best"]["fitness"] <= first["best"]["fitness"]
    exported = db.with_name("designs.csv")
    assert gaitswarm("export", first["id"], "--db", db, "--output", exported).code == 0
    from_file = gaitswarm(*run, "--seed", "8", "--start-from", exported, "--start-count", "1")
    assert from_file.json["spec"]["start"] == [first["best"]["design"]]


def test_a_start_that_makes_no_sense_is_refused_with_its_place(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    run = ("optimize", "--spec", small_spec, "--db", db)
    designs = db.with_name("designs.csv")
    designs.write_text("I,FI1R\n0.5,1e9\n", encoding="utf-8")
    for options, message in (
        (("--start-from", designs), "start.0.FI1R: 1e+09 is outside the bounds"),
        (("--start-from", "nothing"), "start.jobs.0: there is no job 'nothing'"),
        (("--start-count", "3"), "start-count: requires --start-from"),
    ):
        result = gaitswarm(*run, *options)
        assert result.code == 2
        assert message in result.err


def test_an_invalid_cluster_address_leaves_no_job_behind(
    gaitswarm: Gaitswarm, new_db: Path, small_spec: Path
) -> None:
    result = gaitswarm(
        "optimize", "--spec", small_spec, "--db", new_db, "--ray-address", "ray://x:1"
    )
    assert (
        result.code == ExitCode.BAD_INPUT and "is not the address of a cluster's head" in result.err
    )
    assert not new_db.exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--start-from", "FILE"), r"spec\.json is a file, .* its name must end in \.csv"),
        (("--optimizer-settings", "[1]"), r"must be one JSON object"),
    ],
)
def test_errors_of_options_name_the_allowed_values(
    gaitswarm: Gaitswarm, db: Path, small_spec: Path, options: tuple[str, ...], said: str
) -> None:
    words = [str(small_spec) if word == "FILE" else word for word in options]
    result = gaitswarm("optimize", "--db", db, *words)
    assert result.code == ExitCode.BAD_INPUT
    assert re.search(said, " ".join(result.err.split())), result.err
