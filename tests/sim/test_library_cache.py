"""Cache of compiled libraries: never loaded damaged, stored durably, swept when unused."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import hashlib
import os
import stat
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitswarm.sim.compiler.cache import KEPT_UNUSED_DAYS, SIZE_VARIABLE
from gaitswarm.sim.compiler.compilation import load_library
from gaitswarm.sim.errors import KernelBuildError
from tests.sim.processes import run_python

pytestmark = pytest.mark.slow

SOURCE = 'const char *answer(void) { return "the right answer"; }'
ASK = f"""
import ctypes
from gaitswarm.sim.compiler.compilation import load_library
library = load_library("answer", b"", lambda: {SOURCE!r})
library.answer.restype = ctypes.c_char_p
print(library.answer().decode())
"""
NO_COMPILER = {"PATH": "", "CC": ""}
LONG_AGO = time.time() - (KEPT_UNUSED_DAYS + 1) * 86400


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "gaitswarm"


def built(cache: Path, name: str = "answer") -> Path:
    """A library that was compiled into the cache."""
    assert load_library(name, b"", lambda: SOURCE) is not None
    (library,) = cache.glob(f"{name}-*.so")
    return library


def replaced(path: Path, content: bytes) -> None:
    """By rename: a library loaded by this process is unchanged."""
    other = path.with_suffix(".new")
    other.write_bytes(content)
    other.replace(path)


def emptied(library: Path) -> None:
    replaced(library, b"")


def halved(library: Path) -> None:
    content = library.read_bytes()
    replaced(library, content[: len(content) // 2])


def edited(library: Path) -> None:
    content = library.read_bytes()
    assert content.count(b"the right answer") == 1
    replaced(library, content.replace(b"the right answer", b"the wrong answer"))


def without_checksum(library: Path) -> None:
    library.with_name(library.name + ".sha256").unlink()


DAMAGES = pytest.mark.parametrize("damage", [emptied, halved, edited, without_checksum])


@pytest.mark.variants("halved")
@DAMAGES
def test_a_damaged_library_is_built_again(cache: Path, damage: Callable[[Path], None]) -> None:
    library = built(cache)
    sound = library.read_bytes()
    damage(library)
    done = run_python(ASK, XDG_CACHE_HOME=str(cache.parent))
    assert done.stdout.strip() == "the right answer", (done.returncode, done.stderr)
    assert library.read_bytes() == sound


@pytest.mark.variants("edited")
@DAMAGES
def test_a_damaged_library_without_a_compiler_is_refused_with_the_remedy(
    cache: Path, damage: Callable[[Path], None]
) -> None:
    library = built(cache)
    damage(library)
    done = run_python(ASK, XDG_CACHE_HOME=str(cache.parent), **NO_COMPILER)
    assert done.returncode == 1
    assert f"KernelBuildError: {library} is damaged" in done.stderr
    assert "install gcc or clang" in done.stderr


def test_an_intact_library_needs_no_compiler(cache: Path) -> None:
    built(cache)
    done = run_python(ASK, XDG_CACHE_HOME=str(cache.parent), **NO_COMPILER)
    assert done.stdout.strip() == "the right answer", done.stderr


def test_an_intact_library_is_loaded_from_a_cache_that_cannot_be_written(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = built(cache)
    os.utime(library, (LONG_AGO, LONG_AGO))
    before = {path.name: path.stat().st_mtime for path in cache.iterdir()}

    def read_only(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    # Root may write anywhere, so the calls that write are made to fail.
    for name in ("utime", "mkdir", "replace", "unlink"):
        monkeypatch.setattr(os, name, read_only)
    assert load_library("answer", b"", lambda: SOURCE) is not None
    assert {path.name: path.stat().st_mtime for path in cache.iterdir()} == before


def test_a_checksum_is_as_sha256sum_writes_it(cache: Path) -> None:
    library = built(cache)
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    checksum = library.with_name(library.name + ".sha256")
    assert checksum.read_text() == f"{digest}  {library.name}\n"


def test_a_library_that_cannot_be_loaded_is_an_error_with_the_remedy(cache: Path) -> None:
    library = built(cache, "unloadable")
    other = cache.parent / "elsewhere" / "gaitswarm"
    other.mkdir(parents=True)
    (other / library.name).write_text("no library")
    digest = hashlib.sha256(b"no library").hexdigest()
    (other / f"{library.name}.sha256").write_text(f"{digest}  {library.name}\n")
    code = ASK.replace("answer", "unloadable", 1)
    done = run_python(code, XDG_CACHE_HOME=str(other.parent))
    assert f"KernelBuildError: {other / library.name} cannot be loaded" in done.stderr
    assert "XDG_CACHE_HOME" in done.stderr


def test_a_library_is_on_disk_before_it_has_its_name_and_the_name_afterwards(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[tuple[int, bool]] = []
    fsync = os.fsync

    def recorded(descriptor: int) -> None:
        fsync(descriptor)
        flushed.append((os.fstat(descriptor).st_ino, any(cache.glob("*.so"))))

    monkeypatch.setattr(os, "fsync", recorded)
    library = built(cache)
    checksum = library.with_name(library.name + ".sha256")
    expected = {(library.stat().st_ino, False), (checksum.stat().st_ino, False)}
    assert set(flushed[:-1]) == expected
    assert flushed[-1] == (cache.stat().st_ino, True)


def test_one_builds_at_a_time_also_after_builds_that_failed(cache: Path) -> None:
    """Each releases the lock to the next one while others arrive."""
    building = threading.Lock()
    overlaps: list[str] = []

    def source() -> str:
        if not building.acquire(blocking=False):
            overlaps.append(threading.current_thread().name)
            raise KernelBuildError("refused")
        threading.Event().wait(0.02)
        building.release()
        raise KernelBuildError("refused")

    def build_again_and_again() -> None:
        for _ in range(5):
            with pytest.raises(KernelBuildError, match="refused"):
                load_library("answer", b"", source)

    threads = [threading.Thread(target=build_again_and_again) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not overlaps
    assert list(cache.iterdir()) == []


def test_a_build_sweeps_what_dead_processes_and_old_versions_left(cache: Path) -> None:
    cache.mkdir()
    gone, held = f"kernel-gone-{'0' * 24}", f"kernel-held-{'1' * 24}"
    old, young = f"kernel-old-{'2' * 24}-abcdef01.so", f"kernel-young-{'3' * 24}-abcdef01.so"
    (cache / f"{gone}-abcdef01.so.4711.tmp").touch()
    (cache / f"{gone}-k2x.tmp").mkdir()
    (cache / f"{gone}-k2x.tmp" / "kernel.c").touch()
    (cache / f"{gone}.lock").touch()
    (cache / f"{gone}-abcdef01.so.sha256").touch()
    for name in (old, young):
        (cache / name).touch()
        (cache / f"{name}.sha256").touch()
    os.utime(cache / old, (LONG_AGO, LONG_AGO))
    stay = {"notes.txt", "unrelated.lock", "other.so", young, f"{young}.sha256"}
    stay |= {f"{held}.lock", f"{held}-k3x.tmp"}
    for name in stay:
        (cache / name).touch()
    os.utime(cache / "other.so", (LONG_AGO, LONG_AGO))
    with (cache / f"{held}.lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        library = built(cache)
    left = {path.name for path in cache.iterdir()}
    assert left == stay | {library.name, f"{library.name}.sha256"}


def test_a_library_in_use_stays_however_old_it_is(cache: Path) -> None:
    library = built(cache)
    os.utime(library, (LONG_AGO, LONG_AGO))
    assert load_library("answer", b"", lambda: SOURCE) is not None
    built(cache, "another")
    assert library.exists()


def stored(cache: Path, name: str, megabytes: int, *, hours_ago: float) -> Path:
    """A library that another process built and last used at a given age."""
    cache.mkdir(exist_ok=True)
    library = cache / f"kernel-{name}-{'0' * 24}-abcdef01.so"
    library.write_bytes(b"")
    os.truncate(library, megabytes << 20)
    library.with_name(f"{library.name}.sha256").touch()
    then = time.time() - 3600.0 * hours_ago
    os.utime(library, (then, then))
    return library


def test_beyond_its_size_a_cache_loses_the_libraries_that_were_used_longest_ago(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SIZE_VARIABLE, str(8 << 20))
    oldest, old, young = (
        stored(cache, name, 4, hours_ago=hours)
        for name, hours in (("oldest", 72.0), ("old", 48.0), ("young", 1.0))
    )
    library = built(cache)
    assert not oldest.exists()
    assert not oldest.with_name(f"{oldest.name}.sha256").exists()
    assert not old.exists(), "what was just built counts as well"
    assert young.exists()
    assert library.exists()


def test_a_library_that_is_used_counts_as_young(cache: Path) -> None:
    library = built(cache)
    two_hours_ago = time.time() - 7200.0
    os.utime(library, (two_hours_ago, two_hours_ago))
    # Another process uses it, and a third one makes room.
    assert run_python(ASK, XDG_CACHE_HOME=str(cache.parent)).returncode == 0
    unused = stored(cache, "unused", 4, hours_ago=1.0)
    ask = ASK.replace('"answer", b""', '"other", b"other"')
    environment = {"XDG_CACHE_HOME": str(cache.parent), SIZE_VARIABLE: str(1 << 20)}
    assert run_python(ask, **environment).returncode == 0
    assert not unused.exists()
    assert library.exists()


def test_a_process_removes_nothing_that_it_uses_itself(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SIZE_VARIABLE, "0")
    first = built(cache)
    foreign = stored(cache, "foreign", 1, hours_ago=0.0)
    second = built(cache, "another")
    assert first.exists()
    assert second.exists()
    assert not foreign.exists()


def test_a_library_that_another_process_is_building_is_not_removed(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SIZE_VARIABLE, "0")
    foreign = stored(cache, "foreign", 1, hours_ago=1.0)
    with (cache / f"kernel-foreign-{'0' * 24}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        built(cache)
    assert foreign.exists()


def test_a_library_that_is_removed_before_it_is_loaded_is_built_again(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    load = ctypes.CDLL
    met: list[str] = []

    def too_late(path: str) -> ctypes.CDLL:
        if not met:
            Path(path).unlink()
        met.append(path)
        return load(path)

    monkeypatch.setattr(ctypes, "CDLL", too_late)
    assert built(cache).exists()
    assert len(met) == 2


@pytest.mark.parametrize("size", ["much", "-1", "1e9", "1GB"])
def test_an_invalid_size_limit_is_refused_by_its_variable(
    cache: Path, monkeypatch: pytest.MonkeyPatch, size: str
) -> None:
    monkeypatch.setenv(SIZE_VARIABLE, size)
    with pytest.raises(KernelBuildError, match=f"{SIZE_VARIABLE}: '{size}' is not a number"):
        load_library("answer", b"", lambda: SOURCE)


def open_to_all(private: Path) -> None:
    private.mkdir()
    private.chmod(0o777)


def linked_elsewhere(private: Path) -> None:
    private.symlink_to(private.parent)


@pytest.mark.parametrize("planted", [open_to_all, linked_elsewhere])
def test_a_foreign_private_directory_matters_only_where_the_usual_one_cannot_be_used(
    cache: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    planted: Callable[[Path], None],
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    private = tmp_path / "tmp" / f"gaitswarm-{os.getuid()}"
    planted(private)
    library = built(cache)
    assert load_library("answer", b"", lambda: SOURCE) is not None
    # Root may write anywhere, so a file in the directory's place stands for one of someone else.
    monkeypatch.setenv("XDG_CACHE_HOME", str(library))
    with pytest.raises(KernelBuildError, match=f"{private} .*set XDG_CACHE_HOME"):
        load_library("answer", b"", lambda: SOURCE)
    assert not list(private.glob("answer-*"))


@pytest.mark.parametrize("planted", [open_to_all, linked_elsewhere])
def test_no_library_is_loaded_from_a_directory_that_others_can_write(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, planted: Callable[[Path], None]
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    planted(cache)
    built(tmp_path / "tmp" / f"gaitswarm-{os.getuid()}")
    assert not list(cache.glob("answer-*"))


def test_where_the_cache_cannot_be_written_a_private_one_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "image").mkdir()
    # Root may write anywhere, so a file in the directory's place stands for a read-only one.
    (tmp_path / "image" / "gaitswarm").write_text("not a directory")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "image"))
    private = tmp_path / f"gaitswarm-{os.getuid()}"
    library = built(private, "shipped")
    assert stat.S_IMODE(private.stat().st_mode) == 0o700
    before = library.stat()
    assert load_library("shipped", b"", lambda: SOURCE) is not None
    assert library.stat().st_ino == before.st_ino


def test_a_user_without_a_home_has_the_private_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    built(tmp_path / f"gaitswarm-{os.getuid()}")


@pytest.mark.variants("'a/b'", "'../../up'")
@pytest.mark.parametrize("name", ["a/b", "../../up", "[*]", "nul\0", "", "ü" * 300], ids=ascii)
def test_any_robot_name_makes_a_valid_file_name(cache: Path, name: str) -> None:
    library = load_library(name, b"", lambda: SOURCE)
    assert library is not None
    library.answer.restype = ctypes.c_char_p
    assert library.answer() == b"the right answer"
    assert len(list(cache.glob("*.so"))) == 1
    assert load_library(name, b"", lambda: "refused { if compiled again") is not None
