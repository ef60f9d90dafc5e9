"""The worlds of a certificate: their space and their order."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.sim.mujoco.engines import EngineName, engine_variable
from gaitswarm.sim.variables import Variable
from gaitswarm.sim.worlds import PERTURBATIONS, sample_worlds
from gaitswarm.sim.worlds.perturbations import NOMINAL

Floats = NDArray[np.float64]


def world_space(
    variables: Sequence[str | Variable] | None, fixed: Mapping[str, float | str]
) -> DesignSpace:
    """The perturbations that are drawn or held."""
    if variables is None:
        variables = tuple(v for v in PERTURBATIONS if v.name not in fixed)
    return DesignSpace.build(required=(), optional=PERTURBATIONS, chosen=variables, fixed=fixed)


def with_engine(space: DesignSpace, engines: Sequence[EngineName]) -> DesignSpace:
    """The same worlds, each with the engine that computes its walks."""
    if not engines:
        return space
    drawn = len(space.variables)
    return replace(
        space,
        variables=(*space.variables, engine_variable(engines)),
        catalogue=(*space.catalogue[:drawn], engine_variable(), *space.catalogue[drawn:]),
    )


def world_positions(
    space: DesignSpace, engines: Sequence[EngineName], seed: int
) -> Callable[[int, int], Floats]:
    """The order of a certificate's walks."""
    first = [[min(max(NOMINAL[v.name], v.low), v.high) for v in space.variables]]
    nominal = np.array(first * (1 + len(engines)))
    box = with_engine(space, engines).box

    def positions(start: int, stop: int) -> Floats:
        drawn = sample_worlds(max(0, stop - len(nominal)), seed, space.variables)
        worlds = np.concatenate([nominal, drawn])[:stop]
        if engines:
            engine = np.zeros((len(worlds), 1))
            engine[: len(nominal), 0] = np.arange(len(nominal))[: len(worlds)]
            worlds = box.positions(np.hstack([worlds, engine]))
        return worlds[start:]

    return positions
