"""Certificates as they are asked for: worlds, ranges, scenarios, and what is refused."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.kinds.certificate import (
    CASES,
    CertificateSpec,
    certificate_scenarios,
)
from gaitswarm.sim.scenario import HELD_OUT, SCENARIOS
from gaitswarm.sim.worlds.perturbations import DRAWN, sample_worlds
from tests.certificate.examples import DOCUMENT, PI, small


def asked(spec: CertificateSpec) -> list[np.ndarray]:
    """Every ask of the whole job."""
    search, found = spec.create_search(), []
    while search.evaluations < spec.budget:
        found.append(search.ask(spec.budget - search.evaluations))
        search.tell(np.zeros(len(found[-1])))
    return found


def test_the_worlds_are_the_nominal_one_and_those_that_the_simulator_draws() -> None:
    spec = small(seed=5)
    worlds = np.concatenate(asked(spec))
    assert worlds[0].tolist() == [1.0, 1.0, 0.0]
    drawn = sample_worlds(10, 5, spec.design_space().variables)
    assert worlds[1:].tobytes() == drawn.tobytes()
    assert list(spec.world(7).values()) == drawn[7].tolist()


def test_batches_and_further_worlds_change_no_world() -> None:
    few, many = small(worlds=3), small(worlds=40, optimizer={"name": "random", "particles": 7})
    assert [len(batch) for batch in asked(few)] == [4]
    assert [len(batch) for batch in asked(many)] == [7, 7, 7, 7, 7, 6]
    assert np.concatenate(asked(many))[:4].tobytes() == np.concatenate(asked(few)).tobytes()


def test_a_world_does_not_depend_on_what_else_is_drawn() -> None:
    alone = small(variables=["efficiency_factor"])
    assert alone.world(3)["efficiency_factor"] == small().world(3)["efficiency_factor"]


def test_iterations_follow_from_worlds_and_worlds_from_iterations() -> None:
    assert (small(worlds=11).iterations, small(worlds=12).iterations) == (3, 4)
    document = {key: value for key, value in DOCUMENT.items() if key != "worlds"}
    by_iterations = SPECS.validate_python({**document, "iterations": 5})
    assert isinstance(by_iterations, CertificateSpec)
    assert (by_iterations.worlds, by_iterations.budget) == (19, 20)
    default = SPECS.validate_python({"kind": "certificate", "controller": "pi", "design": PI})
    assert isinstance(default, CertificateSpec)
    assert (default.worlds, default.iterations) == (1000, 21)
    assert default.with_budget(40).worlds == 40 * 50 - 1


@pytest.mark.parametrize("given", [{"worlds": 11.0}, {"worlds": "11"}, {"iterations": "3"}])
def test_counts_may_be_floats_or_strings(given: dict[str, Any]) -> None:
    document = {key: value for key, value in DOCUMENT.items() if key != "worlds"}
    spec = SPECS.validate_python(document | given)
    assert isinstance(spec, CertificateSpec)
    assert (spec.worlds, spec.iterations) == (11, 3)
    # What is stored of it can be read again.
    assert SPECS.validate_json(spec.resolved().model_dump_json()) == spec.resolved()


def test_a_single_iteration_of_the_nominal_world_becomes_the_least_certificate() -> None:
    document = {key: value for key, value in DOCUMENT.items() if key != "worlds"}
    spec = SPECS.validate_python(
        document | {"iterations": 1, "optimizer": {"name": "random", "particles": 1}}
    )
    assert isinstance(spec, CertificateSpec)
    assert (spec.worlds, spec.iterations) == (1, 2)


def test_the_nominal_world_is_clipped_to_the_ranges() -> None:
    spec = small(variables=[{"name": "friction_factor", "low": 0.2, "high": 0.4}])
    assert asked(spec)[0][0].tolist() == [0.4]


def test_a_perturbation_that_is_held_is_the_same_in_every_world() -> None:
    spec = small(variables=None, fixed={"slope_added": 2.0})
    assert {spec.world(k)["slope_added"] for k in range(5)} == {2.0}
    assert len(spec.design_space().variables) == len(DRAWN) - 1


def test_the_default_is_the_tuned_and_held_out_scenarios() -> None:
    names = [scenario.name for scenario in certificate_scenarios()]
    assert names == [*(s.name for s in SCENARIOS), "turn-left-fast", "downhill-fast"]
    assert len(certificate_scenarios(SCENARIOS[:1])) == CASES
    seven = certificate_scenarios(tuple(s for s in SCENARIOS) + HELD_OUT[:1])
    assert [s.name for s in seven[7:]] == ["downhill-fast", "half-loaded-fast"]
    default = SPECS.validate_python({"kind": "certificate", "controller": "pi", "design": PI})
    assert isinstance(default, CertificateSpec)
    assert list(default.case_names) == names
    assert default.held_out_names == ("turn-left-fast", "downhill-fast")


def test_a_stored_certificate_reads_back_as_it_was() -> None:
    spec = small().resolved()
    assert SPECS.validate_json(spec.model_dump_json()) == spec
    assert not isinstance(spec.preference, str)
    assert spec.resolved() == spec


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"design": {"P": 1.0}}, "design: I missing; pi needs it"),
        ({"design": PI | {"hat": 1.0}}, "design: unknown variable 'hat'; known are P, I"),
        ({"variables": ["gravity"]}, "variables: unknown variable 'gravity'; known are friction"),
        ({"fixed": {"friction_factor": 1.0}}, "fixed: 'friction_factor' is also among"),
        ({"optimizer": "pso"}, "optimizer: must be random"),
        ({"start": [{"friction_factor": 1.0}]}, "start: worlds are sampled; omit it"),
        ({"worlds": 10, "iterations": 7}, "iterations: determined by worlds; 10 in batches of 4"),
        ({"worlds": 0}, "greater than or equal to 1"),
        ({"scenarios": ["1", "normal-fast"]}, "scenarios: 'normal-fast' is named twice"),
    ],
)
def test_invalid_values_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=re.escape(words)):
        small(**change)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"variables": [{"name": "efficiency_factor", "low": -1.0, "high": 1.0}]}, "variables"),
        ({"scenarios": [DOCUMENT["scenarios"][0] | {"radius": 0.9}]}, "scenarios.0"),
        ({"controller": "fuzzy-pi", "design": dict.fromkeys(
            ("I", "FI1R", "FI2R", "FOR", "FOMF", "FW1", "FW23", "FW4", "FW56"), -1.0
        )}, "design"),
    ],
)  # fmt: skip
def test_what_cannot_be_simulated_names_its_field(change: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidRequest) as raised:
        small(**change).check_can_be_simulated()
    assert raised.value.field == field
