"""Where an SQLite file lies: file systems of a network are refused.

SQLite's write-ahead log is shared memory between processes, which no network file system has, and
its locks are those of the file system, which many of these only pretend to give.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

from sqlalchemy import URL

from gaitswarm.services.optimizer.errors import StoreUnavailable

MOUNTS: Final = Path("/proc/self/mountinfo")

_NETWORK: Final = frozenset(
    {
        *("nfs", "nfs4", "cifs", "smb3", "smbfs", "afs", "ncpfs", "9p"),
        *("ceph", "lustre", "gpfs", "beegfs", "glusterfs", "orangefs", "pvfs2", "davfs"),
    }
)
"""As the kernel calls them; `9p` is how a virtual machine sees its host's folders."""

_NETWORK_IN_USER_SPACE: Final = re.compile(
    r"fuse\.(sshfs|.*nfs|.*smb.*|.*ceph.*|gluster.*|.*s3.*|gcsfuse|blobfuse2?|rclone|davfs2?|juicefs)"
)


@dataclass(frozen=True, slots=True)
class Mount:
    """A mounted file system.

    Attributes:
        point: The folder that it is mounted on.
        kind: As the kernel calls it, such as `ext4` or `fuse.sshfs`.
    """

    point: PurePosixPath
    kind: str

    @property
    def of_a_network(self) -> bool:
        """Whether files on it may be another machine's."""
        # The root of a sandbox such as gVisor is of the machine that runs it.
        if self.kind == "9p" and self.point == PurePosixPath("/"):
            return False
        return self.kind in _NETWORK or bool(_NETWORK_IN_USER_SPACE.fullmatch(self.kind))


def mount_of(path: PurePosixPath, mounts: str) -> Mount | None:
    """Find the file system that a path lies on.

    Args:
        path: Absolute, without links.
        mounts: As the kernel lists them in /proc/self/mountinfo.

    Returns:
        Its mount: the innermost, and of several on the same folder the last; None if there is none.
    """
    found: Mount | None = None
    for line in mounts.splitlines():
        fields, separator, rest = line.partition(" - ")
        if not separator:
            continue
        point = PurePosixPath(_unescaped(fields.split()[4]))
        inner = found is None or len(point.parts) >= len(found.point.parts)
        if inner and path.is_relative_to(point):
            found = Mount(point, rest.split()[0])
    return found


def check_file_system(url: URL) -> None:
    """Refuse an SQLite file on a network file system. Only Linux tells what there is.

    Args:
        url: Of a database, as `parse_url` has it; a file need not exist.

    Raises:
        StoreUnavailable: It lies on such a file system; names it, and the way out.
    """
    if url.get_backend_name() != "sqlite":
        return
    file = Path(url.database or "")
    try:
        mounts = MOUNTS.read_text(encoding="utf-8", errors="surrogateescape")
        path = file.resolve()
    except (OSError, RuntimeError):
        return
    mount = mount_of(PurePosixPath(path), mounts)
    if mount is not None and mount.of_a_network:
        raise StoreUnavailable(
            f"database {file} is on {mount.point}, a {mount.kind} file system, on which SQLite"
            " can lose what is written; name a file on a local disk with --db or GAITSWARM_DB, or"
            " for several machines a postgresql:// database"
        )


def _unescaped(name: str) -> str:
    """A name with what the kernel writes as octal numbers, such as spaces."""
    return re.sub(r"\\([0-7]{3})", lambda code: chr(int(code[1], 8)), name)
