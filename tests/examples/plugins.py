"""Packages with plug-ins, installed as pip does: modules and metadata in a folder of sys.path."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from unittest.mock import patch

from gaitswarm.sim.plugins import find_plugins, plugin_versions

RESEARCH = "gaitswarm-research"
"""The distribution in research/, which development installs."""


def install(
    folder: Path,
    distribution: str,
    entry_points: Mapping[str, Mapping[str, str]],
    modules: Mapping[str, str],
    *,
    version: str = "1.0",
) -> None:
    """Write a distribution into a folder.

    entry_points: places by name, by group. modules: texts by name.
    """
    for name, text in modules.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    metadata = folder / f"{distribution.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n", encoding="utf-8"
    )
    text = ""
    for group, places in entry_points.items():
        text += f"[{group}]\n" + "".join(f"{n} = {place}\n" for n, place in places.items())
    (metadata / "entry_points.txt").write_text(text, encoding="utf-8")


@contextmanager
def installed(folder: Path) -> Iterator[None]:
    """Run as if this process had a folder on its path, and no plug-ins of gaitswarm-research."""
    before = set(sys.modules)

    def entry_points() -> metadata.EntryPoints:
        others = (d for d in metadata.distributions() if d.name != RESEARCH)
        return metadata.EntryPoints(point for other in others for point in other.entry_points)

    sys.path.insert(0, str(folder))
    _forget()
    try:
        with patch.object(metadata, "entry_points", entry_points):
            yield
    finally:
        sys.path.remove(str(folder))
        for name in set(sys.modules) - before:
            if str(getattr(sys.modules[name], "__file__", "")).startswith(str(folder)):
                del sys.modules[name]
        _forget()


def _forget() -> None:
    find_plugins.cache_clear()
    plugin_versions.cache_clear()
