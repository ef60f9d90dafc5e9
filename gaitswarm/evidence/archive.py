"""The evidence archive: stored members with a manifest of their hashes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Final

from pydantic_core import from_json

from gaitswarm.zip_archive import BadArchive, zipped

FORMAT: Final = "gaitswarm-evidence"

VERSION: Final = 1
"""Version of the layout; other versions are refused."""

MANIFEST: Final = "manifest.json"

LARGEST_TEXT: Final = 64 << 20
"""Largest JSON member [B]."""


def archived(members: Mapping[str, bytes]) -> bytes:
    """Write an archive."""
    hashes = {
        name: {"sha256": _hash(content), "bytes": len(content)}
        for name, content in sorted(members.items())
    }
    manifest = {"format": FORMAT, "version": VERSION, "files": hashes}
    text = json.dumps(manifest, indent=2).encode() + b"\n"
    return zipped({**members, MANIFEST: text})


def check_hashes(members: Mapping[str, bytes]) -> list[str]:
    """Compare an archive with its manifest."""
    if MANIFEST not in members:
        raise BadArchive(f"it has no {MANIFEST}")
    manifest = parsed_json(members[MANIFEST], MANIFEST)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise BadArchive(f"{MANIFEST} is none of {FORMAT}")
    if manifest.get("version") != VERSION:
        raise BadArchive(
            f"it is version {str(manifest.get('version'))[:20]} of {FORMAT}, this gaitswarm reads"
            f" version {VERSION}"
        )
    files = manifest.get("files")
    if not isinstance(files, dict):
        raise BadArchive(f"{MANIFEST} names no files")
    found = [f"{name} is not in the manifest" for name in members if name not in {*files, MANIFEST}]
    for name, expected in files.items():
        if name not in members:
            found.append(f"{name} is missing")
        elif not isinstance(expected, dict) or expected.get("sha256") != _hash(members[name]):
            found.append(f"{name} has another SHA-256")
    return found


def parsed_json(content: bytes, name: str) -> Any:
    """Read a JSON document as the standard has it: no NaN, no infinities, no endless nesting.

    pydantic's parser does not use Python's stack. The standard library's exhausts it before it
    refuses deep nesting, and finalizers running at that moment fail.
    """
    if len(content) > LARGEST_TEXT:
        raise BadArchive(f"{name} is larger than {LARGEST_TEXT >> 20} MiB")
    try:
        return from_json(content, allow_inf_nan=False)
    except ValueError as error:
        raise BadArchive(f"{name} is not valid JSON: {error}") from error


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
