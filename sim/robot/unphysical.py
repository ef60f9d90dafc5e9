"""Masses and inertias of a URDF that no body has."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.robot.inertia import BodyInertia
from gaitswarm.sim.robot.urdf import Urdf
from gaitswarm.sim.robot.urdf_errors import with_line

Floats = NDArray[np.float64]

_ROUNDED: Final = 1e-6
"""Share of the largest moment by which a file's digits may be off."""

_NONE: Final = 1e-9
"""Share of the largest moment that is no moment at all: a rod's about its own axis is more."""


def unphysical(urdf: Urdf, text: str) -> Iterator[str]:
    """Look for masses and inertias that no body has.

    Links that are fixed to one another are one body, and only that is simulated: a camera with
    filled-in moments is no matter on a trunk that has its own. Where the whole is wrong, those of
    its links are named that are.
    """
    parts: dict[str, list[str]] = {name: [] for name in urdf.bodies}
    for link, place in urdf.places.items():
        parts[place.body].append(link)
    for name, body in urdf.bodies.items():
        if body.mass == 0.0:
            said = (
                f"link {name!r} and what is fixed to it have no mass: give it an <inertial>, or"
                " joints beyond it are moved by nothing but their rotors' inertia"
            )
            yield with_line(text, f"robot.urdf: {said}")
            continue
        if _possible(body):
            continue
        own = ((link, urdf.links[link].inertia) for link in parts[name])
        wrong = {link: of for link, of in own if of.mass and not _possible(of)}
        for link, inertia in (wrong or {name: body}).items():
            moments = ", ".join(f"{moment:.3g}" for moment in _moments(inertia))
            said = (
                f"link {link!r}: no body of {inertia.mass:g} kg has the principal moments {moments}"
                " kg m2: all must be above 0, and none larger than both others together; look at"
                " its <inertia>"
            )
            yield with_line(text, f"robot.urdf: {said}")


def _possible(inertia: BodyInertia) -> bool:
    least, middle, largest = _moments(inertia)
    return bool(least > _NONE * largest and largest <= (least + middle) * (1.0 + _ROUNDED))


def _moments(inertia: BodyInertia) -> Floats:
    """Principal ones, the least first, (3,) [kg m2]."""
    return np.asarray(np.linalg.eigvalsh(inertia.rotational), dtype=np.float64)
