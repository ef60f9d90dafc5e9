"""Mesh adaptive direct search of the library NOMAD."""

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
"""Random starts drawn, at most, before one that was already evaluated is used."""


class MadsSettings(SearchSettings):
    """Settings of mesh adaptive direct search."""

    name: Literal["mads"] = "mads"
    initial_frame: float = Field(
        default=0.1,
        gt=0.0,
        le=1.0,
        description="Initial frame size, as a share of each variable's range.",
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

    A poll has 2d orthogonal directions in random bases (OrthoMADS, Abramson et al. 2009). It is
    evaluated in blocks of up to `particles` designs, and the rest is dropped after a success. A run
    begins at a random design. When its mesh is below the tolerance, the method restarts at another
    design with another seed and keeps nothing. A random design that fails is abandoned at once. To
    NOMAD, a choice of more than two is an integer, its index. No design is evaluated twice unless
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
                # Hardly any design is left, and NOMAD would propose nothing else.
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
        values_of_block = [known[key] for key in keys]
        block = nomad.tell([v if math.isfinite(v) else None for v in values_of_block])


def _parameters(settings: MadsSettings, space: Space, seed: int) -> list[str]:
    """Return the parameters of NOMAD."""
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
        # NOMAD discards this many random numbers first, one by one.
        f"SEED {seed >> 16}",
    ]


def _random_design(space: Space, random: RandomNumbers, known: dict[bytes, float]) -> Floats:
    """Draw (d,) a design that was not evaluated yet, if one is found soon."""
    design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    for _ in range(_DRAWS - 1):
        if _keys(design)[0] not in known:
            break
        design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    centre: Floats = design[0]
    return centre


def _keys(designs: Floats) -> list[bytes]:
    """Return the bytes of designs."""
    return [row.tobytes() for row in designs + 0.0]


_SCRIPT: Final = Path(__file__).with_name("nomad_process.py")

MOST_PROCESSES: Final = 4
"""Largest number of idle NOMAD processes."""

Block = list[list[float]]


class Nomad:
    """A conversation with NOMAD, whose process can be replaced at any time.

    NOMAD is deterministic, so a new process reproduces a conversation from its messages. The least
    recently used conversations lose their process, and start another when they continue.
    """

    def __init__(self) -> None:
        """Create a conversation; its process starts with the first message."""
        self._said: list[str] = []
        self._process: subprocess.Popen[str] | None = None
        # A conversation may be closed after this module's names have been deleted.
        self._idle = _IDLE

    def begin(
        self, x0: list[float], lower: list[float], upper: list[float], parameters: list[str]
    ) -> Block | None:
        """Begin a run."""
        run = {"x0": x0, "lower": lower, "upper": upper, "parameters": parameters}
        return self._exchange(json.dumps(run))

    def tell(self, values: list[float | None]) -> Block | None:
        """Send the values of the last points, and return the next."""
        return self._exchange(json.dumps({"values": values}))

    def close(self) -> None:
        """End the process, if any, and wait for it."""
        self._idle.remove(self)
        self.sleep()

    def sleep(self) -> None:
        """End the process; the conversation can continue with another one."""
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
    """Idle conversations with a process, the least recently used first."""

    def __init__(self) -> None:
        self._order: OrderedDict[int, Nomad] = OrderedDict()
        # Reentrant: garbage collection may close a conversation during any allocation.
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
# Searches that are never closed are collected at exit, too late to wait for processes.
atexit.register(_IDLE.sleep)


def _start() -> subprocess.Popen[str]:
    """Start a process that ends with this one, when its stdin closes."""
    return subprocess.Popen(
        [sys.executable, "-P", str(_SCRIPT)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        # More threads would mostly wait for each other.
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
