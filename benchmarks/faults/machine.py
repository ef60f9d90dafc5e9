"""What fails in a campaign, all simulated: disk, network, system calls, and a receiver."""

from __future__ import annotations

import json
import mmap
import os
import shutil
import struct
import subprocess
import threading
import time
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Final, Self

_PRELOADED: Final = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

/* The step of the clock [s], and whether the disk fails. */
static volatile long *state(void) {
    static volatile long *mapped;
    static long none[2];
    if (!mapped) {
        const char *path = getenv("FAULTS_STATE");
        int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
        void *found = file < 0 ? MAP_FAILED : mmap(0, 16, PROT_READ, MAP_SHARED, file, 0);
        mapped = found == MAP_FAILED ? none : found;
    }
    return mapped;
}

/* Whether a file is on the disk that fails. */
static int fails(int file) {
    char link[64], path[4096];
    const char *folder = getenv("FAULTS_DISK");
    if (!folder || !state()[1]) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path);
    if (length < (ssize_t)strlen(folder) || strncmp(path, folder, strlen(folder))) return 0;
    errno = EIO;
    return 1;
}

#define REAL(name, ...) \
    static __typeof__(name) *real; \
    if (!real) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name); \
    return fails(file) ? -1 : real(__VA_ARGS__);

ssize_t pwrite(int file, const void *from, size_t size, off_t at) {
    REAL(pwrite, file, from, size, at)
}
ssize_t pwrite64(int file, const void *from, size_t size, off64_t at) {
    REAL(pwrite64, file, from, size, at)
}
int fsync(int file) { REAL(fsync, file) }
int fdatasync(int file) { REAL(fdatasync, file) }

/* A wait until a time of day is the real kernel's, which knows of no step: who waits sees none. */
static long step_for(const void *caller) {
    long seconds = state()[0];
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


class Calls:
    """System calls of all processes that have its variables: time of day, and writes to a disk.

    Both can be changed as they run. Ray's library in them keeps the real time: it waits until times
    of day, in the kernel, and would wait an hour longer.

    Args:
        folder: Of the library that stands before the C library.
        disk: Folder whose files can fail.
    """

    def __init__(self, folder: Path, disk: Path) -> None:
        compiler = shutil.which("cc")
        assert compiler is not None
        source, library, state = folder / "calls.c", folder / "calls.so", folder / "calls.state"
        source.write_text(_PRELOADED, encoding="ascii")
        command = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(source), "-ldl"]
        subprocess.run(command, check=True)
        state.write_bytes(bytes(16))
        self.variables = {
            "LD_PRELOAD": str(library),
            "FAULTS_STATE": str(state),
            "FAULTS_DISK": str(disk),
        }
        with state.open("r+b") as file:
            self._state = mmap.mmap(file.fileno(), 16)

    def step_to(self, seconds: int) -> None:
        """Let the time of day be so far from the real one [s]."""
        self._state[:8] = struct.pack("q", seconds)

    def fail_writes(self, fail: bool) -> None:
        """Let writes to the disk fail with an input/output error, or succeed again."""
        self._state[8:] = struct.pack("q", fail)


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


class Receiver:
    """A receiver of notifications on this machine. Use it as a context manager.

    Attributes:
        jobs: Those about which it took one.
        slow: Whether it answers a byte every two seconds, without end.
    """

    def __init__(self) -> None:
        self.jobs: set[str] = set()
        self.slow = False
        receiver = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                if receiver.slow:
                    with suppress(OSError):
                        self.wfile.write(b"HTTP/1.1 204 No Content\r\nX-Slow: ")
                        while receiver.slow:
                            self.wfile.write(b"a")
                            time.sleep(2.0)
                    return
                receiver.jobs.add(json.loads(body)["data"]["id"])
                self.send_response(204)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.host = f"127.0.0.1:{self._server.server_port}"

    def __enter__(self) -> Self:
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.slow = False
        self._server.shutdown()
        self._server.server_close()


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
