"""Wrong files of robots, with the error and its place."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from gaitswarm.sim.proposal.document import propose_robot
from tests.examples.hostile import chain
from tests.robots.test_proposal import dog

SOURCE: Final = dog().replace("><", ">\n<")
_MADE: Final = propose_robot(SOURCE, "dog")
TOML: Final = _MADE.toml
URDF: Final = _MADE.urdf

_SPARE: Final = '<link name="spare"/>'
_WELD: Final = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'
_LIMIT: Final = '<limit lower="-1.0" upper="3.5" effort="30.0" velocity="20"/>'


@dataclass(frozen=True)
class Wrong:
    """A wrong robot.urdf or robot.toml.

    name: of the test; text: of the file; said: a regular expression for what is wrong and for the
    way out; at: what the line has that is named, None if none is; is_urdf: which file it is.
    """

    name: str
    text: str
    said: str
    at: str | None = None
    is_urdf: bool = True


def _urdf(name: str, old: str, new: str, said: str, at: str | None = None) -> Wrong:
    """The first of what is replaced is that of the leg FL."""
    assert old in SOURCE, name
    return Wrong(name, SOURCE.replace(old, new, 1), said, at)


def _more(name: str, text: str, said: str, at: str | None = None) -> Wrong:
    return _urdf(name, "</robot>", f"\n{text}\n</robot>", said, at)


def _toml(name: str, old: str, new: str, said: str, at: str | None = None) -> Wrong:
    assert old in TOML, name
    return Wrong(name, TOML.replace(old, new, 1), said, at, is_urdf=False)


def _line(begin: str) -> str:
    return next(line for line in TOML.splitlines() if line.startswith(begin))


_needs: Callable[[str], str] = "link 'FL_hip': its <inertial> needs {}".format

WRONG_URDFS: Final = (
    _urdf("no mass", '<mass value="0.3"/>', "", _needs("a <mass>"), 'link name="FL_hip"'),
    _urdf(
        "no inertia",
        '<mass value="0.3"/>\n  <inertia',
        '<mass value="0.3"/>\n  <inert',
        _needs("a <mass> and an <inertia>"),
        'link name="FL_hip"',
    ),
    Wrong(
        "weightless",
        re.sub(r"<inertial>.*?</inertial>", "", SOURCE, flags=re.DOTALL),
        "'trunk' and everything attached to it have no mass; give links an <inertial>",
        'link name="trunk"',
    ),
    Wrong(
        "masses of 0",
        re.sub(r'mass value="[^"]*"', 'mass value="0"', SOURCE),
        "have no mass; give links an <inertial>",
        'link name="trunk"',
    ),
    _urdf("mass of NaN", 'value="0.3"', 'value="nan"', "'nan' of <mass> is not a number", "<mass"),
    _urdf("mass below 0", 'value="0.3"', 'value="-1"', "must not be negative", "FL_hip"),
    _urdf("decimal comma", 'value="0.3"', 'value="0,3"', "'0,3' of <mass> is not a num", "<mass"),
    _urdf("no ixx", '<inertia ixx="1e-3"', "<inertia", "ixx='' of <inertia> is not a number"),
    _more("two roots", _SPARE, r"found: 'trunk', 'spare'; .* attach the others"),
    _more(
        "closed chain",
        _WELD.format("bar", "FL_calf", "FR_calf"),
        "'bar' carries link 'FR_calf', which another joint already carries; .* open",
        "bar",
    ),
    _more(
        "loop",
        f"{_SPARE}\n{_WELD.format('w', 'spare', 'spare')}",
        "'spare' is not attached to the body: .* open the loop",
        '<link name="spare"/>',
    ),
    _more(
        "no such link",
        _WELD.format("w", "trunk", "moon"),
        "'w' refers to a missing link 'moon'; add the link",
        '"moon"',
    ),
    _more("link twice", '<link name="FL_hip"/>', "'FL_hip' is defined twice; rename", '"FL_hip"/>'),
    _more(
        "joint twice",
        f"{_SPARE}\n{_WELD.format('FL_hip_joint', 'trunk', 'spare')}",
        "'FL_hip_joint' is defined twice; rename one",
        "spare",
    ),
    _urdf(
        "limits in degrees",
        _LIMIT,
        _LIMIT.replace("-1.0", "-57").replace("3.5", "200"),
        r"limits -57 and 200 seem to be in degrees.*radians \(45 degrees are 0\.7854",
        "FL_thigh_joint",
    ),
    _urdf(
        "frame in degrees",
        '<origin xyz="0 0 -0.2"/>',
        '<origin xyz="0 0 -0.2" rpy="0 90 0"/>',
        r"rpy='0 90 0' of <origin> seems to be in degrees.* 90 degrees are 1\.5708",
        'rpy="0 90 0"',
    ),
    _urdf("no limit", _LIMIT, "", "has no <limit> .*<limit lower=.*continuous", "FL_thigh_joint"),
    _urdf(
        "limit without effort",
        _LIMIT,
        '<limit lower="-1" upper="3" velocity="1"/>',
        "has no <limit> with effort",
        "FL_thigh_joint",
    ),
    _urdf("limits exchanged", 'lower="-0.8"', 'lower="1.8"', "above the upper one .* swap", "FL_h"),
    _urdf(
        "coupled joints",
        _LIMIT,
        f'{_LIMIT}<mimic joint="FL_hip_joint"/>',
        r"mimics joint 'FL_hip_joint' \(<mimic>\), .* remove <mimic> if",
        "FL_thigh_joint",
    ),
    _urdf(
        "no axis", 'axis xyz="1 0 0"', 'axis xyz="0 0 0"', "axis must not be zero", "FL_hip_joint"
    ),
    Wrong("sliders", SOURCE.replace('"revolute"', '"prismatic"'), "prismatic"),
    _urdf(
        "unknown type",
        'type="revolute"',
        'type="hinge"',
        "type='hinge' of <joint> must be one of revolute",
        "hinge",
    ),
    Wrong("two joints a leg", dog(joints=2), "three (revolute )?joints"),
    _urdf("nested", "</robot>", "\n" + "<a>" * 99 + "</a>" * 99 + "</robot>", "16 elements", "<a>"),
    _urdf(
        "entity", "<robot", '<!DOCTYPE robot [<!ENTITY a "b">]><robot', "remove <!DOCTYPE>", "DOCT"
    ),
    Wrong("4 500 links", chain(4500), "has more than 256 links", "<link"),
    Wrong("too long", SOURCE + " " * 800_000, "800000 characters"),
    Wrong("JSON", '{"links": []}', "line 1: not well-formed XML: "),
    Wrong("broken off", SOURCE[: len(SOURCE) // 2], "line "),
    Wrong("empty", "", "is empty; it must contain the URDF of a robot"),
    Wrong("SDF", "<sdf><model/></sdf>", "its root element is <sdf>.*convert SDF"),
    Wrong("xacro", '<robot><link_of name="a"/></robot>', "no <link>.*xacro FILE.xacro"),
    _urdf(
        "name of two lines",
        'k name="FL_calf"',
        'k name="FL&#10;calf"',
        "printable characters",
        "FL&#10;",
    ),
    _urdf(
        "long name",
        'k name="FL_calf"',
        f'k name="{"l" * 101}"',
        "longer than 100 characters",
        "l" * 101,
    ),
)

WRONG_TOMLS: Final = (
    _toml(
        "unknown joint",
        '"FL_hip_joint"',
        '"FL_hipjoint"',
        r"no joint 'FL_hipjoint' \(did you mean 'FL_hip_joint'\?\); name the leg's three joints",
        "joints =",
    ),
    _toml(
        "unknown foot",
        'foot = "FL_calf_foot"',
        'foot = "FL_calf_fot"',
        r"no link or fixed joint 'FL_calf_fot' \(did you mean 'FL_calf_foot'\?\)",
        "foot =",
    ),
    _toml(
        "foot of another leg",
        'foot = "FL_calf_foot"',
        'foot = "FR_calf_foot"',
        "is not on its last link 'FL_calf'; name a link",
        "foot =",
    ),
    _toml(
        "stance in degrees",
        _line("stance = "),
        "stance = [0.0, 45.0, -90.0]",
        r"at 45 rad, but robot.urdf limits it .*45 degrees are 0\.7854 rad",
        "stance =",
    ),
    _toml(
        "stance beyond a limit",
        _line("stance = "),
        "stance = [0.0, 0.8, -2.8]",
        r"'FL_calf_joint' at -2\.8 rad, but robot\.urdf limits it to -2\.7 to -0\.8 rad",
        "stance =",
    ),
    _toml("leg twice", 'name = "FR"', 'name = "FL"', "FL"),
    _toml("joint of two legs", '"FR_hip_joint"', '"FL_hip_joint"', "more than one leg"),
    _toml("syntax", "[supply]", "[supply", "line "),
    _toml("misspelt", "friction = 0.8", "fricton = 0.8", r"contact\.friction: ", "[contact]"),
    _toml("no friction", _line("friction = "), "", r"contact\.friction: is missing", "[contact]"),
    _toml(
        "text for a number", "friction = 0.8", 'friction = "high"', "must be a number", "friction"
    ),
    _toml("not a number", "friction = 0.8", "friction = nan", "friction", "friction"),
    _toml("unknown actuator", '["drive1"', '["drive9"', "drive9"),
    _toml("deep key", "[contact]", f"{'a.' * 99}a = 1\n[contact]", "16 tables", "a.a"),
    _toml("unknown held joint", "[contact]", "[held_joints]\nneck = 0.0\n[contact]", "remove it"),
    Wrong("no TOML", "<robot/>", "line 1", is_urdf=False),
    Wrong("no character", TOML + "\0", "line ", is_urdf=False),
)
