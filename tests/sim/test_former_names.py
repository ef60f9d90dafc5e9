"""Documents with former names of fields are read; what is written has the current ones."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input.former_names import as_written
from gaitswarm.sim.robot import RobotFiles, RobotSource, RobotVariant, load_robot, parse_robot
from gaitswarm.sim.scenario import Scenario
from tests.examples.walks import quadruped_files

TOML, URDF = quadruped_files().toml, quadruped_files().urdf

TIBIA = "[actuators.tibia]"
WALK = {"name": "own", "cycle_time": 1.5, "radius": 0.16}


def former(toml: str) -> str:
    """A robot.toml as it was written before its tables of actuators were called so."""
    return toml.replace("[actuators.", "[drives.").replace("actuators = ", "drives = ")


def test_a_scenario_is_read_by_its_former_name_of_the_hip_height() -> None:
    scenario = Scenario.model_validate({**WALK, "withers": 0.15})
    assert scenario == Scenario.model_validate({**WALK, "hip_height": 0.15})
    assert scenario.model_dump(exclude_unset=True) == {**WALK, "hip_height": 0.15}


def test_a_variant_is_read_by_its_former_name_of_the_backlash() -> None:
    source: Any = TypeAdapter(RobotSource).validate_python({"gearlash": [2.5, 1.0, 1.0]})
    assert source == RobotVariant(backlash=(2.5, 1.0, 1.0))
    assert load_robot(source).has_backlash
    assert source.model_dump(exclude_unset=True) == {"backlash": (2.5, 1.0, 1.0)}


def test_a_robot_file_is_read_by_its_former_names() -> None:
    loose = parse_robot(TOML.replace(TIBIA, f"{TIBIA}\nbacklash = 0.03"), URDF)
    before = former(TOML).replace("[drives.tibia]", "[drives.tibia]\ngearlash = 0.03")
    assert parse_robot(before, URDF).description == loose.description
    assert loose.has_backlash
    assert RobotFiles(toml=former(TOML), urdf=URDF).toml == former(TOML)


@pytest.mark.parametrize(
    ("model", "document"),
    [
        (Scenario, {**WALK, "withers": 0.15, "hip_height": 0.15}),
        (RobotVariant, {"gearlash": [1, 1, 1], "backlash": [1, 1, 1]}),
    ],
)
def test_a_field_under_both_its_names_is_refused_by_both(
    model: type[Scenario | RobotVariant], document: dict[str, Any]
) -> None:
    with pytest.raises(ValidationError) as refused:
        model.model_validate(document)
    (error,) = refused.value.errors()
    former_name, current_name = list(document)[-2:]
    assert f"{current_name}: given twice, for '{former_name}' is its former name" in error["msg"]


@pytest.mark.parametrize(
    ("line", "and_former", "field"),
    [
        ("[contact]", "[drives]\n[contact]", "actuators"),
        (TIBIA, f"{TIBIA}\ngearlash = 0.1\nbacklash = 0.1", "backlash"),
        ("phase = 0.75", 'phase = 0.75\ndrives = ["coxa", "femur", "tibia"]', "actuators"),
    ],
)
def test_a_robot_file_with_both_names_is_refused_by_field(
    line: str, and_former: str, field: str
) -> None:
    assert line in TOML
    with pytest.raises(RobotFileError, match=f"{field}: given twice"):
        parse_robot(TOML.replace(line, and_former, 1), URDF)


def test_an_error_in_a_former_robot_file_names_field_and_line_as_they_are_written() -> None:
    broken = former(TOML).replace("[drives.tibia]", "[drives.tibia]\nbevel = -2.0", 1)
    line = broken.splitlines().index("bevel = -2.0") + 1
    with pytest.raises(RobotFileError, match=rf"line {line}: drives\.tibia\.bevel"):
        parse_robot(broken, URDF)


def test_a_location_is_told_by_the_names_of_the_document() -> None:
    document = {"scenarios": ["1", {"withers": 5}], "robot": {"backlash": 1}}
    assert as_written(document, ("scenarios", 1, "Scenario", "hip_height")) == (
        *("scenarios", 1, "Scenario", "withers"),
    )
    assert as_written(document, ("robot", "backlash")) == ("robot", "backlash")
    assert as_written(document, ("robot", "contact_law")) == ("robot", "contact_law")
