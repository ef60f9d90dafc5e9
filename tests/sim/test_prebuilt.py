"""Kernels shipped in a wheel, for machines without a compiler or a cache."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from gaitswarm.sim.compiler.compilation import ARM, X86, build_library, load_library, target
from gaitswarm.sim.errors import KernelBuildError
from gaitswarm.sim.robot import DEFAULT_ROBOT
from scripts.prebuilt import TARGETS, main
from tests.sim.emulated import tools_for_arm
from tests.sim.processes import ROOT, run_python

pytestmark = pytest.mark.slow

ANSWER = "int answer(void) { return 42; }"
WALK = """
from gaitswarm.sim.simulate import prepare
from tests.examples.walks import short_walk, walk
for precision in ("double", "single"):
    done = walk(short_walk(cycle_time=0.4), precision=precision)
    print(prepare(), done.outcome.objectives.tobytes().hex())
"""
PREPARE_ANOTHER = """
from gaitswarm.sim.robot import RobotVariant
from gaitswarm.sim.simulate import prepare
print(prepare(RobotVariant(contact_law="karnopp")))
"""

# The page and the manual, made by `make page` and `make manual`.
BUILT = ("api/page/index.html", "api/manual/docs/index.html")

# ELF's names for machines: EM_X86_64 and EM_AARCH64.
MACHINES = {X86: 62, ARM: 183}


def host_target() -> str:
    """What `scripts.prebuilt` calls this machine's target, or the test is skipped."""
    for name, aim in TARGETS.items():
        if aim == target():
            return name
    pytest.skip(f"NOT TESTED: nothing is built beforehand for {target()}")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Our packages from a wheel with this machine's kernels, unpacked."""
    folder = tmp_path_factory.mktemp("installed")
    source = folder / "source"
    # As in a checkout, with symbolic links in the package.
    ignored = shutil.ignore_patterns("__pycache__", "prebuilt", "page", "manual", "node_modules")
    for name in ("sim", "services", "gaitswarm", "api", "cli"):
        shutil.copytree(ROOT / name, source / name, ignore=ignored, symlinks=True)
    # With files that git ignores, which a wheel contains only if configured.
    for name in ("pyproject.toml", "README.md", ".gitignore"):
        shutil.copy(ROOT / name, source)
    for built in BUILT:
        (source / built).parent.mkdir(parents=True)
        (source / built).write_text("<h1>Built</h1>", encoding="utf-8")
    arguments = ["--targets", host_target(), "--robots", DEFAULT_ROBOT]
    main([*arguments, "--directory", str(source / "sim" / "compiler" / "prebuilt")])
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "--quiet", "--wheel-dir", folder, source], check=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "packages")
    return folder / "packages"


def walk_without_a_compiler(
    packages: Path, empty: Path, code: str = WALK
) -> subprocess.CompletedProcess[str]:
    return run_python(
        code,
        PYTHONPATH=f"{packages}:{ROOT}",
        PATH="",
        CC="",
        XDG_CACHE_HOME=str(empty),
        # Where a private cache would be, which may hold a kernel.
        TMPDIR=str(empty),
    )


@pytest.mark.thorough(
    "test_a_prebuilt_library_saves_the_compilation_whatever_the_robot_is_called, from a wheel"
)
def test_a_machine_without_a_compiler_walks_on_the_wheels_kernels(
    installed: Path, tmp_path: Path
) -> None:
    done = walk_without_a_compiler(installed, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert list(tmp_path.rglob("*.so")) == []
    assert done.stdout == run_python(WALK).stdout
    assert done.stdout.startswith("native ")


def test_a_robot_whose_kernel_the_wheel_does_not_bring_walks_on_the_interpreter(
    installed: Path, tmp_path: Path
) -> None:
    done = walk_without_a_compiler(installed, tmp_path, PREPARE_ANOTHER)
    assert done.stdout == "reference\n", done.stderr
    assert "no C compiler found" in done.stderr


def test_a_damaged_kernel_of_a_wheel_is_refused_with_the_remedy(
    installed: Path, tmp_path: Path
) -> None:
    copied = Path(shutil.copytree(installed, tmp_path / "packages"))
    (kernel,) = copied.glob("gaitswarm/sim/compiler/prebuilt/kernel-double-*.so")
    kernel.write_bytes(kernel.read_bytes()[:-1])
    done = walk_without_a_compiler(copied, tmp_path)
    assert done.returncode == 1
    assert f"{kernel} is damaged" in done.stderr
    assert "install gcc or clang" in done.stderr


@pytest.mark.parametrize("built", BUILT)
def test_a_wheel_contains_the_libraries_built_for_release(installed: Path, built: str) -> None:
    assert (installed / "gaitswarm" / built).is_file()


def test_every_library_of_a_wheel_has_its_checksum(installed: Path) -> None:
    files = {
        path.name for path in (installed / "gaitswarm" / "sim" / "compiler" / "prebuilt").iterdir()
    }
    libraries = {name for name in files if name.endswith(".so")}
    kinds = {"-".join(name.split("-")[:2]) for name in libraries if name.startswith("kernel")}
    assert kinds == {"kernel-single", "kernel-double"}
    assert len(libraries) == len(kinds) + 1
    assert files == libraries | {f"{name}.sha256" for name in libraries}


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
