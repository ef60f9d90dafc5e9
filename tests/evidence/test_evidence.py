"""Contents of evidence, equal for equal jobs."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest

import gaitswarm
from gaitswarm.evidence.archive import evidence, unzipped
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.sim.kernel import Precision
from tests.evidence.conftest import JOB, Proved
from tests.examples.servers import Server

pytestmark = pytest.mark.slow


def test_the_same_job_has_the_same_evidence_wherever_its_database_is(
    proved: Proved, tmp_path: Path, serve_database: Callable[[Path], str]
) -> None:
    copy = Path(shutil.copy(proved.db, tmp_path / "copy.db"))
    with gaitswarm.connect(serve_database(copy)) as jobs:
        assert jobs.evidence(proved.id) == proved.content


class Earlier(JobService):
    """A service whose job was read before its last iterations were committed."""

    def job(self, job_id: str) -> Job:
        job = JobService.job(self, job_id)
        committed = job.progress.best_iteration
        assert committed, "the best design is of the first iteration: choose another seed"
        rows = self.store.evaluations_between(job_id, 0, committed)
        progress = job.progress._replace(iterations=committed, evaluations=len(rows))
        return replace(job, state=JobState.RUNNING, progress=progress)


@pytest.mark.variants
@pytest.mark.parametrize("precision", ["double", "single"])
def test_evidence_of_a_job_that_continues_meanwhile_is_of_what_was_committed(
    precision: Precision, tmp_path: Path
) -> None:
    db = tmp_path / "jobs.db"
    job_id = gaitswarm.optimize(db=db, precision=precision, **JOB).job.id
    with closing(open_store(f"sqlite:///{db}")) as store:
        content = evidence(Earlier(store), job_id)
    found = gaitswarm.verify(content, replay=2)
    assert found.verified, found.checks


def test_every_file_but_the_manifest_has_its_hash_in_it(proved: Proved) -> None:
    with zipfile.ZipFile(BytesIO(proved.content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
        assert archive.namelist() == sorted(members)
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    manifest = json.loads(members.pop("manifest.json"))
    assert (manifest["format"], manifest["version"]) == ("gaitswarm-evidence", 1)
    assert manifest["files"] == {
        name: hashlib.sha256(content).hexdigest() for name, content in members.items()
    }


def test_all_of_a_job_is_in_it(proved: Proved) -> None:
    members = unzipped(proved.content)
    document, spec = (json.loads(members[name]) for name in ("job.json", "spec.json"))
    assert (document["id"], document["budgets"]) == (proved.id, [3])
    assert spec["name"] == JOB["name"]
    with gaitswarm.open(proved.db) as jobs:
        assert json.loads(members["best.json"]) == json.loads(
            jobs.best(proved.id).model_dump_json()
        )
        exported = b"".join(jobs.export(proved.id, "parquet"))
        job = jobs.job(proved.id)
        provenance = [r.model_dump(mode="json") for r in job.provenance]
    assert members["history/evaluations.parquet"] == exported
    assert json.loads(members["history/chain.json"])["provenance"] == provenance
    assert {"robots/0/robot.urdf", "robots/0/description.json"} <= set(members)


def test_its_page_shows_convergence_and_needs_no_network(proved: Proved) -> None:
    page = unzipped(proved.content)["index.html"].decode()
    figure = page[page.index("<svg ") : page.index("</figure>")]
    assert ET.fromstring(figure).tag.endswith("svg")  # noqa: S314
    addresses = set(re.findall(r"\w+://[^\s\"'<]+", page))
    assert addresses == {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert not re.findall(r"<(?:script|link|img|iframe)\b|\bsrc=|@import", page)
    assert not re.findall(r"(?:\bhref=\"|url\()(?!#|data:)", page)
    assert "to be &lt;proved&gt;" in page and "<proved>" not in page
    assert "short" in page


def test_a_job_that_has_committed_nothing_has_no_evidence(
    tmp_path: Path, serve_database: Callable[[Path], str]
) -> None:
    db = tmp_path / "new.db"
    with gaitswarm.open(db) as jobs:
        job = jobs.submit(**JOB)
    for opened in (gaitswarm.open(db), gaitswarm.connect(serve_database(db))):
        with opened as jobs:
            with pytest.raises(gaitswarm.Conflict, match="no iteration yet"):
                jobs.evidence(job.id)
            with pytest.raises(gaitswarm.NotFound):
                jobs.evidence("nosuchjob")


def test_a_server_sends_it_as_an_archive(proved: Proved, lasting_server: Server) -> None:
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.runtime import open_store

    store = open_store(str(proved.db))
    lasting_server.serve(JobService(store))
    answer = lasting_server.client.get(f"/v1/jobs/{proved.id}/evidence")
    assert answer.headers["Content-Type"] == "application/zip"
    assert answer.content == proved.content
    store.close()
