"""Requests for real walks, short ones."""

from __future__ import annotations

import numpy as np

from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.case import Walk
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

SCENARIOS = (
    Scenario.model_validate(SHORT_WALK),
    Scenario.model_validate(UPHILL_WALK),
)


def never() -> bool:
    """Whether to stop."""
    return False


def request(
    count: int, *, job_id: str = "job", scenarios: tuple[Scenario, ...] = SCENARIOS, seed: int = 1
) -> EvaluationRequest:
    gains = np.random.default_rng(seed).uniform((0.1, 0.0), (0.5, 0.5), (count, 2))
    cases = tuple(Walk("szabadka2", "pi", scenario, ("P", "I")) for scenario in scenarios)
    return EvaluationRequest(job_id, cases, gains, provenance_of("szabadka2"))


def walked_at_once(wanted: EvaluationRequest) -> tuple[Outcome, ...]:
    """The same walks without any evaluator: one batch per scenario."""
    walks = [case for case in wanted.cases if isinstance(case, Walk)]
    assert len(walks) == len(wanted.cases)
    return tuple(
        simulate(
            case.scenario, case.controller, case.variables, wanted.designs, robot=case.robot
        ).outcome
        for case in walks
    )


def bits(outcomes: tuple[Outcome, ...]) -> list[tuple[bytes, bytes]]:
    return [(outcome.objectives.tobytes(), outcome.statuses.tobytes()) for outcome in outcomes]
