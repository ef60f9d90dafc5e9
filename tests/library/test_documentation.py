"""docs/library.md and the README's Python are programs that run."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

import gaitswarm
from services.runtime import open_runtime
from tests.examples.paths import ROOT
from tests.examples.servers import Server

pytestmark = pytest.mark.slow

URL = "http://127.0.0.1:8000"

_BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(document: str) -> Iterator[tuple[str, str]]:
    """Where each block of Python is, and its text, at its own line numbers."""
    text = (ROOT / document).read_text(encoding="utf-8")
    for match in _BLOCK.finditer(text):
        line = text[: match.start(1)].count("\n")
        yield f"{document}:{line + 1}", "\n" * line + match[1]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    """URL of a server that runs jobs."""
    with ExitStack() as stack:
        runtime = stack.enter_context(
            open_runtime(str(tmp_path / "served.db"), evaluator="in-process", cpus=1)
        )
        served = Server(runtime.service)
        stack.callback(served.close)
        yield served.url


Run = Callable[[str], dict[str, Any]]


@pytest.fixture
def run(server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    """Runs a document's Python in a folder of its own; its names afterwards."""
    monkeypatch.chdir(tmp_path)
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")

    def run(document: str) -> dict[str, Any]:
        names: dict[str, Any] = {"__name__": "__main__"}
        for where, text in blocks(document):
            exec(compile(text.replace(URL, server), where, "exec"), names)  # noqa: S102
        return names

    yield run
    plt.close("all")


def test_the_page_about_the_library_is_a_program_that_runs(
    run: Run, server: str, tmp_path: Path
) -> None:
    names = run("docs/library.md")
    for picture in ("height.png", "job.png", "server.png"):
        assert (tmp_path / picture).read_bytes().startswith(b"\x89PNG")
    with gaitswarm.open("jobs.db") as here, gaitswarm.connect(server) as there:
        assert [job.state for job in here.jobs()] == ["succeeded"] * 4
        assert [job.state for job in there.jobs()] == ["succeeded"] * 2
    assert names["resumed"].job.state == "succeeded"
    assert names["here"] == names["there"]


def test_the_readmes_python_is_a_program_that_runs(run: Run) -> None:
    names = run("README.md")
    assert names["job"].state == "succeeded"


def test_every_method_of_jobs_and_every_error_is_on_the_page() -> None:
    text = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    written = set(re.findall(r"`(?:gaitswarm\.)?(\w+)`", text))
    methods = {name for name, _ in inspect.getmembers(gaitswarm.Jobs, inspect.isfunction)}
    public = {name for name in methods if not name.startswith("_")}
    assert public - {"close", "command"} - written == set()
    errors = {
        name
        for name in gaitswarm.__all__
        if isinstance(getattr(gaitswarm, name), type)
        and issubclass(getattr(gaitswarm, name), BaseException)
    }
    assert errors - {"LeaseLost"} - written == set()
