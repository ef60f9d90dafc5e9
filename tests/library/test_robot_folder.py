"""A job of a robot's folder in Python is that of the command with the same folder."""

from __future__ import annotations

from pathlib import Path

import gaitswarm
from gaitswarm.specs import chosen_spec
from tests.examples.robots import robot_folder


def test_a_robots_folder_says_what_its_jobs_have_unless_an_argument_does(tmp_path: Path) -> None:
    folder = robot_folder(tmp_path / "dog", variables=[{"name": "P", "low": 0.2, "high": 0.6}, "I"])
    spec = chosen_spec(None, {"robot": folder})
    assert isinstance(spec, gaitswarm.JobSpec)
    assert (spec.controller, spec.preference, spec.case_names) == ("pi", "C", ("slow", "fast"))
    assert spec.design_space().variables[0].low == 0.2
    other = chosen_spec({"preference": "B"}, {"robot": folder, "controller": "pid"})
    assert isinstance(other, gaitswarm.JobSpec)
    # Variables of another controller are none of this one's.
    assert (other.controller, other.preference, other.variables) == ("pid", "B", None)
    assert other.case_names == ("slow", "fast")
