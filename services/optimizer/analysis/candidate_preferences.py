"""Results of a search for preferences: what each candidate preference buys"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.preferences import (
    CRITERIA,
    FIGURES,
    PreferencesSpec,
    preference_of,
)
from gaitswarm.services.optimizer.jobs.labels import OWN, preference_name
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.views import DesignValues, IterationIndex, JobName, Particle, View

Figures = Annotated[dict[str, float], Field(examples=[{"energy": 77.4, "speed": 0.043}])]


class CandidatePreferenceView(View):
    """A preference, and what the design that is optimal under it is worth."""

    iteration: IterationIndex
    particle: Particle
    preference: Preference = Field(description="By which the optimum was searched for.")
    named: str | None = Field(description="A, B or C of table 4.5; null for any other.")
    recommended: bool = Field(description="Whether its fitness is the least.")
    fitness: float = Field(
        description="Factor by which objectives may get worse [1]: exp(0.05 sensitivity) risk"
        " unevenness / (1 - failures).",
        examples=[2.43],
    )
    sensitivity: float = Field(
        description="Robustness index of the optimum over its own variables [1]."
    )
    failures: float = Field(description="Share of held-out worlds in which a scenario failed [1].")
    risk: float = Field(
        description="Mean of the objectives in the worst 5 % of these, by the nominal world [1]."
    )
    unevenness: float = Field(
        description="Deviation of the changes from the reference over the scenarios, a factor [1]."
    )
    figures: Figures = Field(
        description="Geometric means over the scenarios, in the units of table 4.1 and m/s;"
        " `slowest` is the speed in the slowest scenario."
    )
    changes: Figures = Field(description="By which share they differ from the reference's [1].")
    design: DesignValues


class CandidatePreferencesView(View):
    """Preferences judged by their optima: robustness, and evenness over the scenarios."""

    job: JobName
    worlds: int = Field(description="Held-out worlds in which each optimum was simulated.")
    samples: int = Field(description="Designs simulated around each optimum.")
    evaluated: int = Field(description="Preferences so far, including those without an optimum.")
    reference: DesignValues
    reference_figures: Figures = Field(description="Its figures, as of the candidates.")
    candidates: list[CandidatePreferenceView] = Field(
        description="Those with a feasible optimum, of least fitness first."
    )


def candidate_preferences(
    job_id: str, spec: PreferencesSpec, columns: EvaluationColumns
) -> CandidatePreferencesView:
    """List the candidates of a search for preferences, from stored results."""
    order = np.argsort(columns.fitness, kind="stable")
    order = order[np.isfinite(columns.fitness[order])]
    if not len(order):
        raise Conflict(f"job {job_id} has no preference with a feasible optimum yet")
    names = [column.name for column in spec.columns]
    rows = [dict(zip(names, row, strict=True)) for row in columns.objectives[order, 0].tolist()]
    space, tuned = spec.design_space(), spec.tuning.design_space()
    candidates = []
    for place, values in zip(order.tolist(), rows, strict=True):
        preference = preference_of(space.shown(columns.designs[place].tolist()))
        assert preference is not None, "it has an optimum"  # noqa: S101
        named = preference_name(preference)
        relative = _as_speed({f.name: values[f"relative_{f.name}"] for f in FIGURES})
        candidates.append(
            CandidatePreferenceView(
                iteration=int(columns.iteration[place]),
                particle=int(columns.particle[place]),
                preference=preference,
                named=None if named == OWN else named,
                recommended=place == order[0],
                fitness=columns.fitness[place],
                figures=_as_speed({f.name: values[f.name] for f in FIGURES}),
                changes={name: value - 1.0 for name, value in relative.items()},
                design=tuned.shown([values[name] for name in tuned.names]),
                **{criterion.name: values[criterion.name] for criterion in CRITERIA},
            )
        )
    start = spec.tuning.start_positions()[:1]
    of_reference = {f.name: rows[0][f.name] / rows[0][f"relative_{f.name}"] for f in FIGURES}
    return CandidatePreferencesView(
        job=job_id,
        worlds=spec.worlds,
        samples=spec.samples,
        evaluated=len(columns),
        reference=tuned.shown(tuned.designs(start)[0].tolist()),
        reference_figures=_as_speed(of_reference),
        candidates=candidates,
    )


def _as_speed(figures: dict[str, float]) -> dict[str, float]:
    """Replace the reciprocal of the speed."""
    speed = 1.0 / figures.pop("reciprocal_speed")
    return {**figures, "speed": speed}
