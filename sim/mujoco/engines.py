"""Engines that a walk can be computed in, as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from types import MappingProxyType
from typing import Final, Literal

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.variables import Variable

EngineName = Literal["mujoco", "mujoco-contacts"]

OWN: Final = "gaitswarm"
"""The engine of all other walks: the compiled kernel, or its interpreter."""

ENGINE: Final = "engine"
"""Name of the column of worlds that says which engine computes them."""

ENGINES: Final[Mapping[EngineName, str]] = MappingProxyType(
    {
        "mujoco": "MuJoCo's rigid bodies and integrator, under our laws of contact",
        "mujoco-contacts": "MuJoCo's rigid bodies, integrator and contacts: spheres on a plane,"
        " as stiff, damped and rough as our soles",
    }
)
"""By name, for people."""

LIBRARY: Final = "mujoco-core"
"""The distribution that all of them compute with."""

_MODULE: Final = "mujoco"


def engine_variable(engines: Sequence[EngineName] = tuple(ENGINES)) -> Variable:
    """Which engine computes a walk, as a column of worlds."""
    return Variable(
        name=ENGINE,
        kind="categorical",
        choices=(OWN, *engines),
        default=0.0,
        description="Engine that computes the walk.",
    )


def check_installed() -> None:
    """Check that the library of the engines is there; it is not imported."""
    if find_spec(_MODULE) is None:
        raise SimulationInputError(
            f"mujoco needs {LIBRARY}, not installed here: pip install 'gaitswarm[mujoco]'"
        )
