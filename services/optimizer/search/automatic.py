"""`auto`: a method chosen by the variables and budget of a job."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Final, Literal, TypeAlias

from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.registry import (
    DEFAULT_METHOD,
    LONGEST_REPLAY,
    METHODS,
    NamedSettings,
    OptimizerSettings,
)
from gaitswarm.services.optimizer.search.space import Kind, Space
from gaitswarm.sim.plugins import KnownName


class AutoSettings(SearchSettings):
    """Settings that are replaced by those of a method when the job is submitted."""

    name: Literal["auto"] = "auto"


AUTO_SUMMARY: Final = (
    "CMA-ES, or differential evolution for more than 64 variables; chosen on submission"
)

if TYPE_CHECKING:
    ChosenSettings: TypeAlias = SearchSettings
else:
    ChosenSettings = AutoSettings | OptimizerSettings
"""Settings of a spec before it is resolved; a stored job has the settings of a method."""

CHOICES: Final = NamedSettings(MappingProxyType({"auto": AutoSettings()}))
"""Names that a job may use, with the settings they stand for."""

ChoiceName: TypeAlias = Annotated[str, KnownName(CHOICES)]


@dataclass(frozen=True, slots=True)
class Rule:
    """Conditions under which a method is chosen."""

    settings: OptimizerSettings  # Settings of the method; its `particles` are replaced by the job's
    largest_budget: float = math.inf  # Largest number of evaluations
    largest_dimension: float = math.inf  # Largest number of variables
    # Kinds of variables allowed
    kinds: frozenset[Kind] = frozenset({"continuous", "integer", "categorical"})

    def suits(self, space: Space, budget: int) -> bool:
        """Return whether a search meets the conditions."""
        method = METHODS[self.settings.name]
        return (
            not method.missing
            and (budget <= LONGEST_REPLAY or not method.replays)
            and budget <= self.largest_budget
            and space.dimension <= self.largest_dimension
            and self.kinds.issuperset(axis.kind for axis in space.axes)
        )


RULES: Final = (
    Rule(CHOICES[DEFAULT_METHOD], largest_dimension=64),
    Rule(CHOICES["de"]),
)
"""The first rule that suits a search applies; the last one suits every search.

No method compared on the job of chapter 4 with twenty seeds was better than CMA-ES
(research/docs/comparison.md). The decomposition of CMA-ES costs the cube of the dimension: about
0.2 s per generation for 64 variables.
"""


def chosen_method(
    settings: AutoSettings, space: Space, budget: int, rules: tuple[Rule, ...] = RULES
) -> OptimizerSettings:
    """Choose the method of a search."""
    rule = next(rule for rule in rules if rule.suits(space, budget))
    return rule.settings.model_copy(update={"particles": settings.particles})
