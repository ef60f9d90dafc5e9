"""A proposed robot as files, made in a limited process for untrusted URDFs."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import takewhile
from typing import Any, Final
from xml.etree import ElementTree as ET
from xml.sax.saxutils import quoteattr

import numpy as np

from gaitswarm.sim.errors import ProcessEnded, RobotFileError, SimulationInputError
from gaitswarm.sim.limited_process import Document, LimitedProcesses, serve
from gaitswarm.sim.proposal.drive import (
    ACTUATOR_NOTES,
    ActuatorChoice,
    DriveNumbers,
    SoleNumbers,
    actuator_tables,
    chosen_kind,
    drive_names,
    propose_drives,
    propose_sole,
    proposed_control,
    quoted,
    weak_actuators,
)
from gaitswarm.sim.proposal.formats import as_urdf
from gaitswarm.sim.proposal.legs import (
    AS_IT_IS,
    NO_HINTS,
    FoundLeg,
    FoundLegs,
    Frame,
    LegHints,
    chain_leg,
    find_legs,
    fixed_joint,
    sideways,
    turned,
    with_elements,
)
from gaitswarm.sim.proposal.stance import (
    HEIGHTS,
    NoStance,
    Stance,
    alternating_phases,
    choose_stance,
    propose_scenarios,
    walk_within_reach,
)
from gaitswarm.sim.robot.bounds import check_urdf
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.robot import parse_robot
from gaitswarm.sim.robot.urdf import Urdf, by_line, parse_urdf, unphysical

_LEVEL: Final = 0.2
"""Accepted height of hips above or below the body's origin, relative to the legs' length."""

_LOWER: Final = 0.02
"""How much lower than the farthest end another one must be, relative to the leg's length."""


def stood_up(urdf: str, frame: Frame, hints: LegHints) -> tuple[str, FoundLegs, list[str]]:
    """Find the legs of a URDF and give it a frame with z up, x ahead and hips about level.

    A body moves by its origin: one on the ground would count as fallen from the start.
    """
    root, *others = parse_urdf(urdf).links
    text = turned(urdf, root, [root, *others], frame)
    legs_found = find_legs(parse_urdf(text), upright=frame != AS_IT_IS, hints=hints)
    tree = parse_urdf(text, legs_found.held)
    legs = [chain_leg(tree, leg.joints, leg.end.at) for leg in legs_found.legs]
    level = float(f"{np.mean([leg.hip[2] for leg in legs]):.3g}")
    if abs(level) <= _LEVEL * max(sum(leg.lengths) for leg in legs):
        return text, _at_their_lowest(text, legs_found), []
    side = "above" if level > 0.0 else "below"
    note = f"the body's frame is {abs(level):g} m {side} that of {root!r}, level with the hips"
    text = turned(urdf, root, [root, *others], frame, level)
    return text, _at_their_lowest(text, legs_found), [note]


def _at_their_lowest(urdf: str, found: FoundLegs) -> FoundLegs:
    """Put ends of legs that only shapes indicate at their lowest point in the stance."""
    if not any(len(leg.end.others) for leg in found.legs):
        return found
    tree = parse_urdf(urdf, found.held)
    legs = [chain_leg(tree, leg.joints, leg.end.at) for leg in found.legs]
    lowered = []
    for leg, chain, angles in zip(found.legs, legs, choose_stance(legs).angles, strict=True):
        low = chain.foot(angles)[2] - _LOWER * sum(chain.lengths)
        heights = [replace(chain, end=end).foot(angles)[2] for end in leg.end.others]
        if heights and min(heights) < low:
            lowest = leg.end.others[int(np.argmin(heights))]
            leg = replace(leg, end=replace(leg.end, at=lowest))  # noqa: PLW2901
        lowered.append(leg)
    return replace(found, legs=tuple(lowered))


def with_feet(urdf: str, legs: Sequence[FoundLeg]) -> tuple[str, list[str]]:
    feet = [leg.end.foot or f"{leg.link}_foot" for leg in legs]
    lines = []
    for leg, foot in zip(legs, feet, strict=True):
        if leg.end.foot is None:
            at = " ".join(map(repr, leg.end.at.tolist()))
            lines += [
                f"  <link name={quoteattr(foot)}/>",
                *fixed_joint(f"{foot}_fixed", leg.link, foot, at),
            ]
    return with_elements(urdf, lines) if lines else urdf, feet


_AIR, _DENSITY = 1.2, 150.0
"""Mass of a robot by the cube of its legs' length [kg/m3]: below the first one it would fly; the
second one is usual."""

_SPREAD: Final = 1.0
"""Largest radius of gyration of a link, relative to the legs' length."""

_BALL: Final = 200.0
"""Density of a ball in place of an implausible inertia [kg/m3]."""


def _with_plausible_inertias(
    text: str, held: Mapping[str, float], legs: Sequence[ChainLeg], mass: float | None
) -> tuple[str, Urdf, list[str]]:
    """Scale masses to a given or plausible sum [kg], and replace inertias of far too large bodies.

    Returns:
        The changed URDF as text and parsed, and a sentence on each change.
    """
    tree, notes = parse_urdf(text, held), list[str]()
    length = max(sum(leg.lengths) for leg in legs)
    masses = {part: body.mass for part, body in tree.bodies.items()}
    shares = dict.fromkeys(masses, 1.0 if mass is None else mass / tree.total_mass)
    if tree.total_mass < _AIR * length**3:
        mass = mass or float(f"{_DENSITY * length**3:.2g}")
        notes.append(
            f"its masses are placeholders, {tree.total_mass:.2g} kg in all: it is taken to have"
            f" {mass:g} kg (`--mass`), half of them in its body"
        )
        trunk = next(iter(masses))
        if 0.0 < masses[trunk] < tree.total_mass:
            shares = dict.fromkeys(masses, 0.5 * mass / (tree.total_mass - masses[trunk]))
            shares[trunk] = 0.5 * mass / masses[trunk]
    odd = [
        name
        for name, link in tree.links.items()
        if np.trace(link.inertia.rotational) > 2.0 * link.inertia.mass * (_SPREAD * length) ** 2
    ]
    if odd:
        more = f" and {len(odd) - 1} others" if len(odd) > 1 else ""
        notes.append(
            f"the inertia of link {odd[0]!r}{more} would need a body larger than the robot: that of"
            " a ball is used"
        )
    if mass is None and not odd:
        return text, tree, notes
    root = ET.fromstring(text)  # noqa: S314 - it was checked when it was parsed
    for link in root.findall("link"):
        name = link.get("name", "")
        share = shares[tree.places[name].body]
        scaled = tree.links[name].inertia.mass * share
        ball = 0.4 * scaled * (3.0 * scaled / (4.0 * math.pi * _BALL)) ** (2.0 / 3.0)
        for element in link.findall("inertial/mass"):
            element.set("value", repr(scaled))
        for element in link.findall("inertial/inertia"):
            for key, value in element.items():
                moment = ball if key in ("ixx", "iyy", "izz") else 0.0
                element.set(key, repr(moment if name in odd else float(value) * share))
    text = ET.tostring(root, encoding="unicode")
    return text, parse_urdf(text, held), notes


_PREFERENCE: Final = "C"
"""Without biases, it ranks walks of robots of any size alike, though scaled to one hexapod."""

_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,59}")
"""Gait parameters that a single leg may have."""

_PART: Final = re.compile(r"[_\-. ]")
"""Separators in names."""

_TWO_LEGS: Final = (
    "two legs with point feet do not balance by themselves, and controllers hold joints, not"
    " balance: expect falls"
)

_ELSE: Final = "battery, rotors, sensors, ground and load are guesses, explained in robot.toml"

_SIDEWAYS: Final = (
    "warning: it seems to face y and would walk sideways: set the axis that points ahead as"
    " `forward` (`--forward=y` or `--forward=-y`), or x if it does"
)


@dataclass(frozen=True, slots=True)
class Proposal:
    """A proposed robot's files."""

    toml: str
    urdf: str  # text of robot.urdf.
    job: dict[str, Any]  # defaults of this robot's jobs, as a spec
    guesses: tuple[str, ...]  # one sentence each, also in robot.toml
    problems: tuple[
        str, ...
    ] = ()  # masses and inertias of the URDF that are impossible, one sentence each

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.guesses, *(f"warning: {problem}" for problem in self.problems))

    def with_guesses(self, more: Sequence[str], **changed: Any) -> Proposal:
        guesses = tuple(dict.fromkeys([*self.guesses, *more]))
        toml = self.toml.replace(_guesses(self.guesses), _guesses(guesses), 1)
        return replace(self, toml=toml, guesses=guesses, **changed)


def propose_robot(
    urdf: str,
    name: str,
    actuator: ActuatorChoice = "auto",
    frame: Frame = AS_IT_IS,
    hints: LegHints = NO_HINTS,
    height: float = HEIGHTS[0],
) -> Proposal:
    """Propose a robot whose hips stand at a share of the legs' reach."""
    with by_line(urdf):
        urdf, found, moved = stood_up(urdf, frame, hints)
    text, feet = with_feet(urdf, found.legs)
    tree, names = parse_urdf(text, found.held), _leg_names(found.legs)
    joints = [leg.joints for leg in found.legs]
    legs = [chain_leg(tree, leg.joints, leg.end.at) for leg in found.legs]
    text, tree, notes = _with_plausible_inertias(text, found.held, legs, hints.mass)
    with by_line(urdf):
        stance = choose_stance(legs, height)
    standing = [
        replace(leg, stance=np.array(angles))
        for leg, angles in zip(legs, stance.angles, strict=True)
    ]
    drives = propose_drives(tree, joints, legs, stance, hints.actuators)
    kind = chosen_kind(actuator, drives)
    sole, sole_note = propose_sole(tree, legs, stance, [leg.end.sole for leg in found.legs])
    toml = "\n".join(
        [
            *_head(name, len(legs), tree.total_mass),
            *actuator_tables(kind, drives),
            *_ground(sole, sole_note, stance),
            *_legs(found, names, feet, stance, alternating_phases(standing), drives),
            *_held(found),
        ]
    )
    job = {
        "preference": _PREFERENCE,
        **proposed_control(kind, drives, propose_scenarios(stance, sole.length, names)),
    }
    notes += [*moved, _TWO_LEGS] if len(legs) == 2 else moved
    if frame.forward is None and sideways(legs, stance.angles):
        notes.append(_SIDEWAYS)
    notes += [f"leg {leg.joints[0]}: {note}" for leg in found.legs for note in leg.end.notes]
    notes += weak_actuators(tree, joints, legs, stance, drives)
    notes += sorted({drive.note for of_leg in drives for drive in of_leg})
    notes += [
        *([] if hints.actuators else [ACTUATOR_NOTES[kind]]),
        f"feet stand {stance.height:.3g} m below the hips, at {height:.0%} of the legs' reach",
        f"soles are {sole.length:g} m long: {sole_note}",
        _ELSE.replace("rotors, ", "") if hints.actuators else _ELSE,
    ]
    notes += found.notes
    made = Proposal(toml + "\n", text, job, (), tuple(unphysical(tree, text)))
    return made.with_guesses(notes)


def _head(name: str, legs: int, mass: float) -> list[str]:
    return [
        f"# {name}: made by `gaitswarm robot init` from the URDF next to this file.",
        "# Comments explain how missing values are guessed. All fields, with units:",
        "# docs/robots.md.",
        "",
        f"name = {quoted(name)}",
        f"description = {quoted(f'{legs} legs of three joints, {mass:.3g} kg.')}",
        "load_height = 0.05                  # m, of a load above the body's origin; guessed",
        _guesses(()),
    ]


def _guesses(sentences: Sequence[str]) -> str:
    return "\n".join(
        [
            "# Shown by `gaitswarm robot check`; remove those you have verified.",
            "guesses = [",
            *(f"  {quoted(sentence)}," for sentence in sentences),
            "]",
        ]
    )


def _ground(sole: SoleNumbers, note: str, stance: Stance) -> list[str]:
    sinking = f"half the legs sink in by 1 % of {stance.height:.3g} m"
    return [
        "",
        "[contact]",
        f"stiffness = {sole.stiffness:g}      # N/m: {sinking}",
        f"damping = {sole.damping:g}          # N s/m: 0.7 of critical",
        f"sole = {sole.length:g}              # m, {note}",
        "friction = 0.8                      # guessed",
        "slip_velocity = 0.05                # m/s",
    ]


def _legs(
    found: FoundLegs,
    names: Sequence[str],
    feet: Sequence[str],
    stance: Stance,
    phases: Sequence[float],
    drives: Sequence[Sequence[DriveNumbers]],
) -> list[str]:
    kinds = drive_names(drives)
    lines = ["", "# Neighbours alternate: a trot on four legs, a tripod on six."]
    for k, leg in enumerate(found.legs):
        lines += [
            "",
            "[[legs]]",
            f"name = {quoted(names[k])}",
            f"joints = [{', '.join(map(quoted, leg.joints))}]",
            f"foot = {quoted(feet[k])}",
            f"stance = [{', '.join(map(repr, stance.angles[k]))}]    # rad, chosen",
            f"phase = {phases[k]}                 # start of support, share of the cycle",
            f"actuators = [{', '.join(quoted(kinds[drive]) for drive in drives[k])}]",
        ]
    return lines


def _held(found: FoundLegs) -> list[str]:
    if not found.held:
        return []
    lines = ["", "[held_joints]                       # belong to no leg; rad"]
    return lines + [f"{quoted(name)} = {float(at)}" for name, at in found.held.items()]


def _leg_names(legs: Sequence[FoundLeg]) -> list[str]:
    """Name legs by the beginning of their joints' names without its common end, or by number."""
    begins = [_shared_beginning(leg.joints) for leg in legs]
    # The end of leg1_j and leg2_j, with joints leg1_j1, leg1_j2 ..., belongs to the joints.
    end = _shared_beginning([begin[::-1] for begin in begins])[::-1]
    part = _PART.search(end)
    cut = len(end) - part.start() if part else 0
    names = [begin[: len(begin) - cut].strip("_-. ")[:60] for begin in begins]
    if len(set(names)) < len(names) or not all(map(_NAME.fullmatch, names)):
        return [f"leg{number}" for number in range(1, len(names) + 1)]
    return names


def _shared_beginning(names: Sequence[str]) -> str:
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    return "".join(letters[0] for letters in alike)


PROCESSES: Final = LimitedProcesses(
    "gaitswarm.sim.proposal.document",
    count=1,
    seconds=40.0,  # a proposal takes tenths of a second, the first one a second more
    cpu_seconds=20,
    memory=2 << 30,  # of which it needs a tenth
)


def walking_proposal(
    urdf: str,
    name: str,
    actuator: ActuatorChoice = "auto",
    frame: Frame = AS_IT_IS,
    hints: LegHints = NO_HINTS,
) -> Proposal:
    """Propose a robot, and check that it can be used and that its legs reach.

    Stances of other heights are tried where joint limits rule out the usual one.
    """
    refused: NoStance | None = None
    for height in HEIGHTS:
        try:
            return _walking(urdf, propose_robot(urdf, name, actuator, frame, hints, height))
        except NoStance as error:
            refused = refused or error
    raise refused or NoStance


def _walking(urdf: str, proposal: Proposal) -> Proposal:
    robot = parse_robot(proposal.toml, proposal.urdf)
    with by_line(urdf):
        fitted = [walk_within_reach(robot, walk) for walk in proposal.job["scenarios"]]
    return proposal.with_guesses(
        [note for _, note in fitted if note],
        job={**proposal.job, "scenarios": [walk for walk, _ in fitted]},
    )


def propose_apart(
    text: str,
    name: str,
    actuator: ActuatorChoice = "auto",
    frame: Frame = AS_IT_IS,
    hints: LegHints = NO_HINTS,
) -> Proposal:
    """Propose a robot in another process with limits of time, processor and memory.

    Args:
        text: URDF, xacro or MJCF.
        name: Of the robot.
        actuator: Kind of actuators.
        frame: Axes of the first link.
        hints: For finding legs; there are no meshes.
    """
    check_urdf(text)
    request = {"text": text, "name": name, "actuator": actuator, "frame": asdict(frame)}
    guidance = {name: getattr(hints, name) for name in ("locks", "feet", "mass", "actuators")}
    try:
        made = PROCESSES.ask(request | {"hints": guidance})
    except ProcessEnded as error:
        raise RobotFileError(
            f"robot.urdf: cannot propose a robot.toml: this {error}; write one by hand, as"
            " docs/robots.md explains"
        ) from error
    except SimulationInputError as error:
        raise RobotFileError(str(error)) from error
    return Proposal(
        made["toml"], made["urdf"], made["job"], tuple(made["guesses"]), tuple(made["problems"])
    )


def _answer(request: Document) -> Document:
    urdf, left_out = as_urdf(request["text"])
    made = walking_proposal(
        urdf,
        request["name"],
        request["actuator"],
        Frame(**request["frame"]),
        LegHints(**request["hints"]),
    )
    return asdict(made.with_guesses(left_out))


if __name__ == "__main__":
    serve(_answer)
