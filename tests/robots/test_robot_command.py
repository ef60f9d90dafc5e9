"""`gaitswarm robot init` and `check`, and the folder's own job."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.cli.main import run
from gaitswarm.sim.proposal.document import walking_proposal
from gaitswarm.sim.robot.robot import parse_robot
from tests.robots.radial import radial_robot
from tests.robots.test_proposal import ARM, dog


def test_init_makes_the_requested_actuators(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dog.urdf").write_text(dog(), encoding="utf-8")

    command = ["robot", "init", str(tmp_path / "dog.urdf"), "--output", str(tmp_path / "dog")]

    def made(folder: Path) -> tuple[str, str]:
        job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
        return (folder / "robot.toml").read_text(encoding="utf-8"), job["controller"]

    assert run([*command, "--actuator", "dc"]) == 0
    dc, auto = made(tmp_path / "dog"), made(folder)
    assert "[motors." in dc[0] and dc[1] == "pid"
    assert 'kind = "torque"' in auto[0] and auto[1] == "joint-pd"
    command[-1] = str(tmp_path / "no")
    assert run([*command, "--actuator", "hydraulic"]) == 2
    assert "auto, dc, torque" in capsys.readouterr().err


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Made of a dog's URDF by the command."""
    path = tmp_path_factory.mktemp("robots")
    (path / "dog.urdf").write_text(dog(), encoding="utf-8")
    assert run(["robot", "init", str(path / "dog.urdf"), "--output", str(path / "dog")]) == 0
    return path / "dog"


def test_init_writes_a_folder_that_loads_and_stands(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sorted(p.name for p in folder.iterdir()) == ["job.json", "robot.toml", "robot.urdf"]
    assert run(["robot", "check", str(folder), "--json"]) == 0
    view = json.loads(capsys.readouterr().out)
    assert view["name"] == "dog"
    assert view["mass"] == pytest.approx(8.0 + 12 * 0.3)
    assert [leg["name"] for leg in view["legs"]] == ["FL", "FR", "RL", "RR"]
    standing = view["standing"]
    assert standing["weight"] == pytest.approx(view["mass"] * 9.81)
    assert standing["normal_forces"] == pytest.approx(standing["weight"], rel=0.01)
    assert view["warnings"] == []
    assert run(["robot", "check", str(folder)]) == 0
    assert "soles carry" in capsys.readouterr().out


def test_check_prints_masses_by_group_of_links_and_guesses_of_init(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dog.urdf").write_text(dog(arm=ARM), encoding="utf-8")
    made = str(tmp_path / "made")
    assert run(["robot", "init", str(tmp_path / "dog.urdf"), "--output", made, "--json"]) == 0
    guesses = json.loads(capsys.readouterr().out)["guesses"]
    assert run(["robot", "check", made, "--json"]) == 0
    view = json.loads(capsys.readouterr().out)
    assert view["body_mass"] == pytest.approx(8.0 + 3 * 0.3), "with the arm"
    assert [leg["mass"] for leg in view["legs"]] == pytest.approx([0.9] * 4)
    assert view["guesses"] == guesses
    assert "joint 'arm1' is held at 0.5 rad" in guesses
    below = -view["legs"][0]["points"][3][2]
    (stands,) = (float(guess.split()[2]) for guess in guesses if guess.startswith("feet stand "))
    assert stands == pytest.approx(below, rel=0.01)
    assert any("soles are 0.02 m long: radius of the feet's spheres" in guess for guess in guesses)
    assert run(["robot", "check", made]) == 0
    said = capsys.readouterr().out
    assert all(guess in said for guess in guesses)
    assert "8.900 kg" in said and said.count("0.900 kg") == 4


def test_guesses_of_shorter_walks_are_in_the_folder_too() -> None:
    proposal = walking_proposal(radial_robot(3, limit=0.15), "round")
    guessed = parse_robot(proposal.toml, proposal.urdf).description.guesses
    assert guessed == proposal.guesses
    assert sum("reach no further" in guess for guess in guessed) == 2


@pytest.mark.variants("its own", "none")
@pytest.mark.parametrize(
    ("given", "name"),
    [('name="Rex 2"', "Rex 2"), ('name="a/b"', "file"), ("", "file"), ('name=" "', "file")],
    ids=["its own", "no file's", "none", "blank"],
)
def test_a_robot_is_named_as_its_urdf_says_or_else_as_the_file(
    given: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "file.urdf"
    source.write_text(dog().replace('<robot name="dog"', f"<robot {given}"), encoding="utf-8")
    for asked, said in (([], name), (["--name", "mine"], "mine")):
        output = tmp_path / said.replace(" ", "-")
        assert run(["robot", "init", str(source), "-o", str(output), "--json", *asked]) == 0
        assert json.loads(capsys.readouterr().out)["name"] == said
        assert f'name = "{said}"' in (output / "robot.toml").read_text(encoding="utf-8")


def test_check_draws_how_it_stands_and_says_the_same(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["robot", "check", str(folder), "--json"]) == 0
    said = capsys.readouterr().out
    for name in ("dog.svg", "dog.png"):
        assert run(["robot", "check", str(folder), "--json", "--draw", str(tmp_path / name)]) == 0
        assert capsys.readouterr().out == said
    assert (tmp_path / "dog.png").read_bytes().startswith(b"\x89PNG")
    svg = (tmp_path / "dog.svg").read_text(encoding="utf-8")
    assert svg.startswith("<?xml") and "<!-- FL -->" in svg and "<!-- support polygon -->" in svg
    assert run(["robot", "check", str(folder), "--draw", str(tmp_path / "dog.gif")]) == 2
    assert "draw" in (error := capsys.readouterr().err) and ".svg" in error


def test_check_prints_legs_and_centre_of_mass(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["robot", "check", str(folder), "--json"]) == 0
    view = json.loads(capsys.readouterr().out)
    robot = parse_robot(
        *((folder / f"robot.{kind}").read_text(encoding="utf-8") for kind in ("toml", "urdf"))
    )
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    for leg in robot.description.legs:
        for name, angle in zip(leg.joints, leg.stance or (), strict=True):
            q[model.joints[model.getJointId(name)].idx_q] = angle
    mass = pin.centerOfMass(model, data, q)
    np.testing.assert_allclose(view["centre_of_mass"], mass, atol=0.01)
    pin.framesForwardKinematics(model, data, q)
    for leg, found in zip(robot.description.legs, view["legs"], strict=True):
        hip = data.oMi[model.getJointId(leg.joints[0])].translation
        np.testing.assert_allclose(found["points"][0], hip, atol=1e-12)
        foot = data.oMf[model.getFrameId(leg.foot)].translation
        # It stands where its gait has it, which the stance's digits are rounded from.
        np.testing.assert_allclose(found["points"][3], foot, atol=0.01)


def test_jobs_of_the_robot_have_its_controller_and_walks_unless_they_say_otherwise(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    budget = ["--iterations", "1", "--particles", "2", "--evaluator", "in-process", "--json"]
    command = ["optimize", "--robot", str(folder), "--db", str(tmp_path / "jobs.db"), *budget]
    assert run(command) == 0
    job = json.loads(capsys.readouterr().out)
    assert job["controller"] == "joint-pd"
    assert job["scenarios"] == ["slow", "fast"]
    # Biases of the others are in units of one robot.
    assert job["spec"]["preference"]["bias"] == [0.0] * 5
    assert run([*command, "--controller", "pi"]) == 0
    assert json.loads(capsys.readouterr().out)["controller"] == "pi"


def test_a_design_walks_in_the_robots_own_scenarios_by_its_controller(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    design = json.dumps({"Kp": 40.0, "Kd": 1.0, "feed_forward": 0.5})

    def walked(*options: str) -> list[str]:
        command = ["simulate", "--robot", str(folder), "--design", design, *options, "--json"]
        assert run(command) == 0
        return list(json.loads(capsys.readouterr().out)["scenarios"])

    assert walked() == walked("--scenario", "all") == ["slow", "fast"]
    assert walked("--scenario", "fast") == walked("--scenario", "2") == ["fast"]
    # Presets have their names there too.
    assert walked("--scenario", "slow,normal-slow") == ["slow", "normal-slow"]
    copy = Path(shutil.copytree(folder, tmp_path / "dog"))
    job = json.loads((copy / "job.json").read_text(encoding="utf-8"))
    for scenarios, code in (([2], 0), ("slow", 2), ([None], 2)):
        (copy / "job.json").write_text(json.dumps({**job, "scenarios": scenarios}))
        assert run(["simulate", "--robot", str(copy), "--design", design, "--json"]) == code
    said = capsys.readouterr()
    assert list(json.loads(said.out)["scenarios"]) == ["normal-slow"]
    assert "robot: its job.json must have a list under scenarios" in said.err
    assert run(["gaits", "--robot", str(folder), "--scenario", "fast", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["scenario"] == "fast"


def test_init_overwrites_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "robot.toml").read_text(encoding="utf-8")
    urdf = folder / "robot.urdf"
    assert run(["robot", "init", str(urdf), "--output", str(folder)]) == 2
    assert "output" in (said := capsys.readouterr().err) and "not empty" in said
    assert (folder / "robot.toml").read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (dog(joints=2), "legs.urdf: legs need three revolute joints"),
        ("<robot>", "legs.urdf, line 1: not well-formed XML: no element found"),
        (None, "cannot read"),
    ],
    ids=["two joints", "no XML", "no file"],
)
def test_a_file_without_legs_is_refused_by_name_and_leaves_nothing(
    text: str | None, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if text is not None:
        (tmp_path / "legs.urdf").write_text(text, encoding="utf-8")
    output = tmp_path / "made"
    assert run(["robot", "init", str(tmp_path / "legs.urdf"), "-o", str(output)]) == 2
    assert said in capsys.readouterr().err
    assert not output.exists()
    assert [p.name for p in tmp_path.iterdir() if p.suffix != ".urdf"] == []


def test_a_damaged_job_file_is_named(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("robot.toml", "robot.urdf"):
        (tmp_path / name).write_text((folder / name).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "job.json").write_text("[]", encoding="utf-8")
    assert run(["optimize", "--robot", str(tmp_path), "--db", str(tmp_path / "jobs.db")]) == 2
    assert "job.json must hold one JSON object" in capsys.readouterr().err
