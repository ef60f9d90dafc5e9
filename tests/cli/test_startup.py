"""The command line answers at once, and cleanly."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from cli.exit_codes import ExitCode
from sim.simulate import lanes, prepare
from tests.cli.conftest import Finished, Gaitswarm

HEAVY = (
    "ray", "pinocchio", "casadi", "numpy", "sqlalchemy", "fastapi", "pydantic", "matplotlib",
    "pyarrow", "rich", "httpx2",
)  # fmt: skip


@pytest.mark.slow
def test_help_imports_none_of_the_heavy_packages() -> None:
    program = (
        "import sys; from cli.main import run; code = run(['--help']);"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr);"
        "sys.exit(code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stderr.strip() == "[]"
    assert "optimize" in done.stdout


def test_help_documents_the_exit_codes(gaitswarm: Gaitswarm) -> None:
    words = " ".join(gaitswarm("--help").out.split())
    documented = {int(code) for code in re.findall(r"(\d+) ", words.partition("Exit codes: ")[2])}
    assert documented - {ExitCode.BUG} == set(ExitCode) - {ExitCode.BUG}


@pytest.mark.parametrize("arguments", [["fly"], ["status"], ["list", "--limit", "none"]])
def test_wrong_usage_is_exit_code_2(gaitswarm: Gaitswarm, arguments: list[str]) -> None:
    result = gaitswarm(*arguments)
    assert result.code == 2
    assert result.out == ""


@pytest.mark.slow
@pytest.mark.parametrize("command", ["simulate --help", "history {id} --json"])
def test_a_reader_that_goes_away_is_no_error(finished: Finished, command: str) -> None:
    program = "from cli.main import main; main()"
    with subprocess.Popen(
        [sys.executable, "-c", program, *command.format(id=finished.id).split()],
        env=os.environ | {"GAITSWARM_DB": str(finished.db)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        # Before the first word: whatever is written, nobody reads it.
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(timeout=60) == ExitCode.OK


@pytest.mark.slow
def test_bench_tells_speed_lanes_and_backend(gaitswarm: Gaitswarm) -> None:
    result = gaitswarm("bench", "--repeats", "1", "--json")
    assert result.code == 0, result.err
    measured = result.json
    assert (measured["backend"], measured["lanes"]) == (prepare(), lanes())
    step = measured["us_per_step_per_walker"]
    assert measured["real_time_factor_per_core"] == pytest.approx(1e6 / (step * 5000))
    assert gaitswarm("bench", "--backend", "abacus").code == 2
