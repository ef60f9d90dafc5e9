"""Tables of targets, from the file to the evidence, on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gaitswarm.cli.targets_file import read_targets
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from tests.cli.conftest import Gaitswarm
from tests.examples.paths import ROOT

HEAD = "walk,controller,design,scenario,quantity,value,tolerance,relative_to,use\n"
PI = 'pi,pi,"{""P"": 0.45, ""I"": 0.1}",normal-fast,'


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return tmp_path / "targets.csv"


def test_rows_of_a_walk_share_the_values_of_its_first_row(table: Path, tmp_path: Path) -> None:
    (tmp_path / "own.json").write_text(json.dumps({"P": 0.3, "I": 0.2, "fir_window": "hamming"}))
    table.write_text(
        HEAD
        + "# measured on the table of the lab\n\n"
        + f"{PI}speed,0.152,0.05\n"
        + "pi,,,,height_loss,0.0077,0.002,,predict\n"
        + "own,pi,own.json,normal-fast,speed,1.2,0.1,pi,\n"
        + "A,fuzzy-pi,published:A,1 2,fitness:A,20.87,0.1\n"
    )
    found = read_targets(table)
    assert [walk["name"] for walk in found["walks"]] == ["pi", "own", "A"]
    assert found["walks"][1]["design"] == {"P": 0.3, "I": 0.2, "fir_window": 1.0}
    assert found["walks"][2]["scenarios"] == ["1", "2"]
    assert [target["use"] for target in found["targets"]] == ["fit", "predict", "fit", "fit"]
    assert found["targets"][2]["relative_to"] == "pi"
    spec = CalibrationSpec.model_validate({"kind": "calibration", "variables": ["energy"], **found})
    assert len(spec.targets) == 4
    assert spec.resolved().walks[1].design["fir_window"] == "hamming"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no rows"),
        ("walk,colour\n", "line 1, column colour: unknown column; known are walk, controller"),
        ("walk,walk\n", "line 1, column walk: duplicate column"),
        ("walk,controller\n", "line 1, column design: missing column"),
        (
            HEAD + "pi,pi,,normal-fast,speed,1,1\n",
            "line 2, column design: required in the first row",
        ),
        (HEAD + f"\n{PI}speed,fast,0.1\n", "line 3, column value: 'fast' is not a number"),
        (HEAD + f"{PI}speed,1,0\n", "line 2, column tolerance: must be greater than 0"),
        (HEAD + f"{PI}speed,-1,0.1\n", "line 2, column value: -1, but speed is greater than 0"),
        (HEAD + f"{PI}haste,1,0.1\n", "line 2, column quantity: must be 'torque'"),
        (HEAD + f"{PI}speed,1,0.1,,guess\n", "line 2, column use: must be 'fit'"),
        (HEAD + f"{PI}speed,1,0.1,pi\n", "line 2, column relative_to: the walk itself"),
        (HEAD + f"{PI}speed,1,0.1,,,6\n", "line 2, column use: the line has more cells"),
        (
            HEAD + f"{PI}speed,1,0.1\npi,p,,,speed,1,0.1\n",
            "line 3, column controller: differs from an earlier row of walk 'pi'",
        ),
        (HEAD + "a,pie,published:A,1,speed,1,0.1\n", "line 2, column controller: .*'pie'"),
        (HEAD + "a,pi,published:Z,1,speed,1,0.1\n", "line 2, column design: no published design"),
        (HEAD + "a,pi,no.json,1,speed,1,0.1\n", "line 2, column design: cannot read"),
        (HEAD + 'a,pi,"{""P"": 1}",1,speed,1,0.1\n', "line 2, column design: I missing"),
        (HEAD + "a,pi,{P: 1},1,speed,1,0.1\n", "line 2, column design: not JSON"),
        (HEAD + f"{PI.replace('normal-fast', 'moon')}speed,1,1\n", "line 2, column scenario: "),
        (
            HEAD + f"{PI.replace('normal-fast', '1 2')}speed,1,1\n",
            "line 2, column quantity: applies to one scenario, but the walk has 2",
        ),
        (HEAD + 'a,"pi', "line 2: "),
    ],
)
def test_a_bad_table_is_refused_by_line_and_column(table: Path, text: str, message: str) -> None:
    table.write_text(text)
    with pytest.raises(InvalidRequest, match=message) as refused:
        read_targets(table)
    assert str(table) in str(refused.value)


def test_a_missing_table_is_refused(gaitswarm: Gaitswarm, tmp_path: Path) -> None:
    ran = gaitswarm("calibrate", tmp_path / "none.csv")
    assert ran.code == 2
    assert "cannot read" in ran.err


@pytest.mark.slow
def test_a_table_is_fitted_shown_and_predicted_from(
    gaitswarm: Gaitswarm, table: Path, db: Path
) -> None:
    table.write_text(HEAD + f"{PI}speed,0.15,0.1\npi,,,,energy,45,0.2\n")
    fitted = gaitswarm(
        "calibrate", table, "--robot", "szabadka2,szabadka2-identified",
        "--variables", "robot,efficiency=0.8:0.95,energy=signed:absolute",
        "--fixed", "contact_law=stick", "--seeds", "2", "--iterations", "2", "--particles", "8",
        "--evaluator", "in-process", "--db", db,
    )  # fmt: skip
    assert fitted.code == 0, fitted.err
    assert "szabadka2-identified" in fitted.out and "Least misfit by choice" in fitted.out
    jobs = [line.split()[1].rstrip(":") for line in fitted.out.splitlines() if "job " in line]
    first, second = dict.fromkeys(jobs[-2:])
    again = gaitswarm(
        "targets", first, second, "--leave-one-out", "target", "--db", db, "--json"
    )  # fmt: skip
    assert again.code == 0, again.err
    speed, energy = again.json["targets"]["targets"]
    assert (speed["quantity"], energy["quantity"]) == ("speed", "energy")
    assert speed["left_out"]["simulated"] > 0.0
    assert again.json["targets"]["design"]["contact_law"] == "stick"
    robot, efficiency, convention = again.json["parameters"]["parameters"]
    assert [choice["name"] for choice in robot["choices"]] == ["szabadka2", "szabadka2-identified"]
    assert (efficiency["low"], efficiency["high"]) == (0.8, 0.95)
    assert [choice["name"] for choice in convention["choices"]] == ["signed", "absolute"]
    other = gaitswarm("targets", first, "--leave-one-out", "row", "--db", db)
    assert other.code == 2 and "'target', 'walk'" in other.err


def test_the_example_is_read_and_can_be_simulated() -> None:
    found = read_targets(ROOT / "examples" / "thesis" / "targets.csv")
    spec = CalibrationSpec.model_validate({"kind": "calibration", "variables": ["energy"], **found})
    spec.check_can_be_simulated()
    assert {walk.controller for walk in spec.walks} == {"p", "pi", "fuzzy-pi", "fuzzy-pi-3"}
