"""Feet of robots whose last links have meshes alone, or nothing."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gaitswarm.cli.main import run
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.robot import Robot, parse_robot
from tests.robots.test_proposal import dog

NAME = "package://dog_description/meshes/calf.obj"
BARE = dog(foot="none")


def with_mesh(attributes: str, origin: str = "") -> str:
    """A dog whose shanks look like a mesh."""
    return on_shanks(f"<visual>{origin}<geometry><mesh {attributes}/></geometry></visual>")


def on_shanks(shapes: str) -> str:
    found = r'(<link name="\w\w_calf">.*?)</link>'
    return re.sub(found, rf"\1{shapes}</link>", BARE, flags=re.DOTALL)


def box(x: float, y: float, z: float, unit: float = 1.0) -> str:
    """An OBJ of a box from above its origin to z below it."""
    corners = [(a, b, c) for a in (-x, x) for b in (-y, y) for c in (0.02, -z)]
    lines = [f"v {unit * a} {unit * b} {unit * c}" for a, b, c in corners]
    return "\n".join([*lines, "f 1 2 3", "f 4 5 6", "f 6 7 8", ""])


Init = Callable[[str], tuple[Robot, list[str]]]


@pytest.fixture
def init(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Init:
    """Makes a robot from a URDF next to a package with its mesh."""

    def made(urdf: str) -> tuple[Robot, list[str]]:
        robots = tmp_path / "dog_description" / "robots"
        robots.mkdir(parents=True, exist_ok=True)
        (robots / "dog.urdf").write_text(urdf, encoding="utf-8")
        output = robots / "made"
        assert run(["robot", "init", str(robots / "dog.urdf"), "-o", str(output), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)["guesses"]
        files = [(output / f"robot.{kind}").read_text("utf-8") for kind in ("toml", "urdf")]
        return parse_robot(*files), said

    (tmp_path / "dog_description" / "meshes").mkdir(parents=True)
    (tmp_path / "dog_description" / "meshes" / "calf.obj").write_text(box(0.01, 0.02, 0.21))
    return made


@pytest.mark.variants("turned")
@pytest.mark.parametrize(
    ("urdf", "length"),
    [
        (with_mesh(f'filename="{NAME}"'), 0.21),
        (with_mesh(f'filename="{NAME}" scale="1 1 0.9"'), 0.189),
        (with_mesh(f'filename="{NAME}"', '<origin xyz="0 0 0.01"/>'), 0.2),
        (with_mesh(f'filename="{NAME}"', '<origin xyz="0 0 -0.19" rpy="3.14159265 0 0"/>'), 0.21),
    ],
    ids=["as it is", "scaled", "moved", "turned"],
)
def test_a_leg_ends_where_its_mesh_does(urdf: str, length: float, init: Init) -> None:
    robot, said = init(urdf)
    for leg in robot.legs:
        assert leg.lengths[2] == pytest.approx(length, abs=1e-6)
    end = "its end is the lowest one of the mesh of the link 'FL_calf' when it stands"
    assert f"leg FL_hip_joint: {end}" in said
    assert sum("its end" in note for note in said) == 4


def test_a_leg_stands_on_its_lowest_end_not_on_its_farthest() -> None:
    """A skid far ahead of the shank is farther from the knee than the heel, which carries."""
    skid = '<origin xyz="0.1 0 -0.16"/><geometry><box size="0.2 0.02 0.02"/></geometry>'
    shank = '<origin xyz="0 0 -0.1"/><geometry><box size="0.02 0.02 0.2"/></geometry>'
    both = "".join(f"<collision>{shape}</collision>" for shape in (skid, shank))
    made = propose_robot(on_shanks(both), "dog")
    robot = parse_robot(made.toml, made.urdf)
    for leg in robot.legs:
        assert isinstance(leg, ChainLeg)
        np.testing.assert_allclose(leg.end, [0.0, 0.0, -0.2])


def test_simple_shapes_go_before_meshes(init: Init) -> None:
    shaped = with_mesh(f'filename="{NAME}"').replace(
        "</visual></link>",
        '</visual><collision><origin xyz="0 0 -0.17"/><geometry><sphere radius="0.02"/></geometry>'
        "</collision></link>",
    )
    robot, _ = init(shaped)
    assert robot.legs[0].lengths[2] == pytest.approx(0.17)


@pytest.mark.variants("missing", "broken")
@pytest.mark.parametrize("content", [None, "no mesh", ""], ids=["missing", "broken", "empty"])
def test_without_its_mesh_a_shank_is_a_rod_and_the_remedy_is_named(
    content: str | None, init: Init, tmp_path: Path
) -> None:
    mesh = tmp_path / "dog_description" / "meshes" / "calf.obj"
    if content is None:
        mesh.unlink()
    else:
        mesh.write_text(content, encoding="utf-8")
    robot, said = init(with_mesh(f'filename="{NAME}"'))
    # Twice the way to the centre of mass.
    np.testing.assert_allclose([leg.lengths[2] for leg in robot.legs], 0.2)
    guess = next(note for note in said if note.startswith("leg FL_hip_joint: its end is a guess"))
    assert f"its mesh '{NAME}' was not found (`--package`)" in guess
    assert "`--foot FL_calf=0,0,-0.2`" in guess


def test_a_shank_without_a_centre_of_mass_is_as_long_as_the_link_before_it() -> None:
    point = BARE.replace('<origin xyz="0 0 -0.1"/>', "")
    made = propose_robot(point, "dog")
    assert any("as long as the link before it" in guess for guess in made.guesses)
    robot = parse_robot(made.toml, made.urdf)
    np.testing.assert_allclose([leg.lengths[2] for leg in robot.legs], 0.2)
    assert all(leg.foot((0.0, 0.0, 0.0))[2] == pytest.approx(-0.4) for leg in robot.legs)

    joined = point.replace('<origin xyz="0 0 -0.2"/>', '<origin xyz="0 0 0"/>')
    with pytest.raises(
        RobotFileError, match=r"'FL_calf' has no foot: give .* `--foot FL_calf=0,0,-0\.2`"
    ):
        propose_robot(joined, "dog")
