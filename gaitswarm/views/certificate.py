"""Certificates: a design's results in many worlds and in held-out scenarios."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.analysis.certificate import (
    LEVEL,
    QUANTILES,
    CaseResult,
    Certificate,
    Compared,
    ComparedCase,
    ComparedEngine,
    Influence,
    Proportion,
    Spread,
    WorldOutcome,
)
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.views import StatusName, View, finite
from gaitswarm.sim.mujoco.engines import ENGINES
from gaitswarm.sim.robot import RobotSource


class ProportionView(View):
    """A count over worlds with its confidence interval."""

    count: int = Field(description="Worlds in which it happened [1].", examples=[3])
    share: float = Field(description="Of all worlds [1].", examples=[0.003])
    low: float = Field(
        description="Lower end of the exact interval of 95 % for its probability, by Clopper and"
        " Pearson [1].",
        examples=[0.00062],
    )
    high: float = Field(description="Upper end [1].", examples=[0.0087])

    @classmethod
    def from_proportion(cls, found: Proportion) -> ProportionView:
        """Make a view of a proportion."""
        return cls(count=found.count, share=found.share, low=found.low, high=found.high)


class SpreadView(View):
    """Distribution of a quantity over worlds; lower is better, and a failure is worse than any."""

    quantiles: list[float | None] = Field(
        description="At the certificate's `quantiles`; null where a quantile is a failed walk.",
        examples=[[19.8, 20.4, 21.0, 21.9, 24.2]],
    )
    worst: float | None = Field(
        description="The greatest of walks that did not fail; null if all did.", examples=[31.7]
    )
    cvar: float | None = Field(
        description="Conditional value at risk: mean of the worst 5 % of worlds. A failed walk"
        " counts as `worst`, so that with failures this is a lower bound; null if all failed.",
        examples=[26.3],
    )
    tail_failed: float = Field(description="Share of these 5 % that failed [1].", examples=[0.06])
    nominal: float | None = Field(
        description="In the nominal world; null if the walk failed there.", examples=[20.93]
    )

    @classmethod
    def from_spread(cls, spread: Spread) -> SpreadView:
        """Make a view of a spread."""
        return cls(
            quantiles=[finite(value) for value in spread.quantiles],
            worst=finite(spread.worst),
            cvar=finite(spread.cvar),
            tail_failed=spread.tail_failed,
            nominal=finite(spread.nominal),
        )


class CertifiedScenarioView(View):
    """One scenario over all worlds."""

    held_out: bool = Field(
        description="Whether it is held out: one of the spec's `held_out`, which the design was"
        " not tuned in; without them a preset for which no design of the thesis was optimized."
    )
    statuses: dict[StatusName, int] = Field(
        description="Simulations by status; missing ones are 0.",
        examples=[{"ok": 997, "fell": 3}],
    )
    fell: ProportionView = Field(description="How often the robot fell.")
    failed: ProportionView = Field(
        description="Failures of any kind: fell, diverged, stalled or out of reach."
    )
    utility: SpreadView = Field(description="By the job's preference (eq. 3.8, 4.1) [1].")
    objectives: dict[str, SpreadView] = Field(
        description="By name, in the units of the job's `objectives`; height_loss by its size."
    )

    @classmethod
    def from_case(
        cls, case: CaseResult, names: list[str], *, held_out: bool
    ) -> CertifiedScenarioView:
        """Make a view of a scenario."""
        return cls(
            held_out=held_out,
            statuses={status.label: count for status, count in case.statuses.items()},
            fell=ProportionView.from_proportion(case.fell),
            failed=ProportionView.from_proportion(case.failed),
            utility=SpreadView.from_spread(case.utility),
            objectives={
                name: SpreadView.from_spread(spread)
                for name, spread in zip(names, case.objectives, strict=True)
            },
        )


class WorldView(View):
    """Results of the design in one world."""

    world: int = Field(description="Number of the world, from 0.", examples=[417])
    iteration: int = Field(description="Iteration of the job that walked it.", examples=[8])
    particle: int = Field(description="Its place in the iteration, from 0.", examples=[18])
    fitness: float | None = Field(
        description="Geometric mean over the scenarios (eq. 4.2) [1]; null if one failed.",
        examples=[31.7],
    )
    failures: dict[str, StatusName] = Field(
        description="Scenarios that failed, and how.", examples=[{"slope-fast": "fell"}]
    )
    scenario: str = Field(
        description="In which it is worst: one that failed, or else the one whose utility is the"
        " greatest multiple of that in the nominal world.",
        examples=["slope-fast"],
    )
    values: dict[str, float | str] = Field(
        description="Value of every perturbation that is drawn or fixed, by name."
    )
    replay: str = Field(
        description="The command that lets the design walk in this world again.",
        examples=["gaitswarm certify k2q7zr5dm9xw --replay 417 --scenarios slope-fast"],
    )

    @classmethod
    def from_world(cls, found: WorldOutcome, job_id: str) -> WorldView:
        """Make a view of a world."""
        return cls(
            world=found.index,
            iteration=found.iteration,
            particle=found.particle,
            fitness=finite(found.fitness),
            failures={name: status.label for name, status in found.failures},
            scenario=found.scenario,
            values=found.values,
            replay=f"gaitswarm certify {job_id} --replay {found.index} --scenarios"
            f" {found.scenario}",
        )


class InfluenceView(View):
    """Correlation of a perturbation with the outcome."""

    name: str = Field(description="Name of the perturbation.", examples=["friction"])
    correlation: float = Field(
        description="Spearman's, of its value with the fitness, failed worlds sharing the last rank"
        " [1]. Positive: greater values go with worse outcomes.",
        examples=[-0.62],
    )
    low: float = Field(description="Lower end of its interval of 95 % [1].", examples=[-0.66])
    high: float = Field(description="Upper end [1].", examples=[-0.58])

    @classmethod
    def from_influence(cls, found: Influence) -> InfluenceView:
        """Make a view of an influence."""
        return cls(name=found.name, correlation=found.correlation, low=found.low, high=found.high)


class ComparedView(View):
    """One quantity in the nominal world, by our engine and by another one."""

    ours: float | None = Field(
        description="By our engine; null if the walk failed there.", examples=[7.805]
    )
    theirs: float | None = Field(
        description="By the other engine; null if the walk failed there.", examples=[7.803]
    )
    difference: float | None = Field(
        description="By which the other engine's is greater, as a share of ours [1]; null if"
        " either is, or if ours is 0.",
        examples=[-0.0003],
    )

    @classmethod
    def from_compared(cls, found: Compared) -> ComparedView:
        """Make a view of a comparison."""
        return cls(
            ours=finite(found.ours),
            theirs=finite(found.theirs),
            difference=finite(found.difference),
        )


class ComparedScenarioView(View):
    """One scenario in the nominal world, by our engine and by another one."""

    ours: StatusName = Field(description="How the walk ended by our engine.", examples=["ok"])
    theirs: StatusName = Field(
        description="How the walk ended by the other engine.", examples=["ok"]
    )
    utility: ComparedView = Field(description="By the job's preference (eq. 3.8, 4.1) [1].")
    objectives: dict[str, ComparedView] = Field(
        description="By name, in the units of the job's `objectives`; height_loss by its size."
    )

    @classmethod
    def from_case(cls, case: ComparedCase, names: list[str]) -> ComparedScenarioView:
        """Make a view of a scenario."""
        return cls(
            ours=case.ours.label,
            theirs=case.theirs.label,
            utility=ComparedView.from_compared(case.utility),
            objectives={
                name: ComparedView.from_compared(found)
                for name, found in zip(names, case.objectives, strict=True)
            },
        )


class ComparedEngineView(View):
    """Results of another engine in the nominal world."""

    description: str = Field(description="What is this engine's own.", examples=[ENGINES["mujoco"]])
    fitness: ComparedView = Field(description="Over all scenarios (eq. 4.2) [1].")
    scenarios: dict[str, ComparedScenarioView] = Field(
        description="By name of the scenario, in the job's order."
    )

    @classmethod
    def from_engine(cls, engine: ComparedEngine, names: list[str]) -> ComparedEngineView:
        """Make a view of an engine."""
        return cls(
            description=ENGINES[engine.name],
            fitness=ComparedView.from_compared(engine.fitness),
            scenarios={
                case.name: ComparedScenarioView.from_case(case, names) for case in engine.cases
            },
        )


class CertificateView(View):
    """Results of a design over all worlds; no guarantee for other worlds."""

    job: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    robot: RobotSource = Field(description="Robot that walked.")
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    design: dict[str, float | str] = Field(description="Value of every variable by name.")
    preference: Preference = Field(description="By which utilities and fitness were computed.")
    seed: int = Field(description="Of the worlds.", examples=[1])
    worlds: int = Field(description="Worlds simulated so far [1].", examples=[1000])
    worlds_planned: int = Field(description="Worlds of the whole job [1].", examples=[1000])
    level: float = Field(
        default=LEVEL, description="Of intervals and of the conditional value at risk [1]."
    )
    quantiles: list[float] = Field(
        description="Quantiles of the distributions [1].", examples=[list(QUANTILES)]
    )
    fitness: SpreadView = Field(
        description="Over all scenarios, the geometric mean of utilities (eq. 4.2) [1]."
    )
    fell: ProportionView = Field(description="How often the robot fell in a scenario at least.")
    failed: ProportionView = Field(
        description="How often a walk failed in a scenario at least, in whatever way."
    )
    scenarios: dict[str, CertifiedScenarioView] = Field(
        description="By name of the scenario, in the job's order."
    )
    worst: list[WorldView] = Field(
        description="The worst worlds, first those in which most scenarios failed."
    )
    influences: list[InfluenceView] = Field(
        description="Which perturbations go with the outcome, the strongest first."
    )
    engines: dict[str, ComparedEngineView] = Field(
        default_factory=dict,
        description="Results of other engines in the nominal world, by name; those of the job's"
        " `engines`.",
    )

    @classmethod
    def from_certificate(
        cls, job_id: str, spec: CertificateSpec, found: Certificate
    ) -> CertificateView:
        """Make a view of a certificate.

        Args:
            job_id: identifier of its job.
            spec: of the job.
            found: what its walks come to.
        """
        names = [objective.name for objective in spec.objectives]
        return cls(
            job=job_id,
            robot=spec.robot,
            controller=spec.controller,
            design=dict(spec.design),
            preference=spec.resolved_preference(),
            seed=spec.seed,
            worlds=found.worlds,
            worlds_planned=spec.worlds,
            quantiles=list(QUANTILES),
            fitness=SpreadView.from_spread(found.fitness),
            fell=ProportionView.from_proportion(found.fell),
            failed=ProportionView.from_proportion(found.failed),
            scenarios={
                case.name: CertifiedScenarioView.from_case(
                    case, names, held_out=case.name in spec.held_out_names
                )
                for case in found.cases
            },
            worst=[WorldView.from_world(world, job_id) for world in found.worst],
            influences=[InfluenceView.from_influence(i) for i in found.influences],
            engines={
                engine.name: ComparedEngineView.from_engine(engine, names)
                for engine in found.engines
            },
        )
