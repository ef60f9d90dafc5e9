"""URDF text of robots that are described in xacro or MJCF."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Literal
from xml.parsers import expat

from gaitswarm.sim.proposal.from_mjcf import mjcf_to_urdf
from gaitswarm.sim.proposal.from_xacro import PackageFinder, expanded, no_package

Format = Literal["urdf", "xacro", "mjcf"]


def as_urdf(
    text: str,
    path: Path | None = None,
    find: PackageFinder = no_package,
    arguments: Mapping[str, str] = MappingProxyType({}),
) -> tuple[str, list[str]]:
    """Convert a robot's description to a URDF.

    Args:
        text: Of the description.
        path: Of its file, next to which others may be; None for an untrusted text, which may name
            no other file and whose expressions may only compute.
        find: Finder of the packages that a xacro file names.
        arguments: Values of its <xacro:arg>.

    Returns:
        The URDF, and what was left out or assumed, one sentence each.
    """
    form = format_of(text)
    if form == "xacro":
        return expanded(text, path, find, arguments), []
    return mjcf_to_urdf(text, path) if form == "mjcf" else (text, [])


def format_of(text: str) -> Format:
    """Infer a format from the elements; malformed text counts as a URDF."""
    elements: list[tuple[str, dict[str, str]]] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, attributes: elements.append((tag, attributes))
    with suppress(expat.ExpatError):
        parser.Parse(text, True)
    if elements and elements[0][0] == "mujoco":
        return "mjcf"
    # A URDF that xacro has written still declares its namespace.
    expands = "${" in text or any(tag.startswith("xacro:") for tag, _ in elements)
    return "xacro" if expands and "xmlns:xacro" in elements[0][1] else "urdf"
