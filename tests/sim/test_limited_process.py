"""Work in processes of its own: what takes too much is ended with the reason, and others go on."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gaitswarm.sim.errors import (
    KernelBuildError,
    ProcessEnded,
    RobotFileError,
    SimulationInputError,
)
from gaitswarm.sim.kernel.emitted import source
from gaitswarm.sim.limited_process import LimitedProcesses
from gaitswarm.sim.robot import check, load_robot
from gaitswarm.sim.robot.check import check_files
from gaitswarm.sim.robot.robot import parse_robot
from tests.examples.paths import QUADRUPED

pytestmark = pytest.mark.slow

TOML, URDF = (
    (QUADRUPED / f"robot.{kind}").read_text(encoding="utf-8") for kind in ("toml", "urdf")
)


def hungry(*, seconds: float = 30.0, count: int = 1, kept: bool = True) -> LimitedProcesses:
    return LimitedProcesses(
        "tests.sim.hungry",
        count=count,
        seconds=seconds,
        cpu_seconds=0,
        memory=1 << 30,
        kept=kept,
    )


@pytest.fixture(scope="module")
def processes() -> Iterator[LimitedProcesses]:
    opened = hungry()
    yield opened
    opened.close()


@pytest.mark.parametrize(
    ("do", "reason"),
    [
        ("compute", r"took more than 0 s of a processor"),
        ("fill", r"took more than 1024 MiB of memory"),
        ("crash", r"was ended by SIGSEGV"),
        ("fail", r"failed: ZeroDivisionError: a bug"),
    ],
)
def test_what_takes_too_much_is_ended_with_the_reason_and_the_next_request_answered(
    processes: LimitedProcesses, do: str, reason: str
) -> None:
    with pytest.raises(ProcessEnded, match=f"^{reason}"):
        processes.ask({"do": do})
    assert processes.ask({"do": "echo", "say": "ä\n"})["said"] == "ä\n"


def test_what_waits_is_ended_by_the_clock() -> None:
    processes = hungry(seconds=0.5)
    begun = time.monotonic()
    with pytest.raises(ProcessEnded, match=r"^took more than 0\.5 s$"):
        processes.ask({"do": "wait"})
    assert time.monotonic() - begun < 20.0
    processes.close()


def test_a_process_is_kept_after_answers_and_refusals_and_replaced_after_failures(
    processes: LimitedProcesses,
) -> None:
    first = processes.ask({"do": "chatter"})["pid"]
    with pytest.raises(SimulationInputError, match="field: no"):
        processes.ask({"do": "refuse"})
    assert processes.ask({"do": "echo"})["pid"] == first
    with pytest.raises(ProcessEnded):
        processes.ask({"do": "fail"})
    assert processes.ask({"do": "echo"})["pid"] != first


def test_a_process_that_is_not_kept_answers_once() -> None:
    processes = hungry(kept=False)
    pids = [processes.ask({"do": "echo"})["pid"] for _ in range(2)]
    assert pids[0] != pids[1]


def test_a_process_does_not_hear_the_terminal(processes: LimitedProcesses) -> None:
    assert os.getsid(processes.ask({"do": "echo"})["pid"]) != os.getsid(0)


def test_a_process_can_write_no_file(processes: LimitedProcesses, tmp_path: Path) -> None:
    with pytest.raises(ProcessEnded, match="failed: OSError"):
        processes.ask({"do": "write", "path": str(tmp_path / "file")})


def test_a_request_is_answered_during_a_long_one() -> None:
    processes = hungry(seconds=3.0, count=2)

    def wait() -> None:
        with pytest.raises(ProcessEnded):
            processes.ask({"do": "wait"})

    waiting = threading.Thread(target=wait)
    waiting.start()
    assert processes.ask({"do": "echo", "say": 1})["said"] == 1
    assert waiting.is_alive()
    waiting.join()
    processes.close()


def test_all_processes_end_when_they_are_closed() -> None:
    processes = hungry(count=2)
    together = threading.Barrier(2)

    def ask(_: int) -> int:
        together.wait()
        return int(processes.ask({"do": "wait", "seconds": 0.3})["pid"])

    with ThreadPoolExecutor(2) as threads:
        first, second = threads.map(ask, range(2))
    assert first != second
    processes.close()
    for pid in (first, second):
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_a_robot_is_checked_in_another_process_once(monkeypatch: pytest.MonkeyPatch) -> None:
    toml = f"# {time.time_ns()}\n{TOML}"
    with pytest.raises(
        RobotFileError,
        match=r"robot\.urdf, line \d+: joint '\w+' of leg '\w+' is \w+, not revolute",
    ):
        check_files(toml, URDF.replace("revolute", "prismatic"))
    check_files(toml, URDF)
    monkeypatch.setattr(check.PROCESSES, "ask", None)
    check_files(toml, URDF)


def test_a_robot_whose_check_is_ended_is_refused_with_the_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def ended(_: object) -> dict[str, object]:
        raise ProcessEnded("was ended by SIGSEGV")

    monkeypatch.setattr(check.PROCESSES, "ask", ended)
    with pytest.raises(RobotFileError, match="checking it was ended by SIGSEGV"):
        check_files(f"# {time.time_ns()}\n{TOML}", URDF)


def test_a_kernel_is_derived_in_another_process_to_the_same_text(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = parse_robot(TOML, URDF)
    expected = source.kernel_source(robot, "single")
    monkeypatch.setattr(source, "kernel_source", None)
    assert source.derived_source(robot, "single") == expected


def test_a_kernel_whose_derivation_is_ended_is_an_error_that_names_the_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def ended(_: object) -> dict[str, object]:
        raise ProcessEnded("took more than 4096 MiB of memory")

    monkeypatch.setattr(source.PROCESSES, "ask", ended)
    with pytest.raises(KernelBuildError, match="'quadruped': its derivation took more than"):
        source.derived_source(parse_robot(TOML, URDF))


def test_a_robot_that_ships_is_derived_without_another_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(source.PROCESSES, "ask", None)
    monkeypatch.setattr(source, "kernel_source", lambda *_, **__: "derived here")
    assert source.derived_source(load_robot("szabadka2-identified")) == "derived here"
