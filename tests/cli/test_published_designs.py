"""Published designs by name, with their gaits."""

from __future__ import annotations

import pytest

from gaitswarm.cli.inputs import read_design
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec, adapted_to_job, published_study
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.sim.catalogue import GAIT_CATALOGUE
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from tests.cli.conftest import Gaitswarm, WriteJson

GAIT = {"cycle_time", "stride", "height", "duty_factor", "fir_ms"}

CHAPTER_3: list[tuple[ControllerName, str]] = [
    ("fuzzy-pi-3", "fuzzy-pso-ps"),
    ("fuzzy-pi-3", "fuzzy-pso"),
    ("pi", "pi-pso-ps"),
    ("pi", "pi-pso"),
]

CHAPTER_4 = ["A", "B", "C"]


def job(controller: ControllerName, **settings: object) -> JobSpec:
    small = {"optimizer": PsoSettings(particles=2), "iterations": 1, "seed": 1}
    return JobSpec.model_validate({"controller": controller, **small, **settings})


@pytest.mark.parametrize(("controller", "name"), CHAPTER_3)
def test_chapter_3s_optima_have_all_variables_and_the_gait_tuned_with_them(
    controller: ControllerName, name: str
) -> None:
    design = read_design(f"published:{name}", controller)
    assert design.keys() == {v.name for v in CONTROLLERS[controller].variables} | GAIT


@pytest.mark.parametrize("name", CHAPTER_4)
def test_chapter_4s_optima_lie_inside_the_bounds_of_table_4_4(name: str) -> None:
    design = read_design(f"published:{name}", "fuzzy-pi")
    variables = CONTROLLERS["fuzzy-pi"].variables
    assert list(design) == [variable.name for variable in variables]
    for variable in variables:
        assert variable.low <= design[variable.name] <= variable.high


@pytest.mark.slow
@pytest.mark.parametrize(
    ("controller", "name"), [*CHAPTER_3, *(("fuzzy-pi", name) for name in CHAPTER_4)]
)
def test_every_published_design_walks(
    gaitswarm: Gaitswarm, controller: ControllerName, name: str
) -> None:
    """Also the one whose cycle of 1.808 s lies beyond the bound of 1.7 s in table 3.2."""
    shown = gaitswarm(
        "simulate", "--controller", controller, "--design", f"published:{name}",
        "--scenario", "normal-fast", "--json",
    )  # fmt: skip
    assert shown.code == 0, shown.err
    assert shown.json["scenarios"]["normal-fast"]["status"] == "ok"


@pytest.mark.slow
def test_a_published_design_walks_in_its_gait_or_a_requested_one(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    walk = ("simulate", "--controller", "pi", "--scenario", "normal-fast", "--json")
    own = gaitswarm(*walk, "--design", "published:pi-pso-ps")
    assert own.json["design"]["cycle_time"] == 1.808
    shorter = write_json({"cycle_time": 1.5})
    other = gaitswarm(*walk, "--design", "published:pi-pso-ps", "--trajectory", shorter)
    assert other.json["design"]["cycle_time"] == 1.5
    assert other.json["design"]["stride"] == 0.168
    assert own.json["fitness"] != other.json["fitness"]


def test_a_published_design_is_compared_in_the_gait_of_the_jobs_designs() -> None:
    published = CONTROLLERS["pi"].published["pi-pso-ps"]
    assert adapted_to_job(published, job("pi")) == {"P": 0.454, "I": 0.147}
    held = job("pi", fixed={"stride": 0.1, "integrator_unit": 1.0})
    assert adapted_to_job(published, held) == {
        "P": 0.454,
        "I": 0.147,
        "stride": 0.1,
        "integrator_unit": 1.0,
    }
    gains = job("pi", variables=("P", "I", "cycle_time", "stride"))
    assert adapted_to_job(published, gains) == {
        "P": 0.454,
        "I": 0.147,
        "cycle_time": 1.808,
        "stride": 0.168,
    }


def test_a_held_gain_of_a_job_is_not_put_into_the_published_design() -> None:
    published = CONTROLLERS["pi"].published["pi-pso-ps"]
    assert adapted_to_job(published, job("pi", fixed={"I": 0.0})) == {"P": 0.454, "I": 0.147}


def test_a_job_is_compared_with_the_optimum_of_its_preference() -> None:
    for preference in CHAPTER_4:
        assert published_study(job("fuzzy-pi", preference=preference)) == preference
    assert published_study(job("pi")) == "pi-pso-ps"


def test_a_job_without_published_designs_is_compared_with_nothing() -> None:
    assert not CONTROLLERS["pid"].published
    assert published_study(job("pid")) is None


def test_no_published_design_names_anything_but_variables_and_gait() -> None:
    for controller in CONTROLLERS.values():
        known = {variable.name for variable in controller.variables} | set(GAIT_CATALOGUE)
        for design in controller.published.values():
            assert design.keys() <= known


def test_a_design_file_may_name_the_choice_of_a_convention(write_json: WriteJson) -> None:
    gains = {"P": 0.454, "I": 0.147}
    named = write_json({**gains, "integrator_unit": "volt_per_radian"}, "named.json")
    indexed = write_json({**gains, "integrator_unit": 1}, "indexed.json")
    expected = {**gains, "integrator_unit": 1.0}
    assert read_design(str(named), "pi") == read_design(str(indexed), "pi") == expected
    unknown = write_json({**gains, "integrator_unit": "volts"}, "unknown.json")
    with pytest.raises(InvalidRequest, match="'volts' is not one of its choices counts, "):
        read_design(str(unknown), "pi")
