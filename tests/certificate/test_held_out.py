"""Held-out walks of a robot that does not ship: like its own, reachable, each another one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.kinds.certificate import (
    CASES,
    LEAST,
    certificate_scenarios,
    certificate_walks,
)
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import HELD_OUT, SCENARIOS, Scenario
from tests.certificate.examples import PI, small
from tests.examples.commands import run_command
from tests.examples.robots import FAST, SLOW, robot_folder
from tests.examples.walks import quadruped_files

QUADRUPED = quadruped_files()


def own(**changes: Any) -> Scenario:
    return Scenario.model_validate(FAST | changes)


def held_out(*tuned: Scenario, **design: float) -> dict[str, Scenario]:
    found = certificate_scenarios(tuned, QUADRUPED, design)
    assert found[: len(tuned)] == tuned
    return {scenario.name: scenario for scenario in found[len(tuned) :]}


def test_they_are_variations_of_the_fastest_scenario() -> None:
    found = held_out(own(), own(name="slow", stride=0.06))
    assert {
        name: {k: v for k, v in walk.model_dump().items() if v != own().model_dump()[k]}
        for name, walk in found.items()
    } == {
        "fast-turn-left": {"name": "fast-turn-left", "turn": -0.5},
        "fast-downhill": {"name": "fast-downhill", "slope": -5.0},
        "fast-loaded": {
            "name": "fast-loaded",
            "load": pytest.approx(load_robot(QUADRUPED).mass / 4, abs=1e-3),
        },
        "fast-faster": {"name": "fast-faster", "cycle_time": 1.6},
        "fast-uphill": {"name": "fast-uphill", "slope": 5.0},
        "fast-slower": {"name": "fast-slower", "cycle_time": 2.5},
    }


def test_there_are_eight_scenarios_and_at_least_two_are_held_out() -> None:
    many = tuple(own(name=f"walk-{k}", stride=0.08 - 0.001 * k) for k in range(7))
    assert len(held_out(own())) == CASES - 1
    assert list(held_out(*many)) == ["walk-0-turn-left", "walk-0-downhill"]
    assert len(held_out(*many)) == LEAST


def test_a_walk_that_was_tuned_under_another_name_is_not_held_out() -> None:
    assert "fast-turn-left" not in held_out(own(), own(name="leftwards", turn=-0.5))
    assert "fast-downhill" not in held_out(own(), own(name="fast-downhill", slope=-20.0))


def test_a_pace_that_the_design_chooses_is_not_changed() -> None:
    found = held_out(own(), cycle_time=1.8)
    assert found.keys() == {
        "fast-turn-left", "fast-downhill", "fast-loaded", "fast-uphill", "fast-turn-right"
    }  # fmt: skip


def test_unreachable_or_invalid_scenarios_are_left_out() -> None:
    # No walk of half a metre from the body's axis can be begun.
    assert held_out(own(radius=0.5)) == {}
    # A shorter cycle than 0.2 s is none.
    assert "fast-faster" not in held_out(own(cycle_time=0.2))


def test_shipped_robots_have_the_presets() -> None:
    tuned = (own(),)
    found = certificate_walks(tuned, "szabadka2", PI)
    assert found.keys() == {"scenarios"}
    assert {walk.name for walk in found["scenarios"][1:]} < {walk.name for walk in HELD_OUT}
    assert certificate_scenarios(SCENARIOS)[:6] == SCENARIOS


def test_a_spec_says_which_of_its_scenarios_are_held_out() -> None:
    assert small(held_out=["uphill"]).held_out_names == ("uphill",)
    assert small().held_out_names == ()
    with pytest.raises(ValidationError, match="held_out: 'hidden' is not among the scenarios"):
        small(held_out=["hidden"])


@pytest.mark.slow
def test_a_design_is_certified_in_the_walks_and_by_the_preference_of_the_robots_folder(
    tmp_path: Path,
) -> None:
    folder = robot_folder(tmp_path / "dog")
    asked = (
        "certify", '{"P": 0.4, "I": 0.1}', "--robot", folder, "--worlds", 2, "--evaluator",
        "in-process", "--db", tmp_path / "jobs.db", "--json",
    )  # fmt: skip
    found = run_command(*asked)
    assert found.code == 0, found.err
    marked = {name: walk["held_out"] for name, walk in found.json["scenarios"].items()}
    assert list(marked.items())[:3] == [("slow", False), ("fast", False), ("fast-turn-left", True)]
    assert len(marked) == CASES and sum(marked.values()) == CASES - 2
    assert found.json["controller"] == "pi"
    assert found.json["preference"] == PREFERENCES["C"].model_dump(mode="json")
    # It goes on where it was, and held-out walks can be chosen by their names.
    assert run_command(*asked).json["job"] == found.json["job"]
    few = run_command(*asked, "--scenarios", f"{SLOW['name']},fast-uphill")
    assert {name: walk["held_out"] for name, walk in few.json["scenarios"].items()} == {
        "slow": False,
        "fast-uphill": True,
    }
