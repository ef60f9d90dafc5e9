"""A job whose iterations are of one to three designs, over HTTP."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import httpx2
import numpy as np
import pytest

from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_store
from tests.examples.servers import Server, unframed
from tests.examples.uneven import SIZES, run_uneven

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("uneven") / "jobs.db"


@pytest.fixture(scope="module")
def path(db: Path) -> str:
    return f"/v1/jobs/{run_uneven(db).job.id}"


@pytest.fixture
def uneven(path: str, db: Path, lasting_server: Server) -> Iterator[httpx2.Client]:
    with closing(open_store(str(db))) as store:
        lasting_server.serve(JobService(store))
        yield lasting_server.client


def test_a_job_tells_how_many_designs_it_has_judged(uneven: httpx2.Client, path: str) -> None:
    job = uneven.get(path).json()
    assert (job["optimizer"], job["particles"]) == ("random", 3)
    assert (job["iterations"], job["iterations_planned"]) == (6, 4)
    assert (job["evaluations"], job["evaluations_planned"]) == (12, 12)
    assert uneven.get("/v1/jobs").json()["items"][0]["evaluations"] == 12


def test_iterations_and_events_tell_how_many_designs_each_has(
    uneven: httpx2.Client, path: str
) -> None:
    listed = uneven.get(f"{path}/iterations").json()["items"]
    assert [item["designs"] for item in listed] == SIZES
    stream = uneven.get(f"{path}/events", params={"follow": False}).text
    assert [int(n) for n in re.findall(r'"designs":(\d+)', stream)] == SIZES
    assert stream.count("event: iteration") == 6
    assert '"iterations":6,"evaluations":12' in stream


def test_each_iteration_has_its_own_designs(uneven: httpx2.Client, path: str) -> None:
    for index, size in enumerate(SIZES):
        items = uneven.get(f"{path}/iterations/{index}/evaluations").json()["items"]
        assert [item["particle"] for item in items] == list(range(size))


def test_the_distribution_is_of_each_iteration_in_pages_of_iterations(
    uneven: httpx2.Client, path: str
) -> None:
    first = uneven.get(f"{path}/distribution", params={"limit": 4}).json()
    rest = uneven.get(f"{path}/distribution", params={"limit": 4, "after": first["next"]}).json()
    items = [*first["items"], *rest["items"]]
    assert ([len(first["items"]), len(rest["items"])], rest["next"]) == ([4, 2], None)
    assert [item["index"] for item in items] == list(range(6))
    assert [item["diversity"] is None for item in items] == [size == 1 for size in SIZES]
    for index, item in enumerate(items):
        own = uneven.get(f"{path}/iterations/{index}/evaluations").json()["items"]
        finite = [e["fitness"] for e in own if e["fitness"] is not None]
        assert item["failed"] == len(own) - len(finite)
        assert item["fitness"][0] == (min(finite) if finite else None)
        assert item["fitness"][-1] == (max(finite) if finite else None)


@pytest.mark.parametrize("most", [12, 7, 3, 2])
def test_particles_are_whole_iterations_within_the_limit(
    uneven: httpx2.Client, path: str, most: int
) -> None:
    answer = uneven.get(f"{path}/particles", params={"max_points": most})
    header, numbers = unframed(answer.content)
    assert (header["total"], header["rows"] <= most) == (12, True)
    iteration, _, fitness = numbers.reshape(-1, header["rows"])[:3]
    assert (np.diff(iteration) >= 0).all()
    best = uneven.get(f"{path}/best").json()["fitness"]
    assert np.nanmin(fitness) == pytest.approx(best, rel=1e-6)
