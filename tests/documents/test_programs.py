"""Documents that are programs: what they show is run as it is printed, in order."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

import gaitswarm
from gaitswarm.services.runtime import open_runtime
from tests.documents.reader import Reader
from tests.examples.paths import ROOT
from tests.examples.servers import Server

pytestmark = pytest.mark.slow

NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Reader]:
    """Someone in a folder with the examples, and with a server that runs jobs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    # What a document exports ends with it.
    monkeypatch.setenv("GAITSWARM_DB", "of-the-reader.db")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    with ExitStack() as stack:
        stack.callback(plt.close, "all")
        runtime = stack.enter_context(
            open_runtime(str(tmp_path / "dog.db"), evaluator="in-process", cpus=1)
        )
        served = Server(runtime.service)
        stack.callback(served.close)
        yield Reader(served.url)


@pytest.mark.thorough("test_the_readmes_commands_do_what_they_say, with another page")
def test_the_tutorial_does_what_it_says(reader: Reader) -> None:
    reader.read("docs/tutorial.md")
    assert Path("dog.svg").read_text(encoding="utf-8").startswith("<?xml")
    submitted, best, ranking = reader.answers
    assert '"state":"succeeded"' in submitted.text.split("event: state")[-1]
    assert best.json()["design"].keys() == {"P", "I", "D"}
    assert len(ranking.json()["top"]) == 3


def test_the_readmes_commands_do_what_they_say(reader: Reader) -> None:
    reader.replaced = {
        "--iterations 10 ": "--iterations 2 --particles 4 ",
        "--from 10": "--from 2",
        "--replay 50": "--replay 2",
        "--worlds 8 --aggregate cvar": "--worlds 2 --aggregate cvar --iterations 1 --particles 2",
    }
    reader.skipped = {"gaitswarm certify": "simulates hundreds of worlds"}
    reader.read("README.md", "Command line")
    for written in ("job.parquet", "job.zip", "convergence.png", "walk.npz", "firmware/Makefile"):
        assert Path(written).stat().st_size > 0


def test_the_readmes_requests_do_what_they_say(reader: Reader) -> None:
    reader.replaced = {'"iterations": 25': '"iterations": 3, "optimizer": {"particles": 8}'}
    reader.read("README.md", "REST in five requests")
    answers = {str(answer.request.url).rpartition("/")[2]: answer for answer in reader.answers}
    assert answers["pause"].json()["state"] in ("pausing", "paused")
    assert answers["resume"].json()["state"] in ("queued", "running")
    events = answers["events"].text.split("event: state")[-1]
    assert '"evaluations":24' in events
    assert '"state":"succeeded"' in events
    assert answers["best"].json()["design"].keys() >= {"I", "FOR"}


def test_the_readmes_python_runs(reader: Reader) -> None:
    reader.read("README.md", languages="python")
    assert reader.names["job"].state == "succeeded"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.thorough("test_the_readmes_python_runs, with notebooks")
def test_a_notebook_runs_and_holds_no_outputs(notebook: Path, reader: Reader) -> None:
    assert "fitness" in reader.read_notebook(notebook.relative_to(ROOT).as_posix())
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)


@pytest.mark.thorough("test_the_readmes_python_runs, with the page about the library")
def test_the_page_about_the_library_runs(reader: Reader) -> None:
    reader.read("docs/library.md")
    for picture in ("height.png", "job.png", "server.png"):
        assert Path(picture).read_bytes().startswith(b"\x89PNG")
    with gaitswarm.open("jobs.db") as here, gaitswarm.connect(reader.server) as there:
        assert [job.state for job in here.jobs()] == ["succeeded"] * 3
        assert [job.state for job in there.jobs()] == ["succeeded"] * 3
    assert reader.names["resumed"].job.state == "succeeded"
    assert reader.names["first"] == reader.names["second"]
