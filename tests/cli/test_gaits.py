"""`gaitswarm gaits`, and gaits of leg groups in designs, jobs and their files."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.sim.gait.gaits import GAITS
from tests.cli.conftest import Gaitswarm, WriteJson
from tests.examples.paths import QUADRUPED, ROOT

CRAWL = ("--robot", str(QUADRUPED), "--scenario", str(QUADRUPED / "crawl.json"))
SCENARIO: dict[str, Any] = {
    "name": "short",
    "cycle_time": 1.0,
    "cycles": 1,
    "radius": 0.16,
    "hip_height": 0.15,
}


def test_all_gaits_are_listed_with_those_that_suit_the_robot(gaitswarm: Gaitswarm) -> None:
    view = gaitswarm("gaits", *CRAWL, "--json").json
    assert (view["robot"], view["scenario"]) == ("quadruped", "crawl")
    items = {item["name"]: item for item in view["items"]}
    assert list(items) == ["own", *GAITS]
    assert {name for name, item in items.items() if not item["suits"]} == {"tripod", "ripple"}
    assert items["own"]["planned"]["stable"] and not items["trot"]["planned"]["stable"]
    assert items["trot"]["planned"]["fewest_feet"] == 2
    assert items["crawl"]["lags"] == items["own"]["lags"]
    assert items["tripod"]["planned"] is None and items["tripod"]["lags"] == {}
    for item in items.values():
        for leg, columns in item["support"].items():
            # A foot comes down where its support begins.
            begin = round(len(columns) * item["lags"][leg]) % len(columns)
            assert columns[begin] == "#" and columns[begin - 1] == "."
    text = gaitswarm("gaits", *CRAWL).out
    assert all(name in text for name in items) and "for 6 legs" in text


def test_a_custom_duty_factor_is_planned(gaitswarm: Gaitswarm) -> None:
    crawl = gaitswarm("gaits", "crawl", *CRAWL, "--duty-factor", "0.9", "--json").json
    assert [item["planned"]["duty_factor"] for item in crawl["items"]] == pytest.approx([0.9])
    refused = gaitswarm("gaits", "crawl", *CRAWL, "--duty-factor", "1.5")
    assert refused.code == 2 and "duty-factor" in refused.err
    assert "trot, pace" in gaitswarm("gaits", "gallop").err


def test_diagrams_in_the_documentation_equal_the_output(gaitswarm: Gaitswarm) -> None:
    text = (ROOT / "docs" / "gaits.md").read_text(encoding="utf-8")
    shown = [body.split("\n", 1) for body in text.split("```console\n$ gaitswarm gaits ")[1:]]
    assert len(shown) == 2
    for arguments, printed in shown:
        words = arguments.replace("examples/quadruped", str(QUADRUPED)).split()
        assert gaitswarm("gaits", *words).out.strip() == printed.split("\n```")[0]


def test_a_design_gives_groups_of_legs_values_of_their_own(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    scenario = write_json(SCENARIO, "scenario.json")

    def walked(name: str, **gait: Any) -> Any:
        file = write_json({"P": 0.45, "I": 0.1, **gait}, name)
        options = ("--design", str(file), "--scenario", str(scenario))
        view = gaitswarm("simulate", "--controller", "pi", *options, "--json").json
        return view["scenarios"]["short"]

    own: dict[str, float | str] = {"stride[front]": 0.06, "gait": "own"}
    plain, alike = walked("a.json"), walked("b.json", **own)
    assert alike["objectives"] == plain["objectives"]
    assert walked("c.json", **{"stride[front]": 0.05})["objectives"] != plain["objectives"]
    wave = walked("d.json", gait="wave", duty_factor=0.85)
    assert wave["gait"]["fewest_feet"] == 5 and wave["gait"]["stable"]
    nose = write_json({"P": 0.45, "I": 0.1, "stride[nose]": 0.05}, "e.json")
    refused = gaitswarm("simulate", "--controller", "pi", "--design", str(nose))
    assert refused.code == 2
    assert "no such group of legs; it has all, left, right, front" in refused.err


def test_simulate_reports_static_stability(gaitswarm: Gaitswarm, write_json: WriteJson) -> None:
    scenario = write_json(SCENARIO, "scenario.json")
    options = ("--controller", "pi", "--design", "published:validation")
    text = gaitswarm("simulate", *options, "--scenario", str(scenario)).out
    assert "short: duty 0.56, at least 3 supporting feet, stability margin" in text


def test_a_job_searches_groups_of_legs_and_begins_with_their_values_from_a_file(
    gaitswarm: Gaitswarm, write_json: WriteJson, tmp_path: Path
) -> None:
    names = ["P", "stride[front]", "start_phase[left_rear]"]
    spec = write_json(
        {
            "controller": "pi",
            "scenarios": [SCENARIO],
            "variables": [
                "P",
                {"name": "stride[front]", "low": 0.04, "high": 0.08},
                "start_phase[left_rear]",
                {"name": "gait", "kind": "categorical", "choices": ["tripod", "ripple"]},
            ],
            "fixed": {"I": 0.1, "height[hind]": 0.03},
            "iterations": 2,
            "optimizer": {"name": "pso", "particles": 3},
        },
        "spec.json",
    )
    start = tmp_path / "start.csv"
    row = {**dict(zip(names, ["0.4", "0.05", "0.05"], strict=True)), "gait": "ripple"}
    start.write_text(",".join(row) + "\n" + ",".join(row.values()) + "\n", encoding="utf-8")
    options = ("--db", str(tmp_path / "jobs.db"))
    job = gaitswarm(
        *("optimize", "--spec", str(spec), "--start-from", str(start), *options, "--json"),
        *("--evaluator", "in-process"),
    ).json
    exported = tmp_path / "designs.csv"
    gaitswarm("export", job["id"], *options, "--output", str(exported))
    with exported.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    column = next(name for name in rows[0] if name.endswith("stride[front]"))
    assert float(rows[0][column]) == pytest.approx(0.05)
    assert {float(row[column]) for row in rows} != {0.05}


@pytest.mark.parametrize(
    ("changes", "field", "said"),
    [
        ({"variables": ["P", "stride[nose]"]}, "variables", "no such group of legs"),
        ({"fixed": {"I": 0.1, "gait": "trot"}}, "fixed", "trot is for 4 legs"),
        ({"variables": ["P", "fir_ms[front]"]}, "variables", "unknown variable 'fir_ms[front]'"),
        ({"scenarios": [SCENARIO | {"gait": "trot"}]}, "scenarios.0", "trot is for 4 legs"),
        (
            {
                "variables": [
                    "P",
                    {"name": "gait", "kind": "categorical", "choices": ["wave", "crawl"]},
                ]
            },
            "variables",
            "crawl is for 4 legs",
        ),
    ],
)
def test_a_job_of_a_gait_or_group_that_the_robot_cannot_have_is_refused(
    gaitswarm: Gaitswarm,
    write_json: WriteJson,
    changes: dict[str, Any],
    field: str,
    said: str,
) -> None:
    spec = {"controller": "pi", "scenarios": [SCENARIO], "variables": ["P"], "fixed": {"I": 0.1}}
    refused = gaitswarm("optimize", "--spec", str(write_json(spec | changes)))
    assert refused.code == 2 and field in refused.err and said in refused.err
