"""The manual can be built of what the image is built of, and has every page."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.examples.paths import ROOT

DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
STAGES = dict(re.findall(r"(?ms)^FROM \S+ AS (\w+)\n(.*?)(?=^FROM|\Z)", DOCKERFILE))


def copied(folder: Path) -> Path:
    """What the image's manual is built of, and no more, as the Dockerfile copies it."""
    ignored = shutil.ignore_patterns("__pycache__", "page", "manual", "prebuilt", "node_modules")
    for line in re.findall(r"(?m)^COPY (?!--from)(.*)$", STAGES["code"] + STAGES["manual"]):
        *sources, into = line.split()
        for source in map(ROOT.joinpath, sources):
            target = folder / Path(into).relative_to("/src")
            if source.is_dir():
                shutil.copytree(source, target, ignore=ignored)
            else:
                target.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, target)
    return folder


@pytest.fixture(scope="module")
def manual(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built by the image's command, without a network; here a warning is an error."""
    folder = copied(tmp_path_factory.mktemp("manual") / "src")
    (line,) = re.findall(r"^RUN cd /src && python (-m sphinx .*)$", STAGES["manual"], re.MULTILINE)
    options = re.sub(r"-d \S+", f"-d {folder.parent / 'read'}", line).split()
    offline = {"PATH": "", "http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}
    subprocess.run([sys.executable, *options, "-W"], cwd=folder, env=offline, check=True)
    return folder / "api" / "manual"


@pytest.mark.thorough("the manual is built, which `make manual` does")
@pytest.mark.slow
def test_every_page_of_docs_is_in_it(manual: Path) -> None:
    pages = {path.relative_to(ROOT).with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    assert pages <= {path.relative_to(manual) for path in manual.rglob("*.html")}


@pytest.mark.thorough("the manual is built, which `make manual` does")
@pytest.mark.slow
def test_reference_is_made_from_the_code(manual: Path) -> None:
    def text(page: str) -> str:
        return (manual / "docs" / "reference" / page).read_text(encoding="utf-8")

    assert "gaitswarm optimize [OPTIONS]" in text("commands.html")
    assert "open-circuit voltage [V]" in text("robot-file.html")
    assert 'id="gaitswarm.simulate"' in text("python.html")
    assert "GET /v1/jobs/{job_id}/events" in text("rest.html")
    assert 'href="schemas.html#schema-jobview"' in text("rest.html")
    assert "GAITSWARM_LEASE_SECONDS" in text("settings.html")


@pytest.mark.thorough("the manual is built, which `make manual` does")
@pytest.mark.slow
def test_it_needs_no_other_server(manual: Path) -> None:
    for page in ("docs/index.html", "docs/cli.html", "docs/reference/python.html"):
        text = (manual / page).read_text(encoding="utf-8")
        assert 'src="http' not in text
        assert 'rel="stylesheet" href="http' not in text


def test_the_image_brings_it() -> None:
    assert "COPY --from=manual /src/api/manual /src/api/manual" in STAGES["build"]


def test_wheels_bring_it_and_nothing_that_runs_waits_for_it() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    needs = {
        target: set(needed.split())
        for target, needed in re.findall(r"^([a-z-]+):(?!=)([^#\n]*)", makefile, re.MULTILINE)
    }
    assert "manual" in needs["wheel"]
    for target in ("serve", "demo"):
        assert needs[target] == {"setup", "page-if-possible"}
