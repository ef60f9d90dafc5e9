"""Processes of this machine, from /proc."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Process:
    """A process and not merely its number, which another may get."""

    pid: int
    started: int
    parent: int

    @property
    def title(self) -> str:
        """Its command; none of one that has ended."""
        try:
            command = Path(f"/proc/{self.pid}/cmdline").read_bytes()
        except (FileNotFoundError, ProcessLookupError):
            return ""
        return command.replace(b"\0", b" ").decode()

    @property
    def resident(self) -> int:
        """Bytes, pages shared with others counted in full."""
        status = Path(f"/proc/{self.pid}/status").read_text()
        (line,) = [line for line in status.splitlines() if line.startswith("VmRSS")]
        return int(line.split()[1]) * 1024

    def has_loaded(self, library: str) -> bool:
        return library in Path(f"/proc/{self.pid}/maps").read_text()

    @property
    def alive(self) -> bool:
        return process(self.pid) == self


def process(pid: int) -> Process | None:
    """None if there is none, or if it is only waiting for its parent to take note of its end."""
    try:
        after_name = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    if after_name[0] == "Z":
        return None
    return Process(pid, started=int(after_name[19]), parent=int(after_name[1]))


def descendants(pid: int) -> list[Process]:
    everyone = [process(int(entry.name)) for entry in Path("/proc").glob("[0-9]*")]
    known, found = {pid}, []
    grown = True
    while grown:
        new = [p for p in everyone if p and p.parent in known and p.pid not in known]
        grown = bool(new)
        known |= {p.pid for p in new}
        found += new
    return found


def walkers(pid: int) -> list[Process]:
    """Ray's worker processes below a driver."""
    titles = ("ray::simulate", "ray::IDLE")
    found = []
    for candidate in descendants(pid):
        try:
            if candidate.title.startswith(titles):
                found.append(candidate)
        except OSError:
            continue
    return found
