"""How long tasks take by test case, learned from those that have ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from gaitswarm.services.worker.cutting import Chunk
from gaitswarm.sim.case import Case

_WEIGHT: Final = 0.5
"""Of the last iteration, against all before."""

Costs = Mapping[str, float]
"""Simulated seconds of a task, by case."""


@dataclass(frozen=True, slots=True)
class CaseTime:
    """One task that has ended.

    Attributes:
        costs: Its simulated seconds by case [s].
        seconds: That its worker took for it [s].
    """

    costs: Costs
    seconds: float


@dataclass(frozen=True, slots=True)
class Durations:
    """What a simulated second of each case takes.

    A task of several cases tells only their sum. It is attributed to them in proportion to what
    they were thought to take, which comes to what each takes as tasks of other mixtures end: the
    multiplicative update of Richardson and Lucy.

    Attributes:
        rates: Seconds for each simulated second, by case [1].
    """

    rates: Mapping[str, float] = field(default_factory=dict)

    def after(self, tasks: Sequence[CaseTime]) -> Durations:
        """With what further tasks have shown.

        Args:
            tasks: Of one iteration, as far as they have ended.

        Returns:
            These rates and the iteration's, with half of the weight each; those alone for a case
            that was not known.
        """
        total = sum(sum(task.costs.values()) for task in tasks)
        if total <= 0.0:
            return self
        mean = sum(task.seconds for task in tasks) / total
        spent: dict[str, float] = {}
        cost: dict[str, float] = {}
        for task in tasks:
            shares = {
                case: self.rates.get(case, mean) * seconds for case, seconds in task.costs.items()
            }
            whole = sum(shares.values())
            for case, share in shares.items():
                part = share / whole if whole > 0.0 else 1.0 / len(shares)
                spent[case] = spent.get(case, 0.0) + task.seconds * part
                cost[case] = cost.get(case, 0.0) + task.costs[case]
        latest = {case: spent[case] / cost[case] for case in spent if cost[case] > 0.0}
        blended = {
            case: (1.0 - _WEIGHT) * self.rates.get(case, rate) + _WEIGHT * rate
            for case, rate in latest.items()
        }
        return Durations({**self.rates, **blended})

    def predicted(self, costs: Costs) -> float | None:
        """How long a task should take.

        Args:
            costs: Its simulated seconds by case [s].

        Returns:
            Seconds [s]; None if a case of it was never measured.
        """
        if any(case not in self.rates for case in costs):
            return None
        return sum(self.rates[case] * seconds for case, seconds in costs.items())


def costs_of(chunk: Chunk, cases: Sequence[Case]) -> dict[str, float]:
    """Simulated seconds of a chunk by case.

    Args:
        chunk: Of a request.
        cases: Of the request.

    Returns:
        The chunk's cost, divided as its walks are long; by the case's name and precision.
    """
    walks = {
        f"{cases[part.case].name} {cases[part.case].precision}": cases[part.case].duration
        * (part.stop - part.start)
        for part in chunk.parts
    }
    total = sum(walks.values())
    if total <= 0.0:
        return walks
    return {case: chunk.cost * seconds / total for case, seconds in walks.items()}
