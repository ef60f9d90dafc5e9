"""Robot files by anybody: what is too long, too deep or too many is refused at once, by line."""

from __future__ import annotations

import time

import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.sim.robot.bounds import (
    DEEPEST,
    LONGEST_NAME,
    LONGEST_TOML,
    LONGEST_URDF,
    MOST_ATTRIBUTES,
    MOST_ELEMENTS,
    MOST_LEGS,
    MOST_LINKS,
    MOST_VALUES,
)
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import parse_robot
from tests.examples.paths import QUADRUPED

TOML, URDF = (
    (QUADRUPED / f"robot.{kind}").read_text(encoding="utf-8") for kind in ("toml", "urdf")
)
END = "</robot>"
LAST_LINE = 1 + TOML.count("\n")


def chain(links: int) -> str:
    """The quadruped's URDF with a tail of links that are fixed to each other."""
    parents = ["body", *(f"tail{k}" for k in range(links))]
    tail = "".join(
        f'<link name="tail{k}"/><joint name="weld{k}" type="fixed"><parent link="{parents[k]}"/>'
        f'<child link="tail{k}"/></joint>'
        for k in range(links)
    )
    return URDF.replace(END, tail + END)


def test_a_robot_at_the_bounds_is_read() -> None:
    own = URDF.count("<link ")
    robot = parse_robot(TOML + "\n" * (LONGEST_TOML - len(TOML)), chain(MOST_LINKS - own))
    assert len(robot.urdf.links) == MOST_LINKS
    assert len(limbs_of(robot)) == 4


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        (TOML + "\n" + ".".join("a" * 90_000) + " = 1", f"line {1 + LAST_LINE}: nested too deep"),
        (TOML + "\n" + ".".join("a" * (DEEPEST + 1)) + " = 1", f"{DEEPEST} tables, arrays"),
        (TOML + "\n[" + ".".join("a" * 90_000) + "]", "nested too deep"),
        (f"x = {'[' * 90_000}{']' * 90_000}", "line 1: nested too deep"),
        (f"x = {'{a = ' * 30_000}1{'}' * 30_000}", "line 1: nested too deep"),
        ('x = """a"""" , ' + "[" * 90_000, "line 1: nested too deep"),
        (f"x = [{'1,' * 90_000}]", f"line 1: has more than {MOST_VALUES} values"),
        ("x = " + "1" * 150_000, "integer string conversion"),
        (TOML + "#" * LONGEST_TOML, f"is longer than {LONGEST_TOML} characters"),
        (TOML + "# \ud800", "is not a valid Unicode character"),
        (TOML.replace("11.6", "1e300"), "supply.voltage: must be 0, or from 1e-15 to 1e+09"),
        (TOML.replace("11.6", "nan"), "supply.voltage: must be a finite number"),
        (TOML.replace("11.6", "9" * 400), "supply.voltage"),
        (TOML.replace("11.6", "1979-05-27"), "supply.voltage"),
        (TOML.replace("[motors.2232SR]", f"[motors.{'m' * 101}]"), f"at most {LONGEST_NAME} "),
        (TOML.replace("left_rear", "left\\u202erear"), "must contain only printable characters"),
        (TOML.replace("left_rear", "right_rear"), "is the name of another leg"),
        (TOML + TOML[TOML.rindex("[[legs]]") :] * MOST_LEGS, f"at most {MOST_LEGS} items"),
    ],
)
def test_a_toml_beyond_the_bounds_is_refused_with_the_way_out(toml: str, said: str) -> None:
    with pytest.raises(RobotFileError, match=r"^robot\.toml") as refused:
        parse_robot(toml, URDF)
    assert said in str(refused.value)
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        (chain(4500), f"has more than {MOST_LINKS} links"),
        (
            chain(2).replace(END, "<a/>" * MOST_ELEMENTS + END),
            f"more than {MOST_ELEMENTS} elements",
        ),
        (chain(2).replace(END, "<a>" * 100_000), "nested too deep"),
        (
            URDF.replace(END, "<a " + " ".join(f"a{k}=''" for k in range(65)) + "/>" + END),
            f"<a> has more than {MOST_ATTRIBUTES} attributes",
        ),
        (URDF.replace(END, f"<!--{' ' * LONGEST_URDF}-->{END}"), "longer than 800000 characters"),
        (URDF.replace('name="body"', f'name="{"b" * 5000}"'), "name of <link> is longer than 100"),
        (URDF.replace('xyz="', f'xyz="{"0 " * 5000}', 1), "xyz of <origin> is longer than 1000"),
        (
            URDF.replace('name="body"', 'name="bo&#x202e;dy"'),
            "must contain only printable characters",
        ),
        (URDF.replace('<mass value="', '<mass value="-', 1), "<mass> must not be negative"),
        (URDF.replace('<mass value="', '<mass value="1e99" was="', 1), "a number of 1e+09 at most"),
        (URDF.replace('<mass value="', '<mass value="nan" was="', 1), "is not a number"),
    ],
)
def test_a_urdf_beyond_the_bounds_is_refused_with_the_way_out(urdf: str, said: str) -> None:
    with pytest.raises(RobotFileError, match=r"^robot\.urdf") as refused:
        parse_robot(TOML, urdf)
    assert said in str(refused.value)
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize("line", ["[" + " " * 100_000, "x" + " " * 100_000, "[a" * 50_000])
def test_an_error_is_found_on_its_line_in_no_time_whatever_the_lines_before_are(line: str) -> None:
    begun = time.process_time()
    with pytest.raises(RobotFileError, match="line 1: described"):
        parse_robot(f'described = """\n{line}\n"""\n{TOML}', URDF)
    # By expressions that go back, a line of 400 blanks takes as long as this one may.
    assert time.process_time() - begun < 0.5


def test_a_robot_whose_files_were_read_once_is_not_read_again_to_be_distinguished_from_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robots = [{"toml": f"# {k}\n{TOML}", "urdf": URDF} for k in range(40)]
    for robot in robots:
        RobotFiles.model_validate(robot)
    monkeypatch.setattr("gaitswarm.sim.robot.robot.parse_robot", None)
    for robot in robots:
        RobotFiles.model_validate(robot)
