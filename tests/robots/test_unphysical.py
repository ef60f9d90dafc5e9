"""Impossible masses and inertias: `init` and `check` warn of each, with its line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gaitswarm.cli.main import run
from tests.robots.wrong_files import SOURCE

MOMENTS = '<inertia ixx="1e-3" iyy="1e-3" izz="1e-4" ixy="0" iyz="0" ixz="0"/>'
HIP = '<link name="FL_hip">\n'
CALF = '<link name="FL_calf">\n'


def with_moments(urdf: str, link: str, moments: str) -> str:
    """A link of other moments."""
    before, after = urdf.split(link)
    return before + link + after.replace(MOMENTS, moments, 1)


def without_inertial(urdf: str, link: str) -> str:
    before, after = urdf.split(link)
    return before + link + re.sub("<inertial>.*?</inertial>", "", after, count=1, flags=re.DOTALL)


def tensor(**moments: str) -> str:
    all_of_them = {"ixx": "0", "iyy": "0", "izz": "0", "ixy": "0", "iyz": "0", "ixz": "0"} | moments
    attributes = " ".join(f'{name}="{value}"' for name, value in all_of_them.items())
    return f"<inertia {attributes}/>"


NEGATIVE = tensor(ixx="-1e-3", iyy="1e-3", izz="1e-3")
TOO_LARGE = tensor(ixx="1e-3", iyy="1e-3", izz="1e-2")
TURNED_NEGATIVE = tensor(ixx="1e-3", iyy="1e-3", izz="1e-3", ixy="2e-3")


def warnings_of(urdf: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[list[str]]:
    """Of `init` and of `check`, which have the same lines."""
    (folder / "mine.urdf").write_text(urdf, encoding="utf-8")
    command = ["robot", "init", str(folder / "mine.urdf"), "--output", str(folder / "made")]
    assert run([*command, "--json"]) == 0
    guesses = json.loads(capsys.readouterr().out)["guesses"]
    assert run(["robot", "check", str(folder / "made"), "--json"]) == 0
    warned = json.loads(capsys.readouterr().out)["warnings"]
    return [
        [said.removeprefix("warning: ") for said in guesses if said.startswith("warning: ")],
        [said for said in warned if "robot.urdf" in said],
    ]


@pytest.mark.variants
@pytest.mark.parametrize(
    ("urdf", "link", "said"),
    [
        (with_moments(SOURCE, HIP, NEGATIVE), HIP, r"moments -0\.001, 0\.001, 0\.001"),
        (with_moments(SOURCE, HIP, TOO_LARGE), HIP, r"moments 0\.001, 0\.001, 0\.01 kg m2"),
        (with_moments(SOURCE, HIP, TURNED_NEGATIVE), HIP, r"moments -0\.001, 0\.001, 0\.003"),
        (with_moments(SOURCE, CALF, tensor()), CALF, "moments 0, 0, 0 kg m2.*check its <inertia"),
        (without_inertial(SOURCE, CALF), CALF, "have no mass: give it an <inertial>"),
    ],
    ids=["negative", "triangle", "negative off the diagonal", "all zero", "no inertial"],
)
def test_init_and_check_warn_of_impossible_inertia_by_line(
    urdf: str, link: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = urdf[: urdf.index(link)].count("\n") + 1
    for found in warnings_of(urdf, tmp_path, capsys):
        assert len(found) == 1, found
        assert re.match(rf"robot\.urdf, line {line}: link .*{said}", found[0]), found


@pytest.mark.thorough("test_init_and_check_warn_of_impossible_inertia_by_line")
def test_a_part_of_a_body_is_named_only_where_the_whole_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mass point and filled-in moments harm no body that has its own."""
    harmless, filled = tensor(), tensor(ixx="1e-6", iyy="1e-6", izz="1e-6", ixy="1e-6", iyz="1e-6")
    for name, moments, count in (("none", harmless, 0), ("ones", filled, 0), ("less", NEGATIVE, 1)):
        camera = f'<link name="camera"><inertial><mass value="0.1"/>{moments}</inertial></link>'
        weld = '<joint name="c" type="fixed"><parent link="trunk"/><child link="camera"/></joint>'
        (tmp_path / name).mkdir()
        urdf = SOURCE.replace("</robot>", f"{camera}\n{weld}\n</robot>")
        for found in warnings_of(urdf, tmp_path / name, capsys):
            assert len(found) == count, found
            assert all("link 'camera': a body of 0.1 kg cannot" in said for said in found), found
