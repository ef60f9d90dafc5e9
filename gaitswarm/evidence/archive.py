"""The file itself: a zip archive of stored members, with a manifest of their hashes.

Members are not compressed. Equal members then make equal bytes whatever the zip library, and an
archive that claims to hold more than it is long is recognized before anything of it is read.
"""

from __future__ import annotations

import hashlib
import io
import json
import stat
import zipfile
from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Any, Final

FORMAT: Final = "gaitswarm-evidence"

VERSION: Final = 1
"""Of the layout; a file of another one is refused."""

MEDIA_TYPE: Final = "application/zip"

MANIFEST: Final = "manifest.json"

LARGEST_ARCHIVE: Final = 1 << 30
"""Of an archive that is read [B]."""

LARGEST_TEXT: Final = 64 << 20
"""Of a member that is a JSON document [B]."""

MOST_MEMBERS: Final = 10_000

_TIME: Final = (1980, 1, 1, 0, 0, 0)
"""The earliest that a zip archive can tell."""

_UNIX: Final = 3

_NEW: Final = stat.S_IFREG | 0o644


class BadArchive(ValueError):
    """A file is no evidence, or is damaged; says how."""


def archived(members: Mapping[str, bytes]) -> bytes:
    """Write an archive.

    Args:
        members: Contents by name, the manifest left out.

    Returns:
        The archive: the same bytes for the same members, whatever their order.
    """
    hashes = {
        name: {"sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}
        for name, content in sorted(members.items())
    }
    manifest = {"format": FORMAT, "version": VERSION, "files": hashes}
    text = json.dumps(manifest, indent=2).encode() + b"\n"
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, content in sorted({**members, MANIFEST: text}.items()):
            entry = zipfile.ZipInfo(name, _TIME)
            entry.create_system = _UNIX
            entry.external_attr = _NEW << 16
            archive.writestr(entry, content)
    return file.getvalue()


def read_archive(content: bytes) -> dict[str, bytes]:
    """Read all members of an archive, after a look at whether that is safe; nothing is written.

    Args:
        content: The file.

    Returns:
        Contents by name, the manifest among them; not compared with it.

    Raises:
        BadArchive: It is no such archive: truncated, compressed, encrypted, too large, or with
            members whose names lead out of it or occur twice.
    """
    if len(content) > LARGEST_ARCHIVE:
        raise BadArchive(f"it is larger than {LARGEST_ARCHIVE >> 30} GiB")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            _check_entries(entries, len(content))
            return {entry.filename: archive.read(entry) for entry in entries}
    except (zipfile.BadZipFile, EOFError, NotImplementedError, OSError, RuntimeError) as error:
        raise BadArchive(f"it is no whole zip archive: {error}") from error
    except (ValueError, OverflowError, KeyError, IndexError) as error:
        if isinstance(error, BadArchive):
            raise
        raise BadArchive(f"it is no whole zip archive: {error}") from error


def check_hashes(members: Mapping[str, bytes]) -> list[str]:
    """Compare an archive with its manifest.

    Args:
        members: Contents by name.

    Returns:
        A sentence for every member that differs, is missing or is not in the manifest.

    Raises:
        BadArchive: There is no manifest, or it is none of this format and version.
    """
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

    Args:
        content: Its bytes.
        name: Of the member, for messages.

    Returns:
        The document.

    Raises:
        BadArchive: It is none, or too long.
    """
    if len(content) > LARGEST_TEXT:
        raise BadArchive(f"{name} is larger than {LARGEST_TEXT >> 20} MiB")
    try:
        return json.loads(content, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise BadArchive(f"{name} is not valid JSON: {type(error).__name__}") from error


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no number of JSON")


def _check_entries(entries: list[zipfile.ZipInfo], length: int) -> None:
    if len(entries) > MOST_MEMBERS:
        raise BadArchive(f"it has more than {MOST_MEMBERS} members")
    names = [entry.filename for entry in entries]
    if len(set(names)) < len(names):
        raise BadArchive("a name occurs twice in it")
    for entry in entries:
        name = entry.filename
        if not _is_safe(name):
            raise BadArchive(f"the name of a member leads out of it: {name[:80]!r}")
        if entry.compress_type != zipfile.ZIP_STORED or entry.file_size != entry.compress_size:
            raise BadArchive(f"{name[:80]!r} is compressed, which no evidence is")
        if entry.flag_bits & 0x1:
            raise BadArchive(f"{name[:80]!r} is encrypted")
    # Members that overlap would be read as often as they are named.
    if sum(entry.file_size for entry in entries) > length:
        raise BadArchive("its members claim to be longer than it is")


def _is_safe(name: str) -> bool:
    path = PurePosixPath(name)
    return (
        name.isprintable()
        and "\\" not in name
        and ":" not in name
        and not path.is_absolute()
        and ".." not in path.parts
        and str(path) == name
    )
