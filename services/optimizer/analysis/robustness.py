"""Robustness index: sensitivity of a design's objectives to small changes of its variables.

The norm of the Jacobian of the normalised objectives with respect to the normalised variables, by
scenario; the smaller, the more robust (thesis 4.4.3). The objectives are not smooth, so the
Jacobian is that of a linear regression over a sample of designs around the given one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Final, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.evaluations import ObjectiveView
from gaitswarm.services.optimizer.analysis.statistics import CONFIDENCE, resample_weights
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.designs import WalksRequest
from gaitswarm.services.optimizer.jobs.preference import WEIGHED, WEIGHED_NAMES, by_design
from gaitswarm.services.optimizer.jobs.sensitivity import (
    LocalSample,
    local_sample,
    slopes_and_squares,
    usable_rows,
)
from gaitswarm.services.optimizer.search.random_stream import swarm_uniform
from gaitswarm.services.optimizer.views import DesignValues, Finite, View
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.catalogue import design_catalogue, design_shown
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.variables import Variable, VariableChoice

T = TypeVar("T")

_RESAMPLES: Final = 400
_RESAMPLE = 0xB0075


class RobustnessRequest(WalksRequest):
    """A design, its scenarios, and the sample around it."""

    variables: tuple[VariableChoice, ...] | None = Field(default=None, max_length=64)
    """Variables to vary, normalised by their bounds: names, whose bounds are then those of
    /v1/controllers, or variables with bounds of your own. Null: all of the controller's."""
    samples: int = Field(default=256, ge=8, le=4096)
    """Designs to sample around the given one."""
    radius: float = Field(default=0.02, gt=0.0, le=0.5)
    """Largest distance from it, as a share of each variable's bounds [1]."""
    seed: int = Field(default=1, ge=0, lt=2**63, description="Of the sample.")

    def sample(self) -> LocalSample:
        return local_sample(
            self.numbers,
            tuple(self._resolved_variables()),
            radius=self.radius,
            samples=self.samples,
            seed=self.seed,
        )

    def _resolved_variables(self) -> Iterator[Variable]:
        catalogue = design_catalogue(self.controller)
        own = CONTROLLERS[self.controller].variables
        seen = set[str]()
        for index, entry in enumerate(own if self.variables is None else self.variables):
            name = entry if isinstance(entry, str) else entry.name
            field = f"variables.{index}"
            if name in seen:
                raise InvalidRequest(f"{name!r} is named twice", field=field)
            seen.add(name)
            if name not in catalogue:
                known = instead_of(name, catalogue)
                raise InvalidRequest(f"unknown variable {name!r}; {known}", field=field)
            if name not in self.design:
                raise InvalidRequest(f"the design gives no {name}", field=field)
            yield catalogue[name] if isinstance(entry, str) else entry


class IndexView(View):
    """A robustness index with its interval; the smaller, the more robust."""

    value: float = Field(description="The estimate [1].", examples=[1.42])
    low: float = Field(description="Lower end of the interval of 95 % [1].", examples=[1.31])
    high: float = Field(description="Upper end [1].", examples=[1.55])


ByVariable = Annotated[dict[str, Finite], Field(examples=[{"FI1R": 0.7, "FOR": 0.8}])]
ByObjective = Annotated[dict[str, Finite], Field(examples=[{"torque": 0.2}])]


class SampledVariableView(View):
    """A sampled variable, in its unit."""

    name: str = Field(description="Name of the variable.", examples=["FI1R"])
    least: float = Field(description="Least value of the sample.", examples=[5613.2])
    most: float = Field(description="Greatest value of the sample.", examples=[5999.1])


class SensitivityView(View):
    """Relative changes of objectives over the variables' whole bounds.

    Numbers are null if too few of the sample's simulations completed.
    """

    index: IndexView | None
    """Frobenius norm of the Jacobian; over all scenarios the root mean square."""
    by_objective: ByObjective = Field(description="Norms of the Jacobian's rows [1].")
    by_variable: ByVariable = Field(description="Norms of the Jacobian's columns [1].")


class ScenarioRobustnessView(SensitivityView):
    """Effect of small changes of the variables in one scenario."""

    jacobian: dict[str, ByVariable]
    """Of the objectives' logarithms, by objective and variable [1]."""
    walked: int = Field(description="Simulations with all objectives.", examples=[257])
    failed: int = Field(description="Simulations without.", examples=[0])


class Sensitivities(SensitivityView):
    """Sensitivities of a design in several scenarios."""

    scenarios: dict[str, ScenarioRobustnessView] = Field(description="By the scenario's name.")


class RobustnessView(Sensitivities):
    """Robustness index: norm of the Jacobian of the normalised objectives (thesis 4.4.3).

    Objectives are normalised by taking their logarithms, variables by their bounds.
    """

    robot: RobotSource = Field(description="The robot, as requested.", examples=["szabadka2"])
    controller: str = Field(description="Controller that drives it.", examples=["fuzzy-pi"])
    design: DesignValues
    precision: Precision = Field(description="Of the physics' numbers.", examples=["double"])
    samples: int = Field(description="Designs sampled around the given one.", examples=[256])
    radius: float = Field(examples=[0.02])
    """Half the width of the box around the design, as a share of the bounds [1]."""
    seed: int = Field(description="Of the sample.", examples=[1])
    variables: list[SampledVariableView] = Field(description="Varied variables.")
    held: list[str] = Field(examples=[["FOMF"]])
    """Fixed variables: categorical ones, and integers whose next value is farther than the
    radius."""
    objectives: list[ObjectiveView] = Field(description="Normalised objectives, f1 to f5.")


def robustness_view(
    request: RobustnessRequest, sample: LocalSample, outcomes: Sequence[Outcome]
) -> RobustnessView:
    """Estimate the robustness of a design from the outcomes of a sample in its scenarios."""
    names = [scenario.name for scenario in request.resolved_scenarios()]
    return RobustnessView(
        **dict(sensitivities(sample, *by_design(outcomes), names)),
        **request.model_dump(include={"controller", "precision", "samples", "radius", "seed"}),
        robot=request.robot,
        design=design_shown(request.controller, request.numbers),
        variables=[
            SampledVariableView(name=variable.name, least=values.min(), most=values.max())
            for variable in sample.varied
            for values in (sample.designs[:, sample.names.index(variable.name)],)
        ],
        held=list(sample.held),
        objectives=[ObjectiveView.model_validate(o) for o in WEIGHED],
    )


def sensitivities(
    sample: LocalSample,
    objectives: Floats,
    failed: NDArray[np.bool_],
    scenarios: Sequence[str],
) -> Sensitivities:
    """Estimate the index from the results (1 + n, K, M) of a sample in K scenarios.

    The contribution of noise to a squared norm is subtracted; intervals are from a bootstrap over
    the designs.
    """
    values = objectives[:, :, : len(WEIGHED)]
    usable = usable_rows(values, failed)
    count = len(sample.designs)
    draws = swarm_uniform(0, _RESAMPLE, iteration=0, particles=_RESAMPLES, count=count)
    weights = resample_weights(draws)
    variables = [variable.name for variable in sample.varied]
    views: dict[str, ScenarioRobustnessView] = {}
    biased, unbiased, rows, columns = [], [], [], []
    for k, name in enumerate(scenarios):
        chosen = usable[:, k]
        slopes, squares = slopes_and_squares(sample, values[:, k], chosen, weights)
        biased.append(float((slopes[0] ** 2).sum()))
        unbiased.append(squares.sum(axis=(1, 2)))
        rows.append(np.sqrt(np.maximum(squares[0].sum(axis=0), 0.0)))
        columns.append(np.sqrt(np.maximum(squares[0].sum(axis=1), 0.0)))
        jacobian = [_named(variables, row) for row in slopes[0].T]
        views[name] = ScenarioRobustnessView(
            index=_interval(biased[-1], unbiased[-1]),
            by_objective=_named(WEIGHED_NAMES, rows[-1]),
            by_variable=_named(variables, columns[-1]),
            jacobian=_named(WEIGHED_NAMES, jacobian),
            walked=int(chosen.sum()),
            failed=int((~chosen).sum()),
        )
    return Sensitivities(
        index=_interval(float(np.mean(biased)), np.mean(unbiased, axis=0)),
        by_objective=_named(WEIGHED_NAMES, np.sqrt(np.mean(np.square(rows), axis=0))),
        by_variable=_named(variables, np.sqrt(np.mean(np.square(columns), axis=0))),
        scenarios=views,
    )


def _interval(biased: float, unbiased: Floats) -> IndexView | None:
    """Interval of a Jacobian's norm by its squares, `unbiased` (1 + B,); None for NaN."""
    if math.isnan(biased):
        return None
    estimate, *resampled = np.sqrt(np.maximum(unbiased, 0.0)).tolist()
    errors = np.array(resampled) - math.sqrt(biased)
    tail = (1.0 - CONFIDENCE) / 2.0
    least, most = np.quantile(errors, [tail, 1.0 - tail]).tolist()
    low, high = max(0.0, estimate - most), max(0.0, estimate - least)
    return IndexView(value=estimate, low=min(low, estimate), high=max(high, estimate))


def _named(names: Iterable[str], values: Iterable[T]) -> dict[str, T]:
    return dict(zip(names, values, strict=True))
