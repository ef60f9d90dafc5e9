"""Search methods on the command line: lists, settings, and uneven iterations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from gaitswarm.services.optimizer.search.registry import OPTIMIZERS
from tests.cli.conftest import Gaitswarm, WriteJson
from tests.examples.uneven import UNEVEN_SPEC, uneven_iterations

pytestmark = pytest.mark.slow


def submitted(gaitswarm: Gaitswarm, db: Path, *options: object) -> Any:
    """Settings of the optimizer of a job that is submitted with options."""
    return gaitswarm("submit", "--db", db, "--json", *options).json["spec"]["optimizer"]


def test_all_methods_are_listed_with_the_schema_of_their_settings(gaitswarm: Gaitswarm) -> None:
    found = gaitswarm("optimizers", "--json").json
    assert [item["name"] for item in found] == list(OPTIMIZERS)
    for item in found:
        jsonschema.validate(item["settings"], item["settings_schema"])
        described = item["settings_schema"]["properties"]
        assert all("description" in field for name, field in described.items() if name != "name")
    table = gaitswarm("optimizers").out
    assert all(name in table for name in OPTIMIZERS)
    assert "inertia_end 0.9" in table


def test_settings_are_laid_over_those_of_the_method(
    gaitswarm: Gaitswarm, db: Path, write_json: WriteJson
) -> None:
    changed = {"sigma": 0.5}
    swarm = submitted(
        *(gaitswarm, db, "--optimizer", "pso-falling-inertia"),
        *("--optimizer-settings", '{"social": 1.0}'),
    )
    assert (swarm["inertia_end"], swarm["social"]) == (0.7, 1.0)
    file = write_json(changed, "settings.json")
    for given in (json.dumps(changed), file, f"@{file}"):
        own = submitted(gaitswarm, db, "--optimizer-settings", given, "--particles", 7)
        assert (own["name"], own["sigma"], own["particles"]) == ("cma-es", 0.5, 7)


def test_settings_are_laid_over_those_of_a_spec(
    gaitswarm: Gaitswarm, db: Path, write_json: WriteJson
) -> None:
    spec = write_json({"optimizer": {"sigma": 0.1, "particles": 4}}, "spec.json")
    own = submitted(gaitswarm, db, "--spec", spec, "--optimizer-settings", '{"growth": 1}')
    assert (own["sigma"], own["growth"], own["particles"]) == (0.1, 1.0, 4)
    other = submitted(gaitswarm, db, "--spec", spec, "--optimizer-settings", '{"name": "random"}')
    assert other == {"name": "random", "particles": 25}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--optimizer", "swarm"], "optimizer: unknown optimizer 'swarm'; known are auto,"),
        (
            ["--optimizer-settings", '{"sigam": 1}'],
            "optimizer.sigam: no setting of cma-es; did you mean 'sigma'?",
        ),
        (
            ["--optimizer-settings", '{"sigma": 3}'],
            "optimizer.sigma: must be at most 1",
        ),
        (["--optimizer-settings", '{"a": '], "optimizer-settings: is not valid JSON"),
        (["--optimizer-settings", "@none.json"], "optimizer-settings: cannot read none.json"),
        (
            ["--optimizer", "pso", "--optimizer-settings", '{"name": "random"}'],
            "optimizer-settings: are those of random, but the optimizer is pso",
        ),
    ],
)
def test_wrong_settings_name_the_field_and_the_way_out(
    gaitswarm: Gaitswarm, new_db: Path, options: list[str], said: str
) -> None:
    refused = gaitswarm("submit", "--db", new_db, *options)
    assert refused.code == 2
    assert said in refused.err
    assert not new_db.exists()


def test_auto_is_stored_as_the_selected_method(gaitswarm: Gaitswarm, db: Path) -> None:
    found = submitted(gaitswarm, db, "--optimizer", "auto", "--particles", 11)
    assert found == submitted(gaitswarm, db, "--particles", 11)


def test_progress_of_uneven_iterations_is_in_designs(
    gaitswarm: Gaitswarm, db: Path, write_json: WriteJson
) -> None:
    spec = write_json(UNEVEN_SPEC, "spec.json")
    with uneven_iterations():
        done = gaitswarm("optimize", "--spec", spec, "--db", db, "--evaluator", "in-process")
    assert done.code == 0, done.err
    assert "6 iterations, 12/12 designs: best" in done.err
    job_id = gaitswarm("list", "--db", db, "--json").json[0]["id"]
    listed = gaitswarm("list", "--db", db).out.split()
    assert {"12/12", "designs"} <= set(listed)
    status = gaitswarm("status", job_id, "--db", db).out
    assert "6, of up to 3 designs" in status
    assert "12 of 12" in status
    watched = gaitswarm("watch", job_id, "--db", db)
    assert (watched.code, "6 iterations, 12/12 designs" in watched.err) == (0, True)
    extended = gaitswarm("extend", job_id, "--iterations", 5, "--db", db)
    assert "with 12 of 15 designs" in extended.out
