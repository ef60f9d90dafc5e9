"""Versions of distributions, and of plug-ins the content of their code as well."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitswarm.sim.plugins.entry_points import Plugin, find_plugins

if TYPE_CHECKING:
    from collections.abc import Iterable

MISSING: Final = "none"
"""In place of the version of a distribution that is not installed."""

_DIGITS: Final = 32

_SHOWN: Final = 12
"""Digits of the digest of a plug-in's code."""

_SUFFIXES: Final = (".py", ".c", ".h", ".so")


def source_digest(root: Path, files: Iterable[Path]) -> str:
    """Digest of source files."""
    digest = hashlib.sha256()
    for file in files:
        content = file.read_bytes()
        digest.update(f"{file.relative_to(root).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:_DIGITS]


def version_of(distribution: str) -> str:
    """The version of a distribution here."""
    known = plugin_versions()
    if distribution in known:
        return known[distribution]
    try:
        return _installed(distribution)
    except metadata.PackageNotFoundError:
        return MISSING


@lru_cache(maxsize=256)
def _installed(distribution: str) -> str:
    """As it is at the first call: every job asks, and to read it takes a millisecond."""
    return metadata.version(distribution)


@lru_cache(maxsize=1)
def plugin_versions() -> dict[str, str]:
    """Versions of all distributions with plug-ins, by name, as they are at the first call."""
    by_name: dict[str, list[Plugin]] = {}
    for plugin in find_plugins():
        by_name.setdefault(plugin.distribution, []).append(plugin)
    return {
        name: f"{plugins[0].version} (code {_code(plugins)})"
        for name, plugins in sorted(by_name.items())
    }


def _code(plugins: Iterable[Plugin]) -> str:
    """Digest of the top-level packages that plug-ins lie in; nothing is imported for it."""
    digest = hashlib.sha256()
    for package in sorted({plugin.module.partition(".")[0] for plugin in plugins}):
        try:
            for root in _roots(package):
                files = [root] if root.is_file() else sorted(root.rglob("*"))
                sources = [f for f in files if f.suffix in _SUFFIXES and f.is_file()]
                digest.update(source_digest(root.parent, sources).encode())
        except (ImportError, OSError, ValueError):
            # Whoever loads it is told why it cannot be read.
            digest.update(b"unreadable")
    return digest.hexdigest()[:_SHOWN]


def _roots(package: str) -> tuple[Path, ...]:
    """The folders of a package, or the file of a module."""
    spec = find_spec(package)
    if spec is None:
        return ()
    if spec.submodule_search_locations is not None:
        return tuple(Path(folder) for folder in spec.submodule_search_locations)
    return () if spec.origin is None else (Path(spec.origin),)
