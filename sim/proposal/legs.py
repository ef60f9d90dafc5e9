"""Legs among the joints of a URDF, their ends, and the axes that point up and ahead."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import filter as matching
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Final, Literal, get_args
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.memory import rotations
from gaitswarm.sim.robot.bounds import LARGEST
from gaitswarm.sim.robot.description import JOINTS_PER_LEG, Leg
from gaitswarm.sim.robot.legs import Chain, ChainLeg, chain_of
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.shapes import visual_meshes
from gaitswarm.sim.robot.urdf import TURNS, Joint, Solid, Urdf, parse_urdf


def fixed_joint(name: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0") -> list[str]:
    """Return a fixed joint, with the child's position [m] and rotation [rad] in the parent."""
    return [
        f'  <joint name={quoteattr(name)} type="fixed">',
        f"    <parent link={quoteattr(parent)}/>",
        f"    <child link={quoteattr(child)}/>",
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
        "  </joint>",
    ]


def with_elements(urdf: str, lines: Sequence[str]) -> str:
    """Add elements at the end of a URDF, so that all other lines keep their numbers."""
    # Offsets count UTF-8 bytes, whatever encoding the text declares.
    content, end = urdf.encode(), 0
    parser = expat.ParserCreate("utf-8")

    def closed(_tag: str) -> None:
        nonlocal end
        end = parser.CurrentByteIndex

    parser.EndElementHandler = closed
    parser.Parse(content, True)
    added = "".join(f"{line}\n" for line in ("", *lines))
    return (content[:end] + added.encode() + content[end:]).decode()


Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
"""Axis of the frame of a URDF's first link."""

AXES: Final[tuple[Axis, ...]] = get_args(Axis)

_ROOT: Final = "robot_frame"
"""Name of the first link that is added to a rotated URDF."""

_FLAT: Final = 3.0
"""How much less hips spread across their plane than along z."""

_HANGS: Final = 0.1
"""Mean position of a foot over all angles, relative to the leg's length, beyond which it indicates
the side that feet are on."""

_SIDEWAYS: Final = 1.5
"""How much farther legs that indicate a direction stand, swing or lie apart along it."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Directions of a URDF's first link."""

    up: Axis | None = None  # None: z, unless the legs contradict it
    forward: Axis | None = None  # at right angles to `up`; None: x

    @property
    def right_angled(self) -> bool:
        return (self.up or "z")[-1] != (self.forward or "x")[-1]


AS_IT_IS: Final = Frame()
"""Unknown directions, to be inferred from the legs."""


def turned(urdf: str, root: str, links: Sequence[str], frame: Frame, level: float = 0.0) -> str:
    """Add a first link to a URDF that has z up and x ahead, its origin `level` higher [m]."""
    up, ahead = _vector(frame.up or "z"), _vector(frame.forward or "x")
    turn = np.array([ahead, np.cross(up, ahead), up])
    if (turn == np.eye(3)).all() and level == 0.0:
        return urdf
    name = next(n for n in (_ROOT, *(f"{_ROOT}{k}" for k in range(len(links)))) if n not in links)
    rpy = " ".join(map(repr, _roll_pitch_yaw(turn)))
    joint = fixed_joint(f"{name}_fixed", name, root, f"0 0 {-level!r}", rpy)
    return with_elements(urdf, [f'  <link name="{name}"/>', *joint])


def check_upright(urdf: Urdf, hips: Floats, feet: Floats) -> None:
    """Check that z can point up: hips are about level, and feet more below than above them.

    `hips` are (n_legs, 3) [m]; `feet` are means over all joint angles, relative to the hip in units
    of the leg's length, (n_legs, 3).
    """
    spread, mean = np.ptp(hips, axis=0), feet.mean(axis=0)
    across = int(spread.argmin())
    level = len(hips) <= 2 or spread[2] <= _FLAT * spread[across]
    if level and mean[2] <= _HANGS:
        return
    axis = 2 if level else across
    seen = ("" if mean[axis] < 0.0 else "-") + "xyz"[axis]
    why = (
        "feet reach above the hips"
        if level
        else f"the hips' plane is perpendicular to {'xyz'[axis]}"
    )
    raise RobotFileError(
        f"robot.urdf: link {next(iter(urdf.links))!r}: {seen} seems to point up in its frame, as"
        f" {why}; set `up` to the axis that does (`--up={seen}`), or to z"
    )


def sideways(legs: Sequence[ChainLeg], stance: Sequence[Sequence[float]]) -> bool:
    """Infer that a robot faces y, from feet ahead of and behind their hips in the stance [rad].

    Legs that turn about z and point along a body's length are believed.
    """
    length, width = np.ptp([leg.hip[:2] for leg in legs], axis=0)
    if length > _SIDEWAYS * width and all(leg.is_upright for leg in legs):
        return False
    sideways, ahead = 0.0, 0.0
    for leg, angles in zip(legs, stance, strict=True):
        if leg.is_upright:
            mounted = [float(np.clip(0.0, *leg.limits[0])), *angles[1:]]
            x, y = np.abs(np.array(leg.foot(mounted)) - leg.hip)[:2]
        else:
            _, slopes = leg.feet(np.array([angles]))
            y, x = np.abs(slopes[0, :2, 2])
        sideways, ahead = sideways + y, ahead + x
    return bool(ahead > _SIDEWAYS * sideways)


def _vector(axis: Axis) -> Floats:
    vector = np.zeros(3)
    vector["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return vector


def _roll_pitch_yaw(turn: Floats) -> tuple[float, float, float]:
    """Angles about fixed axes of a rotation by right angles, (3, 3) [rad]."""
    if turn[2, 0] == 0.0:
        return math.atan2(turn[2, 1], turn[2, 2]), 0.0, math.atan2(turn[1, 0], turn[0, 0])
    pitch = math.copysign(math.pi / 2.0, -turn[2, 0])
    return math.atan2(math.copysign(1.0, pitch) * turn[0, 1], turn[1, 1]), pitch, 0.0


MeshBounds = Callable[[str], Floats | None]
"""Returns least and largest coordinates of a mesh by its name in the URDF, (2, 3), unscaled; None
if it is missing or cannot be read."""


def no_meshes(_name: str) -> None:
    """Find no mesh, for a URDF without mesh files."""


@dataclass(frozen=True, slots=True)
class LegHints:
    """Hints about a robot. Names are those of the URDF, with the wildcards * and ?."""

    locks: Mapping[str, float] = field(
        default_factory=dict
    )  # joints to hold, each at an angle [rad]
    # ends of legs by a link at each leg's end, (3,) in that link's frame [m]
    feet: Mapping[str, Sequence[float]] = field(default_factory=dict)
    bounds: MeshBounds = no_meshes
    mass: float | None = None  # of the robot [kg]; None: the URDF's, unless it is impossible
    # names of listed actuators by joint; of several that match the last
    actuators: Mapping[str, str] = field(default_factory=dict)


NO_HINTS: Final = LegHints()


FOOT_NAME: Final = re.compile(r"foot|toe|sole|ankle|tip|contact", re.IGNORECASE)


@dataclass(frozen=True, slots=True, eq=False)
class LegEnd:
    """End of a leg in its last link's frame."""

    at: Floats  # position, (3,) [m]
    foot: str | None = None  # name of the frame there, if any
    sole: float | None = None  # radius of a sphere there [m], if any
    notes: tuple[str, ...] = ()  # guesses
    # alternatives that fit the shapes equally well, (n, 3) [m]
    others: Floats = field(default_factory=lambda: np.empty((0, 3)))


def end_of(urdf: Urdf, link: str, hints: LegHints = NO_HINTS) -> LegEnd:
    """Find a leg's end: a hint, a frame fixed to its last link, a sphere, the end of its shapes.

    A link without any is assumed to be a rod.
    """
    parts = [name for name, place in urdf.places.items() if place.body == link]
    given = [
        urdf.places[part].rotation @ np.asarray(at, dtype=np.float64) + urdf.places[part].position
        for pattern, at in hints.feet.items()
        for part in parts
        if fnmatchcase(part, pattern)
    ]
    if given:
        return LegEnd(given[-1])
    spheres = [(at, s.size[0]) for part in parts for at, s in _solids(urdf, part, "sphere")]
    others = [name for name in parts if name != link]
    named = [name for name in others if FOOT_NAME.search(name)]
    if others:
        far = max(named or others, key=lambda n: float(np.linalg.norm(urdf.places[n].position)))
        at = urdf.places[far].position
        if np.linalg.norm(at) > 0.0:
            near = [float(r) for centre, r in spheres if np.linalg.norm(centre - at) <= r]
            notes = () if named else (f"its end is the link {far!r}, the farthest one",)
            return LegEnd(at, far, max(near, default=None), notes)
    if spheres:
        at, radius = max(spheres, key=lambda s: float(np.linalg.norm(s[0])))
        note = f"its end is the sphere of the link {link!r}"
        return LegEnd(at, sole=float(radius), notes=(note,))
    of_shapes = [end for part in parts for at, s in _solids(urdf, part) for end in _ends(at, s)]
    ends = of_shapes or [end for part in parts for end in _mesh_ends(urdf, part, hints.bounds)]
    meshes = [mesh.name for part in parts for mesh in visual_meshes(urdf.links[part], {})]
    if ends:
        kind = "shape" if of_shapes else "mesh"
        note = f"its end is the lowest one of the {kind} of the link {link!r} when it stands"
        at = max(ends, key=lambda end: float(np.linalg.norm(end)))
        return LegEnd(at, notes=(note,), others=np.array(ends))
    lost = f", and its mesh {meshes[0]!r} was not found (`--package`)" if meshes else ""
    remedy = f"give its position in the link's frame [m], as `--foot {link}=0,0,-0.2`"
    guess = f"its end is a guess, as link {link!r} has no shape{lost}"
    rod = 2.0 * urdf.bodies[link].centre
    if rod.any():
        note = f"{guess}: a rod from its joint through its centre of mass; or {remedy}"
        return LegEnd(rod, notes=(note,))
    joint = next(joint for joint in urdf.joints if joint.child == link)
    before = joint.origin.matrix().T @ joint.origin.xyz
    straight = before - (before @ joint.axis) * joint.axis
    if not straight.any():
        raise RobotFileError(f"robot.urdf: link {link!r} has no foot{lost}: {remedy}")
    aside = np.cross(joint.axis, straight)
    note = f"{guess}: as long as the link before it; or {remedy}"
    return LegEnd(straight, notes=(note,), others=np.array([straight, aside, -aside]))


def _mesh_ends(urdf: Urdf, part: str, bounds: MeshBounds) -> Iterable[Floats]:
    """Yield centres of the faces of boxes around a link's meshes, in its body's frame."""
    place = urdf.places[part]
    for mesh in visual_meshes(urdf.links[part], {}):
        extent = bounds(mesh.name)
        if extent is None:
            continue
        ends = extent * mesh.scale
        middle, half = ends.mean(axis=0), np.ptp(ends, axis=0) / 2.0
        faces = np.concatenate([middle + np.diag(half), middle - np.diag(half)])
        turn = rotations().from_quat(mesh.origin[3:]).as_matrix()
        yield from (faces @ turn.T + mesh.origin[:3]) @ place.rotation.T + place.position


def _solids(urdf: Urdf, part: str, kind: str | None = None) -> Iterable[tuple[Floats, Solid]]:
    place = urdf.places[part]
    for solid in urdf.links[part].solids("collision"):
        if kind in (None, solid.kind):
            yield place.rotation @ solid.origin.xyz + place.position, solid


def _ends(at: Floats, solid: Solid) -> Iterable[Floats]:
    half = solid.size / 2.0 if solid.kind == "box" else np.full(3, solid.size[-1] / 2.0)
    turn = solid.origin.matrix()
    axes = turn.T * half[:, None] if solid.kind == "box" else (turn.T * half[:, None])[2:]
    yield from (at + axis for axis in axes)
    yield from (at - axis for axis in axes)


_ALIKE: Final = 0.01
"""Tolerance of equal distances, relative to the chain's length."""

_BY_HAND: Final = "or write robot.toml by hand, as docs/robots.md explains, if it is not a leg"


def check_look_alikes(urdf: Urdf, legs: Sequence[str]) -> None:
    """Reject a chain of joints that looks like a leg, but is not recognized as one."""
    paths = {name: _path(urdf, name) for name in urdf.links}
    of_legs = [paths[link] for link in legs]
    distances = [_distances(path) for path in of_legs]
    on_legs = {joint.name for path in of_legs for joint in path if not joint.fixed}
    for path in paths.values():
        moved = [joint for joint in path if not joint.fixed]
        if not moved or on_legs & {joint.name for joint in moved}:
            continue
        for leg, its in zip(of_legs, distances, strict=True):
            if len(path) == len(leg) and _same(_distances(path), its):
                raise RobotFileError(_difference(path, leg))


def _path(urdf: Urdf, link: str) -> list[Joint]:
    carriers = {joint.child: joint for joint in urdf.joints}
    path: list[Joint] = []
    while link in carriers:
        path.insert(0, carriers[link])
        link = carriers[link].parent
    return path


def _distances(path: Sequence[Joint]) -> Floats:
    """Distances between consecutive joints, (n,) [m]: equal for legs on any side."""
    return np.array([float(np.linalg.norm(joint.origin.xyz)) for joint in path])


def _same(one: Floats, other: Floats) -> bool:
    return bool((np.abs(one - other) <= _ALIKE * other.sum()).all())


def _difference(path: Sequence[Joint], leg: Sequence[Joint]) -> str:
    first = next(joint for joint in leg if not joint.fixed)
    for joint, its in zip(path, leg, strict=True):
        if joint.kind != its.kind and not (joint.kind in TURNS and its.kind in TURNS):
            return (
                f"robot.urdf: joint {joint.name!r} is {joint.kind}, but its chain is built like the"
                f" leg of joint {first.name!r}, where {its.name!r} is {its.kind}: change it,"
                f" {_BY_HAND}"
            )
    odd = next(joint for joint in path if not joint.fixed)
    return (
        f"robot.urdf: joint {odd.name!r} begins a chain that is built like the leg of joint"
        f" {first.name!r}, but has more joints or does not reach as far down within"
        f" its limits; check these and its orientation, {_BY_HAND}"
    )


_LISTED: Final = 6
"""Names that an error lists."""

_STEPS: Final = 25
"""Number of angles to try for each joint."""

_UNNAMED: Final = "-"

_SHARE_OF_THE_LONGEST: Final = 0.5
"""How far down a leg has to reach, relative to the chain that reaches furthest."""


@dataclass(frozen=True, slots=True, eq=False)
class FoundLeg:
    """A leg of a URDF."""

    joints: tuple[str, str, str]  # names, from the body outwards
    link: str  # name of the last link
    end: LegEnd


@dataclass(frozen=True, slots=True)
class FoundLegs:
    """Legs and held joints among a URDF's movable joints."""

    legs: tuple[FoundLeg, ...]  # in the order of their first joints in the file
    # all other movable joints, each at an angle within its limits [rad]
    held: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # a sentence for each held joint


_MOST_ALIKE: Final = 4
"""Number of chains of more than three joints from which they count as legs, not as arms."""


def locked_joints(urdf: Urdf, locks: Mapping[str, float]) -> dict[str, tuple[float, str]]:
    """Return the joints to hold, with angles [rad] and reasons: given ones, wheels, surplus ones.

    Surplus joints are held only where no legs of three joints are found.
    """
    movable = [joint.name for joint in urdf.joints if not joint.fixed]
    held: dict[str, tuple[float, str]] = {}
    for pattern, angle in locks.items():
        matches = matching(movable, pattern)
        if not matches:
            raise RobotFileError(
                f"robot.urdf: no movable joint {pattern!r} to lock; there are"
                f" {', '.join(movable[:_LISTED])}{', ...' if len(movable) > _LISTED else ''}"
            )
        held |= dict.fromkeys(matches, (angle, ", as requested"))
    longer = [
        chain
        for of_all in _chains(urdf)
        if len(chain := [joint for joint in of_all if joint.name not in held]) > JOINTS_PER_LEG
        and all(joint.kind in TURNS for joint in chain)
    ]
    for chain in longer:
        endless = [joint.limits[1] >= LARGEST for joint in chain]
        if len(chain) == JOINTS_PER_LEG + 1 and endless[-1] and not all(endless):
            held[chain[-1].name] = (0.0, ", as it turns a wheel")
    if held or any(map(_is_candidate, _chains(urdf))):
        return held
    counts = Counter(map(len, longer)).most_common(1)
    for chain in longer:
        if counts[0][1] >= _MOST_ALIKE and len(chain) == counts[0][0]:
            for joint in chain[JOINTS_PER_LEG:]:
                note = f", as legs have three joints; or lock others, as `--lock {chain[0].name}=0`"
                held[joint.name] = (_held_at(joint), note)
    return held


def find_legs(urdf: Urdf, *, upright: bool = False, hints: LegHints = NO_HINTS) -> FoundLegs:
    """Find legs: chains of three revolute joints from the body to a foot that reaches down."""
    movable = [joint for joint in urdf.joints if not joint.fixed]
    locked = locked_joints(urdf, hints.locks)
    if locked:
        urdf = parse_urdf(urdf.text, {name: at for name, (at, _) in locked.items()})
    chains = list(_chains(urdf))
    threes = [chain for chain in chains if _is_candidate(chain)]
    if len(threes) < 2:
        raise RobotFileError(_why_none(urdf, chains))
    found = [_leg_of(urdf, chain, hints) for chain in threes]
    kinematics = [chain_leg(urdf, leg.joints, leg.end.at) for leg in found]
    reached = [(leg, tried(leg)[1]) for leg in kinematics]
    drops = [leg.hip[2] - float(feet[:, 2].min()) for leg, feet in reached]
    if not upright:
        hips = np.array([leg.hip for leg, _ in reached])
        places = [(feet.mean(axis=0) - leg.hip) / sum(leg.lengths) for leg, feet in reached]
        check_upright(urdf, hips, np.array(places))
    legs = [
        leg
        for leg, drop in zip(found, drops, strict=True)
        if drop > 0.0 and drop >= _SHARE_OF_THE_LONGEST * max(drops)
    ]
    if len(legs) < 2:
        raise RobotFileError(
            "robot.urdf: fewer than two chains of three joints reach below the body; z must point"
            " up in the frame of its first link, or set `up` to the axis that does"
        )
    check_look_alikes(urdf, [leg.link for leg in legs])
    owned = {name for leg in legs for name in leg.joints}
    parts = [name for name, place in urdf.places.items() if place.body in {g.link for g in legs}]
    for pattern in hints.feet:
        if not matching(parts, pattern):
            raise RobotFileError(
                f"robot.urdf: no leg ends with a link {pattern!r}, to have its foot; legs end with"
                f" {', '.join(parts[:_LISTED])}{', ...' if len(parts) > _LISTED else ''}"
            )
    others = {j.name: locked.get(j.name, (_held_at(j), "")) for j in movable if j.name not in owned}
    return FoundLegs(
        tuple(legs),
        {name: at for name, (at, _) in others.items()},
        tuple(f"joint {name!r} is held at {at:g} rad{why}" for name, (at, why) in others.items()),
    )


def chain_leg(urdf: Urdf, joints: Sequence[str], end: Sequence[float] | Floats) -> ChainLeg:
    """Kinematics of three joints at mid-range, to an end in the last link's frame (3,) [m]."""
    last = next(joint.child for joint in urdf.joints if joint.name == joints[-1])
    first, second, third = joints
    chain = chain_of(
        urdf,
        Leg(
            name=_UNNAMED,
            phase=0.0,
            actuators=(_UNNAMED, _UNNAMED, _UNNAMED),
            own_joints=(first, second, third),
            own_foot=last,
        ),
    )
    return _kinematics(first, chain, np.asarray(end, dtype=np.float64))


def _kinematics(name: str, chain: Chain, end: Floats) -> ChainLeg:
    middle = np.clip(chain.limits, -np.pi, np.pi).mean(axis=1)
    return ChainLeg.of(name, chain, end, middle)


def reach_below(robot: Robot, number: int) -> float:
    """Return how far a leg's foot gets below the highest hip within the joints' limits [m]."""
    leg = robot.description.legs[number]
    kinematics = _kinematics(leg.name, (chain := chain_of(robot.urdf, leg)), chain.foot)
    _, feet = tried(kinematics)
    return max(leg.hip[2] for leg in robot.legs) - float(feet[:, 2].min())


def tried(leg: ChainLeg) -> tuple[Floats, Floats]:
    """Return a grid of a leg's angles within their limits and one turn, and its feet, (n, 3)."""
    numbers = (leg.rotations, leg.offsets, leg.axes, leg.end, leg.limits)
    return _tried(_Tried(b"".join(part.tobytes() for part in numbers), leg))


@dataclass(frozen=True, slots=True)
class _Tried:
    """Legs of equal numbers are equal: one is found several times, for stances of each height."""

    numbers: bytes
    leg: ChainLeg = field(compare=False)


@lru_cache(maxsize=16)
def _tried(of: _Tried) -> tuple[Floats, Floats]:
    ends = np.clip(of.leg.limits, -np.pi, np.pi)
    axes = [np.linspace(lower, upper, _STEPS) for lower, upper in ends]
    angles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, JOINTS_PER_LEG)
    feet = of.leg.ends(angles)
    angles.flags.writeable = feet.flags.writeable = False
    return angles, feet


def _chains(urdf: Urdf) -> Iterable[tuple[Joint, ...]]:
    """Yield chains of movable joints from the body, each up to its first branching."""
    behind: dict[str, list[Joint]] = {}
    for joint in urdf.joints:
        if not joint.fixed:
            behind.setdefault(urdf.places[joint.parent].body, []).append(joint)
    for first in behind.get(next(iter(urdf.links)), []):
        chain = [first]
        while len(carried := behind.get(chain[-1].child, [])) == 1:
            chain.append(carried[0])
        # A branching end, such as an arm with fingers, is not a foot.
        yield (*chain, *carried) if carried else tuple(chain)


def _is_candidate(chain: Sequence[Joint]) -> bool:
    return len(chain) == JOINTS_PER_LEG and all(joint.kind in TURNS for joint in chain)


def _why_none(urdf: Urdf, chains: Sequence[Sequence[Joint]]) -> str:
    if not chains:
        return "robot.urdf: it has no movable joint; legs need three revolute joints"
    counts = sorted({len(chain) for chain in chains})
    kinds = sorted({j.kind for chain in chains for j in chain} - TURNS)
    long = max(chains, key=len) if counts[-1] > JOINTS_PER_LEG else ()
    chains_text = (
        f"{len(chains)} chain{'s' * (len(chains) > 1)} of {', '.join(map(str, counts))} joints"
    )
    if kinds:
        chains_text += f", some of them {', '.join(kinds)}"
    return (
        f"robot.urdf: legs need three revolute joints, but"
        f" {next(iter(urdf.links))!r} carries {chains_text}"
        + (f"; hold surplus ones, as `--lock {long[-1].name}=0` [rad]" if long else "")
    )


def _leg_of(urdf: Urdf, chain: Sequence[Joint], hints: LegHints) -> FoundLeg:
    first, second, third = (joint.name for joint in chain)
    link = chain[-1].child
    return FoundLeg((first, second, third), link, end_of(urdf, link, hints))


def _held_at(joint: Joint) -> float:
    lower, upper = joint.limits
    return float(np.clip(0.0, lower, upper)) if joint.kind in TURNS else 0.0
