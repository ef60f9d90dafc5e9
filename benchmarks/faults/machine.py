"""Faults of a machine in a campaign: disk, network and clock, all simulated."""

from __future__ import annotations

import mmap
import os
import shutil
import struct
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Final

_CLOCK: Final = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>

static volatile long *step(void) {
    static volatile long *mapped;
    static long none;
    if (!mapped) {
        const char *path = getenv("CLOCK_STEP_FILE");
        int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
        void *found = file < 0 ? MAP_FAILED : mmap(0, 8, PROT_READ, MAP_SHARED, file, 0);
        mapped = found == MAP_FAILED ? &none : found;
    }
    return mapped;
}

/* A wait until a time of day is the real kernel's, which knows of no step: who waits sees none. */
static long step_for(const void *caller) {
    long seconds = *step();
    Dl_info found;
    if (seconds && dladdr(caller, &found) && found.dli_fname)
        if (strstr(found.dli_fname, "_raylet") || strstr(found.dli_fname, "libstdc++")) return 0;
    return seconds;
}

static int read_clock(clockid_t clock, struct timespec *now, const void *caller) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int result = real(clock, now);
    if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) now->tv_sec += step_for(caller);
    return result;
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    return read_clock(clock, now, __builtin_return_address(0));
}

int gettimeofday(struct timeval *restrict now, void *restrict zone) {
    struct timespec read;
    int result = read_clock(CLOCK_REALTIME, &read, __builtin_return_address(0));
    now->tv_sec = read.tv_sec;
    now->tv_usec = read.tv_nsec / 1000;
    return result;
}

time_t time(time_t *where) {
    struct timespec read;
    read_clock(CLOCK_REALTIME, &read, __builtin_return_address(0));
    if (where) *where = read.tv_sec;
    return read.tv_sec;
}
"""


class Clock:
    """The time of day of all processes that have its variables; it can be stepped as they run.

    Ray's library in them keeps the real one: it waits until times of day, in the kernel, and would
    wait an hour longer.

    Args:
        folder: Of the library that reads it.
    """

    def __init__(self, folder: Path) -> None:
        compiler = shutil.which("cc")
        assert compiler is not None
        source, library, step = folder / "clock.c", folder / "clock.so", folder / "clock.step"
        source.write_text(_CLOCK, encoding="ascii")
        command = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(source), "-ldl"]
        subprocess.run(command, check=True)
        step.write_bytes(bytes(8))
        self.variables = {"LD_PRELOAD": str(library), "CLOCK_STEP_FILE": str(step)}
        with step.open("r+b") as file:
            self._step = mmap.mmap(file.fileno(), 8)

    def step_to(self, seconds: int) -> None:
        """Let it be so far from the real time [s]."""
        self._step[:] = struct.pack("q", seconds)


class Disk:
    """A file system in memory.

    Args:
        folder: Where it is mounted.
        mebibytes: How much there is room for.
    """

    def __init__(self, folder: Path, mebibytes: int) -> None:
        self.folder = folder
        self._ballast = folder / "ballast"
        _run("mount", "-t", "tmpfs", "-o", f"size={mebibytes}m,mode=755", "tmpfs", str(folder))

    def fill(self) -> None:
        """Leave no room."""
        for size in (1 << 20, 4096):
            with self._ballast.open("ab", buffering=0) as file, suppress(OSError):
                while True:
                    file.write(bytes(size))

    def make_room(self) -> None:
        """Leave as much room as there was."""
        self._ballast.unlink(missing_ok=True)

    def close(self) -> None:
        """Unmount it."""
        _run("umount", "-l", str(self.folder))


class Network:
    """A network namespace for a server, and a cable to it for each of its clients.

    Args:
        clients: How many cables.
    """

    def __init__(self, clients: int) -> None:
        self.name = f"faults-{os.getpid()}"
        _run("ip", "netns", "add", self.name)
        number = os.getpid() % 250
        self.addresses = []
        for index in range(clients):
            near, far, net = f"fn{os.getpid()}-{index}", f"ff{index}", f"198.18.{number}."
            block = 4 * index
            _run("ip", "link", "add", near, "type", "veth", "peer", far, "netns", self.name)
            _run("ip", "addr", "add", f"{net}{block + 1}/30", "dev", near)
            _run("ip", "link", "set", near, "up")
            _run("ip", "-n", self.name, "addr", "add", f"{net}{block + 2}/30", "dev", far)
            _run("ip", "-n", self.name, "link", "set", far, "up")
            self.addresses.append(f"{net}{block + 2}")

    def cut(self, client: int) -> None:
        """Pull a client's cable at the server: what it sends is lost in silence."""
        _run("ip", "-n", self.name, "link", "set", f"ff{client}", "down")

    def mend(self, client: int) -> None:
        """Plug it in again."""
        _run("ip", "-n", self.name, "link", "set", f"ff{client}", "up")

    def close(self) -> None:
        """Remove it, with its cables."""
        _run("ip", "netns", "del", self.name)


_PIDS: Final = Path("/sys/fs/cgroup/pids")


def process_group(name: str) -> Path:
    """A new control group that limits processes and threads."""
    group = _PIDS / f"faults-{os.getpid()}-{name}"
    group.mkdir()
    return group


def can() -> dict[str, bool]:
    """Which of these this user may have on this machine."""
    root = os.geteuid() == 0
    return {
        "disk": root and shutil.which("mount") is not None,
        "network": root and shutil.which("ip") is not None and shutil.which("setpriv") is not None,
        "clock": shutil.which("cc") is not None,
        "processes": root and (_PIDS / "cgroup.procs").exists() and os.access(_PIDS, os.W_OK),
    }


def _run(*command: str) -> None:
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
