"""Compiler warnings and sanitizers on the C code."""

from __future__ import annotations

import os
import subprocess
from functools import partial
from pathlib import Path

import pytest

from gaitswarm.sim.compiler.compilation import (
    X86,
    X86_TARGETS,
    Target,
    build_library,
    find_compiler,
    host_architecture,
)
from gaitswarm.sim.controllers.quantisation import inference_source
from gaitswarm.sim.errors import KernelBuildError
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.emitted.source import kernel_identity, kernel_source
from gaitswarm.sim.kernel.native import load_kernel, native_kernel
from gaitswarm.sim.robot import RobotFiles, RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from tests.examples.walks import torque_quadruped_files
from tests.sim.processes import ROOT, run_python
from tests.sim.sanitized_walks import (
    ROBOTS,
    Kind,
    digest_of_tables,
    digests,
)

pytestmark = pytest.mark.slow

WARNINGS = ("-Werror", "-Wshadow", "-Wconversion", "-Wundef", "-Wstrict-prototypes")
# Some warnings are of what optimization finds out.
STRICT = ("-O1", *WARNINGS)
# Without wrapping, so that an overflow of what is no vector is reported. Reports name lines, not
# variables, and little is optimized: both would cost more than twice the time to compile.
SANITIZED = ("-Og", "-g1", "-fno-wrapv", "-fno-sanitize-recover=all")


def quadruped() -> RobotFiles:
    folder = ROOT / "examples" / "quadruped"
    toml, urdf = ((folder / f"robot.{kind}").read_text() for kind in ("toml", "urdf"))
    return RobotFiles(toml=toml, urdf=urdf)


@pytest.mark.variants("stick-double")
@pytest.mark.parametrize(
    ("robot", "precision"),
    [
        (RobotVariant(contact_law="karnopp"), "single"),
        (RobotVariant(contact_law="dead_zone"), "single"),
        (RobotVariant(contact_law="stick"), "double"),
        (RobotVariant(contact_law="stick"), "single"),
        (quadruped(), "double"),
        (quadruped(), "single"),
        (torque_quadruped_files(), "single"),
    ],
    ids=[
        "karnopp-single",
        "dead zone-single",
        "stick-double",
        "stick-single",
        "quadruped-double",
        "quadruped-single",
        "torque-single",
    ],
)
def test_a_robots_kernel_compiles_without_a_warning(
    robot: RobotVariant | RobotFiles, precision: Precision
) -> None:
    """In addition to those compiled with sanitizers, and those of every level."""
    assert load_kernel(load_robot(robot), precision, extra_flags=STRICT) is not None


@pytest.mark.variants("Target(lanes=4,*")
@pytest.mark.skipif(host_architecture() != X86, reason="these are levels of x86-64")
@pytest.mark.parametrize("wanted", [*X86_TARGETS, Target(2, "", X86)], ids=str)
def test_kernels_of_every_level_compile_without_a_warning(wanted: Target) -> None:
    """Also of those that this machine does not run."""
    robot = load_robot("szabadka2")
    kernels: list[Precision] = ["double", "single"]
    build = partial(build_library, "level", compile_for=wanted, extra_flags=STRICT)
    for precision in kernels:
        source = partial(kernel_source, robot, precision)
        assert build(kernel_identity(robot, precision), source)
    inference = inference_source()
    assert build(inference.encode(), lambda: inference)


def test_the_inference_compiles_without_a_warning() -> None:
    source = inference_source()
    assert build_library("inference", source.encode(), lambda: source, extra_flags=STRICT)


def address_sanitizer() -> str:
    """The runtime library that must be loaded before all others; empty if there is none."""
    compiler = find_compiler()
    if compiler is None:
        pytest.skip("NOT TESTED without a compiler")
    asked = subprocess.run(
        [*compiler.command, "-print-file-name=libasan.so"],
        capture_output=True,
        text=True,
        check=False,
    )
    runtime = Path(asked.stdout.strip())
    return str(runtime) if runtime.is_absolute() else ""


def sanitizers() -> tuple[str, ...]:
    """Flags of a build that stops at undefined behaviour and, if it can, at foreign memory."""
    if address_sanitizer():
        return (*SANITIZED, "-fsanitize=address,undefined")
    flags = (*SANITIZED, "-fsanitize=undefined")
    try:
        build_library("sanitizer", b"", lambda: "int f(void) { return 1; }", extra_flags=flags)
    except KernelBuildError:
        pytest.skip("NOT TESTED: this compiler has no sanitizers")
    return flags


def run_sanitized(call: str, *libraries: Path) -> str:
    done = run_python(
        f"from tests.sim.sanitized_walks import *\nprint({call})",
        LIBRARIES=os.pathsep.join(map(str, libraries)),
        **preloaded(),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def preloaded() -> dict[str, str]:
    """The environment of a process that loads sanitized code."""
    runtime = address_sanitizer()
    # The interpreter itself leaks on exit.
    return {"LD_PRELOAD": runtime, "ASAN_OPTIONS": "detect_leaks=0"} if runtime else {}


INTERNAL_STATE: list[Kind] = [("all internal state", "double"), ("all internal state", "single")]
OTHERS: list[Kind] = [
    *((name, "double") for name in ROBOTS if name != "all internal state"),
    ("plain", "single"),
]


@pytest.mark.variants("all internal state")
@pytest.mark.parametrize("kinds", [INTERNAL_STATE, OTHERS], ids=["all internal state", "others"])
@pytest.mark.thorough("the kernel under sanitizers")
def test_walks_and_falls_access_only_their_memory(kinds: list[Kind]) -> None:
    """And what they are compiled from gives no warning."""
    flags = (*sanitizers(), *WARNINGS)
    libraries = [sanitized_kernel(ROBOTS[name], precision, flags) for name, precision in kinds]
    expected = []
    for name, precision in kinds:
        kernel = native_kernel(ROBOTS[name], precision)
        assert kernel is not None
        expected.append(digests(kernel, ROBOTS[name]))
    # One process for all of them: it takes a second to start.
    assert run_sanitized(f"sanitized_walks({kinds!r})", *libraries).split() == expected


def sanitized_kernel(robot: Robot, precision: Precision, flags: tuple[str, ...]) -> Path:
    library = build_library(
        "kernel-sanitized",
        kernel_identity(robot, precision),
        lambda: kernel_source(robot, precision),
        extra_flags=flags,
    )
    assert library is not None
    return library


def test_inferences_access_only_their_memory() -> None:
    source = inference_source()
    library = build_library(
        "inference-sanitized", source.encode(), lambda: source, extra_flags=sanitizers()
    )
    assert library is not None
    assert run_sanitized("sanitized_tables()", library) == digest_of_tables(None)


def test_the_sanitizers_detect_planted_errors(tmp_path: Path) -> None:
    source = (
        "int past_the_end(const int *values, int n) { return values[n]; }\n"
        "int overflow(int value) { return value + 1; }\n"
    )
    library = build_library("faulty", source.encode(), lambda: source, extra_flags=sanitizers())
    assert library is not None
    calls = {"signed integer overflow": "overflow(2147483647)"}
    if address_sanitizer():
        calls["heap-buffer-overflow"] = "past_the_end(values, 1000)"
    for report, call in calls.items():
        done = run_python(
            "import ctypes, os\nvalues = ctypes.create_string_buffer(4000)\n"
            f"ctypes.CDLL(os.environ['LIBRARY']).{call}",
            LIBRARY=str(library),
            **preloaded(),
        )
        assert done.returncode != 0
        assert report in done.stderr
