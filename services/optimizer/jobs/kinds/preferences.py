"""Searches for preferences whose optimum is robust and even (thesis 4.5, 4.6)"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, field_validator, model_validator

from gaitswarm.services.optimizer.errors import within
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.kinds.certificate import (
    CertificateSpec,
    certificate_scenarios,
    conditional_value_at_risk,
    world_positions,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec, nearest_design, reference_design
from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    WEIGHED,
    Judgement,
    Preference,
    PreferenceName,
    by_design,
    exponential,
)
from gaitswarm.services.optimizer.jobs.sensitivity import local_sample, sensitivity_index
from gaitswarm.services.optimizer.jobs.spec import OptimizerChoice, Spec
from gaitswarm.services.optimizer.search.bayesian import BayesianSettings
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case import Case, run_together
from gaitswarm.sim.identification import Recordings
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.outcome import Objective, Outcome, Status
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.variables import Variable

VARIABLES: Final = tuple(
    Variable(name=f"{part}_{f.name}", low=0.0, high=1.0, unit=unit, description=text)
    for part, text in (("exponent", "Exponent e of a preference."), ("bias", "Bias b of it."))
    for f in WEIGHED
    for unit in ("1" if part == "exponent" else f.unit,)
)
"""Weights of a preference; the bounds include those of table 4.5."""

NAMED: Final[tuple[PreferenceName, ...]] = ("A", "B", "C")
"""Preferences of table 4.5, which are judged first."""

RADIUS: Final = 0.05
"""Change of the design's variables in the criterion, as a share of their bounds."""

_SAMPLE_RADIUS: Final = 0.02
"""Of the sample for the robustness index, as for other designs."""

_NEUTRAL: Final = Preference(bias=(0.0,) * 5, exponent=(0.2,) * 5)
"""Geometric mean of f1 to f5, by which all optima are judged in worlds."""

_HELD_OUT: Final = 0x5EED << 40
"""Added to the seed for held-out worlds, so that no tuning uses them."""

CRITERIA: Final = (
    Objective("sensitivity", "1", "robustness index of the optimum over its own variables"),
    Objective("failures", "1", "share of held-out worlds in which a scenario failed"),
    Objective(
        "risk",
        "1",
        "mean of f1 to f5 in the worst 5 % of held-out worlds, relative to the nominal world",
    ),
    Objective("unevenness", "1", "deviation over the scenarios of the changes from the reference"),
)
"""What a preference's optimum is judged by; none depends on the preference."""

FIGURES: Final = (*WEIGHED, Objective("slowest", "m/s", "speed in the slowest scenario"))
"""Geometric means of f1 to f5 over the scenarios, and the least speed."""

_RELATIVE: Final = tuple(
    Objective(f"relative_{f.name}", "1", f"{f.name} relative to that of the reference")
    for f in FIGURES
)

_OPTIMUM: Final = {"optimizer": {"name": "cma-es", "particles": 20}, "iterations": 20}
"""Search for an optimum, unless given."""


def preference_of(design: Mapping[str, float | str]) -> Preference | None:
    """Return the preference with weights by name; None if all exponents are zero."""
    bias, exponent = (
        tuple(float(design[f"{part}_{f.name}"]) for f in WEIGHED) for part in ("bias", "exponent")
    )
    return Preference(bias=bias, exponent=exponent) if any(exponent) else None


def weights_of(preference: Preference) -> dict[str, float | str]:
    """Return the weights of a preference of five objectives by name."""
    return dict(
        zip((v.name for v in VARIABLES), (*preference.exponent, *preference.bias), strict=True)
    )


def search_document(job_id: str, spec: JobSpec) -> dict[str, Any]:
    """Describe the search for preferences of a tuning job, whose best design is the reference."""
    tuning = spec.model_dump(exclude={"optimizer", "iterations", "name"})
    name = f"preferences of {spec.name or job_id}"[:200]
    return {"kind": "preferences", "name": name, "tuning": tuning | {"start": {"jobs": [job_id]}}}


class PreferencesSpec(Spec):
    """A search for preferences: each is judged by the design that is optimal under it.

    Fitness is the factor by which objectives may get worse: by changes of the design's variables,
    in the worst worlds, and between scenarios.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"kind": "preferences", "tuning": {"controller": "fuzzy-pi"}, "seed": 1}]
        },
    )

    kind: Literal["preferences"] = Field(description="Find preferences with robust optima.")
    tuning: JobSpec = Field(
        default_factory=lambda: JobSpec.model_validate(_OPTIMUM),
        description="The job that is tuned by each candidate preference; its own is not used. The"
        " first design of its `start` is the reference, by default the published one, or the"
        " middle of the bounds. Its search has 20 iterations of 20 particles of cma-es by default.",
    )
    samples: int = Field(
        default=64,
        ge=8,
        le=4096,
        description="Designs around an optimum, for its robustness index.",
    )
    worlds: int = Field(
        default=99, ge=1, le=10_000, description="Held-out worlds in which an optimum is judged."
    )
    optimizer: OptimizerChoice = Field(
        default=BayesianSettings(particles=8, sample=13, batch=4),
        description="Search for the preferences, which are the designs of this job.",
    )
    iterations: int = Field(
        default=4,
        ge=1,
        le=1_000_000,
        description="Budget: this many times the optimizer's `particles` preferences.",
    )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, document: Any) -> Any:
        """Take the robot from the tuning, and complete the search for an optimum."""
        if not isinstance(document, Mapping):
            return document
        tuning = document.get("tuning", {})
        given: dict[str, Any] = {}
        if isinstance(tuning, JobSpec):
            given["robot"] = tuning.robot
        elif isinstance(tuning, Mapping):
            given |= {"robot": tuning["robot"]} if "robot" in tuning else {}
            tuning = {**_OPTIMUM, **tuning}
        return {**given, **document, "tuning": tuning}

    @field_validator("tuning")
    @classmethod
    def _with_reference(cls, tuning: JobSpec) -> JobSpec:
        if tuning.case is not None:
            raise ValueError("case: worlds need gaitswarm's simulator; omit it")
        if METHODS[tuning.search.name].multi_objective:
            raise ValueError(f"optimizer: {tuning.search.name} finds no optimum; choose another")
        reference = reference_design(tuning)
        if tuning.start or reference is None:
            return tuning
        space = tuning.design_space()
        start = nearest_design(tuning, reference[2]) or space.shown(space.middle)
        return tuning.model_copy(update={"start": (start,)})

    @model_validator(mode="after")
    def _can_be_run(self) -> Self:
        if self.robot != self.tuning.robot:
            raise ValueError("robot: differs from tuning.robot; omit it")
        if self.precision != "double":
            raise ValueError("precision: optima are judged in double; set tuning.precision")
        self.design_space()
        return self

    def design_space(self) -> DesignSpace:
        """Return the weights of a preference."""
        return DesignSpace.build(
            required=VARIABLES, optional=(), chosen=self.variables, fixed=self.fixed
        )

    def start_positions(self) -> Floats:
        """Return the start, by default A, B and C if the bounds include them."""
        if self.start:
            return super().start_positions()
        try:
            named = [weights_of(PREFERENCES[name]) for name in NAMED]
            return self.design_space().positions(named)[: self.budget]
        except ValueError:
            return np.empty((0, 0))

    def check_can_be_simulated(self) -> None:
        """Check the search for an optimum, and the sample around it."""
        super().check_can_be_simulated()
        with within("tuning"):
            self.tuning.check_can_be_simulated()
        space = self.tuning.design_space()
        lowest = next(space.corners())
        local_sample(
            lowest, space.variables, radius=_SAMPLE_RADIUS, samples=self.samples, seed=self.seed
        )

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """Criteria of a preference's optimum."""
        return CRITERIA

    @property
    def measurements(self) -> tuple[Objective, ...]:
        """Figures of the optimum, the same relative to the reference, and the optimum."""
        columns = self.tuning.design_space().columns
        optimum = (Objective(v.name, v.unit, f"{v.name} of the optimum") for v in columns)
        return (*FIGURES, *_RELATIVE, *optimum)

    @property
    def case_names(self) -> tuple[str, ...]:
        return ("optimum",)

    @property
    def further_libraries(self) -> tuple[str, ...]:
        """Those of the search for an optimum."""
        return (*self.tuning.further_libraries, *METHODS[self.tuning.search.name].libraries)

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        return (
            OptimumCase(
                self.tuning,
                self.design_space().names,
                self.samples,
                self.worlds,
                self.seed,
                self.columns,
            ),
        )

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge optima by the factor by which their objectives may get worse."""
        logarithms = np.array([_log_factor(*row[:4]) for row in objectives[:, 0].tolist()])
        logarithms[failed[:, 0]] = math.inf
        fitness = np.array([exponential(value) for value in logarithms.tolist()])
        return Judgement(fitness, logarithms[:, np.newaxis])

    def resolved(self) -> Self:
        """Return the job with the presets of the tuning written out, too."""
        return super().resolved().model_copy(update={"tuning": self.tuning.resolved()})


def _log_factor(sensitivity: float, failures: float, risk: float, unevenness: float) -> float:
    if not math.isfinite(sensitivity + failures + risk + unevenness) or failures >= 1.0:
        return math.inf
    return RADIUS * sensitivity + math.log(risk * unevenness) - math.log1p(-failures)


@dataclass(frozen=True, slots=True)
class OptimumCase:
    """The search for the optimum of a preference, and its judgement."""

    tuning: JobSpec
    weights: tuple[str, ...]  # columns of the designs
    samples: int
    worlds: int
    seed: int
    objectives: tuple[Objective, ...]

    @property
    def name(self) -> str:
        return "optimum"

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return (self.tuning.robot,)

    @property
    def precision(self) -> Precision:
        return "double"

    @property
    def duration(self) -> float:
        """Simulated time of search, sample and worlds [s]."""
        scenarios = self.tuning.resolved_scenarios()
        once = sum(scenario.duration for scenario in scenarios)
        in_worlds = sum(s.duration for s in certificate_scenarios(scenarios, self.tuning.robot))
        search = self.tuning.budget * sum(case.duration for case in self.tuning.cases({}))
        return search + (2 + self.samples) * once + (1 + self.worlds) * in_worlds

    def run(self, designs: Floats) -> Outcome:
        return self.run_until(designs, lambda: False)

    def run_until(self, designs: Floats, should_stop: Callable[[], bool]) -> Outcome:
        """Find and judge the optima of preferences (n, 10); NaN where no design is feasible."""
        objectives = np.full((len(designs), len(self.objectives)), np.nan)
        for row, weights in zip(objectives, designs.tolist(), strict=True):
            preference = preference_of(dict(zip(self.weights, weights, strict=True)))
            optimum = None if preference is None else self._optimum(preference, should_stop)
            if optimum is not None:
                row[:] = self._judged(optimum, should_stop)
        return Outcome(objectives, np.full(len(designs), Status.OK, dtype=np.uint8))

    def _optimum(self, preference: Preference, should_stop: Callable[[], bool]) -> Floats | None:
        """Return the best feasible design (v,) of the tuning by a preference."""
        spec = self.tuning.model_copy(update={"preference": preference})
        search, space, cases = spec.create_search(), spec.design_space(), spec.cases({})
        least, best = math.inf, None
        while (left := spec.budget - search.evaluations) > 0:
            designs = space.designs(search.ask(left))
            results = _simulated(cases, space.simulated(designs), should_stop)
            fitness = spec.judge(*results).fitness
            search.tell(spec.search_feedback(*results, fitness))
            if fitness.min() < least:
                least, best = float(fitness.min()), designs[fitness.argmin()]
        return best

    def _judged(self, optimum: Floats, should_stop: Callable[[], bool]) -> Floats:
        """Return the columns of an optimum: criteria, figures, and the optimum itself."""
        spec = self.tuning.model_copy(
            update={"preference": _NEUTRAL, "worlds": None, "precision": "double"}
        )
        space = spec.design_space()
        reference = space.designs(spec.start_positions()[:1])
        rows = space.simulated(np.vstack([optimum, reference]))
        sample = local_sample(
            dict(zip(space.names, rows[0].tolist(), strict=True)),
            space.variables,
            radius=_SAMPLE_RADIUS,
            samples=self.samples,
            seed=self.seed,
        )
        cases = spec.cases({})
        results, failed = _simulated(cases, np.vstack([sample.designs, rows[1:]]), should_stop)
        values = results[:, :, : len(WEIGHED)]
        index = sensitivity_index(sample, values[:-1], failed[:-1])
        of_optimum, of_reference = (
            np.append(np.exp(np.log(row).mean(axis=0)), 1.0 / row[:, -1].max())
            for row in (values[0], values[-1])
        )
        changes = np.log(values[0] / values[-1])
        unevenness = math.exp(math.sqrt(float(changes.var(axis=0).mean())))
        design = space.shown(optimum.tolist())
        failures, risk = self._in_worlds(spec, design, should_stop)
        criteria = [index, failures, risk, unevenness]
        return np.concatenate([criteria, of_optimum, of_optimum / of_reference, optimum])

    def _in_worlds(
        self, spec: JobSpec, design: Mapping[str, float | str], should_stop: Callable[[], bool]
    ) -> tuple[float, float]:
        """Return the share of failures, and the conditional value at risk by the nominal world."""
        seed = (self.seed + _HELD_OUT) % 2**63
        certificate = CertificateSpec.of_job(spec, design, worlds=self.worlds, seed=seed)
        space = certificate.world_space()
        positions = world_positions(space, (), seed)(0, 1 + self.worlds)
        worlds = space.simulated(space.designs(positions))
        results, failed = _simulated(certificate.cases({}), worlds, should_stop)
        nominal, *drawn = certificate.judge(results, failed).fitness.tolist()
        successes = [value for value in drawn if math.isfinite(value)]
        if not successes:
            return 1.0, math.nan
        # A failure counts as the worst success.
        values = np.minimum(np.array(drawn), max(successes))
        return 1.0 - len(successes) / len(drawn), conditional_value_at_risk(values) / nominal


def _simulated(
    cases: Sequence[Case], designs: Floats, should_stop: Callable[[], bool]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return (n, K, m) results and (n, K) failures."""
    if should_stop():
        raise InterruptedError("the optimum is not needed any more")
    return by_design(run_together(cases, [designs] * len(cases)))
