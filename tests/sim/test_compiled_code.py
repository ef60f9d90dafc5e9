"""What compilers and sanitizers say of the C code."""

from __future__ import annotations

import subprocess
from functools import partial
from pathlib import Path

import pytest

from sim.compiler.compilation import build_library
from sim.compiler.target import Target, target
from sim.compiler.toolchain import find_compiler
from sim.controllers.native_inference import inference_source
from sim.kernel.native import load_kernel, native_kernel
from sim.kernel.source import kernel_identity, kernel_source
from sim.kernel.walk import Precision
from sim.robot import RobotFiles, RobotVariant, load_robot
from tests.sim.processes import ROOT, run_python
from tests.sim.sanitized_walks import ROBOTS, digest_of_tables, digest_of_walks

pytestmark = pytest.mark.slow

STRICT = ("-O1", "-Werror", "-Wshadow", "-Wconversion", "-Wundef", "-Wstrict-prototypes")
# Without wrapping, so that an overflow of what is no vector is reported.
SANITIZED = (
    *("-O1", "-g", "-fno-wrapv"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
)


def quadruped() -> RobotFiles:
    folder = ROOT / "examples" / "quadruped"
    toml, urdf = ((folder / f"robot.{kind}").read_text() for kind in ("toml", "urdf"))
    return RobotFiles(toml=toml, urdf=urdf)


@pytest.mark.parametrize(
    "robot",
    [
        "szabadka2",
        RobotVariant(contact_law="karnopp"),
        RobotVariant(contact_law="dead_zone"),
        RobotVariant(contact_law="stick"),
        RobotVariant(contact_law="stick", backlash=(2.5, 1.0, 1.0)),
        quadruped(),
    ],
    ids=["linear zone", "karnopp", "dead zone", "stick", "stick and backlash", "quadruped"],
)
@pytest.mark.parametrize("precision", ["double", "single"])
def test_every_robots_kernel_compiles_without_a_warning(
    robot: str | RobotVariant | RobotFiles, precision: Precision
) -> None:
    assert load_kernel(load_robot(robot), precision, extra_flags=STRICT) is not None


@pytest.mark.parametrize("wanted", [Target(4, "x86-64-v3"), Target(2, "")], ids=str)
def test_narrower_kernels_compile_without_a_warning(wanted: Target) -> None:
    aim = wanted if wanted.lanes <= target().lanes else target()
    robot = load_robot("szabadka2")
    sources = {
        "kernel-narrow": kernel_source(robot),
        "kernel-narrow-single": kernel_source(robot, "single"),
        "inference": inference_source(),
    }
    for name, text in sources.items():
        library = build_library(
            name, text.encode(), partial(str, text), wanted=aim, extra_flags=STRICT
        )
        assert library is not None


def test_the_inference_compiles_without_a_warning() -> None:
    source = inference_source()
    assert build_library("inference", source.encode(), lambda: source, extra_flags=STRICT)


def sanitizer() -> str:
    """The runtime library that must be loaded before all others."""
    compiler = find_compiler()
    if compiler is None:
        pytest.skip("there is no compiler")
    asked = subprocess.run(
        [*compiler.command, "-print-file-name=libasan.so"],
        capture_output=True,
        text=True,
        check=False,
    )
    runtime = Path(asked.stdout.strip())
    if not runtime.is_absolute():
        pytest.skip(f"{compiler.version} has no sanitizers")
    return str(runtime)


def run_sanitized(call: str, library: Path) -> str:
    done = run_python(
        f"from tests.sim.sanitized_walks import *\nprint({call})",
        LIBRARY=str(library),
        LD_PRELOAD=sanitizer(),
        # The interpreter itself leaks on exit.
        ASAN_OPTIONS="detect_leaks=0",
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("name", ROBOTS)
def test_walks_and_falls_read_and_write_what_is_theirs_only(name: str) -> None:
    sanitizer()
    robot = ROBOTS[name]
    library = build_library(
        "kernel-sanitized",
        kernel_identity(robot),
        lambda: kernel_source(robot),
        extra_flags=SANITIZED,
    )
    assert library is not None
    kernel = native_kernel(robot)
    assert kernel is not None
    assert run_sanitized(f"sanitized_walks({name!r})", library) == digest_of_walks(kernel, robot)


def test_inferences_read_and_write_what_is_theirs_only() -> None:
    sanitizer()
    source = inference_source()
    library = build_library(
        "inference-sanitized", source.encode(), lambda: source, extra_flags=SANITIZED
    )
    assert library is not None
    assert run_sanitized("sanitized_tables()", library) == digest_of_tables(None)


def test_the_sanitizers_find_what_they_are_run_for(tmp_path: Path) -> None:
    sanitizer()
    source = (
        "int past_the_end(const int *values, int n) { return values[n]; }\n"
        "int overflow(int value) { return value + 1; }\n"
    )
    library = build_library("faulty", source.encode(), lambda: source, extra_flags=SANITIZED)
    assert library is not None
    calls = {
        "heap-buffer-overflow": "past_the_end(ctypes.c_void_p(values.ctypes.data), 1000)",
        "signed integer overflow": "overflow(2147483647)",
    }
    for report, call in calls.items():
        done = run_python(
            "import ctypes, os, numpy\nvalues = numpy.zeros(1000, dtype=numpy.int32)\n"
            f"ctypes.CDLL(os.environ['LIBRARY']).{call}",
            LIBRARY=str(library),
            LD_PRELOAD=sanitizer(),
            ASAN_OPTIONS="detect_leaks=0",
        )
        assert done.returncode != 0
        assert report in done.stderr
