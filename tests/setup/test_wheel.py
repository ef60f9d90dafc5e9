"""The installed package: one top-level folder, with kernels, page and manual of a release."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from gaitswarm.sim.compiler.compilation import target
from gaitswarm.sim.robot import DEFAULT_ROBOT
from scripts.prebuilt import TARGETS, main
from tests.examples.paths import ROOT
from tests.sim.processes import run_python

pytestmark = pytest.mark.slow

NAMESAKES = ("sim", "services", "api", "cli", "worker", "tests")
"""Modules that a user's folder, or a ROS workspace, may have."""

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


def host_target() -> str:
    """What `scripts.prebuilt` calls this machine's target, or the test is skipped."""
    for name, aim in TARGETS.items():
        if aim == target():
            return name
    pytest.skip(f"NOT TESTED: nothing is built beforehand for {target()}")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel with this machine's kernels, built from a copy of the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
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
    build = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([sys.executable, *build, "--wheel-dir", folder, source], check=True)
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the wheel installs."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture
def crowded(tmp_path: Path) -> Path:
    """A user's folder whose modules and packages have the names of our folders."""
    for name in NAMESAKES[:3]:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise ImportError('the wrong one')\n")
    for name in NAMESAKES[3:]:
        (tmp_path / f"{name}.py").write_text("raise ImportError('the wrong one')\n")
    return tmp_path


def run_in(folder: Path, installed: Path, *command: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder), str(installed)])
    return subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.mark.thorough("a wheel, built with its kernels")
def test_the_wheel_has_one_top_level_package(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (scripts,) = [archive.read(name) for name in names if name.endswith("entry_points.txt")]
    assert b"gaitswarm = gaitswarm.cli.main:main" in scripts
    packages = {name.partition("/")[0] for name in names if ".dist-info/" not in name}
    assert packages == {"gaitswarm"}
    for expected in ("sim/simulate.py", "services/runtime.py", "api/app.py", "cli/main.py"):
        assert f"gaitswarm/{expected}" in names
    for built in BUILT:
        assert f"gaitswarm/{built}" in names


@pytest.mark.thorough("an installed wheel")
def test_library_and_command_work_next_to_modules_of_the_same_names(
    installed: Path, crowded: Path
) -> None:
    program = "import gaitswarm; print(gaitswarm.__file__); print(*gaitswarm.SCENARIOS)"
    imported = run_in(crowded, installed, "-c", program)
    assert imported.returncode == 0, imported.stderr
    assert imported.stdout.startswith(str(installed))
    assert "normal-fast" in imported.stdout

    command = ("-m", "gaitswarm", "simulate", "--design", "published:A", "--json")
    simulated = run_in(crowded, installed, *command)
    assert simulated.returncode == 0, simulated.stderr
    assert '"objectives"' in simulated.stdout


@pytest.mark.thorough("test_a_checksum_is_as_sha256sum_writes_it, in a wheel")
def test_every_library_of_a_wheel_has_its_checksum(installed: Path) -> None:
    files = {
        path.name for path in (installed / "gaitswarm" / "sim" / "compiler" / "prebuilt").iterdir()
    }
    libraries = {name for name in files if name.endswith(".so")}
    kinds = {"-".join(name.split("-")[:2]) for name in libraries if name.startswith("kernel")}
    assert kinds == {"kernel-single", "kernel-double"}
    assert len(libraries) == len(kinds) + 1
    assert files == libraries | {f"{name}.sha256" for name in libraries}


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


@pytest.mark.thorough("test_without_a_compiler_the_interpreter_runs_with_a_warning, from a wheel")
def test_a_robot_whose_kernel_the_wheel_does_not_bring_walks_on_the_interpreter(
    installed: Path, tmp_path: Path
) -> None:
    done = walk_without_a_compiler(installed, tmp_path, PREPARE_ANOTHER)
    assert done.stdout == "reference\n", done.stderr
    assert "no C compiler found" in done.stderr


@pytest.mark.thorough(
    "test_a_damaged_library_without_a_compiler_is_refused_with_the_remedy, from a wheel"
)
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
