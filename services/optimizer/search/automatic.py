"""`auto`: the method that suits a job's budget and variables."""

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
    """The method is chosen when the job is submitted; the job then names that method."""

    name: Literal["auto"] = "auto"


AUTO_SUMMARY: Final = (
    "CMA-ES, or differential evolution for more than 64 variables; chosen on submission"
)

if TYPE_CHECKING:
    ChosenSettings: TypeAlias = SearchSettings
else:
    ChosenSettings = AutoSettings | OptimizerSettings
"""What a spec may have before it is resolved; a stored job has the settings of a method."""

CHOICES: Final = NamedSettings(MappingProxyType({"auto": AutoSettings()}))
"""Everything that a job may name, with the settings that the name stands for."""

ChoiceName: TypeAlias = Annotated[str, KnownName(CHOICES)]
"""What a job may name."""


@dataclass(frozen=True, slots=True)
class Rule:
    """Searches for which one method is chosen.

    Attributes:
        settings: Of the method; its `particles` become those of the job.
        largest_budget: Evaluations, at most.
        largest_dimension: Variables, at most.
        kinds: Kinds of variables that there may be.
    """

    settings: OptimizerSettings
    largest_budget: float = math.inf
    largest_dimension: float = math.inf
    kinds: frozenset[Kind] = frozenset({"continuous", "integer", "categorical"})

    def suits(self, space: Space, budget: int) -> bool:
        """Whether it is for a search."""
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
"""The first one that suits a search is taken; the last one suits all.

None of ten searches raced on the job of chapter 4 with twenty seeds was better than CMA-ES. On
those of chapter 3 `de` is; which property of theirs makes it so is not known. The decomposition of
CMA-ES costs the cube of the dimension: some 0.2 s a generation for 64 variables, more than the
walks for many.
"""


def chosen_method(
    settings: AutoSettings, space: Space, budget: int, rules: tuple[Rule, ...] = RULES
) -> OptimizerSettings:
    """Choose the method of a search."""
    rule = next(rule for rule in rules if rule.suits(space, budget))
    return rule.settings.model_copy(update={"particles": settings.particles})
