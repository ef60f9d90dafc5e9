"""The benchmarks run; what they say is for people to judge."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import import_module
from itertools import product
from typing import Any

import pytest

from gaitswarm.sim.assembly import PHYSICS_RATE
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.simulate import lanes, prepare
from tests.examples.processes import python
from tests.robots.known import QUADRUPEDS, urdf_of

pytestmark = pytest.mark.thorough("benchmarks, which no job depends on")

Report = Callable[..., Any]


@pytest.fixture
def report(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Report:
    """The document that a benchmark prints, run in this process."""

    def run(name: str, *options: str) -> Any:
        module = import_module(f"benchmarks.{name}")
        monkeypatch.setattr("sys.argv", [name, *options, "--json"])
        module.main()
        return json.loads(capsys.readouterr().out)

    return run


@pytest.mark.slow
def test_the_physics_benchmark_tells_ratios(report: Report) -> None:
    rows = report("physics", "--rounds", "1")
    assert len(rows) == 3
    for row in rows:
        assert 0.0 < row["fastest"] <= row["us_per_step"]
        ratio = row["us_per_step"] / rows[0]["us_per_step"]
        assert row["times_the_kernel"] == pytest.approx(ratio)
        # A step is 0.4 ms of the robot's time.
        assert row["real_time_factor"] == pytest.approx(400.0 / row["us_per_step"])


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
def test_the_simulator_benchmark_tells_speed_lanes_and_backend(
    report: Report, precision: Precision
) -> None:
    measured = report("simulator", "--repeats", "1", "--precision", precision)
    assert (measured["backend"], measured["lanes"]) == (prepare(), lanes(precision))
    assert measured["precision"] == precision
    assert 0.9 < measured["lane_use"] <= 1.0
    step = measured["us_per_step_per_walker"]
    assert measured["real_time_factor_per_core"] == pytest.approx(1e6 / (step * PHYSICS_RATE))


@pytest.mark.slow
def test_the_engines_benchmark_says_what_each_contestant_computes_and_what_is_timed(
    report: Report,
) -> None:
    rows = report("engines", "--rounds", "1")["rows"]
    assert {row["figure"] for row in rows} == {"throughput", "latency", "both"}
    assert all(row["computes"] and 0.0 < row["fastest"] <= row["us_per_step"] for row in rows)
    speed = {(row["what"], row["figure"]): row["us_per_step"] for row in rows}
    for what, figure in speed:
        if figure == "throughput":
            assert speed[what, "throughput"] < speed[what, "latency"]
    # A shorter step makes a second of the robot's time cost more, not a step.
    for row in rows:
        assert row["real_time_factor"] == pytest.approx(1e6 / row["rate"] / row["us_per_step"])
        ratio = rows[0]["real_time_factor"] / row["real_time_factor"]
        assert row["times_the_kernel"] == pytest.approx(ratio)
    rates = {row["rate"] for row in rows if "its own contacts" in row["what"]}
    assert rates == {2_500, 5_000, 10_000}


@pytest.mark.slow
def test_the_accuracy_benchmark_finds_our_step_nearer_to_a_fine_one_than_mujocos(
    report: Report,
) -> None:
    ours, mujocos = report("step_accuracy", "--rates", "2500")
    assert (ours["rate"], mujocos["rate"]) == (2_500, 2_500)
    assert max(ours["percent"]) < max(mujocos["percent"]) < 5.0


@pytest.mark.slow
def test_the_history_benchmark_reads_a_store_of_its_own(report: Report) -> None:
    found = report("history", "--jobs", "8", "--iterations", "20", "--repeats", "1")
    assert found["evaluations"] == 500
    assert found["seconds"]
    assert all(0.0 < seconds < 60.0 for seconds in found["seconds"].values())


@pytest.mark.slow
def test_the_start_up_benchmark_tells_how_long_people_wait(
    report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.startup.HELP", (["db", "backup"],))
    seconds = report("startup", "--rounds", "1", "--iterations", "1")
    assert "gaitswarm db backup --help" in seconds
    assert all(0.0 < waited < 120.0 for waited in seconds.values())
    for cache in ("warm", "cold"):
        assert seconds[f"optimize, {cache}: first walk"] < seconds[f"optimize, {cache}: result"]


@pytest.mark.slow
def test_the_benchmark_of_known_walks_tells_what_the_cache_adds(report: Report) -> None:
    seconds = report("known_walks", "--rows", "1000", "--rounds", "2")
    parts = seconds["keys"] + seconds["query"] + seconds["index"]
    assert seconds["added"] == pytest.approx(parts)


@pytest.mark.slow
def test_the_trade_offs_benchmark_judges_as_many_designs_by_every_method(report: Report) -> None:
    methods = ["hype", "cma-es", "random", "NSGA-II, 25", "NSGA-III, 35"]
    rows = report(
        *("trade_offs", "--seeds", "1", "--evaluations", "50", "--methods", ";".join(methods))
    )
    assert [row["method"] for row in rows] == methods
    for row in rows:
        assert 0.0 < row["hypervolume_early"] == row["hypervolume"] < 1.0
        # The published optimum A is worth 20.72.
        assert 16.0 < row["A"] < 25.0


@pytest.mark.slow
def test_the_benchmark_of_legs_tells_how_much_faster_fewer_are(report: Report) -> None:
    rows = {(row["robot"], row["what"]): row for row in report("legs", "--rounds", "1")}
    assert set(rows) >= set(product(("hexapod", "quadruped"), ("walks", "stands")))
    for (_, what), row in rows.items():
        ratio = rows["hexapod", what]["us_per_step"] / row["us_per_step"]
        assert row["times_as_fast"] == pytest.approx(ratio)


@pytest.mark.slow
def test_the_benchmark_of_known_robots_runs_the_users_commands(report: Report) -> None:
    urdf_of(QUADRUPEDS["a1"])
    row = report("known_robots", "a1", "--iterations", "2", "--particles", "4")["a1"]
    assert row["designs"] == 8 and 0 < row["upright"] <= 8
    assert row["standing"] == pytest.approx(1.0, rel=0.01)
    assert {walk["status"] for walk in row["walks"].values()} == {"ok"}
    assert all(walk["speed"] > 0.0 for walk in row["walks"].values())


@pytest.mark.slow
def test_the_benchmark_of_statement_orders_compares_the_same_results(
    report: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.statement_order.ROBOTS", ("szabadka2",))
    monkeypatch.setattr("benchmarks.statement_order.PRECISIONS", ("double",))
    rows = report("statement_order", "--rounds", "1")
    assert rows
    for row in rows:
        assert row["ratio"] == pytest.approx(row["as_derived"] / row["ordered"])


@pytest.mark.slow
def test_the_scale_benchmark_counts_the_costs_of_tasks_and_iterations() -> None:
    """In a process of its own, as a process has one connection to Ray."""
    options = ("--slots", "4", "--nodes", "1", "--cpus", "2", "--designs", "5", "--json")
    done = python("-m", "benchmarks.scale", *options)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    (tasks,), (iterations,) = found["tasks"], found["iterations"]
    assert tasks["tasks"] == 12
    assert min(tasks["evaluator_ms"], iterations["iteration_ms"]) > 0.0


@pytest.mark.slow
def test_a_profile_reports_shares_of_the_slots_time(report: Report) -> None:
    brief = ("--particles", "2", "--iterations", "2", "--cpus", "1")
    found = report("profile", "--evaluator", "in-process", *brief)
    assert (found["slots"], found["walks"]) == (1, 12)
    assert found["walks_per_second"] == pytest.approx(12 / found["seconds"])
    assert 0.0 < found["lane_use"] <= 1.0
    shares = found["shares"]
    assert sum(shares.values()) == pytest.approx(1.0)
    assert min(shares.values()) >= 0.0
    assert all(shares[name] > 0.0 for name in ("physics", "tables", "preparation", "store"))
