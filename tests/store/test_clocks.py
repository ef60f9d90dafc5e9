"""Leases between processes whose clocks differ."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.store import open_store
from tests.examples.processes import python
from tests.store.examples import LEASE, spec

COMPILER = shutil.which("cc")

pytestmark = [
    pytest.mark.slow,
    # All that can open an SQLite file share one machine, and so one clock.
    pytest.mark.skipif(COMPILER is None, reason="needs a C compiler"),
    pytest.mark.parametrize("database_url", ["postgresql"], indirect=True),
]

SHIFTED_CLOCK = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <time.h>

int clock_gettime(clockid_t clock, struct timespec *time) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int result = real(clock, time);
    if (clock == CLOCK_REALTIME) time->tv_sec += atol(getenv("CLOCK_SHIFT"));
    return result;
}
"""

HOUR = 3600

Claimed = Callable[[int], list[str]]


@pytest.fixture
def claimed_by_a_clock(database_url: str, tmp_path: Path) -> Claimed:
    """Ids that a process claims whose clock is so many seconds ahead."""
    source, library = tmp_path / "clock.c", tmp_path / "clock.so"
    source.write_text(SHIFTED_CLOCK)
    subprocess.run([str(COMPILER), "-shared", "-fPIC", source, "-o", library, "-ldl"], check=True)

    def run(seconds: int) -> list[str]:
        done = python(
            *("-m", "tests.store.worker_process", "claim", database_url),
            environment={"LD_PRELOAD": str(library), "CLOCK_SHIFT": str(seconds)},
            input="go\n",
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.removeprefix("ready\n").split()

    return run


def test_a_runner_whose_clock_is_ahead_steals_no_job(
    database_url: str, claimed_by_a_clock: Claimed
) -> None:
    with closing(open_store(database_url)) as store:
        store.create_job(spec())
        assert store.claim("runner", lease_seconds=LEASE) is not None
        waiting, _ = store.create_job(spec())
        assert claimed_by_a_clock(HOUR) == [waiting.id]


def test_a_runner_whose_clock_is_behind_loses_no_job(
    database_url: str, claimed_by_a_clock: Claimed
) -> None:
    with closing(open_store(database_url)) as store:
        job, _ = store.create_job(spec())
        assert claimed_by_a_clock(-HOUR) == [job.id]
        assert store.claim("runner", lease_seconds=LEASE) is None
