"""Broken or conflicting plug-ins are named with their distribution, and never fatal."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.registry import METHODS, OPTIMIZERS
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.plugins import find_plugins, version_of
from gaitswarm.views.catalogue import plugin_views
from tests.examples.plugins import install, installed
from tests.examples.processes import loaded_by, python

METHOD = """
from typing import Literal
from gaitswarm.plugins import SearchSettings, from_generator

class {name}Settings(SearchSettings):
    name: Literal["{name}"] = "{name}"

def search(settings, space, budget, random):
    while True:
        yield space.from_unit(random.uniform(settings.particles, space.dimension))

METHOD = from_generator({name}Settings, "Random designs", search)
"""

BROKEN = {
    "no_such_module": ({}, "no_such_module:METHOD", "ModuleNotFoundError"),
    "raising": ({"raising": "1 / 0"}, "raising:METHOD", "ZeroDivisionError"),
    "leaving": ({"leaving": "import sys; sys.exit(3)"}, "leaving:METHOD", "SystemExit"),
    "empty": ({"empty": ""}, "empty:METHOD", "AttributeError"),
    "no_method": ({"no_method": "METHOD = 7"}, "no_method:METHOD", "is a int, not a Method"),
    "other": (
        {"other": METHOD.format(name="another")},
        "other:METHOD",
        "its own name is 'another'",
    ),
}


GROUP = "gaitswarm.optimizers"


def method(name: str, module: str) -> dict[str, str]:
    return {module: METHOD.format(name=name)}


def sound(site: Path) -> None:
    """Installs a plug-in with which nothing is wrong."""
    places = {GROUP: {"sound": "sound_search:METHOD"}}
    install(site, "sound-search", places, method("sound", "sound_search"))


@pytest.mark.variants("no_such_module", "leaving")
@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_plug_in_is_left_out_with_its_distribution_and_the_reason(
    site: Path, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    modules, place, reason = BROKEN[name]
    install(site, "broken-search", {GROUP: {name: place}}, modules, version="2.1")
    sound(site)
    with installed(site):
        assert "sound" in OPTIMIZERS and name not in OPTIMIZERS
        with pytest.raises(ValidationError) as refused:
            JobSpec.model_validate({"optimizer": name})
        listed = {view.name: view for view in plugin_views()}
    text = listed[name].reason or ""
    assert listed[name].state == "refused" and listed["sound"].state == "ok"
    assert reason in text and "broken-search 2.1" in text
    assert text in str(refused.value)
    assert [record.message for record in caplog.records] == [text]


def test_a_name_of_gaitswarms_stays_gaitswarms(site: Path) -> None:
    install(site, "taker", {GROUP: {"pso": "taker:METHOD"}}, method("pso", "taker"))
    own = METHODS["pso"]
    with installed(site):
        assert METHODS["pso"] is own
        (view,) = plugin_views()
    assert view.reason == (
        "optimizer 'pso' of taker 1.0 is ignored: gaitswarm itself uses the name"
    )


def test_of_two_plug_ins_of_one_name_neither_is_used(site: Path) -> None:
    for distribution in ("first", "second"):
        places = {GROUP: {"twin": f"{distribution}_module:METHOD"}}
        install(site, distribution, places, method("twin", f"{distribution}_module"))
    with installed(site):
        assert "twin" not in METHODS
        reasons = [view.reason for view in plugin_views()]
    assert reasons == [
        "optimizer 'twin' of first 1.0 is ignored: second 1.0 uses the name, too",
        "optimizer 'twin' of second 1.0 is ignored: first 1.0 uses the name, too",
    ]


def test_a_job_names_it_and_its_document_comes_back(site: Path) -> None:
    sound(site)
    with installed(site):
        spec = JobSpec.model_validate({"optimizer": {"name": "sound", "particles": 7}})
        again = JobSpec.model_validate_json(spec.model_dump_json())
        assert again == spec and again.optimizer.particles == 7
        assert spec.search_libraries == {"sound-search": version_of("sound-search")}
        with pytest.raises(ValidationError, match="no setting of sound; known are particles"):
            JobSpec.model_validate({"optimizer": {"name": "sound", "size": 7}})
        schema = JobSpec.model_json_schema()
    assert "sound" in str(schema)
    with pytest.raises(ValidationError, match="unknown method 'sound'"):
        JobSpec.model_validate_json(spec.model_dump_json())


def test_its_version_changes_with_any_byte_of_its_code(site: Path) -> None:
    sound(site)
    with installed(site):
        before = version_of("sound-search")
    with (site / "sound_search.py").open("a") as file:
        file.write("# edited\n")
    with installed(site):
        after = version_of("sound-search")
    assert before != after
    assert before.startswith("1.0 (code ") and after.startswith("1.0 (code ")


def test_names_of_gaitswarm_are_answered_without_looking_for_plug_ins() -> None:
    find_plugins.cache_clear()
    assert CONTROLLERS["fuzzy-pi"].name == "fuzzy-pi"
    JobSpec.model_validate({"optimizer": "pso", "controller": "pi"})
    assert find_plugins.cache_info().misses == 0


@pytest.mark.thorough("the suites in a process of their own")
@pytest.mark.slow
def test_the_suites_are_imported_without_a_test_runner() -> None:
    assert loaded_by("import gaitswarm.testing", ["pytest"]) == set()


@pytest.mark.slow
def test_help_does_not_look_for_plug_ins() -> None:
    looked = "import importlib.metadata as m; m.entry_points = None"
    statements = f"{looked}; from gaitswarm.cli.main import run; raise SystemExit(run(['--help']))"
    assert python("-c", statements).returncode == 0


@pytest.mark.parametrize("optimizer", ["gsa", {"name": "gsa", "particles": 7}])
def test_a_method_of_research_is_refused_with_the_command_that_installs_it(
    site: Path, optimizer: object
) -> None:
    with (
        installed(site),
        pytest.raises(ValidationError, match=r"'gsa'; .*: pip install ./research"),
    ):
        JobSpec.model_validate({"optimizer": optimizer})
