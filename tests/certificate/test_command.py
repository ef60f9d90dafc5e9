"""`gaitswarm certify` from beginning to end."""

from __future__ import annotations

import json
import os
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.certificate.examples import PI
from tests.examples.commands import Result, run_command
from tests.examples.forked import ForkedCommand
from tests.examples.processes import output
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

SMALL = ("--evaluator", "in-process", "--only", "friction_factor,efficiency_factor")


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with a design and two scenarios."""
    for name, document in (("pi", PI), ("short", SHORT_WALK), ("uphill", UPHILL_WALK)):
        (tmp_path / f"{name}.json").write_text(json.dumps(document), encoding="utf-8")
    return tmp_path


def arguments(files: Path) -> tuple[str, ...]:
    scenarios = f"{files / 'short.json'},{files / 'uphill.json'}"
    return (
        "certify", str(files / "pi.json"), "--controller", "pi", "--scenarios", scenarios,
        *SMALL, "--db", str(files / "jobs.db"),
    )  # fmt: skip


def certify(files: Path, *options: Any) -> Result:
    return run_command(*arguments(files), *options)


def test_the_summary_says_how_often_it_fails_how_bad_it_gets_and_where(files: Path) -> None:
    result = certify(files, "--worlds", 30, "--seed", 4, "--json")
    assert result.code == 0, result.err
    found = result.json
    assert (found["worlds"], found["seed"], found["controller"]) == (30, 4, "pi")
    assert list(found["scenarios"]) == ["short", "uphill"]
    for of in (found, *found["scenarios"].values()):
        assert of["failed"]["count"] == 0
        # Exact, of 0 in 30: 1 - 0.025 ** (1 / 30).
        assert of["failed"]["high"] == pytest.approx(1.0 - 0.025 ** (1 / 30))
    spread = found["fitness"]
    assert spread["quantiles"][2] < spread["cvar"] <= spread["worst"]
    assert found["worst"][0]["fitness"] == spread["worst"]
    assert {i["name"] for i in found["influences"]} == {"friction_factor", "efficiency_factor"}

    shown = certify(files, "--worlds", 30, "--seed", 4)
    for words in ("short", "uphill", "CVaR", "30 worlds of seed 4", "friction_factor", "--replay"):
        assert words in shown.out


@pytest.mark.thorough(
    "test_differences_are_shares_of_ours_by_scenario_and_objective",
    "test_under_the_runner_our_rows_have_the_bits_of_a_certificate_without_engines",
)
@pytest.mark.slow
def test_another_engine_is_compared_by_scenario_and_objective(files: Path) -> None:
    asked = ("--worlds", 5, "--engine", "mujoco", "--engine", "mujoco-contacts")
    result = certify(files, *asked, "--json")
    assert result.code == 0, result.err
    assert list(result.json["engines"]) == ["mujoco", "mujoco-contacts"]
    for engine, most in (("mujoco", 0.04), ("mujoco-contacts", 0.25)):
        scenarios = result.json["engines"][engine]["scenarios"]
        assert list(scenarios) == ["short", "uphill"]
        for name, found in scenarios.items():
            assert (found["ours"], found["theirs"]) == ("ok", "ok")
            nominal = result.json["scenarios"][name]["utility"]["nominal"]
            assert found["utility"]["ours"] == nominal
            torque = found["objectives"]["torque"]
            expected = torque["theirs"] / torque["ours"] - 1.0
            assert torque["difference"] == pytest.approx(expected, rel=1e-9)
            for quantity in list(found["objectives"].values())[:5]:
                assert 0.0 < abs(quantity["difference"]) < most
    shown = certify(files, *asked)
    assert "iteration" not in shown.err
    for words in ("The nominal world in mujoco-contacts", "difference", "ang.acc."):
        assert words in shown.out


def test_the_same_command_simulates_only_new_worlds(files: Path) -> None:
    first = certify(files, "--worlds", 3, "--json").json
    again = certify(files, "--worlds", 3, "--json")
    assert again.json == first and "iteration" not in again.err
    more = certify(files, "--worlds", 5, "--json").json
    assert (more["job"], more["worlds"]) == (first["job"], 5)
    # Of a longer certificate the first worlds are those of a shorter one.
    few = certify(files, "--worlds", 3, "--json").json
    assert {**few, "worlds_planned": 3} == first
    other = certify(files, "--worlds", 1, "--seed", 2, "--json").json
    assert other["job"] != first["job"]


def test_a_world_is_walked_again_by_its_number(files: Path) -> None:
    found = certify(files, "--worlds", 3, "--most", 1, "--json").json
    (worst,) = found["worst"]
    again = certify(files, "--replay", worst["world"], "--log", files / "walk.npz", "--json")
    assert again.code == 0, again.err
    assert again.json["fitness"] == worst["fitness"]
    assert again.json["world"] == worst["values"]
    with np.load(files / "walk.npz") as log:
        assert len(log["short/time"]) == 500

    command = worst["replay"].split()[1:]
    by_job = run_command(*command, "--db", files / "jobs.db", "--json")
    assert by_job.code == 0, by_job.err
    assert list(by_job.json["scenarios"]) == [worst["scenario"]]
    assert by_job.json["scenarios"][worst["scenario"]]["status"] == "ok"
    assert "efficiency_factor" in run_command(*command, "--db", files / "jobs.db").out


@pytest.mark.thorough(
    "test_a_design_is_certified_in_the_walks_and_by_the_preference_of_the_robots_folder"
)
def test_the_best_of_a_job_is_certified_with_its_robot_and_preference(files: Path) -> None:
    job = run_command(
        "optimize", "--controller", "pi", "--scenarios", files / "short.json", "--preference", "B",
        "--robot", "szabadka2", "--iterations", 1, "--particles", 4, "--evaluator", "in-process",
        "--db", files / "jobs.db", "--json",
    ).json  # fmt: skip
    result = run_command(
        "certify", job["id"], "--worlds", 2, *SMALL, "--db", files / "jobs.db", "--json"
    )
    assert result.code == 0, result.err
    found = result.json
    assert found["design"] == job["best"]["design"]
    assert (found["robot"], found["preference"]) == ("szabadka2", job["spec"]["preference"])
    assert len(found["scenarios"]) == 8
    assert not found["scenarios"]["short"]["held_out"]
    assert found["scenarios"]["turn-left-fast"]["held_out"]
    nominal = found["scenarios"]["short"]["utility"]["nominal"]
    assert nominal == job["best"]["scenarios"]["short"]["utility"]
    # A certificate's own identifier goes on with it.
    more = run_command(
        "certify", found["job"], "--worlds", 3, "--evaluator", "in-process",
        "--db", files / "jobs.db", "--json",
    ).json  # fmt: skip
    assert (more["job"], more["worlds"]) == (found["job"], 3)


def test_users_choose_ranges_and_fixed_values(files: Path) -> None:
    result = certify(
        files, "--worlds", 6, "--range", "friction_factor=0.2:0.3", "--range", "angle_delay=1:3",
        "--set", "slope_added=4", "--most", 6, "--json",
    )  # fmt: skip
    assert result.code == 0, result.err
    for world in result.json["worst"]:
        assert 0.2 <= world["values"]["friction_factor"] <= 0.3
        assert world["values"]["slope_added"] == 4.0
        assert world["values"]["angle_delay"] in (1.0, 2.0, 3.0)
        assert set(world["values"]) == {
            "friction_factor", "efficiency_factor", "angle_delay", "slope_added",
        }  # fmt: skip


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("published:Z",), 2, "design: no published design 'Z' of fuzzy-pi"),
        (("nowhere.json",), 2, "design: cannot read nowhere.json"),
        (("bcdfghjkmnpq",), 3, "there is no job 'bcdfghjkmnpq'; pass the id of a job"),
        (("published:A", "--range", "friction_factor"), 2, "range: 'friction_factor' is not NAME="),
        (("published:A", "--range", "friction_factor=1"), 2, "range: 'friction_factor=1' is not"),
        (("published:A", "--range", "hat=0:1"), 2, "variables: unknown variable 'hat'"),
        (("published:A", "--set", "slope_added=steep"), 2, "fixed: slope_added"),
        (
            ("published:A", "--set", "angle_delay=1.4"),
            2,
            "fixed: angle_delay: 1.4 in world 0 is no",
        ),
        (("published:A", "--scenarios", "moon"), 2, "scenarios.0: unknown scenario 'moon'"),
        (("published:A", "--log", "walk.npz"), 2, "log: requires --replay"),
        (("published:A", "--replay", 100_000), 2, "99999"),
        (("published:A", "--preference", "D"), 2, "preference: "),
    ],
)
def test_bad_input_names_the_option(
    tmp_path: Path, options: tuple[str, ...], code: int, words: str
) -> None:
    db = tmp_path / "jobs.db"
    if code == 3:
        assert run_command("submit", "--iterations", 1, "--db", db).code == 0
    result = run_command("certify", *options, "--db", db)
    assert (result.code, words in result.err) == (code, True), result.err
    assert code == 3 or not db.exists()


@pytest.mark.thorough(
    "test_resumed_job_equals_one_never_killed",
    "test_the_same_command_simulates_only_new_worlds",
)
@pytest.mark.slow
def test_a_killed_and_continued_certificate_has_the_same_results(files: Path) -> None:
    asked = ("--worlds", "240", "--engine", "mujoco", "--json")
    whole = certify(files, *asked).json
    assert whole["engines"]["mujoco"]["scenarios"]["short"]["theirs"] == "ok"
    killed = [*arguments(files)[:-1], str(files / "killed.db"), *asked]
    for number in (signal.SIGKILL, signal.SIGINT):
        process = ForkedCommand(*killed, start_new_session=True)
        for line in output(process.stderr):
            if re.match(r"\d+(/\d+)? iterations", line):
                break
        os.killpg(process.pid, number)
        _, rest = process.communicate(timeout=60)
        assert process.returncode != 0
        if number == signal.SIGINT:
            assert "to resume, run the same command" in rest
    last = run_command(*killed)
    assert last.code == 0, last.err
    assert {**last.json, **_changing(whole)} == whole


def _changing(document: dict[str, Any]) -> dict[str, Any]:
    """What names the job, which is another."""
    return {key: document[key] for key in ("job", "worst")}
