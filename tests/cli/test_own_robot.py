"""Commands with other robots than the default, including custom ones."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from gaitswarm.cli.main import run
from tests.examples.paths import QUADRUPED

pytestmark = pytest.mark.slow

CRAWL = str(QUADRUPED / "crawl.json")
SIMULATE = ["simulate", "--controller", "pi", "--design", "published:validation", "--json"]


def edited(tmp_path: Path, file: str, old: str, new: str) -> Path:
    """The quadruped's folder, copied, with a text replaced in one of its files."""
    folder = tmp_path / "robot"
    if not folder.exists():
        shutil.copytree(QUADRUPED, folder)
    path = folder / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return folder


def test_a_quadruped_crawls(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*SIMULATE, "--robot", str(QUADRUPED), "--scenario", CRAWL]) == 0
    walked = json.loads(capsys.readouterr().out)["scenarios"]["crawl"]
    assert walked["status"] == "ok"
    # Stride over support: 0.08 m in 0.8 of 2 s.
    assert 1.0 / walked["objectives"]["reciprocal_speed"] == pytest.approx(0.05, rel=0.1)


def test_the_identified_robot_walks_by_its_name_and_as_a_variant(
    capsys: pytest.CaptureFixture[str],
) -> None:
    walks = []
    for robot in (
        "szabadka2",
        "szabadka2-identified",
        '{"name": "szabadka2-identified", "planned_soles": "own"}',
    ):
        assert run([*SIMULATE, "--robot", robot, "--scenario", "1"]) == 0
        walks.append(json.loads(capsys.readouterr().out)["scenarios"]["normal-fast"])
    assert [walk["status"] for walk in walks] == ["ok"] * 3
    assert len({walk["objectives"]["energy"] for walk in walks}) == 3


def test_a_job_with_a_quadruped_is_stored_with_its_robot(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    database = str(tmp_path / "jobs.db")
    arguments = ["optimize", "--robot", str(QUADRUPED), "--scenarios", CRAWL, "--json"]
    arguments += ["--controller", "pi", "--iterations", "2", "--particles", "3"]
    assert run([*arguments, "--db", database, "--evaluator", "in-process"]) == 0
    job = json.loads(capsys.readouterr().out)
    assert job["state"] == "succeeded"
    assert job["best"]["scenarios"]["crawl"]["status"] == "ok"
    assert "quadruped" in job["spec"]["robot"]["toml"]


def test_a_scenario_out_of_its_reach_is_refused_by_leg_and_millimetres(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    far = tmp_path / "far.json"
    far.write_text('{"name": "far", "cycle_time": 2, "radius": 0.5, "hip_height": 0.16}')
    assert run([*SIMULATE, "--robot", str(QUADRUPED), "--scenario", str(far)]) == 2
    result = capsys.readouterr().err
    assert "far" in result
    assert "mm" in result


@pytest.mark.parametrize(
    ("line", "broken", "said"),
    [
        ("stiffness = 10000.0", "stiffness = -5.0", ("line 50", "contact.stiffness", "[N/m]")),
        ('motor = "2232SR"', 'motor = "9999"', ("actuators.coxa.motor", "9999")),
        ("voltage = 11.6", 'voltage = "high"', ("supply.voltage", "[V]")),
        ("counts = 511", "counts = = 511", ("line 39",)),
        ("counts = 511", "counts = 0", ("line 39: pwm.counts", "(full scale [counts])")),
        ('name = "left_rear"', 'name = "tail"', ("line 72: leg 'tail'", "no joint 'tail_coxa'")),
        ("phase = 0.75", "phase = 7.5", ("legs.1.phase", "line 64", "[1]")),
        ("phase = 0.75", f"{'.'.join('a' * 99)} = 1", ("robot.toml, line 64", "nested too deep")),
    ],
)
def test_an_error_in_a_robot_file_names_field_line_and_unit(
    line: str,
    broken: str,
    said: tuple[str, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = edited(tmp_path, "robot.toml", line, broken)
    assert run([*SIMULATE, "--robot", str(folder), "--scenario", CRAWL]) == 2
    result = capsys.readouterr().err
    for part in said:
        assert part in result


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        (
            "no-such-robot",
            "unknown robot 'no-such-robot'; known are szabadka2, szabadka2-identified",
        ),
        ('{"contact_law": "glue"}', "robot.contact_law: must be 'linear_zone'"),
        (str(QUADRUPED.parent), "is not a robot's folder"),
        ('{"name": ' * 5000, "robot: is nested too deeply"),
    ],
)
@pytest.mark.parametrize("command", [SIMULATE, ["optimize", "--iterations", "1", "--json"]])
def test_an_unknown_robot_is_named(
    robot: str, said: str, command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*command, "--robot", robot]) == 2
    assert said in capsys.readouterr().err


def test_a_leg_without_its_joints_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = edited(tmp_path, "robot.toml", "left_rear", "tail")
    assert run([*SIMULATE, "--robot", str(folder), "--scenario", CRAWL]) == 2
    assert "leg 'tail': robot.urdf has no joint 'tail_coxa'" in capsys.readouterr().err


def test_a_leg_joint_with_a_turned_frame_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    turned = '<origin rpy="0 0 0.5" xyz='
    folder = edited(tmp_path, "robot.urdf", "<origin xyz=", turned)
    assert run([*SIMULATE, "--robot", str(folder), "--scenario", CRAWL]) == 2
    assert "its frame is rotated against the body's; give leg" in capsys.readouterr().err
