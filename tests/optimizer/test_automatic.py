"""`auto`: a name that stands for a method until a job is submitted."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.registry import (
    DEFAULT_METHOD,
    OPTIMIZERS,
    AutoSettings,
    chosen_method,
    create_search,
)
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.calibration.conftest import spec as calibration


def test_it_stands_for_the_default_method() -> None:
    assert JobSpec.model_validate({"optimizer": "auto"}).search == OPTIMIZERS[DEFAULT_METHOD]


@pytest.mark.parametrize(
    ("dimension", "budget", "method"),
    [
        (1, 251, "cma-es"),
        (64, 251, "cma-es"),
        (65, 251, "de"),
        (64, 250, "bayesian"),
        (65, 250, "de"),
    ],
)
def test_it_goes_by_the_numbers_of_variables_and_evaluations(
    dimension: int, budget: int, method: str
) -> None:
    space = Space([Axis(0.0, 1.0)] * dimension)
    assert chosen_method(AutoSettings(particles=7), space, budget, starts=False).name == method
    given, expected = (
        create_search({"name": n, "particles": 7}, space, budget, 1) for n in ("auto", method)
    )
    assert given.ask().tobytes() == expected.ask().tobytes()


def test_it_centres_integers_where_they_are_most_of_the_variables() -> None:
    space = Space([Axis(0.0, 9.0, "integer")] * 2 + [Axis(0.0, 1.0)])
    assert chosen_method(AutoSettings(particles=7), space, 999, starts=False).model_dump() == {
        **OPTIMIZERS["cma-es"].model_dump(),
        "particles": 7,
        "sigma": 0.1,
        "integers": "centred",
    }
    half = Space(space.axes[1:])
    assert chosen_method(AutoSettings(), half, 999, starts=True) == OPTIMIZERS["cma-es"]


def test_a_search_with_a_start_needs_no_model() -> None:
    space, start = Space([Axis(0.0, 1.0)] * 2), np.full((1, 2), 0.5)
    given, expected = (create_search(name, space, 100, 1, start) for name in ("auto", "cma-es"))
    for optimizer in (given, expected):
        optimizer.tell(np.ones(len(optimizer.ask())))
    assert given.ask().tobytes() == expected.ask().tobytes()


def test_a_reference_of_constraints_is_a_start(store: Store) -> None:
    small = {"optimizer": "auto", "iterations": 4}
    constrained = {**small, "constraints": ["*<=published:A"]}
    jobs = [JobService(store).submit(JobSpec.model_validate(d))[0] for d in (small, constrained)]
    assert [job.spec.optimizer.name for job in jobs] == ["bayesian", "cma-es"]


def test_the_size_of_iterations_stays_and_with_it_the_budget() -> None:
    spec = JobSpec.model_validate({"optimizer": {"name": "auto", "particles": 8}})
    assert spec.resolved().optimizer.particles == 8
    assert spec.resolved().budget == spec.budget == 25 * 8


def test_a_spec_that_is_not_resolved_yet_searches_by_the_same_method() -> None:
    spec = JobSpec.model_validate({"optimizer": "auto", "seed": 5})
    expected = spec.resolved().create_search().ask()
    assert spec.create_search().ask().tobytes() == expected.tobytes()


def test_a_job_of_any_kind_is_resolved_to_the_method() -> None:
    identification = {"kind": "identification", "recordings": ["0" * 32]}
    for document in ({}, identification, calibration().model_dump()):
        asked = SPECS.validate_python({**document, "optimizer": "auto", "iterations": 40})
        assert asked.resolved().optimizer == OPTIMIZERS[DEFAULT_METHOD]


def test_a_stored_job_names_the_method(store: Store) -> None:
    job, _ = JobService(store).submit(JobSpec.model_validate({"optimizer": "auto"}))
    assert store.job(job.id).spec.optimizer.name == DEFAULT_METHOD


def test_it_has_no_settings_of_a_method() -> None:
    with pytest.raises(ValidationError, match="no setting of auto; known are particles"):
        JobSpec.model_validate({"optimizer": {"name": "auto", "inertia_end": 0.5}})
