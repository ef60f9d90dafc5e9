"""Zip archives of stored members: equal members make equal bytes, and reading one is safe.

Members are not compressed. Equal members then make equal bytes whatever the zip library, and an
archive that claims to hold more than it is long is recognized before anything of it is read.
"""

from __future__ import annotations

import io
import stat
import zipfile
from collections.abc import Mapping
from pathlib import PurePosixPath
from typing import Final

MEDIA_TYPE: Final = "application/zip"

LARGEST_ARCHIVE: Final = 1 << 30
"""Largest archive that is read [B]."""

MOST_MEMBERS: Final = 10_000

_UNIX: Final = 3

_NEW: Final = stat.S_IFREG | 0o644


class BadArchive(ValueError):
    """A file is not such an archive, or is damaged."""


def zipped(members: Mapping[str, bytes]) -> bytes:
    """Write an archive."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, content in sorted(members.items()):
            entry = zipfile.ZipInfo(name)
            entry.create_system = _UNIX
            entry.external_attr = _NEW << 16
            archive.writestr(entry, content)
    return file.getvalue()


def unzipped(content: bytes) -> dict[str, bytes]:
    """Read all members of an archive after checking that this is safe."""
    if len(content) > LARGEST_ARCHIVE:
        raise BadArchive(f"it is larger than {LARGEST_ARCHIVE >> 30} GiB")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            _check_entries(entries, len(content))
            return {entry.filename: archive.read(entry) for entry in entries}
    except BadArchive:
        raise
    except (
        zipfile.BadZipFile,
        EOFError,
        LookupError,
        OSError,
        OverflowError,
        RuntimeError,
        ValueError,
    ) as error:
        raise BadArchive(f"it is not a complete zip archive: {error}") from error


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
    # Overlapping members would be read several times.
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
