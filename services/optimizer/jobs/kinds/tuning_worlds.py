"""Perturbed models for tuning, and the aggregation of utilities over worlds and scenarios"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from gaitswarm.services.optimizer.jobs.preference import Judgement, geometric_mean
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import Data, message_of
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable, VariableChoice

Aggregate = Literal["mean", "quantile", "worst", "cvar"]

Weight = Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]

ScenarioWeights = Annotated[
    dict[str, Weight],
    Field(
        description="Weights of scenarios in the geometric mean, by name; 1 for all others.",
        examples=[{"slope-fast": 2.0}],
    ),
]

ScenarioAggregate = Annotated[
    Literal["mean", "worst"],
    Field(
        description="Aggregate of the utilities of all scenarios: `mean`, their weighted geometric"
        " mean, or `worst`, the greatest of them."
    ),
]


def other_measure(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return changed fields that are not None; weights and `worst` replace each other."""
    changes = {name: value for name, value in fields.items() if value is not None}
    if changes.get("scenario_aggregate") == "worst":
        changes.setdefault("scenario_weights", {})
    elif changes.get("scenario_weights"):
        changes.setdefault("scenario_aggregate", "mean")
    return changes


_EDGE: Final = 1e-9
"""Tolerance in worlds: a share this close to an integer counts as that integer."""


class TuningWorlds(Data):
    """A set of worlds, shared by all designs and scenarios: common random numbers."""

    count: int = Field(default=8, ge=1, le=100)
    """Number of worlds; every design is simulated in each."""
    seed: int = Field(default=1, ge=0, lt=2**63)
    """Seed of the worlds; see `seed` of a certificate."""
    ranges: tuple[VariableChoice, ...] | None = Field(default=None, min_length=1, max_length=128)
    """Perturbations to draw: names, or variables with custom bounds. Default: all but roughness."""
    aggregate: Aggregate = "cvar"
    """Aggregate of a scenario's utilities over all worlds: `mean`, `quantile` at `level`, `worst`,
    or `cvar`, the conditional value at risk, which is the mean of the worst 1 - `level` of them."""
    level: float = Field(default=0.75, ge=0.0, lt=1.0)
    """Level of `quantile` and `cvar` [1]."""

    @model_validator(mode="after")
    def _can_be_drawn(self) -> Self:
        self.variables()
        return self

    def variables(self) -> tuple[Variable, ...]:
        """Return the perturbations with their bounds. Raises ValueError, not once validated."""
        from gaitswarm.sim.worlds.perturbations import DRAWN, PERTURBATIONS

        perturbations = {variable.name: variable for variable in PERTURBATIONS}
        chosen = DRAWN if self.ranges is None else self.ranges
        variables: dict[str, Variable] = {}
        for entry in chosen:
            name = entry if isinstance(entry, str) else entry.name
            if name not in perturbations:
                raise ValueError(
                    f"ranges: unknown perturbation {name!r}; {instead_of(name, perturbations)}"
                )
            if name in variables:
                raise ValueError(f"ranges: {name!r} is named twice")
            variables[name] = (
                perturbations[name]
                if isinstance(entry, str)
                else _bounded(perturbations[name], entry)
            )
        return tuple(variables.values())

    def drawn(self) -> tuple[tuple[tuple[str, float], ...], ...]:
        """Return names and values of each world."""
        return _drawn(self)

    def aggregated(self, log_utilities: Floats) -> Floats:
        """Return (n, K) logarithms of utilities over worlds, by scenario.

        +inf for too many failures: more than 1 - `level` of the worlds for a quantile, any failure
        for the others.

        Args:
            log_utilities: (n, K W), worlds varying fastest, +inf after a failure.
        """
        # Not -1: the number of scenarios cannot be inferred from an empty array.
        designs, walks = log_utilities.shape
        by_scenario = log_utilities.reshape(designs, walks // self.count, self.count)
        rows = [[self._aggregate(worlds) for worlds in row] for row in by_scenario.tolist()]
        return np.array(rows, dtype=np.float64).reshape(by_scenario.shape[:2])

    def _aggregate(self, logarithms: Sequence[float]) -> float:
        ordered = sorted(logarithms, reverse=True)
        tail = (1.0 - self.level) * self.count
        if self.aggregate == "quantile":
            # The number of worlds that may be worse.
            return ordered[min(math.floor(tail + _EDGE), self.count - 1)]
        if self.aggregate == "worst" or math.isinf(ordered[0]):
            return ordered[0]
        size = self.count if self.aggregate == "mean" else max(1.0, tail)
        utilities = [math.exp(value - ordered[0]) for value in ordered]
        return ordered[0] + math.log(mean_of_greatest(utilities, size))


@dataclass(frozen=True, slots=True)
class Aggregation:
    """Aggregation of utilities over worlds and scenarios, up to the geometric mean."""

    worlds: TuningWorlds | None = None
    weights: tuple[float, ...] | None = None  # of the scenarios, positive; None: all equal
    worst: bool = False  # whether the worst scenario alone counts

    def judged(self, log_utilities: Floats) -> Judgement:
        """Judge designs by the geometric mean of `aggregated` (eq. 4.2)."""
        return Judgement(geometric_mean(self.aggregated(log_utilities)), log_utilities)

    def aggregated(self, log_utilities: Floats) -> Floats:
        """Return (n, S) logarithms of which the fitness is the mean, from (n, K) by world."""
        logarithms = log_utilities
        if self.worlds is not None:
            logarithms = self.worlds.aggregated(logarithms)
        if self.weights is not None:
            weights = np.array(self.weights)
            logarithms = logarithms * (weights * (len(weights) / weights.sum()))
        return logarithms.max(axis=1, keepdims=True) if self.worst else logarithms


PLAIN: Final = Aggregation()
"""The geometric mean over scenarios of equal weight."""


def _bounded(perturbation: Variable, custom: Variable) -> Variable:
    """Return a perturbation with custom bounds, and its own kind and unit. Raises ValueError."""
    if custom.kind not in (perturbation.kind, "continuous"):
        raise ValueError(
            f"ranges: {custom.name} is {perturbation.kind}, not {custom.kind}; omit `kind` or set"
            f" it to {perturbation.kind}"
        )
    document = perturbation.model_dump() | {"low": custom.low, "high": custom.high}
    try:
        return Variable.model_validate(document)
    except ValidationError as error:
        message = message_of(error.errors(include_url=False)[0])
        raise ValueError(f"ranges: {message}") from error


def mean_of_greatest(ordered: Sequence[float], size: float) -> float:
    """Mean of the first `size` of descending values, the last possibly in part."""
    whole = math.floor(size + _EDGE)
    total = math.fsum(ordered[:whole])
    if size - whole > _EDGE:
        total += (size - whole) * ordered[whole]
    return total / size


@lru_cache(maxsize=32)
def _drawn(worlds: TuningWorlds) -> tuple[tuple[tuple[str, float], ...], ...]:
    from gaitswarm.sim.worlds.perturbations import sample_worlds

    variables = worlds.variables()
    names = [variable.name for variable in variables]
    rows = sample_worlds(worlds.count, worlds.seed, variables).tolist()
    return tuple(tuple(zip(names, row, strict=True)) for row in rows)
