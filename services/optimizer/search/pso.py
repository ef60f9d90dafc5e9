"""Particle swarm optimization (thesis 3.4.1, 4.4.1), and its presets."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    NonNegativeInt,
    model_validator,
)

from services.optimizer.search.optimizer import matrix, parse_state
from services.optimizer.search.random_stream import swarm_uniform

_SCHEMA_VERSION: Final = 1
_SCATTER: Final = 1
_MOVE: Final = 2
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""

_INITIAL_VELOCITY: Final = 0.1
"""Share of each variable's range."""


class PsoSettings(BaseModel):
    """Settings of the particle swarm; defaults are the thesis's, but for an inertia that falls."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: Literal["pso"] = "pso"
    particles: int = Field(default=25, ge=1, le=10_000, description="Size of the swarm.")
    cognitive: float = Field(default=0.5, ge=0.0, le=10.0, description="Pull to a particle's best.")
    social: float = Field(default=1.5, ge=0.0, le=10.0, description="Pull to the swarm's best.")
    inertia_start: float = Field(default=0.9, ge=0.0, le=2.0, description="Inertia at the start.")
    inertia_end: float = Field(default=0.7, ge=0.0, le=2.0, description="Inertia at the end.")
    velocity_limit: float = Field(
        default=0.5,
        gt=0.0,
        le=1.0,
        description="Largest step, as a share of each variable's range.",
    )
    bounds: Literal["absorb", "reflect"] = Field(
        default="reflect", description="What happens to a particle that leaves the box."
    )

    @model_validator(mode="after")
    def _inertia_falls(self) -> PsoSettings:
        if self.inertia_end > self.inertia_start:
            raise ValueError("inertia_end must not exceed inertia_start: inertia never rises")
        return self


OptimizerName = Literal["pso", "pso-thesis"]

OPTIMIZERS: Final[dict[OptimizerName, PsoSettings]] = {
    "pso": PsoSettings(),
    "pso-thesis": PsoSettings(inertia_end=0.9),
}
"""`pso`: the default, whose inertia falls. `pso-thesis`: inertia 0.9 throughout (3.4.1)."""


def optimizer_settings(choice: object) -> object:
    """Look up settings that are named.

    Args:
        choice: name of a preset, or anything else.

    Returns:
        The preset's settings; what is no name as it is.

    Raises:
        ValueError: no preset of that name; names those that there are.
    """
    if not isinstance(choice, str):
        return choice
    for name, settings in OPTIMIZERS.items():
        if name == choice:
            return settings
    raise ValueError(
        f"unknown optimizer {choice!r}; known are {', '.join(OPTIMIZERS)}, or give an object:"
        " settings of your own"
    )


OptimizerChoice = Annotated[
    PsoSettings,
    BeforeValidator(optimizer_settings, json_schema_input_type=OptimizerName | PsoSettings),
]
"""How jobs choose a search: once it is read, a name has become settings."""


class _SwarmState(BaseModel):
    """What `dump` writes. best_fitness: None where a particle has not succeeded yet."""

    model_config = ConfigDict(extra="forbid", strict=True)

    optimizer: Literal["pso"]
    schema_version: Literal[1]
    iteration: NonNegativeInt
    asked: bool
    positions: list[list[FiniteFloat]]
    velocities: list[list[FiniteFloat]]
    best_positions: list[list[FiniteFloat]]
    best_fitness: list[FiniteFloat | None]


class ParticleSwarm:
    """A swarm that remembers each particle's best, the `pso` of job specs.

    It moves in the continuous box, in the variables' own units; whoever evaluates a position
    rounds its integer variables. A velocity is the change of position in one iteration, in the
    same units.
    """

    def __init__(
        self,
        settings: PsoSettings,
        low: NDArray[np.float64],
        high: NDArray[np.float64],
        iterations: int,
        seed: int,
    ) -> None:
        """Create a swarm that has not been asked yet.

        Args:
            settings: of the method.
            low: (d,) lower bounds, in the variables' own units.
            high: (d,) upper bounds.
            iterations: of the planned run, over which inertia goes from its start to its end.
            seed: of all random numbers.
        """
        self._settings = settings
        self._low = np.array(low, dtype=np.float64)
        self._high = np.array(high, dtype=np.float64)
        self._iterations = iterations
        self._seed = seed
        shape = (settings.particles, len(self._low))
        self._iteration = 0
        self._asked = False
        self._positions = np.tile(self._low, (settings.particles, 1))
        self._velocities = np.zeros(shape)
        self._best_positions = self._positions.copy()
        self._best_fitness = np.full(settings.particles, np.inf)

    @property
    def iteration(self) -> int:
        """Number of completed tells."""
        return self._iteration

    def ask(self) -> NDArray[np.float64]:
        """Give the positions to evaluate next; the same ones again until they are told.

        Returns:
            (particles, d), inside the bounds, in the variables' own units.
        """
        if not self._asked:
            if self._iteration == 0:
                self._scatter()
            else:
                self._move()
            self._asked = True
        return self._positions.copy()

    def tell(self, fitness: NDArray[np.float64]) -> None:
        """Take what the positions last asked for are worth.

        Args:
            fitness: (particles,) of each of them, minimized; +inf for a failed evaluation.

        Raises:
            ValueError: nothing was asked for, the shape is another, or a value is NaN or -inf.
        """
        if not self._asked:
            raise ValueError("tell() before ask(): there are no positions that this belongs to")
        if fitness.shape != self._best_fitness.shape:
            raise ValueError(
                f"fitness has shape {fitness.shape}, the swarm {self._best_fitness.shape}"
            )
        if np.isnan(fitness).any() or np.isneginf(fitness).any():
            raise ValueError("fitness must be finite, or +inf for a failed evaluation")
        better = fitness < self._best_fitness
        self._best_positions[better] = self._positions[better]
        self._best_fitness[better] = fitness[better]
        self._iteration += 1
        self._asked = False

    def dump(self) -> dict[str, Any]:
        """Give the whole state.

        Returns:
            JSON-able values with a schema version. JSON prints the shortest text that reads back
            as the same float, so none loses a bit.
        """
        return {
            "optimizer": self._settings.name,
            "schema_version": _SCHEMA_VERSION,
            "iteration": self._iteration,
            "asked": self._asked,
            "positions": self._positions.tolist(),
            "velocities": self._velocities.tolist(),
            "best_positions": self._best_positions.tolist(),
            "best_fitness": [f if math.isfinite(f) else None for f in self._best_fitness.tolist()],
        }

    def load(self, state: dict[str, Any]) -> None:
        """Take on a state.

        Args:
            state: as `dump` gave it, for the same settings and bounds.

        Raises:
            ValueError: it is of another method, version or shape, or outside the bounds; the state
                before is kept.
        """
        dumped = parse_state(state, "pso", _SwarmState)
        shape = self._positions.shape
        arrays = {
            name: matrix(getattr(dumped, name), shape, name)
            for name in ("positions", "velocities", "best_positions")
        }
        if len(dumped.best_fitness) != shape[0]:
            raise ValueError(f"best_fitness: {len(dumped.best_fitness)} values, not {shape[0]}")
        for name in ("positions", "best_positions"):
            if (arrays[name] < self._low).any() or (arrays[name] > self._high).any():
                raise ValueError(f"{name}: outside the bounds of this job")
        self._iteration, self._asked = dumped.iteration, dumped.asked
        self._positions, self._velocities = arrays["positions"], arrays["velocities"]
        self._best_positions = arrays["best_positions"]
        self._best_fitness = np.array([math.inf if f is None else f for f in dumped.best_fitness])

    def _scatter(self) -> None:
        """Uniform in the box, with small random velocities.

        Small, because a swarm that starts fast spends its first steps at the walls; not zero,
        because the leader, and a swarm of which every member failed, would then stand still.
        """
        draws = self._draw(purpose=_SCATTER)
        span = self._high - self._low
        largest = min(_INITIAL_VELOCITY, self._settings.velocity_limit) * span
        self._positions = np.clip(self._low + draws[0] * span, self._low, self._high)
        self._velocities = (2.0 * draws[1] - 1.0) * largest

    def _move(self) -> None:
        own, swarm = self._draw(purpose=_MOVE)
        settings = self._settings
        velocities = self._inertia() * self._velocities
        known = np.isfinite(self._best_fitness)
        to_own_best = np.where(known[:, np.newaxis], self._best_positions - self._positions, 0.0)
        velocities += settings.cognitive * own * to_own_best
        if known.any():
            leader = self._best_positions[int(np.argmin(self._best_fitness))]
            velocities += settings.social * swarm * (leader - self._positions)
        fastest = settings.velocity_limit * (self._high - self._low)
        velocities = np.clip(velocities, -fastest, fastest)
        at_bounds = absorb if settings.bounds == "absorb" else reflect
        self._positions, self._velocities = at_bounds(
            self._positions + velocities, velocities, self._low, self._high
        )

    def _inertia(self) -> float:
        """Linear from the first to the last iteration of the plan, then it stays."""
        share = min(self._iteration / max(self._iterations - 1, 1), 1.0)
        start, end = self._settings.inertia_start, self._settings.inertia_end
        return start + share * (end - start)

    def _draw(self, *, purpose: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Two numbers in [0, 1) per particle and coordinate: twice (particles, d)."""
        particles, d = self._positions.shape
        draws = swarm_uniform(
            self._seed, purpose, iteration=self._iteration, particles=particles, count=2 * d
        )
        return draws[:, :d], draws[:, d:]


def absorb(
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Let a particle beyond a wall stop at it.

    Args:
        positions: (n, d), in the variables' own units.
        velocities: (n, d), in the same units per iteration.
        low: (d,) lower bounds.
        high: (d,) upper bounds.

    Returns:
        Positions inside the bounds, and velocities without the components into a wall.
    """
    inside = np.clip(positions, low, high)
    return inside, np.where(inside == positions, velocities, 0.0)


def reflect(
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Let a particle beyond a wall bounce, as often as it takes.

    Args:
        positions: (n, d), in the variables' own units.
        velocities: (n, d), in the same units per iteration.
        low: (d,) lower bounds.
        high: (d,) upper bounds.

    Returns:
        Positions inside the bounds, and velocities, turned round after an odd number of bounces.
    """
    span = high - low
    outside = (positions < low) | (positions > high)
    phase = np.mod(positions - low, 2.0 * span)
    odd = phase > span
    folded = np.clip(low + np.where(odd, 2.0 * span - phase, phase), low, high)
    return (
        np.where(outside, folded, positions),
        np.where(outside & odd, -velocities, velocities),
    )
