"""Searches for preferences: candidates are judged by their optima, independently of themselves."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from gaitswarm import (
    PREFERENCES,
    InvalidRequest,
    JobSpec,
    PreferencesSpec,
    job_spec,
    optimize,
    robustness,
    simulate,
)
from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.preferences import preference_of, weights_of
from tests.examples.preferences import DOCUMENT, small

TUNING: dict[str, Any] = DOCUMENT["tuning"]


def reference(spec: PreferencesSpec) -> dict[str, float | str]:
    assert isinstance(spec.tuning.start, tuple)
    return dict(spec.tuning.start[0])


def criteria(**changes: float) -> np.ndarray:
    """The criteria of one optimum, as the results of its case."""
    values = {"sensitivity": 3.0, "failures": 0.1, "risk": 1.5, "unevenness": 1.2} | changes
    return np.array([[list(values.values())]])


def fitness(**changes: float) -> float:
    return float(small().judge(criteria(**changes), np.zeros((1, 1), np.bool_)).fitness[0])


def test_fitness_is_the_product_of_the_factors_of_all_criteria() -> None:
    assert fitness() == pytest.approx(np.exp(0.05 * 3.0) * 1.5 * 1.2 / 0.9)


@pytest.mark.parametrize("criterion", ["sensitivity", "failures", "risk", "unevenness"])
def test_less_is_better_by_each_criterion(criterion: str) -> None:
    value = {"sensitivity": 4.0, "failures": 0.2, "risk": 1.6, "unevenness": 1.3}[criterion]
    assert fitness(**{criterion: value}) > fitness()
    assert fitness(**{criterion: np.nan}) == np.inf


def test_an_optimum_that_fails_in_every_world_has_no_fitness() -> None:
    assert fitness(failures=1.0) == np.inf


def test_weights_by_name_are_a_preference() -> None:
    for name in ("A", "B", "C"):
        assert preference_of(weights_of(PREFERENCES[name])) == PREFERENCES[name]
    assert preference_of(weights_of(PREFERENCES["A"]) | {}) is not None
    assert preference_of(dict.fromkeys(weights_of(PREFERENCES["A"]), 0.0)) is None


def test_the_preferences_of_the_thesis_come_first_and_published_a_is_the_reference() -> None:
    search = {"name": "random", "particles": 3}
    spec = small(tuning={"controller": "fuzzy-pi"}, optimizer=search)
    named = [weights_of(PREFERENCES[name]) for name in ("A", "B", "C")]
    assert spec.create_search().ask().tolist() == [list(weights.values()) for weights in named]
    published = gaitswarm.CONTROLLERS["fuzzy-pi"].published["A"]
    assert reference(spec) == pytest.approx(published)
    assert spec.tuning.budget == 400


@pytest.mark.slow
def test_an_optimum_is_the_best_of_a_tuning_job_and_judged_as_any_design_is(
    tmp_path: Path,
) -> None:
    spec = small()
    (case,) = spec.cases({})
    preference = PREFERENCES["B"]
    names = spec.design_space().names
    weights = np.array([[float(weights_of(preference)[name]) for name in names]])
    outcome = pickle.loads(pickle.dumps(case)).run(weights)  # noqa: S301 - written by the line
    values = dict(zip([c.name for c in spec.columns], outcome.objectives[0], strict=True))

    tuning = spec.tuning.model_copy(update={"preference": preference})
    best = optimize(tuning, db=str(tmp_path / "jobs.db")).best
    assert {name: values[name] for name in best.design} == best.design

    walks: dict[str, Any] = {"controller": "pi", "scenarios": TUNING["scenarios"]}
    index = robustness(best.design, **walks, samples=12, seed=spec.seed).index
    assert index is not None
    assert values["sensitivity"] == pytest.approx(index.value)

    designs = [best.design, reference(spec)]
    own, before = simulate(designs, **walks).objectives[:, :, :5]
    changes = np.log(own / before)
    assert values["relative_energy"] == pytest.approx(np.exp(changes[:, 3].mean()))
    assert values["unevenness"] == pytest.approx(np.exp(np.sqrt(changes.var(axis=0).mean())))
    assert values["slowest"] == pytest.approx(1.0 / own[:, 4].max())

    neutral = {"bias": [0.0] * 5, "exponent": [0.2] * 5}
    judged = JobSpec.model_validate(tuning.model_dump() | {"preference": neutral})
    plan = CertificateSpec.of_job(judged, best.design, worlds=3, seed=1 + (0x5EED << 40))
    with gaitswarm.open(tmp_path / "jobs.db") as jobs:
        certificate = jobs.certificate(jobs.run(jobs.submit(plan).id).id)
    assert values["failures"] == certificate.failed.share
    assert certificate.fitness.nominal is not None
    assert certificate.fitness.cvar is not None
    assert values["risk"] == pytest.approx(certificate.fitness.cvar / certificate.fitness.nominal)


def test_a_search_ends_soon_once_its_optimum_is_not_needed() -> None:
    (case,) = small().cases({})
    with pytest.raises(InterruptedError):
        case.run_until(np.ones((1, 10)), lambda: True)  # type: ignore[attr-defined]


@pytest.mark.slow
def test_without_a_feasible_design_there_is_no_optimum(tmp_path: Path) -> None:
    with gaitswarm.open(tmp_path / "jobs.db") as jobs:
        fast = TUNING | {"constraints": [{"quantity": "speed", "min": 9.0}]}
        job = jobs.run(jobs.submit(small(tuning=fast, iterations=1)).id)
        assert job.state == "succeeded"
        assert job.best is None
        with pytest.raises(Conflict, match="no preference with a feasible optimum"):
            jobs.preferences(job.id)


@pytest.mark.parametrize(
    ("changes", "field", "message"),
    [
        ({"robot": "szabadka2"}, "robot", "differs from tuning.robot"),
        ({"precision": "single"}, "precision", "tuning.precision"),
        ({"samples": 8}, "samples", "require at least 12"),
        ({"tuning": TUNING | {"optimizer": "hype"}}, "tuning", "hype finds no optimum"),
        ({"tuning": TUNING | {"controller": "joint-pd"}}, "tuning.controller", "torque"),
        ({"fixed": {"bias": 1.0}}, "fixed", "unknown variable 'bias'"),
        ({"variables": ["exponent_torque"]}, "variables", "search or fix"),
    ],
)
def test_invalid_fields_are_named(changes: dict[str, Any], field: str, message: str) -> None:
    with pytest.raises(InvalidRequest, match=message) as caught:
        job_spec(DOCUMENT | changes)
    assert caught.value.field == field
