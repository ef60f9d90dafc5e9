"""SQLite on a network file system is refused; which one a file is on is read from the mounts."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import pytest

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store import engine, open_store
from gaitswarm.services.optimizer.store.engine import is_network, mount_of

MOUNTS = r"""22 27 0:21 / /proc rw,relatime - proc proc rw
27 1 254:0 / / rw,relatime - ext4 /dev/vda rw,discard
40 27 0:40 / /home rw,relatime shared:5 master:1 - nfs4 server:/home rw,vers=4.2
41 40 8:1 / /home/ann/scratch rw,relatime - xfs /dev/sdb1 rw
42 27 0:42 / /mnt/with\040space rw - cifs //server/share rw
43 27 0:43 / /mnt/ssh rw - fuse.sshfs ann@server:/ rw
44 27 0:44 / /mnt/windows rw - 9p drvfs rw
45 27 0:45 / /mnt/disk rw - fuseblk /dev/sdc1 rw
46 27 0:46 / /mnt/twice rw - nfs server:/old rw
47 27 8:2 / /mnt/twice rw - btrfs /dev/sdd1 rw
"""


@pytest.mark.parametrize(
    ("path", "kind", "refused"),
    [
        ("/var/lib/jobs.db", "ext4", False),
        ("/home/ann/jobs.db", "nfs4", True),
        ("/home/ann/scratch/jobs.db", "xfs", False),
        ("/homework/jobs.db", "ext4", False),
        ("/mnt/with space/jobs.db", "cifs", True),
        ("/mnt/ssh/jobs.db", "fuse.sshfs", True),
        ("/mnt/windows/jobs.db", "9p", True),
        ("/mnt/disk/jobs.db", "fuseblk", False),
        ("/mnt/twice/jobs.db", "btrfs", False),
    ],
)
def test_the_innermost_and_latest_mount_decides(path: str, kind: str, refused: bool) -> None:
    mount = mount_of(PurePosixPath(path), MOUNTS)
    assert mount[1] == kind
    assert is_network(*mount) == refused


def test_the_root_of_a_sandbox_is_local() -> None:
    mount = mount_of(PurePosixPath("/jobs.db"), "20 1 0:9 / / rw - 9p none rw,trans=fd\n")
    assert mount == (PurePosixPath("/"), "9p") and not is_network(*mount)


def test_a_refused_file_is_not_made_and_the_message_names_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mounts = tmp_path / "mountinfo"
    mounts.write_text(f"1 0 0:1 / {tmp_path.resolve()} rw - nfs4 server:/export rw\n")
    monkeypatch.setattr(engine, "MOUNTS", mounts)
    (tmp_path / "link").symlink_to(tmp_path)
    path = tmp_path / "link" / "jobs.db"
    with pytest.raises(StoreUnavailable, match=r"nfs4.*local disk.*postgresql://"):
        open_store(str(path))
    assert not path.exists()


def test_where_mounts_are_not_listed_nothing_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "MOUNTS", tmp_path / "none")
    open_store(str(tmp_path / "jobs.db")).close()
