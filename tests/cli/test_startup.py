"""The command line answers at once, and cleanly."""

from __future__ import annotations

import subprocess
import sys

import pytest

from cli.exit_codes import ExitCode
from tests.cli.conftest import Gaitswarm

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
    for code in ExitCode:
        if code is not ExitCode.BUG:
            assert f"{code.value} " in words


@pytest.mark.parametrize("arguments", [["fly"], ["status"], ["list", "--limit", "none"]])
def test_wrong_usage_is_exit_code_2(gaitswarm: Gaitswarm, arguments: list[str]) -> None:
    result = gaitswarm(*arguments)
    assert result.code == 2
    assert result.out == ""


@pytest.mark.slow
def test_a_reader_that_goes_away_is_no_error() -> None:
    program = "import sys; from cli.main import run; sys.exit(run(['simulate', '--help']))"
    done = subprocess.run(
        ["/bin/sh", "-c", f'"{sys.executable}" -c "{program}" | true'],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_bench_tells_speed_lanes_and_backend(gaitswarm: Gaitswarm) -> None:
    result = gaitswarm("bench", "--repeats", "1", "--json")
    assert result.code == 0, result.err
    measured = result.json
    assert measured["backend"] in ("native", "reference")
    assert measured["lanes"] >= 1
    step = measured["us_per_step_per_walker"]
    assert measured["real_time_factor_per_core"] == pytest.approx(1e6 / (step * 5000))
    assert gaitswarm("bench", "--backend", "abacus").code == 2
