"""Names and descriptions of the engines; MuJoCo itself is not imported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Final, Literal

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.variables import Variable

EngineName = Literal["mujoco", "mujoco-contacts"]

OWN: Final = "gaitswarm"
"""gaitswarm's own kernels."""

ENGINE: Final = "engine"
"""Name of the column of worlds that selects the engine."""

ENGINES: Final[Mapping[EngineName, str]] = {
    "mujoco": "MuJoCo's rigid bodies and integrator, under our laws of contact",
    "mujoco-contacts": "MuJoCo's rigid bodies, integrator and contacts: spheres on the ground, as"
    " stiff, damped and rough as our soles",
}
"""Descriptions by name."""

LIBRARY: Final = "mujoco-core"
"""The distribution that provides all of them."""


def engine_variable(engines: Sequence[EngineName] = tuple(ENGINES)) -> Variable:
    """The engine of a walk as a column of worlds."""
    return Variable(
        name=ENGINE,
        kind="categorical",
        choices=(OWN, *engines),
        default=0.0,
        description="Engine that computes the walk.",
    )


def check_installed() -> None:
    """Check that the engines' library is installed, without importing it."""
    if find_spec("mujoco") is None:
        raise SimulationInputError(
            f"mujoco requires {LIBRARY}, not installed here: pip install 'gaitswarm[mujoco]'"
        )
