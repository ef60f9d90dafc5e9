"""`gaitswarm tournament` from beginning to end."""

from __future__ import annotations

import os
import re
import signal
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm.cli.tournament.report
from gaitswarm.cli.tournament.plan import PRESETS, Size, tournament_jobs
from gaitswarm.cli.tournament.runs import read_runs
from gaitswarm.services.optimizer.jobs.kinds.problem import TuningProblem
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.tournament.methods import method_names
from tests.examples.commands import Result, run_command
from tests.examples.forked import ForkedCommand
from tests.examples.processes import output

TWO = "D4C1R0I1,D7C0R0I1"
"""A page has two pictures and one of every problem."""


def small(problems: str) -> tuple[Any, ...]:
    return ("--problems", problems, "--evaluations", 60, "--evaluator", "in-process")


def command(
    folder: Path, *options: Any, methods: str = "pso,random", problems: str = "D4C1R0I1"
) -> Result:
    return run_command(
        "tournament", "thesis", *small(problems), "--methods", methods,
        "--db", folder / "jobs.db", "--output", folder / "report", *options,
    )  # fmt: skip


def numbers(folder: Path) -> dict[tuple[str, str], tuple[bytes, bytes]]:
    return {
        (problem, method): (runs.best.tobytes(), runs.to_best.tobytes())
        for problem, by_method in read_runs(folder / "report", "output").items()
        for method, runs in by_method.items()
    }


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without pictures, which take longer than the runs."""
    monkeypatch.setattr(gaitswarm.cli.tournament.report, "_picture", lambda _: "")


def jobs(folder: Path) -> dict[str, int]:
    """Committed iterations of every job, by name."""
    with closing(sqlite3.connect(folder / "jobs.db")) as connection:
        rows = connection.execute("SELECT json_extract(spec, '$.name'), iterations FROM jobs")
        return dict(rows.fetchall())


def test_the_report_holds_what_was_measured(tmp_path: Path) -> None:
    result = command(tmp_path, "--repetitions", 4, "--json", problems=TWO)
    assert result.code == 0, result.err
    found = result.json
    runs = read_runs(tmp_path / "report", "output")
    assert list(runs) == list(found["problems"]) == ["D4C1R0I1", "D7C0R0I1"]
    for problem, by_method in runs.items():
        for method, mine in by_method.items():
            told = found["problems"][problem]["methods"][method]
            assert told["runs"] == len(mine) == 4
            assert told["solved"] == int((mine.final <= 1e-3).sum())
            assert told["median_best"]["60"] == np.sort(mine.final)[1]
            assert told["least"] == mine.final.min()
    assert sorted(rank["value"] for rank in found["mean_ranks"].values()) == [1.0, 2.0]
    assert found["rank_correlation"] is None

    page = Path(found["report"]).read_text(encoding="utf-8")
    assert page.count("<svg") == 2 + len(runs)
    # Nothing is loaded from elsewhere.
    assert not re.search(r"(?:src|href)\s*=\s*[\"'](?!#|data:)", page)
    best = found["problems"]["D7C0R0I1"]["methods"]["pso"]
    assert f"<td>{best['least']:.4g}</td>" in page
    assert "inertia_start: 0.7 to 1" in page  # what was drawn


@pytest.mark.usefixtures("undrawn")
def test_the_table_on_the_terminal_names_every_method_and_problem(tmp_path: Path) -> None:
    result = command(tmp_path, "--repetitions", 1, "--settings", "default", problems=TWO)
    assert result.code == 0, result.err
    for word in ("pso", "random", "D4C1R0I1", "D7C0R0I1", "mean rank", "report.html"):
        assert word in result.out


def test_the_same_command_runs_nothing_again_and_more_only_what_is_missing(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    assert command(tmp_path, "--repetitions", 2).code == 0
    first, page = numbers(tmp_path), (tmp_path / "report" / "report.html").read_bytes()
    again = command(tmp_path, "--repetitions", 2)
    assert "run 1 of" not in again.err
    assert (numbers(tmp_path), jobs(tmp_path)) == (
        first,
        {"tournament: pso": 2, "tournament: random": 2},
    )
    assert (tmp_path / "report" / "report.html").read_bytes() == page

    request.getfixturevalue("undrawn")
    more = command(tmp_path, "--repetitions", 2, methods="pso,random,ps")
    assert re.findall(r"^(\w+): run", more.err, re.MULTILINE) == ["ps", "ps"]
    assert {key: numbers(tmp_path)[key] for key in first} == first

    longer = command(tmp_path, "--repetitions", 3)
    assert sorted(re.findall(r"^(\w+): run (\d)", longer.err, re.MULTILINE)) == [
        ("pso", "3"),
        ("random", "3"),
    ]
    # The first repetitions are those of before, also when fewer are asked for again.
    assert command(tmp_path, "--repetitions", 2).code == 0
    assert numbers(tmp_path) == first


@pytest.mark.usefixtures("undrawn")
def test_settings_of_your_own_have_a_label(tmp_path: Path) -> None:
    file = tmp_path / "methods.json"
    file.write_text('{"tiny swarm": {"name": "pso", "particles": 4}}', encoding="utf-8")
    result = command(
        tmp_path, "--repetitions", 1, "--method-file", file, "--settings", "default", "--json"
    )
    assert result.code == 0, result.err
    assert set(result.json["mean_ranks"]) == {"pso", "random", "tiny swarm"}


@pytest.mark.usefixtures("undrawn")
def test_ranks_are_compared_with_those_of_an_earlier_report(tmp_path: Path) -> None:
    methods = "pso,random,ps"
    assert command(tmp_path, "--repetitions", 2, methods=methods).code == 0
    result = command(
        tmp_path, "--repetitions", 2, "--compare-with", tmp_path / "report", "--json",
        methods=methods,
    )  # fmt: skip
    correlation = result.json["rank_correlation"]
    assert set(correlation["methods"]) == {"pso", "random", "ps"}
    assert correlation["value"] == pytest.approx(1.0)
    assert correlation["low"] <= correlation["value"]


@pytest.mark.parametrize(
    ("options", "field", "words"),
    [
        (("--methods", "annealing"), "methods", "unknown 'annealing'; known are"),
        (("--methods", "pso,hype"), "methods", "hype is multi-objective; a tournament ranks"),
        (("--methods", "pso,pso"), "methods", "named twice"),
        (("--problems", "D5"), "problems", "unknown 'D5'; known are D4C0R0I0"),
        (("--settings", "mine"), "settings", "neither random nor default"),
        (("--precision", "half"), "precision", "neither single nor double"),
        (("--compare-with", "nowhere"), "compare-with", "cannot read"),
        (("--method-file", "nowhere.json"), "method-file", "cannot read"),
    ],
)
def test_bad_input_names_the_option(
    tmp_path: Path, options: tuple[str, ...], field: str, words: str
) -> None:
    result = run_command("tournament", "thesis", "--db", tmp_path / "jobs.db", *options)
    assert result.code == 2
    assert f"{field}: " in result.err and words in result.err
    assert not (tmp_path / "jobs.db").exists()


@pytest.mark.thorough(
    "test_resumed_job_equals_one_never_killed",
    "test_the_same_command_runs_nothing_again_and_more_only_what_is_missing",
)
@pytest.mark.slow
def test_a_tournament_that_is_killed_and_goes_on_has_the_same_numbers(tmp_path: Path) -> None:
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    methods = "pso,random,ps"
    for folder in (whole, killed):
        folder.mkdir()
    assert command(whole, "--repetitions", 8, methods=methods, problems=TWO).code == 0

    arguments = (
        "tournament", "thesis", *map(str, small(TWO)), "--methods", methods,
        "--repetitions", "8", "--db", str(killed / "jobs.db"), "--output", str(killed / "report"),
    )  # fmt: skip
    for number in (signal.SIGKILL, signal.SIGINT):
        process = ForkedCommand(*arguments, start_new_session=True)
        for line in output(process.stderr):
            if ": run " in line:
                break
        os.killpg(process.pid, number)
        _, rest = process.communicate(timeout=60)
        assert process.returncode != 0
        if number == signal.SIGINT:
            assert "the same command goes on" in rest
    assert sum(jobs(killed).values()) < 24
    last = run_command(*arguments)
    assert last.code == 0, last.err
    assert numbers(killed) == numbers(whole)


def test_methods_that_cannot_take_part_are_in_no_preset() -> None:
    for preset in PRESETS.values():
        assert set(preset.methods) <= set(method_names())


def test_the_robot_races_on_chapter_4_and_on_chapter_3_with_its_gait() -> None:
    preset = PRESETS["robot"]
    size = Size(repetitions=1, evaluations=30, seed=1, settings="default")
    spec = tournament_jobs({"random": "random"}, preset.problems, size, "single")["random"]
    jobs = {p.name: p.job for p in spec.problems if isinstance(p, TuningProblem)}
    assert [job.resolved_preference() for job in jobs.values()] == [
        *(PREFERENCES["A"], PREFERENCES["B"], PREFERENCES["C"]),
        *2 * [PREFERENCES["chapter-3"]],
    ]
    assert [len(job.scenarios) for job in jobs.values()] == [6, 6, 6, 1, 1]
    # Tables 4.4, 3.2 and 3.4: nine, or a controller's and five of the gait.
    assert [p.space.dimension for p in spec.problems] == [9, 9, 9, 2 + 5, 12 + 5]
    assert {job.precision for job in jobs.values()} == {"single"}


@pytest.mark.usefixtures("undrawn")
def test_a_race_on_the_robot_is_reported_like_any_other(tmp_path: Path) -> None:
    result = run_command(
        "tournament", "robot", "--methods", "pso,random", "--problems", "chapter-3.pi",
        "--evaluations", 10, "--repetitions", 2, "--evaluator", "in-process", "--json",
        "--db", tmp_path / "jobs.db", "--output", tmp_path / "report",
    )  # fmt: skip
    assert result.code == 0, result.err
    (problem,) = result.json["problems"].values()
    # Without a target of its own: 1 % above the least value.
    least = min(method["least"] for method in problem["methods"].values())
    assert problem["target"] == pytest.approx(1.01 * least)
    assert sum(method["solved"] for method in problem["methods"].values()) >= 1
