"""The manual can be built, and has every page."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.examples.paths import ROOT


@pytest.fixture(scope="module")
def manual(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built as `make manual` does, without a network; a warning is an error."""
    folder = tmp_path_factory.mktemp("manual")
    options = ("-q", "-W", "-b", "html", "-d", str(folder / "read"), "-c", "docs")
    command = [sys.executable, "-m", "sphinx", *options, ".", str(folder / "html")]
    subprocess.run(command, cwd=ROOT, check=True)
    return folder / "html"


@pytest.mark.slow
def test_every_page_of_docs_is_in_it(manual: Path) -> None:
    pages = {path.relative_to(ROOT).with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    assert pages <= {path.relative_to(manual) for path in manual.rglob("*.html")}


@pytest.mark.slow
def test_reference_is_made_from_the_code(manual: Path) -> None:
    def text(page: str) -> str:
        return (manual / "docs" / "reference" / page).read_text(encoding="utf-8")

    assert "gaitswarm optimize [OPTIONS]" in text("commands.html")
    assert "open-circuit voltage [V]" in text("robot-file.html")
    assert 'id="gaitswarm.simulate"' in text("python.html")


@pytest.mark.slow
def test_it_needs_no_other_server(manual: Path) -> None:
    for page in ("docs/index.html", "docs/cli.html", "docs/reference/python.html"):
        text = (manual / page).read_text(encoding="utf-8")
        assert 'src="http' not in text
        assert 'rel="stylesheet" href="http' not in text
