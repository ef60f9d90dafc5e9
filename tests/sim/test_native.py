"""Compilation: cached, shared between processes, optional, and atomic."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from gaitswarm.sim.assembly import PHYSICS_RATE, plan_walk
from gaitswarm.sim.compiler.compilation import (
    COMPILER_MEMORY,
    load_library,
    vector_header,
)
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.errors import KernelBuildError, SimulationInputError
from gaitswarm.sim.kernel.dynamics.kinds import robot_constants
from gaitswarm.sim.kernel.native import NativeKernel, native_kernel
from gaitswarm.sim.kernel.parameters import Layout
from gaitswarm.sim.kernel.walk import Coding
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotFiles, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import prepare
from tests.examples.paths import copy_package
from tests.examples.walks import PUBLISHED_A
from tests.sim.processes import ROOT, run_python

pytestmark = pytest.mark.slow

QUADRUPED = ROOT / "examples" / "quadruped"


def test_a_library_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    calls: list[int] = []

    def source() -> str:
        calls.append(1)
        return "int answer(void) { return 42; }"

    for _ in range(2):
        library = load_library("answer", b"one", source)
        assert library is not None
        assert library.answer() == 42
    assert len(calls) == 1
    load_library("answer", b"another identity", source)
    assert len(calls) == 2


def test_a_source_with_errors_is_reported_and_leaves_no_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(KernelBuildError, match="error"):
        load_library("broken", b"", lambda: "int f( {")
    assert not [path for path in (tmp_path / "gaitswarm").iterdir() if path.suffix != ".lock"]


def test_processes_that_start_together_share_one_compilation(tmp_path: Path) -> None:
    code = (
        "from gaitswarm.sim.compiler.compilation import load_library\n"
        "print(load_library('race', b'', lambda: 'int f(void) { return 7; }').f())"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path)}
    running = [
        subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE)
        for _ in range(2)
    ]
    assert [process.communicate(timeout=60)[0].strip() for process in running] == [b"7"] * 2
    assert len(list((tmp_path / "gaitswarm").glob("race-*.so"))) == 1


def test_a_process_with_a_warm_cache_needs_neither_casadi_nor_pinocchio() -> None:
    assert native_kernel(load_robot(DEFAULT_ROBOT)) is not None
    done = run_python(
        "import sys\n"
        "import numpy as np\n"
        "from gaitswarm.sim.controllers import CONTROLLERS\n"
        "from gaitswarm.sim.scenario import SCENARIOS\n"
        "from gaitswarm.sim.simulate import simulate\n"
        "design = CONTROLLERS['fuzzy-pi'].published['A']\n"
        "simulate(SCENARIOS[0], 'fuzzy-pi', list(design), np.array([list(design.values())]))\n"
        "print(sorted({'casadi', 'pinocchio', 'ray', 'sqlalchemy', 'fastapi'} & set(sys.modules)))"
    )
    assert done.stdout.strip() == "[]", done.stderr


def test_without_a_compiler_the_interpreter_runs_with_a_warning(tmp_path: Path) -> None:
    done = run_python(
        "import gaitswarm.sim.compiler.compilation as c\n"
        "from gaitswarm.sim.simulate import prepare\nprint(prepare())",
        PATH="",
        CC="",
        XDG_CACHE_HOME=str(tmp_path),
        # Where a private cache would be, which may hold a kernel.
        TMPDIR=str(tmp_path),
    )
    assert done.stdout.strip() == "reference", done.stderr
    assert "no C compiler found" in done.stderr


@pytest.mark.thorough("test_the_interpreter_has_double_precision_alone, without a compiler")
def test_without_a_compiler_single_precision_is_refused_rather_than_computed_in_double(
    tmp_path: Path,
) -> None:
    done = run_python(
        "from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec\n"
        "from gaitswarm.sim.errors import SimulationInputError\n"
        "from gaitswarm.sim.simulate import prepare\n"
        "for asked in (lambda: prepare(precision='single'),\n"
        "              JobSpec(precision='single').check_can_be_simulated):\n"
        "    try:\n"
        "        print(asked())\n"
        "    except (SimulationInputError, ValueError) as error:\n"
        "        print(error)\n",
        PATH="",
        CC="",
        XDG_CACHE_HOME=str(tmp_path),
        TMPDIR=str(tmp_path),
    )
    said = "precision: single needs the compiled kernel; no C compiler found"
    lines = done.stdout.splitlines()
    assert len(lines) == 2 and all(line.startswith(said) for line in lines), done
    assert all("install gcc or clang" in line and "choose double" in line for line in lines)


def test_the_interpreter_has_double_precision_alone() -> None:
    with pytest.raises(
        SimulationInputError, match="precision: the reference kernel supports double"
    ):
        prepare("szabadka2", backend="reference", precision="single")


def test_sine_and_cosine_are_accurate_to_the_last_bits(tmp_path: Path) -> None:
    source = vector_header() + (
        "void both(const double *x, double *s, double *c, int64_t n)\n"
        "{ for (int64_t k = 0; k < n; k++) { vec a, b; vec_sincos(SPLAT(x[k]), &a, &b);\n"
        "  s[k] = a[0]; c[k] = b[0]; } }"
    )
    library = load_library("sincos-check", source.encode(), lambda: source)
    assert library is not None
    import ctypes

    x = np.concatenate([np.linspace(-20, 20, 20001), np.random.default_rng(1).normal(size=5000)])
    sine, cosine = np.empty_like(x), np.empty_like(x)
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (x, sine, cosine)]
    library.both(*pointers, ctypes.c_int64(len(x)))
    assert np.abs(sine - np.sin(x)).max() < 2.5e-16
    assert np.abs(cosine - np.cos(x)).max() < 2.5e-16


def _compiler_that(folder: Path, does: str) -> str:
    """A C compiler of this name and version that does so when it is to compile."""
    script = folder / "cc"
    script.write_text(
        "#!/bin/sh\n"
        'case "$*" in *--version*) echo "scripted compiler 1.0"; exit 0;; esac\n'
        f"{does}\n"
    )
    script.chmod(0o755)
    return str(script)


def test_a_compiler_that_takes_too_long_is_ended_with_all_that_it_started(tmp_path: Path) -> None:
    alive = tmp_path / "alive"
    os.mkfifo(alive)
    slow = _compiler_that(tmp_path, f'sleep 1000 > "{alive}" & wait')
    cache = tmp_path / "cache"
    code = (
        "from gaitswarm.sim.compiler.compilation import load_library\n"
        "load_library('slow', b'', lambda: 'int f(void) { return 7; }', time_limit=3.0)"
    )
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(run_python, code, CC=slow, XDG_CACHE_HOME=str(cache))
        # Opens when the compiler's child does, and ends when no process holds it open.
        assert alive.read_bytes() == b""
        done = running.result()
    assert "KernelBuildError" in done.stderr
    assert "did not compile slow" in done.stderr
    assert "within 3 s" in done.stderr
    assert list((cache / "gaitswarm").iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="no other system has these limits for sure")
def test_a_compiler_has_limits_of_memory_and_of_a_processors_time(tmp_path: Path) -> None:
    tells = _compiler_that(tmp_path, "echo limits $(ulimit -d) $(ulimit -t) >&2; exit 1")
    code = (
        "from gaitswarm.sim.compiler.compilation import load_library\n"
        "load_library('limited', b'', lambda: '', time_limit=7.5)"
    )
    done = run_python(code, CC=tells, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert f"limits {COMPILER_MEMORY >> 10} 8" in done.stderr


LOAD_QUADRUPED = """
import os
from pathlib import Path
from gaitswarm.sim.kernel.dynamics.kinds import robot_constants
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.robot import RobotFiles, load_robot
files = Path(os.environ["FILES"])
toml, urdf = ((files / f"robot.{kind}").read_text() for kind in ("toml", "urdf"))
print(native_kernel(load_robot(RobotFiles(toml=toml, urdf=urdf))).backend)
"""
COMPILE_ANOTHER = """
import os, threading
from pathlib import Path
from gaitswarm.sim.controllers.fuzzy_pi import FuzzyPi
from gaitswarm.sim.errors import KernelBuildError, SimulationInputError
from gaitswarm.sim.kernel.dynamics.kinds import robot_constants
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.robot import load_robot
def compile_another():
    try:
        native_kernel(load_robot("szabadka2"))
    except KernelBuildError:
        print("and the other one was refused")
thread = threading.Thread(target=compile_another)
thread.start()
Path(os.environ["STARTED"]).read_text()
"""
GO_ON = """
Path(os.environ["GATE"]).write_text("go on\\n")
thread.join()
"""


@pytest.mark.thorough(
    "test_a_kernel_that_is_being_built_holds_up_only_those_who_need_it_and_are_not_stopped"
)
def test_a_kernel_loads_while_another_one_is_compiled(tmp_path: Path) -> None:
    started, gate = tmp_path / "started", tmp_path / "gate"
    gated = _compiler_that(
        tmp_path,
        f'[ -e "{gate}" ] || exec cc "$@"\necho > "{started}"; read line < "{gate}"; exit 1',
    )
    environment = {"CC": gated, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    environment |= {"FILES": str(QUADRUPED), "STARTED": str(started), "GATE": str(gate)}
    ready = run_python(LOAD_QUADRUPED, **environment)
    assert ready.returncode == 0, ready.stderr
    os.mkfifo(started)
    os.mkfifo(gate)
    held_open = os.open(gate, os.O_RDWR)
    try:
        done = run_python(COMPILE_ANOTHER + LOAD_QUADRUPED + GO_ON, 60.0, **environment)
    finally:
        os.write(held_open, b"the compiler may end\n")
        os.close(held_open)
    assert done.stdout.split("\n") == ["native", "and the other one was refused", ""], done.stderr


def test_integer_overflow_wraps() -> None:
    source = "int grows(int value) { return value + 1 > value; }"
    library = load_library("wrapping-check", source.encode(), lambda: source)
    assert library is not None
    assert library.grows(1) == 1
    assert library.grows(2**31 - 1) == 0


def test_a_source_is_derived_without_the_files_that_its_identity_leaves_out() -> None:
    done = run_python(
        "import sys\n"
        "from gaitswarm.sim.kernel.emitted.source import kernel_source\n"
        "from gaitswarm.sim.robot import load_robot\n"
        "kernel_source(load_robot('szabadka2'))\n"
        "print(*sorted(name for name in sys.modules if name.startswith('gaitswarm.sim.kernel.')))"
    )
    derived_by = {name.removeprefix("gaitswarm.sim.kernel.") for name in done.stdout.split()}
    assert {"dynamics.articulated_body", "emitted.emit_c", "emitted.source"} <= derived_by, (
        done.stderr
    )
    assert {name.split(".")[0] for name in derived_by} == {"dynamics", "emitted", "parameters"}


def test_a_robot_may_have_any_name() -> None:
    toml, urdf = ((QUADRUPED / f"robot.{kind}").read_text() for kind in ("toml", "urdf"))
    named = RobotFiles(toml=toml.replace('name = "quadruped"', 'name = "a/b"', 1), urdf=urdf)
    assert load_robot(named).description.name == "a/b"
    assert prepare(named) == "native"


IDENTITIES = """
import os, sys
from pathlib import Path
import gaitswarm.sim.kernel
from gaitswarm.sim.kernel.emitted.source import kernel_identity
from gaitswarm.sim.robot import load_robot
robot, folder = load_robot("szabadka2"), Path(gaitswarm.sim.kernel.__file__).parent
for name in ["unchanged", *sys.argv[1:]]:
    # What a process has read of the files it keeps, so each is looked at by a process of its own.
    if (child := os.fork()) == 0:
        if name != "unchanged":
            with (folder / name).open("a") as file:
                file.write("\\n")
        print(name, kernel_identity(robot).hex(), flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""


@pytest.mark.thorough("test_a_source_is_derived_without_the_files_that_its_identity_leaves_out")
def test_an_identity_changes_with_every_file_that_generates_a_source(
    tmp_path: Path,
) -> None:
    used = run_python(
        "import sys\n"
        "from gaitswarm.sim.kernel.emitted import emit_c, pieces, source\n"
        "print(*(module.__file__ for name, module in sys.modules.items()"
        " if name.startswith('gaitswarm.sim.kernel.')), sep='\\n')"
    )
    kernel = ROOT / "gaitswarm/sim/kernel"
    files = [
        *(str(path.relative_to(kernel)) for path in kernel.rglob("*.[ch]")),
        *(str(Path(line).relative_to(kernel)) for line in used.stdout.splitlines()),
    ]
    assert {
        "emitted/tick.c", "emitted/pool.c", "emitted/pieces.py", "dynamics/limb.py", "parameters.py"
    } < set(files)  # fmt: skip
    copy_package(tmp_path)
    done = subprocess.run(
        [sys.executable, "-B", "-c", IDENTITIES, *files, "emitted/a_new_law.py", "reference.py"],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )
    *identities, last = [line.split()[1] for line in done.stdout.splitlines()]
    assert len(identities) == len(set(identities)) == 2 + len(files)
    assert last == identities[-1], "the reference is no part of the source"


def test_a_library_whose_structures_differ_is_refused_with_its_name(robot: Robot) -> None:
    right = {
        **dict.fromkeys(("lanes", "single", "integrands"), 1),
        "joints": 18,
        "parameters": Layout(robot).size,
        "internal_state_size": 0,
        "log_width": 85,
        "constants": len(robot_constants(robot)),
        "size_of_coding": 88,
        "size_of_table": 64,
        "size_of_walker": 576,
        "size_of_lane_use": 32,
        "size_of_call": 48,
        "size_of_pool": 24,
    }

    def made_of(sizes: dict[str, int]) -> NativeKernel:
        source = "void gaitswarm_walk(void) {}\nvoid gaitswarm_left(void) {}\n" + "\n".join(
            f"int gaitswarm_{name}(void) {{ return {size}; }}" for name, size in sizes.items()
        )
        library = load_library("border-check", source.encode(), lambda: source)
        assert library is not None
        return NativeKernel(robot, library)

    assert made_of(right).lanes == 1
    for name in right.keys() - {"lanes", "single", "integrands"}:
        with pytest.raises(KernelBuildError, match=rf"szabadka2 .* its {name} is 7, not"):
            made_of(right | {name: 7})


def test_an_inference_is_refused_by_the_compiled_kernel(robot: Robot) -> None:
    kernel = native_kernel(robot)
    plan = plan_walk(robot, SCENARIOS[0], 1.0 / PHYSICS_RATE)
    assert kernel is not None and plan is not None
    with pytest.raises(SimulationInputError, match="runs tables only"):
        kernel.walk([plan(FuzzyPi().without_table(PUBLISHED_A))], Coding.of(robot, 10), log=False)
