"""A URDF as a robot needs it: in a frame with z up and x ahead, with legs that end in feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final
from xml.sax.saxutils import quoteattr

import numpy as np

from gaitswarm.sim.proposal.feet import MeshBounds
from gaitswarm.sim.proposal.frame import AS_IT_IS, Frame, turned
from gaitswarm.sim.proposal.legs import FoundLeg, FoundLegs, chain_leg, find_legs
from gaitswarm.sim.proposal.stance import choose_stance
from gaitswarm.sim.proposal.xml_text import fixed_joint, with_elements
from gaitswarm.sim.robot.urdf import parse_urdf

_LEVEL: Final = 0.2
"""How far hips may be above or below the body's origin, as a share of the legs' length."""

_LOWER: Final = 0.02
"""By how much another end has to be lower than the farthest one, as a share of the leg's length."""


def stood_up(urdf: str, frame: Frame, bounds: MeshBounds) -> tuple[str, FoundLegs, list[str]]:
    """Find the legs of a URDF, which is given a frame with z up, x ahead and hips about level.

    What a body does is told by its origin, so one on the ground would always have fallen.
    """
    root, *others = parse_urdf(urdf).links
    text = turned(urdf, root, [root, *others], frame)
    tree = parse_urdf(text)
    found = find_legs(tree, upright=frame != AS_IT_IS, bounds=bounds)
    legs = [chain_leg(tree, leg.joints, leg.end) for leg in found.legs]
    level = float(f"{np.mean([leg.hip[2] for leg in legs]):.3g}")
    if abs(level) <= _LEVEL * max(sum(leg.lengths) for leg in legs):
        return text, _at_their_lowest(text, found), []
    side = "above" if level > 0.0 else "below"
    note = f"the body's frame is {abs(level):g} m {side} that of {root!r}, as high as the hips"
    text = turned(urdf, root, [root, *others], frame, level)
    return text, _at_their_lowest(text, found), [note]


def _at_their_lowest(urdf: str, found: FoundLegs) -> FoundLegs:
    """Legs that end where they are lowest as they stand, if only shapes say where they end."""
    if not any(len(leg.ends) for leg in found.legs):
        return found
    tree = parse_urdf(urdf)
    legs = [chain_leg(tree, leg.joints, leg.end) for leg in found.legs]
    lowered = []
    for leg, chain, angles in zip(found.legs, legs, choose_stance(legs).angles, strict=True):
        low = chain.foot(angles)[2] - _LOWER * sum(chain.lengths)
        heights = [replace(chain, end=end).foot(angles)[2] for end in leg.ends]
        end = leg.end
        if heights and min(heights) < low:
            x, y, z = leg.ends[int(np.argmin(heights))].tolist()
            end = (x, y, z)
        lowered.append(replace(leg, end=end))
    return replace(found, legs=tuple(lowered))


def with_feet(urdf: str, legs: Sequence[FoundLeg]) -> tuple[str, list[str]]:
    """Add a frame at the end of every leg that has none."""
    feet = [leg.foot or f"{leg.link}_foot" for leg in legs]
    missing = [(leg, foot) for leg, foot in zip(legs, feet, strict=True) if leg.foot is None]
    if not missing:
        return urdf, feet
    lines = []
    for leg, foot in missing:
        lines += [
            f"  <link name={quoteattr(foot)}/>",
            *fixed_joint(f"{foot}_fixed", leg.link, foot, " ".join(map(repr, leg.end))),
        ]
    return with_elements(urdf, lines), feet
