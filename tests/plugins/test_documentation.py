"""docs/plugins.md is a package that is installed, passes its own tests, and runs jobs."""

from __future__ import annotations

import os
import re
import shlex
import tomllib
from pathlib import Path

import pytest

from tests.examples.commands import run_command
from tests.examples.paths import ROOT
from tests.examples.plugins import install, installed
from tests.examples.processes import python

pytestmark = pytest.mark.slow

PAGE = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")

FILES = re.findall(r"^```(?:python|toml)\n# (\S+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture
def path(site: Path) -> dict[str, str]:
    """Environment in which the page's package is installed."""
    texts = dict(FILES)
    project = tomllib.loads(texts.pop("pyproject.toml"))["project"]
    install(site, project["name"], project["entry-points"], {}, version=project["version"])
    for name, text in texts.items():
        (site / name).write_text(text, encoding="utf-8")
    return {"PYTHONPATH": os.pathsep.join(map(str, (ROOT, site)))}


@pytest.mark.thorough("test_its_commands_run, with the contract suites")
def test_its_package_keeps_to_the_contracts(site: Path, path: dict[str, str]) -> None:
    options = ("-q", "-p", "no:cacheprovider", "--rootdir", site)
    environment = path | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = python("-m", "pytest", *options, site / "test_my_gaitswarm.py", environment=environment)
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout


@pytest.mark.usefixtures("path")
def test_its_commands_run(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(site)
    (block,) = re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    printed = ""
    with installed(site):
        for line in block.splitlines():
            _, *words = shlex.split(line)
            extra = ["--evaluator", "in-process"] if words[0] == "optimize" else []
            done = run_command(*words, *extra)
            assert done.code == 0, done.err
            printed += done.out
    assert "refused" not in printed
    assert all(name in printed for name in ("pd", "hill", "damped", "share"))
