"""The robustness index of functions whose Jacobian is known."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.robustness import Sensitivities, sensitivities
from gaitswarm.services.optimizer.jobs.sensitivity import LocalSample, local_sample
from gaitswarm.sim.variables import Variable

X = Variable(name="x", low=0.0, high=10.0)
Y = Variable(name="y", low=-1.0, high=1.0)
SHAPE = Variable(name="shape", low=1, high=3, kind="integer")
LENGTH = Variable(name="length", low=0, high=200, kind="integer")
KIND = Variable(name="kind", kind="categorical", choices=("a", "b"))

SLOPES = np.array([[0.5, -0.2], [0.0, 1.0], [0.3, 0.0], [0.0, 0.0], [-0.4, 0.1]])
"""Relative changes of five objectives over the bounds of x and y."""


def sample_of(samples: int = 128, seed: int = 1, radius: float = 0.05) -> LocalSample:
    return local_sample({"x": 5.0, "y": 0.0}, (X, Y), radius=radius, samples=samples, seed=seed)


def walked(sample: LocalSample, slopes: np.ndarray = SLOPES, noise: float = 0.0) -> np.ndarray:
    """(1 + n, 6) objectives that answer as the slopes say, in units that do not matter."""
    generator = np.random.default_rng(abs(int(1e9 * sample.shift[1, 0])))
    logarithms = sample.shift @ slopes.T
    logarithms = logarithms + noise * generator.standard_normal(logarithms.shape)
    units = np.array([8.0, 1.5, 16.0, 45.0, 6.0])
    height_loss = np.full((len(logarithms), 1), -0.003)
    return np.hstack([units * np.exp(logarithms), height_loss])


def robustness(sample: LocalSample, objectives: np.ndarray, failed: np.ndarray) -> Sensitivities:
    """Scenarios are named by number."""
    names = [str(k) for k in range(objectives.shape[1])]
    return sensitivities(sample, objectives, failed, names)


def values(named: Mapping[str, float | None]) -> np.ndarray:
    return np.array(list(named.values()), dtype=np.float64)


def in_one_scenario(objectives: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return objectives[:, None], np.zeros((len(objectives), 1), dtype=np.bool_)


def test_the_jacobian_of_an_exponential_is_found_exactly() -> None:
    sample = sample_of()
    found = robustness(sample, *in_one_scenario(walked(sample)))
    (part,) = found.scenarios.values()
    jacobian = [values(row) for row in part.jacobian.values()]
    np.testing.assert_allclose(jacobian, SLOPES, atol=1e-9)
    assert part.index is not None and found.index is not None
    assert part.index.value == pytest.approx(np.linalg.norm(SLOPES))
    assert found.index.value == pytest.approx(part.index.value)
    np.testing.assert_allclose(values(part.by_objective), np.linalg.norm(SLOPES, axis=1), atol=1e-9)
    np.testing.assert_allclose(values(part.by_variable), np.linalg.norm(SLOPES, axis=0), atol=1e-9)
    assert (part.walked, part.failed) == (129, 0)


def test_units_of_objectives_and_variables_do_not_matter() -> None:
    wide = Variable(name="x", low=0.0, high=10_000.0)
    sample = local_sample({"x": 5000.0, "y": 0.0}, (wide, Y), radius=0.05, samples=128, seed=1)
    objectives = walked(sample) * 1000.0
    found = robustness(sample, *in_one_scenario(objectives))
    assert found.index is not None
    assert found.index.value == pytest.approx(np.linalg.norm(SLOPES))


@pytest.mark.thorough("test_noise_alone_is_no_sensitivity")
def test_the_interval_covers_the_index_of_a_noisy_function() -> None:
    true = float(np.linalg.norm(SLOPES))
    covered = []
    for seed in range(100):
        sample = sample_of(samples=64, seed=seed)
        found = robustness(sample, *in_one_scenario(walked(sample, noise=0.01)))
        assert found.index is not None
        covered.append(found.index.low <= true <= found.index.high)
    assert 0.88 <= np.mean(covered) <= 1.0


def test_noise_alone_is_no_sensitivity() -> None:
    flat = np.zeros((5, 2))
    sample = sample_of(samples=256)
    found = robustness(sample, *in_one_scenario(walked(sample, flat, noise=0.02)))
    assert found.index is not None
    assert found.index.low == 0.0
    # Without what noise adds taken off it would be some 0.13.
    assert found.index.value < 0.1


def test_over_several_scenarios_the_index_is_their_root_mean_square() -> None:
    sample = sample_of()
    parts = [walked(sample), walked(sample, 2.0 * SLOPES)]
    objectives = np.stack(parts, axis=1)
    found = robustness(sample, objectives, np.zeros(objectives.shape[:2], dtype=np.bool_))
    assert found.index is not None
    assert found.index.value == pytest.approx(np.linalg.norm(SLOPES) * math.sqrt(2.5))
    np.testing.assert_allclose(
        values(found.by_variable), np.linalg.norm(SLOPES, axis=0) * math.sqrt(2.5), atol=1e-9
    )


def test_walks_that_fail_are_left_out_and_counted() -> None:
    sample = sample_of()
    objectives, failed = in_one_scenario(walked(sample))
    objectives[3:9] = np.nan
    failed[3:9] = True
    found = robustness(sample, objectives, failed)
    (part,) = found.scenarios.values()
    assert (part.walked, part.failed) == (123, 6)
    assert part.index is not None
    assert part.index.value == pytest.approx(np.linalg.norm(SLOPES))


def test_where_too_few_walk_there_is_no_index() -> None:
    sample = sample_of()
    objectives = np.stack([walked(sample), walked(sample)], axis=1)
    failed = np.zeros(objectives.shape[:2], dtype=np.bool_)
    failed[11:, 1] = True
    found = robustness(sample, objectives, failed)
    assert found.index is None
    assert found.scenarios["0"].index is not None
    assert found.scenarios["1"].index is None
    assert set(found.scenarios["1"].jacobian["torque"].values()) == {None}


def test_the_same_sample_gives_the_same_numbers() -> None:
    first, second = sample_of(), sample_of()
    np.testing.assert_array_equal(first.designs, second.designs)
    found = [robustness(s, *in_one_scenario(walked(s, noise=0.01))) for s in (first, second)]
    assert found[0].index == found[1].index
    assert not np.array_equal(first.designs, sample_of(seed=2).designs)


def test_more_samples_begin_with_those_of_fewer() -> None:
    np.testing.assert_array_equal(sample_of(64).designs, sample_of(128).designs[:65])


def test_the_design_itself_comes_first_and_all_are_within_the_radius() -> None:
    sample = sample_of(512)
    assert sample.designs[0].tolist() == [5.0, 0.0]
    assert sample.shift[0].tolist() == [0.0, 0.0]
    assert 0.045 < np.abs(sample.shift).max() <= 0.05
    np.testing.assert_allclose(sample.designs[:, 0], 5.0 + 10.0 * sample.shift[:, 0])


def test_near_a_bound_the_sample_is_on_one_side() -> None:
    sample = local_sample({"x": 0.1, "y": 1.0}, (X, Y), radius=0.05, samples=512, seed=1)
    x, y = sample.designs.T
    assert (x.min() >= 0.0) and (x.max() <= 0.6) and (x.min() < 0.02) and (x.max() > 0.5)
    assert y.max() == 1.0 and y.min() >= 0.9
    found = robustness(sample, *in_one_scenario(walked(sample)))
    assert found.index is not None
    assert found.index.value == pytest.approx(np.linalg.norm(SLOPES))


def test_a_design_outside_its_bounds_is_sampled_towards_them() -> None:
    sample = local_sample({"x": 12.0, "y": 0.0}, (X, Y), radius=0.05, samples=64, seed=1)
    assert sample.designs[:, 0].max() == 12.0
    assert sample.designs[:, 0].min() >= 11.5


def test_integers_vary_in_whole_steps_if_the_radius_reaches_them_and_choices_never() -> None:
    design = {"x": 5.0, "shape": 2.0, "length": 100.0, "kind": 1.0}
    sample = local_sample(design, (X, SHAPE, LENGTH, KIND), radius=0.05, samples=256, seed=1)
    assert [variable.name for variable in sample.varied] == ["x", "length"]
    assert sample.held == ("shape", "kind")
    columns = dict(zip(sample.names, sample.designs.T, strict=True))
    assert set(columns["shape"]) == {2.0} and set(columns["kind"]) == {1.0}
    assert set(columns["length"]) == set(range(90, 111))


def test_a_sample_without_variables_or_with_too_few_designs_is_refused() -> None:
    with pytest.raises(ValueError, match="variables: none"):
        local_sample({"kind": 1.0}, (KIND,), radius=0.05, samples=64, seed=1)
    with pytest.raises(ValueError, match="samples: 2 variables require at least 12"):
        local_sample({"x": 5.0, "y": 0.0}, (X, Y), radius=0.05, samples=11, seed=1)
