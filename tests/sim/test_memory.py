"""A process that lacks memory for SciPy says so, and does not hang."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.examples.processes import python

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="address spaces are limited on Linux only"),
]

SHORT = """
import os, resource
import numpy as np
from gaitswarm.services.optimizer.run.outage import is_infrastructure
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.sim.gait.trajectory import fir_gains

def limit(mebibytes):
    size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (size + (mebibytes << 20), hard))

for mebibytes in (8, 32, 48, 64, 96, 128):
    for load in (lambda: RandomNumbers(1, 0).normal(3), lambda: fir_gains(100, "hamming")):
        limit(mebibytes)
        try:
            load()
        except MemoryError as error:
            assert is_infrastructure(error)
            print(mebibytes, error)
limit(4096)
assert RandomNumbers(1, 0).normal(3).shape == (3,)
limit(8)
assert RandomNumbers(1, 0).normal(3).shape == (3,)
"""


@pytest.mark.thorough("scipy in a process of little memory")
def test_scipy_is_not_loaded_where_its_openblas_would_try_for_ever_to_find_memory() -> None:
    try:
        ended = python("-c", SHORT, timeout=60)
    except subprocess.TimeoutExpired:
        pytest.fail("it hangs")
    assert ended.returncode == 0, ended.stderr
    said = ended.stdout.splitlines()
    assert len(said) == 12
    assert all("SciPy needs 192 MiB of address space" in line for line in said)
