"""Cost of the model's simplifications."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm import CONTROLLERS, SCENARIOS
from gaitswarm.plugins import load_robot
from gaitswarm_research.studies.accuracy import (
    Deviation,
    noise_on_links,
    step_halving,
    tables_against_inference,
)
from research.tests.conftest import Command

ROBOT = load_robot("szabadka2-reconstructed")
PI = {"P": 0.45, "I": 0.1}
PUBLISHED_A = CONTROLLERS["fuzzy-pi"].published["A"]
BRIEF = SCENARIOS[0].model_copy(update={"cycles": 1.0, "cycle_time": 0.25})


@pytest.mark.slow
def test_finer_tables_are_closer_to_the_inference() -> None:
    # Shorter than a cycle, a walk says more of single steps than of tables.
    cycle = SCENARIOS[0].model_copy(update={"cycles": 1.0})
    coarse, _, fine = tables_against_inference(PUBLISHED_A, [cycle], ROBOT)
    assert (coarse.variant, fine.variant) == ("6x6 bit", "10x6 bit")
    assert fine.relative[:5].max() < 0.02
    assert 0.0 < fine.relative[:5].mean() < coarse.relative[:5].mean() < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("name", ["szabadka2-reconstructed", "szabadka2"])
def test_time_steps_are_short_enough(name: str) -> None:
    """In a fast and in a slow walk. Landings, which are faster than a step, have shorter ones."""
    walks = [scenario for scenario in SCENARIOS if scenario.name in ("normal-fast", "loaded-slow")]
    found = step_halving("fuzzy-pi", PUBLISHED_A, walks, load_robot(name))
    assert [(d.variant, d.scenario) for d in found] == [
        (f"{rate} kHz", scenario.name) for scenario in walks for rate in ("2.5", "5", "10", "20")
    ]
    for deviation in found:
        assert deviation.relative[:5].max() < 0.006


@pytest.mark.slow
def test_noise_is_compared_with_the_noiseless_simulation_for_each_link() -> None:
    found = noise_on_links("pi", PI, SCENARIOS[:1], ROBOT)
    assert [d.variant for d in found] == ["link 1", "link 2", "link 3"]
    # Accelerations grow on every link, as in table 2.9, torque on the first; speed hardly changes.
    for deviation in found:
        assert (deviation.ratio[1:3] > 1.5).all()
        assert deviation.ratio[4] == pytest.approx(1.0, abs=0.15)
    torques = [deviation.ratio[0] for deviation in found]
    assert torques[0] > 1.1
    assert torques == sorted(torques, reverse=True)


def test_noise_is_on_angles_by_default() -> None:
    found = noise_on_links("pi", PI, [BRIEF], ROBOT)
    same = noise_on_links("pi", PI, [BRIEF], ROBOT, kind="angle", deviation=0.001)
    torque = noise_on_links("pi", PI, [BRIEF], ROBOT, kind="torque")
    for noisy, again, other in zip(found, same, torque, strict=True):
        assert noisy.ratio.tolist() == again.ratio.tolist() != other.ratio.tolist()
        assert noisy.quality < 1.0


def test_the_quality_is_the_sixth_row_of_table_2_9() -> None:
    ratio = np.array([3.28, 1.54, 2.11, 1.46, 1.0 / 1.05, 1.0])
    assert Deviation("link 1", "any", ratio).quality == pytest.approx(0.07, abs=0.005)


@pytest.mark.slow
def test_ratios_are_printed(research: Command) -> None:
    done = research("study", "noise", "--json", "--kind", "torque", "--deviation", "5")
    assert [row["variant"] for row in done.json] == ["link 1", "link 2", "link 3"]
    assert "2.5 kHz" in research("study", "steps", "--scenario", "1").out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("steps", "--scenario", "moon"), "moon"),
        (("steps", "--controller", "mpc"), "unknown controller 'mpc'"),
        (("tables", "--design", "published:Z"), "no published design 'Z'"),
        (("noise", "--deviation", "5"), "deviation: 5 rad is more than 0.5 rad"),
        (("noise", "--deviation", "-1"), "deviation: "),
    ],
)
def test_invalid_options_are_refused(
    research: Command, arguments: tuple[str, ...], said: str
) -> None:
    refused = research("study", *arguments)
    assert refused.code == 2
    assert said in refused.err
