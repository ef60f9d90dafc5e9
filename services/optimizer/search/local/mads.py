"""Mesh adaptive direct search, of the library NOMAD."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.search.local.nomad_client import Nomad
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.replayed import Proposals, Start
from gaitswarm.services.optimizer.search.space import Space

Floats = NDArray[np.float64]

_DRAWS: Final = 20
"""Random starts to draw, at most, before one that was judged already is taken."""


class MadsSettings(SearchSettings):
    """Settings of mesh adaptive direct search."""

    name: Literal["mads"] = "mads"
    initial_frame: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="First size of the frame that is polled, as a share of each variable's range.",
    )
    mesh_tolerance: float = Field(
        default=1e-8,
        ge=1e-10,
        le=0.1,
        description="Mesh of continuous variables, as a share of the range, that ends a run.",
    )
    models: bool = Field(
        default=False,
        description="Whether quadratic models suggest designs, where a variable is continuous: "
        "fewer evaluations, more computing.",
    )
    simplex: bool = Field(
        default=False,
        description="Whether a simplex of Nelder and Mead suggests designs, one at a time.",
    )


def mads(
    settings: MadsSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by polling in directions that become dense: MADS of NOMAD 4 (Audet et al. 2022).

    Orthogonal directions (OrthoMADS, Abramson et al. 2009), 2d of them, in random bases; a poll is
    judged in blocks of up to `particles` designs, and what is left is dropped after a success. A
    run begins at a random design. When its mesh is below the tolerance it begins anew at another
    one, with another seed, and keeps nothing. A random design that fails is left at once. A choice
    of more than two is an integer to NOMAD, its index. No design is judged twice, but where
    draws find no other.
    """
    known: dict[bytes, float] = {}
    nomad = Nomad()
    try:
        if start is not None:
            known = dict(zip(_keys(space.designs(start.positions)), start.fitness, strict=True))
            for centre in space.designs(start.best_first[0][:1]):
                yield from _run(nomad, settings, space, centre, known, random.seed())
        while True:
            centre = _random_design(space, random, known)
            if _keys(centre[np.newaxis])[0] in known:
                # There is hardly a design left; NOMAD would ask for nothing else.
                yield space.positions(centre[np.newaxis])
                continue
            yield from _run(nomad, settings, space, centre, known, random.seed())
    finally:
        nomad.close()


def _run(
    nomad: Nomad,
    settings: MadsSettings,
    space: Space,
    centre: Floats,
    known: dict[bytes, float],
    seed: int,
) -> Proposals:
    """One run of NOMAD, whose continuous variables are shares of their range."""
    real = ~(space.integer | space.categorical)
    low, span = np.where(real, 0.0, space.low), np.where(real, 1.0, space.span)
    x0 = np.where(real, space.to_unit(centre), centre)
    block = nomad.begin(
        x0.tolist(), low.tolist(), (low + span).tolist(), _parameters(settings, space, seed)
    )
    while block is not None:
        points = np.array(block)
        designs = space.designs(np.where(real, space.from_unit(points), points)) + 0.0
        keys = _keys(designs)
        new = [i for i, key in enumerate(keys) if key not in known]
        if new:
            values = yield space.positions(designs[new])
            known.update(zip([keys[i] for i in new], values.tolist(), strict=True))
        told = [known[key] for key in keys]
        block = nomad.tell([value if math.isfinite(value) else None for value in told])


def _parameters(settings: MadsSettings, space: Space, seed: int) -> list[str]:
    """Parameters of NOMAD."""
    real = ~(space.integer | space.categorical)
    kinds = np.where(real, "R", np.where((space.low == 0.0) & (space.high == 1.0), "B", "I"))
    frames = settings.initial_frame * np.where(real, 1.0, space.span)
    frames = np.where(real, frames, np.maximum(np.rint(frames), 1.0))
    meshes = np.where(real, settings.mesh_tolerance, 1.0)
    yes = {True: "yes", False: "no"}
    return [
        f"DIMENSION {space.dimension}",
        f"BB_INPUT_TYPE ( {' '.join(kinds)} )",
        "BB_OUTPUT_TYPE OBJ",
        f"BB_MAX_BLOCK_SIZE {max(settings.particles, 2)}",
        "DIRECTION_TYPE ORTHO 2N",
        "DISPLAY_DEGREE 0",
        "EVAL_QUEUE_SORT DIR_LAST_SUCCESS",
        f"INITIAL_FRAME_SIZE ( {' '.join(map(repr, frames.tolist()))} )",
        f"MIN_MESH_SIZE ( {' '.join(map(repr, meshes.tolist()))} )",
        "NB_THREADS_PARALLEL_EVAL 1",
        f"NM_SEARCH {yes[settings.simplex]}",
        f"QUAD_MODEL_SEARCH {yes[settings.models and bool(real.any())]}",
        # NOMAD throws away as many random numbers first, one by one.
        f"SEED {seed >> 16}",
    ]


def _random_design(space: Space, random: RandomNumbers, known: dict[bytes, float]) -> Floats:
    """(d,) a design that was not judged yet, if one is found soon."""
    design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    for _ in range(_DRAWS - 1):
        if _keys(design)[0] not in known:
            break
        design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    centre: Floats = design[0]
    return centre


def _keys(designs: Floats) -> list[bytes]:
    """What tells designs apart, bit by bit."""
    return [row.tobytes() for row in designs + 0.0]
