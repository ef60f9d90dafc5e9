"""Meshes of robots whose folders the server knows: which files are given out, and which never."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.replay import ReplayRequest, run_replay
from gaitswarm.sim.robot import meshes
from gaitswarm.sim.robot.meshes import urdf_digest
from tests.examples.commands import run_command
from tests.examples.meshes import tetrahedron, with_mesh
from tests.examples.paths import QUADRUPED
from tests.examples.servers import Server, ServerProcess, unframed
from tests.examples.walks import PUBLISHED_A, SHORT_WALK

SECRET = "not for readers"

NAMES = (
    "meshes/body.stl",
    "package://quadruped_description/meshes/leg.STL",
    "../secret.stl",
    "package://quadruped_description/../secret.stl",
    "package://../secret.stl",
    "linked.stl",
    "large.obj",
    "robot.toml",
    "none.dae",
    "/etc/passwd",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Files of a robot that names meshes in every way, in a folder of robots, next to a secret."""
    folder = tmp_path / "robots" / "quadruped_description"
    (folder / "meshes").mkdir(parents=True)
    urdf = with_mesh((QUADRUPED / "robot.urdf").read_text(encoding="utf-8"), *NAMES)
    (folder / "robot.urdf").write_text(urdf, encoding="utf-8")
    (folder / "robot.toml").write_text(SECRET, encoding="utf-8")
    (folder / "quadruped_description" / "meshes").mkdir(parents=True)
    for name in ("meshes/body.stl", "quadruped_description/meshes/leg.STL"):
        (folder / name).write_bytes(tetrahedron(0.1))
    for place in (folder.parent, tmp_path):
        (place / "secret.stl").write_text(SECRET, encoding="utf-8")
    (folder / "linked.stl").symlink_to(folder.parent / "secret.stl")
    (folder / "large.obj").write_bytes(b"# large\n" * 8)
    return folder


@pytest.fixture
def server(folder: Path) -> Iterator[Server]:
    started = Server(None, robots=(folder.parent,))
    yield started
    started.close()


@pytest.fixture
def digest(folder: Path) -> str:
    return urdf_digest((folder / "robot.urdf").read_text(encoding="utf-8"))


def listed(server: Server, digest: str) -> dict[str, dict[str, Any]]:
    answer = server.client.get(f"/v1/robots/{digest}/meshes")
    assert answer.status_code == 200, answer.text
    return {item["name"]: item for item in answer.json()["items"]}


def test_files_that_the_urdf_names_are_given_out_with_a_tag_of_their_content(
    server: Server, folder: Path, digest: str
) -> None:
    for name in NAMES[:2]:
        url = listed(server, digest)[name]["url"]
        answer = server.client.get(url)
        assert answer.status_code == 200
        assert answer.content == tetrahedron(0.1)
        tag = {"If-None-Match": answer.headers["etag"]}
        same = server.client.get(url, headers=tag)
        assert (same.status_code, same.content) == (304, b"")
    (folder / "quadruped_description" / "meshes" / "leg.STL").write_bytes(tetrahedron(0.2))
    assert server.client.get(url, headers=tag).content == tetrahedron(0.2)


def test_files_outside_of_the_robots_folder_are_never_given_out(
    server: Server, digest: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(meshes, "LARGEST_MESH", 63)
    found = listed(server, digest)
    assert list(found) == list(NAMES)
    said = {
        "../secret.stl": "not found",
        "package://quadruped_description/../secret.stl": "not found",
        "package://../secret.stl": "not found",
        "linked.stl": "outside",
        "large.obj": "MiB",
        "robot.toml": "none of STL",
        "none.dae": "not found",
        "/etc/passwd": "none of STL",
    }
    for number, name in enumerate(NAMES):
        if name not in said:
            continue
        assert found[name]["url"] is None
        assert said[name] in found[name]["problem"]
        answer = server.client.get(f"/v1/robots/{digest}/meshes/{number}")
        assert answer.status_code == 404
        assert said[name] in answer.json()["detail"]
        assert SECRET not in answer.text


@pytest.mark.parametrize("end", ["99", "-1", "../robot.toml", "%2e%2e%2frobot.toml", "body.stl"])
def test_nothing_is_asked_for_by_a_path(server: Server, digest: str, end: str) -> None:
    answer = server.client.get(f"/v1/robots/{digest}/meshes/{end}")
    assert answer.status_code in (404, 422)
    assert SECRET not in answer.text


def test_a_robot_in_no_folder_has_none(server: Server) -> None:
    assert listed(server, 64 * "0") == {}
    assert server.client.get("/v1/robots/..%2f..%2f/meshes").status_code in (404, 422)


@pytest.mark.slow
def test_serve_gives_out_the_meshes_of_the_folders_that_its_option_names_and_no_others(
    folder: Path, digest: str, tmp_path: Path
) -> None:
    serving, closed = (
        ServerProcess(tmp_path / f"{name}.db", "--no-runner", *options)
        for name, options in (("serving", ("--robots", str(folder))), ("closed", ()))
    )
    try:
        items = serving.client.get(f"/v1/robots/{digest}/meshes").json()["items"]
        assert [item["name"] for item in items if item["url"]][:2] == [*NAMES[:2]]
        assert closed.client.get(f"/v1/robots/{digest}/meshes").json()["items"] == []
    finally:
        serving.close()
        closed.close()
    refused = run_command("serve", "--robots", tmp_path / "nowhere")
    assert refused.code == 2 and "nowhere" in refused.err


def test_a_replay_tells_where_meshes_are(digest: str, folder: Path) -> None:
    files = {
        "toml": (QUADRUPED / "robot.toml").read_text(encoding="utf-8"),
        "urdf": (folder / "robot.urdf").read_text(encoding="utf-8"),
    }
    crawl = json.loads((QUADRUPED / "crawl.json").read_text(encoding="utf-8"))
    body = {"robot": files, "design": PUBLISHED_A, "scenario": crawl | {"cycles": 1}, "rate": 1}
    header, _ = unframed(run_replay(ReplayRequest.model_validate(body)))
    assert header["robot"]["urdf"] == digest
    meshes = header["robot"]["links"][0]["meshes"]
    assert [mesh["name"] for mesh in meshes] == list(NAMES)
    assert meshes[0]["scale"] == [2.0, 2.0, 2.0]
    assert meshes[0]["colour"] == [0.1, 0.9, 0.1, 1.0]
    assert meshes[0]["origin"][:3] == [0.0, 0.0, 0.05]
    shipped = {"design": PUBLISHED_A, "scenario": SHORT_WALK, "rate": 1}
    header, _ = unframed(run_replay(ReplayRequest.model_validate(shipped)))
    assert header["robot"]["urdf"] is None
