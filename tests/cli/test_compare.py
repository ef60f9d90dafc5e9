"""`gaitswarm compare`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gaitswarm.cli.main import run
from gaitswarm.sim.scenario import find_scenario

pytestmark = pytest.mark.slow


def test_drives_are_compared_side_by_side(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    picture = tmp_path / "drives.png"
    arguments = ["compare", "2011", "pi", "--scenario", "1,2", "--json", "--plot", str(picture)]
    assert run(arguments) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [(r["drive"], r["scenario"]) for r in rows] == [
        ("2011", "normal-fast"),
        ("pi", "normal-fast"),
        ("2011", "normal-slow"),
        ("pi", "normal-slow"),
    ]
    assert all(r["status"] == "ok" for r in rows)
    for row in rows:
        walk = find_scenario(row["scenario"])
        # A foot that does not slip pushes the body on by a stride in each support.
        commanded = walk.stride / (walk.duty_factor * walk.cycle_time)
        assert 0.8 < row["speed"] / commanded < 1.05
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_design_file_is_compared_on_a_variant_of_the_robot(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    design = tmp_path / "pid.json"
    design.write_text('{"P": 0.4, "I": 0.1, "D": 0.002}')
    variant = '{"contact_law": "stick"}'
    arguments = ["compare", "pi", f"pid:{design}", "--scenario", "1", "--robot", variant]
    assert run(arguments) == 0
    assert f"pid:{design}"[:20] in capsys.readouterr().out.replace("\n", "")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["compare", "2012"], "2012"),
        (["compare", "mpc:design.json"], "mpc"),
        (["compare", "--scenario", "moon"], "moon"),
        (["compare", "--robot", '{"backlash": 3}'], "robot.backlash"),
        (["compare", "--robot", "{"], "robot"),
    ],
)
def test_invalid_input_is_exit_code_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    assert said in capsys.readouterr().err
