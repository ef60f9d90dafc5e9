"""Meshes that `gaitswarm robot init` copies next to the URDF."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gaitswarm.cli.main import run
from gaitswarm.robots import mesh_content
from gaitswarm.sim.robot import meshes
from gaitswarm.sim.robot.meshes import copy_meshes, own_place, served_meshes, urdf_digest
from tests.robots.test_proposal import dog


def named(*names: str) -> str:
    """A dog whose trunk has these meshes."""
    shapes = "".join(f'<geometry><mesh filename="{name}"/></geometry>' for name in names)
    return dog().replace('<link name="trunk">', f'<link name="trunk"><visual>{shapes}</visual>')


def test_the_folder_shows_its_meshes_wherever_it_goes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package = tmp_path / "ros" / "dog_description"
    contents = {
        "trunk.stl": package / "robots" / "trunk.stl",
        "../meshes/hip.STL": package / "meshes" / "hip.STL",
        "package://dog_description/meshes/x/../thigh.dae": package / "meshes" / "thigh.dae",
        "package://dog_parts/calf.obj": tmp_path / "elsewhere" / "dog_parts" / "calf.obj",
    }
    for name, path in contents.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name, encoding="utf-8")
    (package / "meshes" / "x").mkdir()
    (package / "robots" / "secret.txt").touch()
    lost = {
        "secret.txt": "none of STL",
        "package://dog_parts/none.stl": "not found",
        str(package / "robots" / "trunk.stl"): "absolute",
    }
    urdf = package / "robots" / "dog.urdf"
    urdf.write_text(named(*contents, *lost), encoding="utf-8")
    output = tmp_path / "dog"
    command = ["robot", "init", str(urdf), "--package", str(tmp_path / "elsewhere"), "-o"]
    assert run([*command, str(output), "--json"]) == 0
    meshes = json.loads(capsys.readouterr().out)["meshes"]
    assert meshes["copied"] == list(contents)
    for left, (name, why) in zip(meshes["left_out"], lost.items(), strict=True):
        assert left["name"] == name and why in left["problem"]

    moved = output.rename(tmp_path / "elsewhere" / "moved")
    (tmp_path / "ros").rename(tmp_path / "gone")
    digest = urdf_digest((moved / "robot.urdf").read_text(encoding="utf-8"))
    served = served_meshes([moved], digest)
    assert [name for name, found in served.items() if isinstance(found, Path)] == list(contents)
    assert [mesh_content([moved], digest, n).decode() for n in range(4)] == list(contents)

    urdf = tmp_path / "gone" / "dog_description" / "robots" / "dog.urdf"
    assert run(["robot", "init", str(urdf), "--no-meshes", "-o", str(output)]) == 0
    assert sorted(p.name for p in output.iterdir()) == ["job.json", "robot.toml", "robot.urdf"]
    for file in ("robot.toml", "robot.urdf", "job.json"):
        assert (output / file).read_bytes() == (moved / file).read_bytes()


def test_what_is_too_large_or_in_anothers_place_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, output = tmp_path / "urdf", tmp_path / "made"
    sizes = {"a.stl": 6, "b.stl": 11, "../a.stl": 6, "d.stl": 4}
    folder.mkdir()
    for name, size in sizes.items():
        (folder / name).write_bytes(b"x" * size)
    monkeypatch.setattr(meshes, "LARGEST_MESH", 10)
    copied, left_out = copy_meshes(named(*sizes, "a.stl"), folder, output)
    assert copied == ["a.stl", "d.stl"]
    assert left_out["b.stl"].endswith("MiB; simplify it")
    assert "a.stl in the folder" in left_out["../a.stl"]
    assert sorted(p.name for p in output.iterdir()) == ["a.stl", "d.stl"]


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("m/../../x.stl", "x.stl"),
        ("package://p/m/./x.stl", "p/m/x.stl"),
        ("package://p/../q/x.stl", None),
        ("package:///etc/x.stl", None),
        ("file:///etc/x.stl", None),
        ("/etc/x.stl", None),
    ],
)
def test_a_copy_lies_inside_of_the_folder(name: str, place: str | None) -> None:
    assert own_place(name) == (None if place is None else Path(place))


def test_init_says_how_the_page_shows_the_copies(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "trunk.stl").touch()
    urdf = tmp_path / "dog.urdf"
    urdf.write_text(named("trunk.stl"), encoding="utf-8")
    for options, said in (((), True), (("--no-meshes",), False)):
        folder = tmp_path / f"dog-{said}"
        assert run(["robot", "init", str(urdf), "-o", str(folder), *options]) == 0
        assert (f"gaitswarm serve --robots {folder}" in capsys.readouterr().err) == said
