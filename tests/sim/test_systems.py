"""Compilation targets, and systems without POSIX or a compiler."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from pathlib import Path

import pytest

from gaitswarm.sim.compiler.compilation import (
    ARM,
    X86,
    Compiler,
    Target,
    cpu_flags,
    find_compiler,
    host_architecture,
    target,
    without_compiler,
)
from tests.examples.walks import SHORT_WALK
from tests.sim.processes import run_python

V2 = "fpu sse2 pni ssse3 cx16 sse4_1 sse4_2 popcnt"
V3 = f"{V2} fma movbe f16c bmi1 avx2 bmi2"
V4 = f"{V3} avx512f avx512dq avx512cd avx512bw avx512vl"


@pytest.fixture(autouse=True)
def _asked_anew() -> Iterator[None]:
    """Clear cached facts about this machine, before and after a simulated one."""
    target.cache_clear()
    yield
    target.cache_clear()


def pretend(monkeypatch: pytest.MonkeyPatch, system: str, machine: str) -> None:
    monkeypatch.setattr(platform, "system", lambda: system)
    monkeypatch.setattr(platform, "machine", lambda: machine)


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (V4, Target(8, "x86-64-v4", X86)),
        (f"{V3} avx512f", Target(4, "x86-64-v3", X86)),
        (V3.replace(" fma", ""), Target(2, "x86-64-v2", X86)),
        (V2, Target(2, "x86-64-v2", X86)),
        ("fpu sse2", Target(2, "", X86)),
    ],
    ids=["AVX-512", "AVX2", "AVX2 without FMA", "SSE4", "SSE2"],
)
@pytest.mark.parametrize(("system", "machine"), [("Linux", "x86_64"), ("Windows", "AMD64")])
def test_the_target_is_the_widest_whose_instructions_the_cpu_has(
    monkeypatch: pytest.MonkeyPatch, flags: str, expected: Target, system: str, machine: str
) -> None:
    pretend(monkeypatch, system, machine)
    monkeypatch.setattr(
        "gaitswarm.sim.compiler.compilation.cpu_flags", lambda: frozenset(flags.split())
    )
    assert target() == expected


@pytest.mark.parametrize(
    ("system", "machine"), [("Linux", "aarch64"), ("Darwin", "arm64"), ("Windows", "ARM64")]
)
def test_arm_of_every_system_has_two_lanes(
    monkeypatch: pytest.MonkeyPatch, system: str, machine: str
) -> None:
    pretend(monkeypatch, system, machine)
    assert target() == Target(2, "", ARM)


def test_an_unknown_architecture_gets_baseline_code(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend(monkeypatch, "Linux", "riscv64")
    assert target() == Target(2, "", "riscv64")


def test_an_unknown_cpu_gets_baseline_code(monkeypatch: pytest.MonkeyPatch) -> None:
    pretend(monkeypatch, "Darwin", "x86_64")

    def read_text(*_: object, **__: object) -> str:
        raise FileNotFoundError("/proc/cpuinfo")

    monkeypatch.setattr(Path, "read_text", read_text)
    assert cpu_flags() == frozenset()
    assert target() == Target(2, "", X86)


def test_zig_spells_levels_in_its_own_way() -> None:
    aim = Target(4, "x86-64-v3", X86)
    gcc = Compiler(("gcc",), "").flags(aim)
    zigs = [("python", "-m", "ziglang", "cc"), ("/opt/zig", "cc", "-target", "x86_64-linux-gnu")]
    assert gcc[-1] == "-march=x86-64-v3"
    assert [Compiler(zig, "").flags(aim)[-1] for zig in zigs] == ["-mcpu=x86_64_v3"] * 2
    assert Compiler(("gcc",), "").flags(Target(2, "", ARM)) == gcc[:-1]


@pytest.mark.parametrize(
    ("system", "way_out"),
    [("Linux", "install gcc"), ("Darwin", "xcode-select --install"), ("Windows", "WSL")],
)
def test_every_system_has_advice_for_a_missing_compiler(
    monkeypatch: pytest.MonkeyPatch, system: str, way_out: str
) -> None:
    pretend(monkeypatch, system, platform.machine())
    assert without_compiler().startswith("no C compiler found: ")
    assert way_out in without_compiler()


def test_no_compiler_is_found_for_an_unknown_architecture() -> None:
    assert find_compiler("z80") is None or host_architecture() == "z80"


# What the libraries need of their own system is imported before it is taken away.
ANOTHER_SYSTEM = """
import asyncio, multiprocessing, os, pathlib, platform, signal, subprocess, sys, tempfile
import casadi, numpy, pinocchio, pydantic, scipy, sqlalchemy
for module in ("fcntl", "grp", "pwd", "resource", "termios"):
    sys.modules[module] = None
for name in ("fork", "getuid", "geteuid", "killpg", "mkfifo", "sched_getaffinity", "uname"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGHUP", "SIGKILL", "SIGUSR1"):
    if hasattr(signal, name):
        delattr(signal, name)
platform.system, platform.machine = lambda: "Windows", lambda: "AMD64"
"""
SIMULATE = """
from tests.examples.walks import short_walk, walk
done = walk(short_walk(cycle_time=0.3), {"P": 0.45, "I": 0.1}, "pi")
print(done.outcome.statuses, done.outcome.objectives[0, 0])
"""
OPTIMIZE = """
from gaitswarm.cli.main import main
sys.argv = "gaitswarm optimize --particles 2 --iterations 1 --evaluator in-process".split()
sys.argv += ["--controller", "pi", "--scenarios", os.environ["SCENARIO"]]
main()
"""


@pytest.mark.thorough("test_without_a_compiler_the_interpreter_runs_with_a_warning, without POSIX")
@pytest.mark.slow
def test_without_posix_and_a_compiler_the_interpreter_runs_with_a_warning() -> None:
    elsewhere, here = (
        run_python(f"{system}{SIMULATE}", CC="") for system in (ANOTHER_SYSTEM, "import sys")
    )
    assert elsewhere.returncode == 0, elsewhere.stderr
    assert "no C compiler found: kernels are compiled on Linux and macOS only" in elsewhere.stderr
    statuses, torque = elsewhere.stdout.rsplit(maxsplit=1)
    assert statuses == here.stdout.rsplit(maxsplit=1)[0]
    assert float(torque) == pytest.approx(float(here.stdout.split()[-1]), rel=1e-7)


@pytest.mark.slow
@pytest.mark.thorough(
    "test_without_a_compiler_the_interpreter_runs_with_a_warning, as a job without POSIX"
)
def test_without_posix_a_job_is_optimized_in_this_process(tmp_path: Path) -> None:
    brief = tmp_path / "brief.json"
    brief.write_text(json.dumps(SHORT_WALK | {"cycle_time": 0.3}), encoding="utf-8")
    done = run_python(
        f"{ANOTHER_SYSTEM}{OPTIMIZE}", XDG_DATA_HOME=str(tmp_path), SCENARIO=str(brief)
    )
    assert done.returncode == 0, done.stderr
    assert "fitness of best:" in done.stdout
