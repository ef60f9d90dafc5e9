"""Results of a calibration, target by target."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.analysis.targets import Reached, TargetResult, TargetResults
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.services.optimizer.views import View, finite


class ReachedView(View):
    """Simulated value of one target."""

    simulated: float | None = Field(
        description="Value, in the target's unit; null if its walk failed.", examples=[47.6]
    )
    difference: float | None = Field(
        description="From the target's value, in tolerances: ln(simulated / value) /"
        " ln(1 + tolerance), of height_loss (simulated - value) / tolerance.",
        examples=[0.69],
    )

    @classmethod
    def from_reached(cls, reached: Reached) -> ReachedView:
        """Make a view of a value."""
        return cls(simulated=finite(reached.simulated), difference=finite(reached.difference))


class TargetResultView(ReachedView):
    """One target and the best design's value."""

    walk: str = Field(description="Label of the walk.", examples=["fuzzy-pso-ps"])
    relative_to: str | None = Field(
        description="Walk that the value is the ratio to; null for a value of its own."
    )
    quantity: str = Field(description="What was measured.", examples=["energy"])
    unit: str = Field(description="Unit of the value; 1 for a ratio.", examples=["J/m"])
    value: float = Field(description="The target.", examples=[41.96])
    tolerance: float = Field(
        description="Deviation that counts as one: relative; of height_loss in metres.",
        examples=[0.2],
    )
    use: str = Field(description="fit, or predict for one that is only compared.", examples=["fit"])
    left_out: ReachedView | None = Field(
        description="Value of the design that is best without this target; null if that was"
        " not requested, the target is not fitted, or no other target is."
    )

    @classmethod
    def from_result(cls, result: TargetResult) -> TargetResultView:
        """Make a view of a target."""
        target, left_out = result.target, result.left_out
        return cls(
            simulated=finite(result.best.simulated),
            difference=finite(result.best.difference),
            walk=target.walk,
            relative_to=target.relative_to,
            quantity=target.quantity,
            unit=target.unit,
            value=target.value,
            tolerance=target.tolerance,
            use=target.use,
            left_out=None if left_out is None else ReachedView.from_reached(left_out),
        )


class TargetsView(View):
    """Targets reached by the best design of several runs of a calibration."""

    jobs: list[str] = Field(description="The runs.", examples=[["k2q7zr5dm9xw"]])
    job: str = Field(description="The run that found the best design.", examples=["k2q7zr5dm9xw"])
    iteration: int = Field(description="Iteration that found it, from 0.", examples=[24])
    particle: int = Field(
        description="Number of the design in its iteration, from 0.", examples=[7]
    )
    fitness: float = Field(
        description="Root mean square of the differences of fitted targets, in tolerances [1].",
        examples=[0.84],
    )
    design: dict[str, float | str] = Field(
        description="Value of every variable, searched and fixed, by name.",
        examples=[{"battery_voltage": 9.22, "contact_law": "stick"}],
    )
    targets: list[TargetResultView] = Field(description="Every target, in the job's order.")

    @classmethod
    def from_results(
        cls, jobs: list[str], spec: CalibrationSpec, results: TargetResults
    ) -> TargetsView:
        """Make a view of all targets.

        Args:
            jobs: ids of the runs.
            spec: of the runs.
            results: what they say, each run in the same order.
        """
        return cls(
            jobs=jobs,
            job=jobs[results.run],
            iteration=results.iteration,
            particle=results.particle,
            fitness=results.fitness,
            design=spec.design_space().shown(results.design.tolist()),
            targets=[TargetResultView.from_result(result) for result in results.targets],
        )
