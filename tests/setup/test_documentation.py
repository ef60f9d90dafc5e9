"""README and docs/ say what is true: commands, settings, routes and scenarios exist, and all do."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.sim.scenario import PRESETS, Scenario
from tests.examples.api_document import api_document
from tests.examples.paths import ROOT
from tests.setup import command_line, settings_classes
from tests.setup.documents import blocks, documentation, shell_commands, typed_commands


def test_every_gaitswarm_command_that_is_written_exists_with_its_options() -> None:
    written = shell_commands("gaitswarm")
    assert len(written) > 20
    assert [p for p in map(command_line.problem, written) if p] == []


def test_every_command_of_a_block_is_taken_by_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for robot in ("a1", "dog"):
        (tmp_path / robot).mkdir()
    refused = []
    typed = typed_commands("gaitswarm")
    for words in typed:
        known = [re.sub(r"\b(ID|JOB\d)\b", "k2q7zr5dm9xw", word) for word in words]
        if words != ["COMMAND"] and (said := command_line.refusal(known)):
            refused.append(f"{' '.join(words)}: {said}")
    assert len(typed) > 200
    assert refused == []


@pytest.mark.parametrize(
    "wrong",
    ["best", "best ID ID", "list --limit x", "study other", "token create ci --scope all",
     "optimize --iterations", "prioritize ID --priority 11", "plot surfaces", "optimizers --quick"],
)  # fmt: skip
def test_a_command_that_the_command_line_does_not_take_is_seen(wrong: str) -> None:
    known = wrong.replace("ID", "k2q7zr5dm9xw").split()
    assert command_line.refusal(known)


def test_every_command_is_shown() -> None:
    shown = {" ".join(words[:n]) for words in shell_commands("gaitswarm") for n in (1, 2)}
    assert sorted(set(command_line.commands()) - shown) == []


def test_every_make_target_that_is_written_exists() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    written = {words[0] for words in shell_commands("make") if words}
    assert {"demo", "test"} <= written
    assert written - targets == set()


def test_every_setting_that_is_written_exists() -> None:
    written = set(re.findall(r"`(GAITSWARM_[A-Z_]+)", documentation()))
    known = settings_classes.variables()
    groups = {word for word in written if word.endswith("_")}
    assert len(written) > 30
    assert written - groups - known == set()
    assert [word for word in groups if not any(name.startswith(word) for name in known)] == []


def test_every_route_that_is_written_exists() -> None:
    paths = [re.sub(r"\{\w+\}", "{}", path) for path in api_document()["paths"]]
    text = re.sub(r"\{\w+\}|\bID\b", "{}", documentation())
    written = set(re.findall(r"[` ](/v1/[\w/{}-]+)", text))
    assert len(written) > 30
    assert [path for path in written if path.rstrip("/") not in paths] == []


def test_every_file_that_is_written_exists() -> None:
    folders = "benchmarks|deploy|docs|examples|research|scripts|services|sim|tests|web"
    written = set(re.findall(rf"`((?:{folders})/[\w./-]+)`", documentation()))
    assert len(written) > 20
    assert [path for path in written if not (ROOT / path).exists()] == []


def test_pages_of_the_manual_that_the_page_leads_to_exist() -> None:
    sources = [*(ROOT / "web" / "src").rglob("*.tsx"), *(ROOT / "web" / "src").rglob("*.ts")]
    texts = [source.read_text(encoding="utf-8") for source in sources]
    named = {name for text in texts for name in re.findall(r"/manual/([\w/-]+)\.html", text)}
    assert named
    assert [name for name in named if not (ROOT / f"{name}.md").is_file()] == []


@pytest.mark.parametrize("scenario", PRESETS, ids=lambda s: s.name)
def test_every_scenario_is_documented(scenario: object) -> None:
    assert f"`{getattr(scenario, 'name', '')}`" in documentation()


def test_every_scenario_that_is_shown_is_valid() -> None:
    shown = [json.loads(body) for body in blocks("json")]
    scenarios = [example for example in shown if "cycle_time" in example]
    assert scenarios
    for scenario in scenarios:
        Scenario.model_validate(scenario)


def test_every_job_spec_that_is_shown_is_valid() -> None:
    shown = [json.loads(body) for body in blocks("json")]
    specs = [example for example in shown if {"iterations", "scenarios"} & set(example)]
    assert specs
    for spec in specs:
        SPECS.validate_python(spec)
