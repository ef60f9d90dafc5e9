"""Kernels shipped in a wheel, for machines without a compiler or a cache."""

from __future__ import annotations

from pathlib import Path

import pytest

from gaitswarm.sim.compiler.compilation import ARM, X86, build_library, load_library
from gaitswarm.sim.errors import KernelBuildError
from gaitswarm.sim.robot import DEFAULT_ROBOT
from scripts.prebuilt import main
from tests.sim.emulated import tools_for_arm

pytestmark = pytest.mark.slow

ANSWER = "int answer(void) { return 42; }"
# ELF's names for machines: EM_X86_64 and EM_AARCH64.
MACHINES = {X86: 62, ARM: 183}


@pytest.fixture
def prebuilt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory with a library that was built beforehand; and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("gaitswarm.sim.compiler.compilation.PREBUILT", tmp_path / "prebuilt")
    monkeypatch.delenv("CC", raising=False)
    assert build_library("robot", b"", lambda: ANSWER, directory=tmp_path / "prebuilt")
    return tmp_path / "prebuilt"


def refuse() -> str:
    raise KernelBuildError("compiled")


def test_a_prebuilt_library_saves_the_compilation_whatever_the_robot_is_called(
    prebuilt: Path,
) -> None:
    library = load_library("the same robot", b"", refuse)
    assert library is not None
    assert library.answer() == 42
    assert not (prebuilt.parent / "cache").exists()
    with pytest.raises(KernelBuildError, match="compiled"):
        load_library("robot", b"another one", refuse)


def test_a_damaged_prebuilt_library_is_recompiled_into_the_cache(prebuilt: Path) -> None:
    (library,) = prebuilt.glob("*.so")
    library.write_bytes(b"")
    assert load_library("robot", b"", lambda: ANSWER) is not None
    assert len(list((prebuilt.parent / "cache").rglob("*.so"))) == 1


def test_a_compiler_named_by_cc_takes_precedence_over_prebuilt_libraries(
    prebuilt: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "cc")
    with pytest.raises(KernelBuildError, match="compiled"):
        load_library("robot", b"", refuse)


@pytest.mark.thorough("kernels of all machines are built, which `make wheel` does")
def test_kernels_are_built_for_other_machines_and_old_ones_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools_for_arm(monkeypatch)
    (tmp_path / "kernel-of-before.so").touch()
    main(["--targets", ARM, "--robots", DEFAULT_ROBOT, "--directory", str(tmp_path)])
    libraries = sorted(tmp_path.glob("*.so"))
    assert [path.name.split("-")[0] for path in libraries] == ["inference", "kernel", "kernel"]
    for path in libraries:
        header = path.read_bytes()[:20]
        assert header[:4] == b"\x7fELF"
        assert int.from_bytes(header[18:20], "little") == MACHINES[ARM]
