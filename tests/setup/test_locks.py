"""Lock files pin everything that pyproject.toml asks for, and name no index."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.examples.paths import ROOT

LOCKS = sorted((ROOT / "requirements").glob("*.lock"))
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def _pins(path: Path) -> dict[str, set[str]]:
    """Versions by name; there may be several, for different Pythons."""
    pins: dict[str, set[str]] = {}
    for name, version in re.findall(r"^([\w.-]+)==([^\s;]+)", path.read_text(), re.MULTILINE):
        pins.setdefault(name, set()).add(version)
    return pins


def _name(requirement: str) -> str:
    found = re.match(r"[\w.-]+", requirement)
    assert found
    return re.sub(r"[-_.]+", "-", found[0]).lower()


@pytest.mark.parametrize("path", LOCKS, ids=lambda p: p.stem)
def test_a_lock_names_hashes_for_every_package_and_no_address(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "://" not in text
    entries = re.split(r"^(?=\w)", text, flags=re.MULTILINE)[1:]
    assert entries
    assert [entry.split()[0] for entry in entries if "--hash=sha256:" not in entry] == []


def test_locks_pin_all_that_is_asked_for() -> None:
    run, dev, image = (_pins(ROOT / "requirements" / f"{n}.lock") for n in ("run", "dev", "image"))
    extras = PROJECT["project"]["optional-dependencies"]
    asked = {_name(r) for r in [*PROJECT["project"]["dependencies"], *extras["postgres"]]}
    development = {_name(r) for r in PROJECT["dependency-groups"]["dev"] if isinstance(r, str)}
    assert asked - set(run) == set()
    engines = {_name(r) for r in extras["mujoco"]}
    development |= {_name(r) for r in PROJECT["dependency-groups"]["manual"]}
    logs = {_name(r) for r in extras["mcap"]}
    assert (asked | development | engines | logs) - set(dev) == set()
    assert (asked | engines | {_name(r) for r in extras["cluster"]}) - set(image) == set()
    for group in ("manual", "node", "installer", "robots"):
        wanted = {_name(r) for r in PROJECT["dependency-groups"][group]}
        assert wanted - set(_pins(ROOT / "requirements" / f"{group}.lock")) == set()


@pytest.mark.parametrize("other", ["dev", "image"])
def test_what_is_developed_and_shipped_has_the_versions_that_run(other: str) -> None:
    run, compared = (_pins(ROOT / "requirements" / f"{name}.lock") for name in ("run", other))
    assert {
        name: versions for name, versions in run.items() if compared.get(name) != versions
    } == {}


def test_the_manual_is_built_with_the_versions_that_it_is_developed_with() -> None:
    built, developed = (_pins(ROOT / "requirements" / f"{name}.lock") for name in ("manual", "dev"))
    assert {name: v for name, v in built.items() if not v <= developed.get(name, set())} == {}
