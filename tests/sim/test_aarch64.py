"""The kernel on another architecture: compiled for aarch64 here, and run by an emulator."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from gaitswarm.sim.compiler.compilation import target
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.emitted.source import kernel_source
from gaitswarm.sim.kernel.native import NativeKernel, native_kernel
from gaitswarm.sim.scenario import SCENARIOS
from tests.sim.emulated import EmulatedLibrary, tools_for_arm
from tests.sim.sanitized_walks import ROBOTS, digest_of_walks
from tests.sim.test_vectors import PRECISIONS, RESULTS, bits, call, source, triples

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def emulator() -> Iterator[list[str]]:
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield tools_for_arm(monkeypatch)


@pytest.mark.variants("plain-double")
@pytest.mark.parametrize(
    ("name", "precision"),
    [
        ("plain", "double"),
        ("plain", "single"),
        ("all internal state", "double"),
        ("torque", "double"),
        ("torque", "single"),
    ],
)
def test_walks_and_falls_have_the_same_bits_on_aarch64(
    name: str, precision: Precision, emulator: list[str], tmp_path: Path
) -> None:
    robot = ROBOTS[name]
    here = native_kernel(robot, precision)
    assert here is not None
    library = EmulatedLibrary(kernel_source(robot, precision), tmp_path, emulator)
    there = NativeKernel(robot, cast(ctypes.CDLL, library))
    assert there.lanes == (2 if precision == "double" else 4)
    # Each step is emulated, and with backlash a walk has sixteen times as many.
    scenarios = SCENARIOS[: 1 if robot.has_backlash else 3]
    expected, found = (
        digest_of_walks(kernel, robot, logs=[True], scenarios=scenarios) for kernel in (here, there)
    )
    assert found == expected


@pytest.mark.parametrize("precision", PRECISIONS)
def test_operations_have_the_same_bits_on_aarch64(
    precision: Precision, emulator: list[str], tmp_path: Path
) -> None:
    library = EmulatedLibrary(source(precision), tmp_path, emulator)
    a, b, c = triples(precision)
    for name, inputs in (("fused", (a, b, c)), ("others", (a, b))):
        found = np.empty((len(a), RESULTS[name]), dtype=a.dtype)
        getattr(library, f"gaitswarm_{name}")(*inputs, found, len(a))
        np.testing.assert_array_equal(bits(found), bits(call(target(), name, *inputs)))
