"""Pareto fronts, and preferences under which a given design wins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.evaluations import ObjectiveView
from gaitswarm.services.optimizer.analysis.front import Front
from gaitswarm.services.optimizer.analysis.robustness_index import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.analysis.utilities import objective_vectors
from gaitswarm.services.optimizer.analysis.winning_preference import PreferenceFit
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.views import View, finite

OBJECTIVE_NAMES: Final = tuple(objective.name for objective in NORMALISED_OBJECTIVES)

PreferenceOwner = Literal["job", "A", "B", "C"]

_EXAMPLE: Final = {
    "torque": 8.7,
    "acceleration": 1.8,
    "angular_acceleration": 16.1,
    "energy": 42.0,
    "reciprocal_speed": 6.4,
}


class TradeOffDesignView(View):
    """A design of a job, by its objectives over all scenarios."""

    iteration: int = Field(description="Iteration of the job, from 0.", examples=[24])
    particle: int = Field(
        description="Number of the design in its iteration, from 0.", examples=[7]
    )
    design: dict[str, float | str] = Field(
        description="Value of every variable, by name; units as in /v1/controllers.",
        examples=[{"I": 0.171, "FI1R": 5837.0}],
    )
    objectives: dict[str, float] = Field(
        description="Each objective's geometric mean over the scenarios, minimized; units are in"
        " the front's `objectives`.",
        examples=[_EXAMPLE],
    )
    fitness: float | None = Field(
        description="By the job's own preference, minimized [1].", examples=[20.87]
    )

    @classmethod
    def from_row(
        cls, row: int, vectors: NDArray[np.float64], columns: EvaluationColumns, spec: JobSpec
    ) -> TradeOffDesignView:
        """Make a view of one evaluation."""
        return TradeOffDesignView(**_fields(row, vectors, columns, spec))


class NormalisedDesignView(TradeOffDesignView):
    """A design of a job with respect to the job's front."""

    normalised: dict[str, float] = Field(
        description="Logarithm of each objective, 0 at the front's ideal and 1 at its nadir [1].",
        examples=[dict.fromkeys(_EXAMPLE, 0.25)],
    )


class FrontDesignView(NormalisedDesignView):
    """A design that no other of its job dominates."""

    marks: list[str] = Field(
        description="Labels: `knee 1` and so on, `least energy` and so on,"
        " `best under A` and so on, `best of the job`.",
        examples=[["knee 1", "best under C"]],
    )


class KneeView(NormalisedDesignView):
    """A design that is nearer to the ideal than those around it."""

    distance: float = Field(
        description="From the plane of equal intercepts through the mean of the extremes, in"
        " normalised objectives [1].",
        examples=[0.41],
    )


class ExtremeView(NormalisedDesignView):
    """The best design in one objective."""

    objective: str = Field(description="Its name.", examples=["energy"])


class FrontWinnerView(NormalisedDesignView):
    """The best design of the job under a preference, which need not be on the front.

    Biases differ from scenario to scenario in what they do, so that a dominated design can win.
    """

    preference: PreferenceOwner = Field(
        description="A, B or C of table 4.5, or the job's own.", examples=["A"]
    )
    on_front: bool = Field(description="Whether no design of the job dominates it.")
    dominated_by: int = Field(description="Designs of the front that dominate it.", examples=[0])
    behind: float = Field(
        description="Share by which one of these is better in every objective [1].", examples=[0.0]
    )


class FrontIterationView(View):
    """Hypervolume of the front at an iteration."""

    index: int = Field(description="Index of the iteration, from 0.", examples=[24])
    hypervolume: float = Field(
        description="Of the front of this and all earlier iterations [1].", examples=[0.63]
    )


class FrontView(View):
    """The Pareto front of a job, without simulation."""

    objectives: list[ObjectiveView] = Field(description="f1 to f5 of table 4.1, in order.")
    designs_judged: int = Field(
        description="Designs of the job that walk in all scenarios.", examples=[618]
    )
    failed: int = Field(description="Designs that do not.", examples=[7])
    size: int = Field(
        description="Designs that no other dominates; of equal ones the earliest.", examples=[74]
    )
    ideal: dict[str, float] = Field(
        description="Least of the front in each objective, in its unit.", examples=[_EXAMPLE]
    )
    nadir: dict[str, float] = Field(
        description="Greatest of the front in each objective.", examples=[_EXAMPLE]
    )
    reference: dict[str, float] = Field(
        description="Reference point of the hypervolume: a tenth of the front's range beyond the"
        " nadir, in logarithms.",
        examples=[_EXAMPLE],
    )
    hypervolume: float = Field(
        description="Share of the box between ideal and reference that the front dominates, in"
        " logarithms [1].",
        examples=[0.63],
    )
    hypervolume_error: float = Field(
        description="Its standard error [1]; 0 if it is exact. A front of thousands of designs may"
        " be measured by points drawn in the box.",
        examples=[0.0],
    )
    iterations: list[FrontIterationView] = Field(
        description="Hypervolume over the iterations, in the same box; it never falls."
    )
    knees: list[KneeView] = Field(
        description="At most five, the most pronounced first: nearer to the ideal than all designs"
        " that differ by less than a quarter of the front's range in each objective."
    )
    extremes: list[ExtremeView] = Field(description="The best design in each objective.")
    winners: list[FrontWinnerView] = Field(
        description="The best designs under A, B and C and under the job's own preference."
    )
    designs: list[FrontDesignView] = Field(
        description="Designs of the front, in the order in which they were tried. Of a front of"
        " more than requested: labelled designs, and others that cover it evenly."
    )

    @classmethod
    def from_front(
        cls, front: Front, columns: EvaluationColumns, spec: JobSpec, *, most: int
    ) -> FrontView:
        """Make a view of a front.

        Args:
            front: of the job.
            columns: its evaluations.
            spec: of the job.
            most: designs to list.
        """

        def fields(row: int) -> dict[str, Any]:
            normalised = by_objective(front.normalised[row])
            return {**_fields(row, front.vectors, columns, spec), "normalised": normalised}

        marks = _marks(front)
        judged = int(np.isfinite(front.vectors[:, 0]).sum())
        return cls(
            objectives=[ObjectiveView.model_validate(f) for f in NORMALISED_OBJECTIVES],
            designs_judged=judged,
            failed=len(columns) - judged,
            size=len(front.rows),
            ideal=by_objective(front.ideal),
            nadir=by_objective(front.nadir),
            reference=by_objective(front.reference),
            hypervolume=float(front.hypervolume[-1]),
            hypervolume_error=front.standard_error,
            iterations=[
                FrontIterationView(index=index, hypervolume=value)
                for index, value in zip(
                    front.iterations.tolist(), front.hypervolume.tolist(), strict=True
                )
            ],
            knees=[KneeView(**fields(knee.row), distance=knee.distance) for knee in front.knees],
            extremes=[
                ExtremeView(**fields(row), objective=name)
                for name, row in zip(OBJECTIVE_NAMES, front.extremes.tolist(), strict=True)
            ],
            winners=[
                FrontWinnerView.model_validate(
                    {
                        **fields(winner.row),
                        "preference": name,
                        "on_front": winner.on_front,
                        "dominated_by": winner.dominated_by,
                        "behind": winner.behind,
                    }
                )
                for name, winner in front.winners.items()
            ],
            designs=[
                FrontDesignView(**fields(row), marks=marks.get(row, []))
                for row in front.spread(most).tolist()
            ],
        )


class PreferenceFitView(View):
    """Rank of a design under a preference, among all designs of the job."""

    preference: Preference = Field(description="Its exponents sum to about 1.")
    biases_of: list[PreferenceOwner] = Field(
        description="Whose biases these are.", examples=[["job", "A"]]
    )
    rank: int = Field(description="Of the design, from 1; equal designs share it.", examples=[1])
    fitness: float = Field(description="Of the design under it [1].", examples=[4.81])
    margin: float | None = Field(
        description="Share by which the rival's fitness is worse, below 0 if it is better [1], with"
        " exponents that sum to 1; null without a rival.",
        examples=[0.012],
    )
    rival: TradeOffDesignView | None = Field(
        description="The best of all other designs under it; null if there is none."
    )


class PreferenceForView(View):
    """Preferences under which a design wins its job, without simulation."""

    chosen: TradeOffDesignView = Field(description="The design.")
    on_front: bool = Field(description="Whether no other design of the job dominates it.")
    wins: bool = Field(description="Whether no design is better under the best of the fits.")
    certain: bool = Field(
        description="Whether exponents were found by which it wins, or it is proven that with the"
        " biases of none of the fits there are any. Not proven for a job that judges in worlds."
    )
    fits: list[PreferenceFitView] = Field(
        description="One for each set of biases, the job's own and those of A, B and C, the best"
        " first: those by which it wins by the most, or has the best rank that was found."
    )

    @classmethod
    def from_fits(
        cls, row: int, fits: Sequence[PreferenceFit], columns: EvaluationColumns, spec: JobSpec
    ) -> PreferenceForView:
        """Make the answer for one design.

        Args:
            row: of the design, in the columns.
            fits: the best first, at least one.
            columns: evaluations of the job.
            spec: of the job.
        """
        vectors = objective_vectors(columns, worlds=spec.worlds)

        def shown(row: int) -> TradeOffDesignView:
            return TradeOffDesignView.from_row(row, vectors, columns, spec)

        better = (vectors <= vectors[row]).all(axis=1) & (vectors < vectors[row]).any(axis=1)
        wins = fits[0].wins
        return cls(
            chosen=shown(row),
            on_front=not better.any(),
            wins=wins,
            certain=wins or spec.worlds is None,
            fits=[
                PreferenceFitView.model_validate(
                    {
                        "preference": fit.preference,
                        "biases_of": list(fit.biases_of),
                        "rank": fit.rank,
                        "fitness": fit.fitness,
                        "margin": finite(fit.margin),
                        "rival": None if fit.rival is None else shown(fit.rival),
                    }
                )
                for fit in fits
            ],
        )


def by_objective(values: NDArray[np.float64]) -> dict[str, float]:
    """Name numbers by their objectives."""
    return dict(zip(OBJECTIVE_NAMES, values.tolist(), strict=True))


def _fields(
    row: int, vectors: NDArray[np.float64], columns: EvaluationColumns, spec: JobSpec
) -> dict[str, Any]:
    """Of a view of one evaluation."""
    return {
        "iteration": int(columns.iteration[row]),
        "particle": int(columns.particle[row]),
        "design": spec.design_space().shown(columns.designs[row].tolist()),
        "objectives": by_objective(vectors[row]),
        "fitness": finite(float(columns.fitness[row])),
    }


def _marks(front: Front) -> dict[int, list[str]]:
    """Labels of designs, by row."""
    marks: dict[int, list[str]] = {}
    for number, knee in enumerate(front.knees, start=1):
        marks.setdefault(knee.row, []).append(f"knee {number}")
    for name, row in zip(OBJECTIVE_NAMES, front.extremes.tolist(), strict=True):
        marks.setdefault(row, []).append(f"least {name}")
    for name, winner in front.winners.items():
        label = "best of the job" if name == "job" else f"best under {name}"
        marks.setdefault(winner.row, []).append(label)
    return marks
