"""Wrong robot files: messages name file, line and remedy, in commands and over HTTP."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import httpx2
import pytest

from gaitswarm.cli.main import run
from tests.robots.wrong_files import SOURCE, TOML, URDF, WRONG_TOMLS, WRONG_URDFS, Wrong

Message = Callable[..., str]
ALL = (*WRONG_URDFS, *WRONG_TOMLS)


def check_said(said: str, wrong: Wrong, file: str) -> None:
    """File, line and remedy."""
    assert file in said
    assert re.search(wrong.said, said), said
    assert "Traceback" not in said
    if wrong.at is not None:
        named = re.search(r"line (\d+)", said)
        assert named, said
        assert wrong.at in wrong.text.splitlines()[int(named[1]) - 1]


def refused(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """What a command says that ends as one with wrong input does."""
    assert run([*map(str, arguments)]) == 2
    return " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("wrong", WRONG_URDFS, ids=lambda wrong: wrong.name)
def test_init_names_file_line_and_remedy(
    wrong: Wrong, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "mine.urdf"
    source.write_text(wrong.text, encoding="utf-8")
    said = refused(capsys, "robot", "init", source, "--output", tmp_path / "made")
    check_said(said, wrong, "mine.urdf")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.urdf"]


@pytest.mark.variants("no mass", "unknown joint", "no character")
@pytest.mark.parametrize("wrong", ALL, ids=lambda wrong: wrong.name)
def test_check_names_file_line_and_remedy(
    wrong: Wrong, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "robot.toml").write_text(TOML if wrong.is_urdf else wrong.text, encoding="utf-8")
    (tmp_path / "robot.urdf").write_text(wrong.text if wrong.is_urdf else URDF, encoding="utf-8")
    said = refused(capsys, "robot", "check", tmp_path)
    check_said(said, wrong, "robot.urdf" if wrong.is_urdf else "robot.toml")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (bytes(range(256)), r"is not UTF-8.*save it as UTF-8"),
        (SOURCE.encode("utf-16"), r"is not UTF-8.*save it as UTF-8"),
        (SOURCE.replace("dog", "chien bâtard").encode("latin-1"), r"is not UTF-8.*byte 0xe2"),
        (None, "No such file"),
    ],
    ids=["binary", "UTF-16", "Latin-1", "missing"],
)
def test_a_file_that_is_no_text_is_refused_by_name(
    content: bytes | None, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "mine.urdf"
    if content is not None:
        source.write_bytes(content)
    found = refused(capsys, "robot", "init", source, "--output", tmp_path / "made")
    assert "mine.urdf" in found and re.search(said, found), found
    for name in ("robot.toml", "robot.urdf"):
        folder = tmp_path / name.replace(".", "-")
        folder.mkdir()
        (folder / "robot.toml").write_text(TOML, encoding="utf-8")
        (folder / "robot.urdf").write_text(URDF, encoding="utf-8")
        (folder / name).unlink()
        if content is not None:
            (folder / name).write_bytes(content)
        found = refused(capsys, "robot", "check", folder)
        assert name in found and re.search(said, found), found


@pytest.mark.parametrize("name", ["../up", "a/b", "a\nb", "", "x" * 101])
def test_a_robots_name_is_one_that_a_file_can_have(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.urdf").write_text(SOURCE, encoding="utf-8")
    made = tmp_path / "made"
    said = refused(
        capsys, "robot", "init", tmp_path / "mine.urdf", "--output", made, "--name", name
    )
    assert "name" in said and not made.exists()


@pytest.mark.slow
def test_a_server_names_file_line_and_remedy_and_keeps_running(
    serve_database: Callable[[Path], str], database: Path
) -> None:
    with httpx2.Client(base_url=serve_database(database), timeout=60.0) as client:

        def ask(toml: str, urdf: str) -> httpx2.Response:
            spec = {"robot": {"toml": toml, "urdf": urdf}, "scenarios": ["1"], "iterations": 1}
            return client.post("/v1/estimates", json=spec)

        for wrong in ALL:
            if "\0" in wrong.text:
                continue
            files = (TOML, wrong.text) if wrong.is_urdf else (wrong.text, URDF)
            answer = ask(*files)
            assert answer.status_code == 422, (wrong.name, answer.text)
            assert answer.headers["content-type"] == "application/problem+json"
            (error,) = answer.json()["errors"]
            assert error["field"] == "robot"
            check_said(error["message"], wrong, "robot.urdf" if wrong.is_urdf else "robot.toml")
        assert client.get("/v1/healthz").status_code == 200
        assert len(ALL) >= 30
