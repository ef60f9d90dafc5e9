"""The command line answers at once, and cleanly."""

from __future__ import annotations

import re

import pytest

from cli.exit_codes import ExitCode
from sim.simulate import lanes, prepare
from tests.cli.conftest import Finished, Gaitswarm
from tests.examples.processes import COMMAND_LINE, loaded_by, output, start_python

HEAVY = (
    "ray", "pinocchio", "casadi", "numpy", "sqlalchemy", "fastapi", "pydantic", "matplotlib",
    "pyarrow", "rich", "httpx2",
)  # fmt: skip


@pytest.mark.slow
def test_help_imports_none_of_the_heavy_packages() -> None:
    assert loaded_by("from cli.main import run; assert run(['--help']) == 0", HEAVY) == set()


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
    arguments = command.format(id=finished.id).split()
    where = {"GAITSWARM_DB": str(finished.db)}
    with start_python(*COMMAND_LINE, *arguments, environment=where) as process:
        # Before the first word: whatever is written, nobody reads it.
        output(process.stdout).close()
        assert output(process.stderr).read() == ""
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
