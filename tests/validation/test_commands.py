"""`gaitswarm validate`, and synthetic logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.cli.main import run
from gaitswarm.cli.validation import write_report
from gaitswarm.sim.measurement.measured_files import parse_npz
from gaitswarm.sim.measurement.measured_log import MeasuredLog, synchronise
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.sim.validation import Tolerance, compare_synchronised
from scripts.measured_logs import format_measured_log
from tests.examples.commands import Result, run_command, synthesize
from tests.examples.paths import QUADRUPED
from tests.validation.conftest import TwoWalks
from tests.validation.walks import compare

pytestmark = pytest.mark.slow

DESIGN = ("--design", "published:A", "--scenario", "1", "--cycles", 1)
WALK = (*DESIGN, "--robot", "szabadka2")


@pytest.fixture
def measured(walks: TwoWalks, tmp_path: Path) -> Path:
    path = tmp_path / "walk.csv"
    path.write_text(walks.text, encoding="utf-8")
    return path


def validate(path: Path, *options: object) -> Result:
    return run_command("validate", path, *WALK, *options)


def test_synthesize_writes_the_log_of_the_seed(walks: TwoWalks, tmp_path: Path) -> None:
    path = tmp_path / "made.csv"
    done = synthesize(*WALK, "--seed", 7, "-o", path)
    assert done.code == 0, done.err
    assert path.read_text(encoding="utf-8") == walks.text
    assert "SYNTHETIC" in done.err


def test_the_robot_of_a_log_is_that_of_its_validation_by_default(tmp_path: Path) -> None:
    path = tmp_path / "made.npz"
    done = synthesize(*DESIGN, "-o", path)
    assert done.code == 0, done.err
    made = parse_npz(path.read_bytes(), load_robot(DEFAULT_ROBOT))
    assert made.metadata["robot"] == DEFAULT_ROBOT
    shown, named = (
        run_command("validate", path, *DESIGN, *robot, "--json")
        for robot in ((), ("--robot", DEFAULT_ROBOT))
    )
    assert shown.code == 0, shown.err
    assert shown.json == named.json
    assert "desired angles differ" not in shown.err


def test_the_table_shows_links_units_and_classes(measured: Path) -> None:
    shown = validate(measured)
    assert shown.code == 0, shown.err
    for text in ("q_D [rad]", "I_M [A]", "U_S [V]", "a_BODY [g]", "link 3", "RMAE", "green"):
        assert text in shown.out
    assert "0.124 s later" in shown.out
    assert "not validated; passed: q_D\nU_P failed (a digital signal: this ends it)" in shown.out
    assert "A of the battery" in shown.out
    assert "SYNTHETIC" in shown.err


def test_json_is_the_whole_comparison(walks: TwoWalks, measured: Path) -> None:
    shown = validate(measured, "--json")
    assert shown.code == 0, shown.err
    expected = compare(walks.synthetic, walks.simulated, walks.scenario.cycle_time)
    assert shown.json == expected.model_dump(mode="json")


def test_repeats_give_confidence_intervals(walks: TwoWalks, measured: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text(format_measured_log(walks.simulated), encoding="utf-8")
    shown = validate(measured, "--repeat", other)
    assert shown.code == 0, shown.err
    assert "CONF" in shown.out
    # One of the two measurements is the simulated walk itself.
    assert "inside" in shown.out
    assert "outside" not in shown.out


def of_one_leg(log: MeasuredLog) -> MeasuredLog:
    """Return the log of the first leg alone."""
    by_joint = ("desired_angle", "control_voltage", "joint_angle", "current", "potentiometer")
    signals: dict[str, Any] = {name: getattr(log, name)[:, :3] for name in by_joint}
    assert log.supply is not None
    joints, legs, supply = log.joints[:3], log.legs[:1], log.supply[:, :1]
    return replace(
        log, joints=joints, potentiometer_joints=joints, legs=legs, supply=supply, **signals
    )


def test_the_report_has_tables_and_pictures(walks: TwoWalks, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "report"
    logs = of_one_leg(walks.synthetic), of_one_leg(walks.simulated)
    pair = synchronise(*logs, walks.scenario.cycle_time)
    report = write_report(folder, compare_synchronised(pair), pair, {"scenario": "normal-fast"})
    text = report.read_text(encoding="utf-8")
    assert "| scenario | normal-fast |" in text
    pictures = {"rmae.png", "angles.png", "currents.png", "spectra.png", "maps.png", "battery.png"}
    assert {path.name for path in folder.iterdir()} == pictures | {"report.md"}
    for name in pictures:
        assert f"]({name})" in text
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    assert "SYNTHETIC" in text
    assert "| U_P [V] | right_front_tibia |" in text
    assert "- not validated; passed: q_D" in text
    for tolerance in Tolerance:
        assert tolerance.phrase in text


@pytest.mark.thorough("test_the_report_has_tables_and_pictures, of all legs")
def test_a_validation_is_reported(measured: Path, tmp_path: Path) -> None:
    done = validate(measured, "--report", tmp_path)
    assert done.code == 0, done.err
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "| U_P [V] | left_rear_tibia |" in text
    assert "published:A" in text


def test_another_scenario_than_the_measured_one_is_noticed(measured: Path) -> None:
    shown = run_command("validate", measured, *WALK, "--scenario", "5")
    assert shown.code == 0
    assert "desired angles differ" in shown.err


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("q.right_front_femur [rad]", "q.right_front_femur [deg]", "unit 'deg'; it must be 'rad'"),
        ("I_M.left_rear_tibia [A],", "", "line 10, column 'I_M.left_rear_tibia [A]': is missing"),
        ("time [s]", "time", "no unit; it must be 's'"),
    ],
)
def test_a_bad_log_is_exit_code_2_and_names_line_column_and_unit(
    measured: Path, old: str, new: str, problem: str
) -> None:
    measured.write_text(measured.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    refused = validate(measured)
    assert refused.code == 2
    assert str(measured) in refused.err
    assert "line 10, column" in refused.err
    assert problem in refused.err
    assert refused.out == ""


def test_other_bad_input_is_exit_code_2_too(measured: Path, tmp_path: Path) -> None:
    short = tmp_path / "short.csv"
    lines = measured.read_text(encoding="utf-8").splitlines()
    short.write_text("\n".join(lines[:300]), encoding="utf-8")
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"# fine\n\xff\xfe")
    for path, problem in (
        (short, "shorter than a walking cycle of 1.5 s"),
        (binary, "line 2: not UTF-8"),
        (tmp_path / "absent.csv", "cannot read"),
    ):
        refused = validate(path)
        assert (refused.code, problem in refused.err) == (2, True), refused.err
    assert (
        run_command("validate", measured, "--design", "published:A", "--scenario", "99").code == 2
    )
    assert synthesize(*WALK, "-o", tmp_path / "log.txt").code == 2
    (tmp_path / "file").write_text("")
    assert validate(measured, "--report", tmp_path / "file").code == 2


@pytest.mark.thorough("test_json_is_the_whole_comparison, of another robot")
def test_a_custom_robot_is_validated_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = str(tmp_path / "synthetic.csv")
    walk = ["--robot", str(QUADRUPED), "--scenario", str(QUADRUPED / "crawl.json")]
    walk += ["--controller", "pi", "--design", "published:validation"]
    assert synthesize(*walk, "--output", log).code == 0
    assert run(["validate", log, *walk, "--json"]) == 0
    assert "left_rear" in capsys.readouterr().out
    assert run(["validate", log, *walk[:2], *walk[4:], "--scenario", "1,2"]) == 2
