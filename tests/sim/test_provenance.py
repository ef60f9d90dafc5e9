"""Provenance of a case's results."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

import pytest

from gaitswarm.sim.plugins import source_digest
from gaitswarm.sim.provenance import Provenance, provenance_of, simulator_files
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotFiles, RobotVariant
from tests.examples.paths import ROOT
from tests.examples.processes import python

PROGRAM = """
import json, sys
import numpy as np
from gaitswarm.sim.case import Walk
from gaitswarm.sim.identification import CurrentFit
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import prepare

short = Scenario(name="short", cycle_time=0.6, radius=0.16, hip_height=0.15, cycles=1)
Walk("szabadka2", "pi", short, ("P", "I")).run(np.array([[0.3, 0.1]]))
prepare(backend="reference")
from gaitswarm.sim.kernel.emitted import emit_c
files = [m.__file__ for name, m in sys.modules.items() if name.startswith("gaitswarm.sim.")]
print(json.dumps([provenance_of("szabadka2").model_dump(), files]))
"""


def robot_file(name: str) -> str:
    return (resources.files("gaitswarm.sim.robot") / "szabadka2" / name).read_text(encoding="utf-8")


SHIPPED = RobotFiles(toml=robot_file("robot.toml"), urdf=robot_file("robot.urdf"))


@pytest.mark.slow
def test_all_modules_that_a_case_runs_through_are_in_the_digest_which_any_process_finds() -> None:
    done = python("-W", "ignore", "-c", PROGRAM)
    assert done.returncode == 0, done.stderr
    found, loaded = json.loads(done.stdout)
    assert Provenance(**found) == provenance_of("szabadka2")
    covered = set(simulator_files())
    uncovered = {Path(file) for file in loaded} - covered
    assert uncovered == {ROOT / "gaitswarm" / "sim" / "provenance.py"}
    code = ("kernel/emitted/driver.c", "controllers/estimate.c", "compiler/vec.h")
    for source in (*code, "presets.toml", "variables.toml"):
        assert ROOT / "gaitswarm" / "sim" / source in covered


def test_a_robot_is_known_by_its_content_and_not_by_how_it_is_named() -> None:
    shipped = provenance_of("szabadka2")
    assert provenance_of(RobotVariant(name="szabadka2")) == provenance_of(SHIPPED) == shipped
    assert provenance_of(RobotVariant()) == provenance_of(DEFAULT_ROBOT) != shipped


@pytest.mark.parametrize(
    "robot",
    [
        RobotVariant(name="szabadka2", contact_law="stick"),
        RobotVariant(name="szabadka2", backlash=(2.5, 1.0, 1.0)),
        RobotFiles(
            toml=SHIPPED.toml.replace("\nfriction = 1.0", "\nfriction = 0.9"), urdf=SHIPPED.urdf
        ),
        RobotFiles(
            toml=SHIPPED.toml, urdf=SHIPPED.urdf.replace('<mass value="3', '<mass value="4', 1)
        ),
    ],
    ids=["contact law", "backlash", "a parameter", "a mass of the URDF"],
)
def test_another_content_is_another_robot(robot: RobotVariant | RobotFiles) -> None:
    changes = provenance_of("szabadka2").changes(provenance_of(robot))
    assert changes == ("the robot szabadka2 has changed",)


def test_any_byte_and_any_name_of_a_source_file_counts(tmp_path: Path) -> None:
    def digest(**files: str) -> str:
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        return source_digest(folder, sorted(folder.iterdir()))

    seen = [
        digest(a="x = 1", b="y"),
        digest(a="x = 2", b="y"),
        digest(a="x = 1  # why", b="y"),
        digest(a="x = 1", c="y"),
        digest(a="x = 1y", b=""),
        digest(a="x = 1"),
    ]
    assert len(set(seen)) == len(seen)
    assert digest(a="x = 1", b="y") == seen[0]


def test_source_files_are_read_once_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    known = provenance_of("szabadka2").code_digest

    def read(self: Path) -> bytes:
        raise AssertionError(f"{self} was read again")

    monkeypatch.setattr(Path, "read_bytes", read)
    robot = RobotVariant(contact_law="karnopp", backlash=(1.0, 1.0, 1.0))
    assert provenance_of(robot).code_digest == known
