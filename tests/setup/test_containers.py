"""Dockerfile and the files of Compose name commands, settings and routes that exist.

They are checked as texts: building and starting them takes a container engine.
"""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import check_jsonschema
import jsonschema
import pytest

from gaitswarm.settings import Settings
from tests.examples.api_document import api_document
from tests.examples.paths import ROOT
from tests.setup import command_line, settings_classes
from tests.setup.compose import CLUSTER, OVERLAY, SINGLE

SERVICES: dict[str, Any] = CLUSTER["services"]
OURS = {name: service for name, service in SERVICES.items() if "build" in service}
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")


def _words(command: str | list[str]) -> list[str]:
    return shlex.split(command) if isinstance(command, str) else command


def _health_command(service: dict[str, Any]) -> list[str]:
    if "healthcheck" not in service:
        (test,) = re.findall(r"^HEALTHCHECK .*\n +CMD (\[.*\])$", DOCKERFILE, re.MULTILINE)
        return list(json.loads(test))
    kind, *words = service["healthcheck"]["test"]
    return shlex.split(words[0]) if kind == "CMD-SHELL" else words


@pytest.mark.parametrize("document", [SINGLE, OVERLAY, CLUSTER], ids=["single", "over", "cluster"])
def test_the_compose_specification_allows_the_files(document: dict[str, Any]) -> None:
    folder = Path(check_jsonschema.__file__).parent / "builtin_schemas" / "vendor"
    schema = json.loads((folder / "compose-spec.json").read_text(encoding="utf-8"))
    validator = jsonschema.validators.validator_for(schema)(schema)
    assert [error.message for error in validator.iter_errors(document)] == []
    assert "version" not in document


def test_one_server_needs_no_secrets_and_keeps_its_database() -> None:
    assert set(SINGLE["services"]) == {"server"}
    assert "${" not in str(SINGLE)
    (volume,) = SINGLE["services"]["server"]["volumes"]
    name, folder = volume.split(":")
    (database,) = re.findall(r"GAITSWARM_DB=(\S+)", DOCKERFILE)
    assert name in SINGLE["volumes"] and Path(database).parent == Path(folder)


def test_a_cluster_takes_the_server_without_its_runner() -> None:
    alone, server = SINGLE["services"]["server"], SERVICES["server"]
    assert {key: server[key] for key in alone} == alone
    assert "--no-runner" in server["command"]


def test_names_of_volumes_networks_and_files_exist() -> None:
    for service in SERVICES.values():
        for volume in service.get("volumes", ()):
            source = volume.partition(":")[0]
            assert (ROOT / source).is_dir() if "/" in source else source in CLUSTER["volumes"]
        assert set(service["networks"]) <= set(CLUSTER["networks"])
        assert {entry["source"] for entry in service.get("configs", ())} <= set(CLUSTER["configs"])


def test_only_this_machine_reaches_what_is_published() -> None:
    for service in SERVICES.values():
        for port in service.get("ports", ()):
            assert port.startswith("127.0.0.1:")
            assert not all(CLUSTER["networks"][n] for n in service["networks"]), "all are internal"


def test_there_is_everything_that_a_cluster_needs() -> None:
    ours = {"server", "runner", "ray-head", "ray-worker"}
    assert set(OURS) == ours and set(SERVICES) - ours == {"postgres", "prometheus", "grafana"}
    assert len({service["image"] for service in OURS.values()}) == 1


def test_walks_get_less_of_the_processors_than_waiting_clients() -> None:
    usual = 1024
    shares = {name: service.get("cpu_shares", usual) for name, service in SERVICES.items()}
    assert {name for name, share in shares.items() if share < usual} == {"ray-worker"}


@pytest.mark.parametrize("name", OURS)
def test_commands_and_health_checks_are_programs_of_ours_or_ray(name: str) -> None:
    for words in (_words(OURS[name]["command"]), _health_command(OURS[name])):
        program, *arguments = words
        if program == "gaitswarm":
            assert command_line.problem(arguments) is None
        else:
            assert program in ("ray", "python")


def options_of_ray(words: list[str], command: str) -> list[str]:
    """What is given to a command of Ray's, by itself or as a node of ours."""
    if words[:2] == ["ray", command]:
        return words[2:]
    is_node = command == "start" and words[:3] == [
        "python",
        "-m",
        "gaitswarm.services.worker.ray_node",
    ]
    return words[3:] if is_node else []


@pytest.mark.thorough("Ray's command line in a process of its own")
@pytest.mark.variants
@pytest.mark.slow
@pytest.mark.parametrize("command", ["start", "health-check"])
def test_options_given_to_ray_exist(command: str) -> None:
    ray = Path(sys.executable).with_name("ray")
    done = subprocess.run(
        [ray, command, "--help"], capture_output=True, text=True, check=True, timeout=120
    )
    used = {
        word.partition("=")[0]
        for service in OURS.values()
        for words in (_words(service["command"]), _health_command(service))
        for word in options_of_ray(words, command)
    }
    assert used
    assert [option for option in used if f"{option} " not in f"{done.stdout} "] == []


@pytest.mark.parametrize("name", SERVICES)
def test_every_service_runs_without_root_and_is_checked(name: str) -> None:
    service = SERVICES[name]
    (user,) = (
        {service["user"]}
        if "user" in service
        else re.findall(r"^USER (\w+)$", DOCKERFILE, re.MULTILINE)
    )
    assert user not in ("root", "0")
    assert _health_command(service)
    assert "privileged" not in service


@pytest.mark.parametrize("name", SERVICES)
def test_services_wait_for_those_that_they_need_to_be_healthy(name: str) -> None:
    for needed, how in SERVICES[name].get("depends_on", {}).items():
        assert how["condition"] == "service_healthy"
        shared = set(SERVICES[name]["networks"]) & set(SERVICES[needed]["networks"])
        assert shared, f"{name} cannot reach {needed}"


def test_settings_of_ours_exist() -> None:
    known = settings_classes.variables()
    given = {name for service in OURS.values() for name in service.get("environment", ())}
    given |= set(re.findall(r"\b(GAITSWARM_[A-Z_]+)=", DOCKERFILE))
    ours = {variable for variable in given if variable.startswith("GAITSWARM_")}
    assert ours
    assert ours - known == set()


def test_processes_have_time_to_drain_before_they_are_killed() -> None:
    settings = Settings()
    for name in ("server", "runner"):
        given = re.fullmatch(r"(\d+)s", SERVICES[name]["stop_grace_period"])
        assert given and int(given[1]) > settings.drain_seconds + settings.api_shutdown_seconds
    text = (ROOT / "docs" / "operations.md").read_text(encoding="utf-8")
    (unit,) = re.findall(r"^TimeoutStopSec=(\d+)$", text, re.MULTILINE)
    assert int(unit) > settings.drain_seconds + settings.api_shutdown_seconds


def test_every_node_of_the_cluster_has_the_same_token_and_none_is_built_in() -> None:
    nodes = [s["environment"] for name, s in OURS.items() if name != "server"]
    assert len({node["RAY_AUTH_TOKEN"] for node in nodes}) == 1
    assert nodes[0]["RAY_AUTH_TOKEN"].startswith("${RAY_AUTH_TOKEN:?")


def test_secrets_that_must_be_given_are_in_the_example() -> None:
    needed = set(re.findall(r"\$\{([A-Z_]+):\?", str(OVERLAY)))
    example = (ROOT / ".env.example").read_text(encoding="utf-8")
    assert needed == set(re.findall(r"^([A-Z_]+)=$", example, re.MULTILINE))
    assert re.search(r"^\.env$", (ROOT / ".gitignore").read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.thorough("the health check of a container, as a process")
def test_the_api_is_asked_for_its_health_where_it_answers() -> None:
    paths = set(api_document()["paths"])
    (asked,) = re.findall(r"http://127\.0\.0\.1:8000(/[\w/]*)", DOCKERFILE)
    assert asked in paths


def test_the_image_ends_without_root_and_starts_a_command_of_ours() -> None:
    assert re.findall(r"^USER (\w+)$", DOCKERFILE, re.MULTILINE)[-1] == "gaitswarm"
    (command,) = re.findall(r"^CMD (\[.*\])$", DOCKERFILE, re.MULTILINE)
    program, *arguments = json.loads(command)
    assert program == "gaitswarm"
    assert command_line.problem(arguments) is None


def test_what_the_image_copies_is_not_ignored() -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    copied = [
        source
        for line in re.findall(r"^COPY (?!--from)(.*)$", DOCKERFILE, re.MULTILINE)
        for source in line.split()[:-1]
    ]
    assert copied
    for source in copied:
        assert (ROOT / source).exists()
        assert {f"!{source}", *(f"!{folder}" for folder in Path(source).parents)} & set(ignored)
