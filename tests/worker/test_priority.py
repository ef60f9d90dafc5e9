"""Workers stand back behind whatever else wants their machine's processors."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from tests.examples.paths import ROOT
from tests.worker.processes import walkers
from tests.worker.requests import never, request

_TELLS = """
import os
from pathlib import Path
from unittest.mock import patch
from gaitswarm.services.worker.cluster.priority import Priority

def tell():
    print(os.getsid(0) == os.getpid(), os.getpgid(0) == os.getpid(), end=" ")
    # Nothing is read where no session was begun since the system was.
    print((Path("/proc/self/autogroup").read_text().split() or ["none"])[-1])
"""

NICER = min(os.nice(0) + 4, 19)

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/autogroup").exists(), reason="this system has no autogroups"
)


def told(code: str, niceness: int = 0) -> list[str]:
    """What a process says that leads a group but no session, as Ray's workers do."""
    command = ["nice", f"-n{niceness}", sys.executable, "-c", _TELLS + code]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, process_group=0, check=True
    )
    return done.stdout.splitlines()


def test_a_nice_worker_gets_a_session_that_is_as_nice_and_keeps_its_group() -> None:
    before, after = told("tell(); Priority().stand_back(); tell()", 4)
    assert before.startswith("False True")
    assert after == f"True True {NICER}"


def test_a_worker_that_is_not_nice_is_left_alone() -> None:
    if os.nice(0):
        pytest.skip("these tests are nice themselves")
    before, after = told("tell(); Priority().stand_back(); tell()")
    assert before == after
    assert before.startswith("False True")


def test_what_the_kernel_refuses_for_now_is_tried_again() -> None:
    refused, tried = told(
        """
priority = Priority()
with patch.object(Path, "write_text", side_effect=BlockingIOError(11, "again")):
    priority.stand_back()
tell()
priority.stand_back()
tell()
""",
        4,
    )
    assert refused.startswith("True True")
    assert tried == f"True True {NICER}"


def test_what_the_system_refuses_for_good_is_let_be() -> None:
    (tried,) = told(
        """
priority = Priority()
with patch.object(Path, "write_text", side_effect=PermissionError(1, "no")) as write:
    priority.stand_back()
    priority.stand_back()
print(write.call_count)
""",
        4,
    )
    assert tried == "1"


@pytest.mark.slow
def test_the_workers_of_an_embedded_cluster_stand_back(ray_evaluator: RayEvaluator) -> None:
    ray_evaluator.evaluate(request(60, job_id="behind"), never)
    at_work = [worker.pid for worker in walkers(os.getpid()) if os.getsid(worker.pid) == worker.pid]
    assert at_work
    for pid in at_work:
        niceness = Path(f"/proc/{pid}/autogroup").read_text().split()[-1]
        assert int(niceness) == os.getpriority(os.PRIO_PROCESS, pid) > 0
