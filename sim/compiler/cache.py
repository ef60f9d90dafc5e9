"""Cache of compiled libraries on disk: found only if intact, stored atomically, swept when unused.

A library has its SHA-256 in a file next to it: loading a damaged one could give wrong numbers.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from gaitswarm.sim.errors import KernelBuildError

KEPT_UNUSED_DAYS: Final = 90
"""Libraries not loaded for this long are removed when another one is built."""

SIZE_VARIABLE: Final = "GAITSWARM_KERNEL_CACHE_BYTES"
"""Environment variable: limit of the libraries' total size; beyond it, the least recently loaded
ones are removed when another one is built."""

DEFAULT_SIZE: Final = 1 << 30

_USE_RESOLUTION: Final = 60.0
"""Resolution of the recorded time of use [s]."""

_in_use: Final[set[Path]] = set()
"""Libraries that this process has found or built and may have loaded: it never removes them."""

_OWN_FILE: Final = re.compile(r"(?P<stem>.+-[0-9a-f]{24})(-.+\.(so|sha256|tmp)|\.lock)")


def find(pattern: str, directory: Path | None = None) -> tuple[Path | None, tuple[Path, ...]]:
    """Look in the usual directory, then in the private one; also return damaged libraries."""
    damaged: list[Path] = []
    for place in _directories() if directory is None else (directory,):
        try:
            candidates = sorted(place.glob(pattern))
        except OSError:  # not a directory, or not to be read
            continue
        for library in candidates:
            if is_intact(library):
                _in_use.add(library)
                with contextlib.suppress(OSError):  # read-only, e.g. in an image
                    # The time of use, which `_sweep` reads.
                    if library.stat().st_mtime < time.time() - _USE_RESOLUTION:
                        os.utime(library)
                return library, tuple(damaged)
            damaged.append(library)
    return None, tuple(damaged)


def is_intact(library: Path) -> bool:
    """Whether a file can be read and matches its checksum."""
    try:
        recorded = _checksum_of(library).read_text(encoding="ascii", errors="replace").split()
        return recorded[:1] == [hashlib.sha256(library.read_bytes()).hexdigest()]
    except OSError:
        return False


def build(
    stem: str, file: str, make: Callable[[Path], None], directory: Path | None = None
) -> Path:
    """Store a library in the cache, unless another process has done so meanwhile."""
    size = _size_limit()
    place = directory or _writable_directory()
    library = place / file
    try:
        place.mkdir(parents=True, exist_ok=True)
        with _locked(place / f"{stem}.lock"):
            if not is_intact(library):
                with tempfile.TemporaryDirectory(
                    prefix=f"{stem}-", suffix=".tmp", dir=place, ignore_cleanup_errors=True
                ) as scratch:
                    built = Path(scratch) / "library.so"
                    make(built)
                    _put(built, library)
    except OSError as error:
        raise KernelBuildError(
            f"{library} cannot be stored: {error}; set XDG_CACHE_HOME to a writable directory"
        ) from error
    _in_use.add(library)
    if directory is None:
        _sweep(place, size)
    return library


def _put(built: Path, library: Path) -> None:
    checksum = built.with_name("checksum")
    digest = hashlib.sha256(built.read_bytes()).hexdigest()
    checksum.write_text(f"{digest}  {library.name}\n", encoding="ascii")
    for written in (built, checksum):
        _flush(written)
    # A crash between the two leaves a pair that does not match.
    checksum.replace(_checksum_of(library))
    built.replace(library)
    with contextlib.suppress(OSError):  # not every file system can flush a directory
        _flush(library.parent)


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _checksum_of(library: Path) -> Path:
    return library.with_name(f"{library.name}.sha256")


def _directories() -> Iterator[Path]:
    """Directories of libraries. Lazy: the temporary one is checked only if needed."""
    usual = _usual_directory()
    if usual is not None and _is_private(usual):
        yield usual
    # Windows does not report the owner of a directory.
    if hasattr(os, "getuid") and _is_private(private := _private_directory()):
        yield private


def _usual_directory() -> Path | None:
    """`gaitswarm` in $XDG_CACHE_HOME or ~/.cache; None for a user without a home."""
    base = os.environ.get("XDG_CACHE_HOME")
    if base:
        return Path(base) / "gaitswarm"
    try:
        return Path.home() / ".cache" / "gaitswarm"
    except RuntimeError:
        return None


def _private_directory() -> Path:
    return Path(tempfile.gettempdir()) / f"gaitswarm-{os.getuid()}"


def _is_private(directory: Path) -> bool:
    """Return whether no other user (but root) can have put libraries into it, which we execute."""
    if not hasattr(os, "getuid"):
        return True
    try:
        status = directory.lstat()
    except OSError:  # does not exist yet
        return True
    mine = status.st_uid in (os.getuid(), 0) and not status.st_mode & 0o022
    return mine and not stat.S_ISLNK(status.st_mode)


def _writable_directory() -> Path:
    refused: OSError | None = None
    for directory in _directories():
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=directory):
                return directory
        except OSError as error:
            refused = error
    lacks = [
        f"{directory} is not {'writable' if _is_private(directory) else 'private to this user'}"
        for directory in (_usual_directory(), _private_directory())
        if directory is not None
    ]
    raise KernelBuildError(
        f"{' and '.join(lacks)}; set XDG_CACHE_HOME to a writable directory, whose gaitswarm/ no"
        " other user can write"
    ) from refused


@contextlib.contextmanager
def _locked(path: Path, *, wait: bool = True) -> Iterator[bool]:
    """Hold a lock that is released if its process dies; yield whether it is held."""
    while True:
        with path.open("w") as file:
            held = _lock(file.fileno(), wait=wait)
            # The previous holder has removed the file, and another process may have recreated it.
            if held and not _is_at(file.fileno(), path):
                continue
            try:
                yield held
            finally:
                if held:
                    path.unlink(missing_ok=True)
            return


def _lock(descriptor: int, *, wait: bool) -> bool:
    """Return False without a lock; the atomic rename is safe too."""
    try:
        import fcntl  # noqa: PLC0415  not on every system

        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except (ImportError, OSError):
        return False
    return True


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _size_limit() -> int:
    text = os.environ.get(SIZE_VARIABLE) or str(DEFAULT_SIZE)
    if not (text.isascii() and text.isdecimal()):
        raise KernelBuildError(f"{SIZE_VARIABLE}: {text!r} is not a number of bytes")
    return int(text)


def _sweep(directory: Path, size: int) -> None:
    """Remove leftovers of dead processes, and libraries that have not been used for long."""
    oldest = time.time() - KEPT_UNUSED_DAYS * 86400.0
    with contextlib.suppress(OSError):
        for path in sorted(directory.iterdir()):
            match = _OWN_FILE.fullmatch(path.name)
            if match and _is_leftover(path, oldest):
                _remove_unlocked(path, match["stem"])
        libraries = [
            (path.stat().st_mtime, path.stat().st_size, path, match["stem"])
            for path in directory.glob("*.so")
            if (match := _OWN_FILE.fullmatch(path.name))
        ]
        taken = sum(bytes_ for _, bytes_, _, _ in libraries)
        for _, bytes_, path, stem in sorted(libraries):
            if taken <= size:
                break
            if path not in _in_use:
                _remove_unlocked(path, stem)
                taken -= bytes_


def _remove_unlocked(path: Path, stem: str) -> None:
    """Remove a file unless a process that builds its library holds the lock."""
    with contextlib.suppress(OSError), _locked(path.with_name(f"{stem}.lock"), wait=False) as held:
        if held and path.is_dir():
            shutil.rmtree(path)
        elif held:
            path.unlink(missing_ok=True)
            if path.suffix == ".so":
                _checksum_of(path).unlink(missing_ok=True)


def _is_leftover(path: Path, oldest: float) -> bool:
    if path.suffix == ".so":
        return path not in _in_use and path.stat().st_mtime < oldest
    if path.suffix == ".sha256":
        return not path.with_suffix("").exists()
    return True
