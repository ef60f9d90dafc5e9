"""Compilation: cached, shared, done without, and never half-done."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sim.compiler.compilation import load_library, vector_header
from sim.errors import KernelBuildError
from sim.kernel.native import native_kernel
from sim.robot import load_robot

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def run_python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "default", "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


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


def test_a_refused_source_says_why_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(KernelBuildError, match="error"):
        load_library("broken", b"", lambda: "int f( {")
    assert not [path for path in (tmp_path / "gaitswarm").iterdir() if path.suffix != ".lock"]


def test_processes_that_start_together_share_one_compilation(tmp_path: Path) -> None:
    code = (
        "from sim.compiler.compilation import load_library\n"
        "print(load_library('race', b'', lambda: 'int f(void) { return 7; }').f())"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path)}
    running = [
        subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE)
        for _ in range(4)
    ]
    assert [process.communicate(timeout=60)[0].strip() for process in running] == [b"7"] * 4
    assert len(list((tmp_path / "gaitswarm").glob("race-*.so"))) == 1


def test_a_process_with_a_warm_cache_needs_neither_casadi_nor_pinocchio() -> None:
    assert native_kernel(load_robot("szabadka2")) is not None
    done = run_python(
        "import sys\n"
        "from sim.benchmark import measure\n"
        "measure(repeats=1, walkers=1)\n"
        "print(sorted({'casadi', 'pinocchio', 'ray', 'sqlalchemy', 'fastapi'} & set(sys.modules)))"
    )
    assert done.stdout.strip() == "[]", done.stderr


def test_without_a_compiler_the_interpreter_serves_and_says_so(tmp_path: Path) -> None:
    done = run_python(
        "import sim.compiler.compilation as c\nfrom sim.simulate import prepare\nprint(prepare())",
        PATH="",
        CC="",
        XDG_CACHE_HOME=str(tmp_path),
    )
    assert done.stdout.strip() == "reference", done.stderr
    assert "no C compiler found" in done.stderr


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


def test_where_the_cache_cannot_be_written_a_private_one_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "image"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    source = "int f(void) { return 1; }"
    assert load_library("shipped", b"", lambda: source) is not None
    # Root may write anywhere, so a file in the directory's place stands for a read-only one.
    shipped = tmp_path / "image" / "gaitswarm"
    shipped.rename(tmp_path / "kept")
    shipped.write_text("not a directory")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "image"))
    assert load_library("shipped", b"", lambda: source) is not None
    private = tmp_path / f"gaitswarm-{os.getuid()}"
    assert len(list(private.glob("shipped-*.so"))) == 1
    assert private.stat().st_mode & 0o077 == 0
