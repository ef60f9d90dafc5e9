"""Mesh adaptive direct search, of the library NOMAD."""

from __future__ import annotations

import atexit
import json
import math
import os
import subprocess
import sys
import threading
from collections import OrderedDict
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import Proposals, RandomNumbers, SearchSettings, Space, Start, from_generator

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


_SCRIPT: Final = Path(__file__).with_name("nomad_process.py")

MOST_PROCESSES: Final = 4
"""Idle processes of NOMAD, at most, that this process keeps."""

Block = list[list[float]]


class Nomad:
    """A conversation with NOMAD, whose process is a mere convenience.

    NOMAD says the same again where it is told the same again. So of all conversations the least
    recently used ones lose their process, and have another one when they go on.
    """

    def __init__(self) -> None:
        """Begin a conversation; the process starts with the first message."""
        self._said: list[str] = []
        self._process: subprocess.Popen[str] | None = None
        # Its own reference: a conversation may be closed when this module's names are gone.
        self._idle = _IDLE

    def begin(
        self, x0: list[float], lower: list[float], upper: list[float], parameters: list[str]
    ) -> Block | None:
        """Begin a run, where none is under way."""
        run = {"x0": x0, "lower": lower, "upper": upper, "parameters": parameters}
        return self._exchange(json.dumps(run))

    def tell(self, values: list[float | None]) -> Block | None:
        """Give what the last points are worth."""
        return self._exchange(json.dumps({"values": values}))

    def close(self) -> None:
        """End the process, if there is one, and wait until it is gone."""
        self._idle.remove(self)
        self.sleep()

    def sleep(self) -> None:
        """End the process; the conversation can go on with another one."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.communicate()

    def _exchange(self, message: str) -> Block | None:
        self._idle.remove(self)
        if self._process is None:
            self._process = _start()
            for said in self._said:
                _answer(self._process, said)
        block = _answer(self._process, message)
        self._said.append(message)
        self._idle.add(self)
        return block


class _Idle:
    """Conversations that have a process and are not waited for, the least recently used first."""

    def __init__(self) -> None:
        self._order: OrderedDict[int, Nomad] = OrderedDict()
        # Reentrant: collecting garbage may close a conversation wherever memory is asked for.
        self._lock = threading.RLock()

    def add(self, nomad: Nomad) -> None:
        with self._lock:
            self._order[id(nomad)] = nomad
            while len(self._order) > MOST_PROCESSES:
                self._order.popitem(last=False)[1].sleep()

    def remove(self, nomad: Nomad) -> None:
        with self._lock:
            self._order.pop(id(nomad), None)

    def sleep(self) -> None:
        """End the processes of all."""
        with self._lock:
            while self._order:
                self._order.popitem()[1].sleep()


_IDLE: Final = _Idle()
# Searches that are never closed are collected when this process ends, too late to wait for others.
atexit.register(_IDLE.sleep)


def _start() -> subprocess.Popen[str]:
    """A process that ends with this one, as its stdin does."""
    return subprocess.Popen(
        [sys.executable, "-P", str(_SCRIPT)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        # More threads wait for each other most of the time.
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )


def _answer(process: subprocess.Popen[str], message: str) -> Block | None:
    assert process.stdin is not None  # noqa: S101
    assert process.stdout is not None  # noqa: S101
    process.stdin.write(message + "\n")
    process.stdin.flush()
    line = process.stdout.readline()
    if not line:
        raise RuntimeError(f"NOMAD's process ended with status {process.wait()}")
    answer: dict[str, Any] = json.loads(line)
    block: Block | None = answer["block"]
    return block


METHOD = from_generator(
    MadsSettings,
    "Mesh adaptive direct search (NOMAD 4; Audet, Le Digabel, Rochon Montplaisir et al. 2022)",
    mads,
    libraries=("PyNomadBBO",),
)
