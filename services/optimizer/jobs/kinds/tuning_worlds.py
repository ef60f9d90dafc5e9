"""Worlds in which a tuning judges every design, and what it makes of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from gaitswarm.services.optimizer.jobs.judgement import Judgement
from gaitswarm.services.optimizer.jobs.preference import Preference, geometric_mean, log_utilities
from gaitswarm.sim.input import message_of
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable, VariableChoice
from gaitswarm.sim.worlds import PERTURBATIONS, sample_worlds

Floats = NDArray[np.float64]

Aggregate = Literal["mean", "quantile", "worst", "cvar"]

_ALONE: Final = tuple(
    Preference(bias=(0.0,) * 5, exponent=tuple(exponent)) for exponent in np.eye(5).tolist()
)
"""Preferences for one objective each."""

_EDGE: Final = 1e-9
"""Of a world: a share that is nearer to a whole number of worlds is one."""


class TuningWorlds(BaseModel):
    """A set of worlds, the same for all designs and scenarios: common random numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    count: int = Field(
        default=8, ge=1, le=100, description="How many are drawn; a design walks in each of them."
    )
    seed: int = Field(
        default=1, ge=0, lt=2**63, description="Of the worlds; see `seed` of a certificate."
    )
    ranges: tuple[VariableChoice, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=128,
        description="Perturbations that are drawn: names, or variables with bounds of your own."
        " Default: all.",
    )
    aggregate: Aggregate = Field(
        default="cvar",
        description="What a scenario's utilities in all worlds come to: their `mean`, their"
        " `quantile` at `level`, the `worst`, or the conditional value at risk `cvar`, which is the"
        " mean of the worst 1 - `level` of them.",
    )
    level: float = Field(
        default=0.75, ge=0.0, lt=1.0, description="Of a quantile or of the value at risk [1]."
    )

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Self:
        self.variables()
        return self

    def variables(self) -> tuple[Variable, ...]:
        """The perturbations that are drawn, with their bounds.

        Raises:
            ValueError: One is unknown, named twice or cannot have its bounds. A set that was
                validated raises nothing.
        """
        known = {variable.name: variable for variable in PERTURBATIONS}
        chosen = PERTURBATIONS if self.ranges is None else self.ranges
        found: dict[str, Variable] = {}
        for entry in chosen:
            name = entry if isinstance(entry, str) else entry.name
            if name not in known:
                raise ValueError(f"ranges: no perturbation {name!r}; {instead_of(name, known)}")
            if name in found:
                raise ValueError(f"ranges: {name!r} is named twice")
            found[name] = known[name] if isinstance(entry, str) else _bounded(known[name], entry)
        return tuple(found.values())

    def drawn(self) -> tuple[tuple[tuple[str, float], ...], ...]:
        """Names and values of each of the worlds."""
        return _drawn(self)

    def judged(self, log_utilities: Floats) -> Judgement:
        """Judge designs by what their utilities in all worlds come to.

        Args:
            log_utilities: (n, K W) logarithms of utilities, worlds the fastest, +inf where a walk
                failed.

        Returns:
            Fitness, the geometric mean over the K scenarios of the aggregates (eq. 4.2), and the
            logarithms as they are.
        """
        logarithms = self.aggregated(log_utilities)
        return Judgement(geometric_mean(logarithms), log_utilities)

    def aggregated(self, log_utilities: Floats) -> Floats:
        """What utilities in all worlds come to, by scenario. A failed walk is infinitely bad.

        Args:
            log_utilities: (n, K W), as for `judged`.

        Returns:
            (n, K) logarithms; +inf where as many walks failed that the aggregate has no value: for
            a quantile more than 1 - `level` of them, for any other a single one.
        """
        # Not -1: the number of scenarios cannot be inferred from an array of no designs.
        designs, walks = log_utilities.shape
        by_scenario = log_utilities.reshape(designs, walks // self.count, self.count)
        rows = [[self._aggregate(worlds) for worlds in row] for row in by_scenario.tolist()]
        return np.array(rows, dtype=np.float64).reshape(by_scenario.shape[:2])

    def objective_vectors(self, objectives: Floats, failed: NDArray[np.bool_]) -> Floats:
        """What each design comes to in each of f1 to f5, over all worlds and scenarios.

        Objective m is the fitness under a preference that weighs it alone and has no bias. So each
        objective is aggregated over worlds of its own: its worst world may be another one's best.

        Args:
            objectives: (n, K W, 6) raw objectives, worlds the fastest, in their units.
            failed: (n, K W), true where a walk failed.

        Returns:
            (n, 5), minimized; a row is +inf throughout where an objective has no value.
        """
        columns = [
            geometric_mean(self.aggregated(log_utilities(objectives, failed, alone)))
            for alone in _ALONE
        ]
        vectors = np.stack(columns, axis=1)
        vectors[~np.isfinite(vectors).all(axis=1)] = math.inf
        return vectors

    def _aggregate(self, logarithms: Sequence[float]) -> float:
        ordered = sorted(logarithms, reverse=True)
        tail = (1.0 - self.level) * self.count
        if self.aggregate == "quantile":
            # So many may be worse.
            return ordered[min(math.floor(tail + _EDGE), self.count - 1)]
        if self.aggregate == "worst" or math.isinf(ordered[0]):
            return ordered[0]
        return _log_mean(ordered, self.count if self.aggregate == "mean" else max(1.0, tail))


def _bounded(known: Variable, own: Variable) -> Variable:
    """A perturbation with bounds of one's own, which keeps its kind and unit. Raises ValueError."""
    if own.kind not in (known.kind, "continuous"):
        raise ValueError(
            f"ranges: {own.name} is {known.kind}, not {own.kind}; leave `kind` out, or set it so"
        )
    document = known.model_dump() | {"low": own.low, "high": own.high}
    try:
        return Variable.model_validate(document)
    except ValidationError as error:
        message = message_of(error.errors(include_url=False)[0])
        raise ValueError(f"ranges: {message}") from error


def _log_mean(ordered: Sequence[float], size: float) -> float:
    """Logarithm of the mean of the greatest `size` numbers, the last of which may count in part.

    ordered: their logarithms, the greatest first.
    """
    whole = math.floor(size + _EDGE)
    terms = [math.exp(value - ordered[0]) for value in ordered[: whole + 1]]
    total = math.fsum(terms[:whole])
    if size - whole > _EDGE:
        total += (size - whole) * terms[whole]
    return ordered[0] + math.log(total / size)


@lru_cache(maxsize=32)
def _drawn(worlds: TuningWorlds) -> tuple[tuple[tuple[str, float], ...], ...]:
    variables = worlds.variables()
    names = [variable.name for variable in variables]
    rows = sample_worlds(worlds.count, worlds.seed, variables).tolist()
    return tuple(tuple(zip(names, row, strict=True)) for row in rows)
