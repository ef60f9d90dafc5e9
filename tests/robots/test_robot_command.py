"""`gaitswarm robot init` and `check`, and the folder's own job."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from tests.robots.test_proposal import dog


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


def test_jobs_of_the_robot_have_its_controller_and_walks_unless_they_say_otherwise(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    budget = ["--iterations", "1", "--particles", "2", "--evaluator", "in-process", "--json"]
    command = ["optimize", "--robot", str(folder), "--db", str(tmp_path / "jobs.db"), *budget]
    assert run(command) == 0
    job = json.loads(capsys.readouterr().out)
    assert job["controller"] == "pid"
    assert job["scenarios"] == ["slow", "fast"]
    assert run([*command, "--controller", "pi"]) == 0
    assert json.loads(capsys.readouterr().out)["controller"] == "pi"


def test_init_overwrites_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "robot.toml").read_text(encoding="utf-8")
    urdf = folder / "robot.urdf"
    assert run(["robot", "init", str(urdf), "--output", str(folder)]) == 2
    assert "output" in (said := capsys.readouterr().err) and "not empty" in said
    assert (folder / "robot.toml").read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (dog(joints=2), "legs.urdf: legs of three joints"),
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


def test_check_warns_of_inertia_that_no_body_has(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("robot.toml", "robot.urdf"):
        text = (folder / name).read_text(encoding="utf-8")
        changed = text.replace('izz="1e-4"', 'izz="1e-2"', 2)
        (tmp_path / name).write_text(changed, encoding="utf-8")
    assert run(["robot", "check", str(tmp_path), "--json"]) == 0
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    assert any("'FL_hip'" in text and "principal moments" in text for text in warnings)


def test_a_damaged_job_file_is_named(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("robot.toml", "robot.urdf"):
        (tmp_path / name).write_text((folder / name).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "job.json").write_text("[]", encoding="utf-8")
    assert run(["optimize", "--robot", str(tmp_path), "--db", str(tmp_path / "jobs.db")]) == 2
    assert "job.json must hold one JSON object" in capsys.readouterr().err
