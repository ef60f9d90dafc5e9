"""The commands of `make demo`."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.cli.conftest import Gaitswarm
from tests.examples.paths import ROOT


@pytest.mark.slow
def test_both_jobs_of_the_demo_run(gaitswarm: Gaitswarm, tmp_path: Path) -> None:
    target = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\ndemo:")[2]
    commands = target.partition("\n\n")[0].replace("\\\n", " ")
    jobs = re.findall(r"\$\(BIN\)/gaitswarm (.+?)\s+\$\(DB_OPTION\)", commands)
    assert len(jobs) == 2
    shorter = ["--iterations", "1", "--particles", "2", "--db", str(tmp_path / "demo.db")]
    for job in jobs:
        result = gaitswarm(*shlex.split(job), *shorter)
        assert result.code == 0, result.err
