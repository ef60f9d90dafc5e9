"""Firmware on emulated microcontrollers: equal samples, sizes and cycles."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from gaitswarm.firmware import write_firmware
from gaitswarm.sim.catalogue import GAIT_CATALOGUE
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.firmware.microcontroller import CODE_BYTES, Memory
from tests.examples.walks import short_walk
from tests.firmware.conftest import TOOLS, make, published, with_changed_cell

pytestmark = pytest.mark.slow

COUNTED = re.compile(r"controller_tick: (\d+) instructions on average, (\d+) at most, for 3 joints")
SIZES = re.compile(r"^ *(\d+)\t +(\d+)\t +(\d+)\t.*build/(\w+)-m0\.o$", re.MULTILINE)


@pytest.fixture(scope="module", autouse=True)
def tools() -> None:
    """Without a compiler and an emulator these tests are skipped."""
    path = f"{os.environ['PATH']}{os.pathsep}{TOOLS}"
    for name in ("arm-none-eabi-gcc", "qemu-system-arm"):
        if shutil.which(name, path=path) is None:
            pytest.skip(f"NOT TESTED without {name}: run scripts/microcontroller.sh")


def test_both_processors_reproduce_the_simulator_in_time(copy_of_a: Path) -> None:
    ran = make(copy_of_a, "target")
    assert ran.code == 0, ran.out + ran.err
    totals = [entry for entry in ran.compared if entry[0] == "all"]
    assert totals == 2 * [("all", 81_000, 0)]
    counts = [tuple(map(int, found)) for found in COUNTED.findall(ran.out)]
    assert len(counts) == 2
    # Half the budget remains for converters, buses and interrupts.
    assert all(0 < mean <= most < Memory.cycles / 2 for mean, most in counts)
    sizes = {name: tuple(map(int, s)) for *s, name in SIZES.findall(ran.out)}
    text, data, bss = sizes["controller"]
    assert text <= CODE_BYTES and (data, bss) == (0, 40)
    (stack,) = re.findall(r"^stack of controller_tick: (\d+) bytes$", ran.out, re.MULTILINE)
    assert 0 < int(stack) < 512
    assert sizes["tables"] == (65536, 0, 0)
    assert sum(size[0] for size in sizes.values()) > 65536


def test_a_processor_with_other_outputs_fails(brief_a: Path) -> None:
    with_changed_cell(brief_a, 512 * 64)
    ran = make(brief_a, "target")
    assert ran.code != 0
    assert ran.compared[-1][2] > 0


def test_a_law_with_64_bit_integers_reproduces_the_simulator(tmp_path: Path) -> None:
    folder = tmp_path / "firmware"
    design = published("fuzzy-pi-3", "fuzzy-pso-ps")
    gait = short_walk(cycle_time=0.5, stride=0.04, height=0.02)
    own = {name: value for name, value in design.items() if name not in GAIT_CATALOGUE}
    write_firmware(own, folder, controller="fuzzy-pi-3", scenarios=gait)
    ran = make(folder, "target")
    assert ran.code == 0, ran.out + ran.err
    assert [entry[2] for entry in ran.compared if entry[0] == "all"] == [0, 0]


@pytest.mark.parametrize(
    ("controller", "name"),
    [("fuzzy-pi", "A"), ("fuzzy-pi-3", "fuzzy-pso-ps"), ("pi", "validation")],
)
def test_nothing_computes_with_floating_point(
    controller: ControllerName, name: str, tmp_path: Path
) -> None:
    folder = tmp_path / "firmware"
    write_firmware(published(controller, name), folder, controller=controller, scenarios="1")
    assert make(folder, "sizes").code == 0
    nm = shutil.which("arm-none-eabi-nm", path=f"{os.environ['PATH']}{os.pathsep}{TOOLS}")
    assert nm is not None
    listed = subprocess.run(
        [nm, "-u", *sorted(map(str, (folder / "build").glob("*.o")))],
        capture_output=True,
        text=True,
        check=True,
    )
    needed = set(re.findall(r"^ +U (\S+)$", listed.stdout, re.MULTILINE))
    # Of gcc's own functions only those on integers of 64 bits.
    assert needed <= {"direct_table", "integrated_table", "__aeabi_lmul"}, needed


def test_cycles_are_those_of_the_counted_instructions(brief_a: Path) -> None:
    counted = COUNTED.search(make(brief_a, "target").out)
    ran = make(brief_a, "cycles")
    assert ran.code == 0, ran.out + ran.err
    instructions, cortex, estimated = (
        int(number)
        for number in re.findall(r"^ *(\d+) (?:instructions|cycles)", ran.out, re.MULTILINE)
    )
    assert counted is not None
    assert abs(instructions - int(counted[1])) <= 3
    # An instruction takes one to four cycles, and none is shorter on 16 bits.
    assert instructions < cortex < 4 * instructions
    assert cortex < estimated < Memory.cycles


def test_missing_tools_are_named(brief_a: Path, tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir()
    for name in ("sh", "mkdir", "echo"):
        found = shutil.which(name)
        assert found is not None
        (tmp_path / "bin" / name).symlink_to(found)
    ran = make(brief_a, "target", path=str(tmp_path / "bin"))
    assert ran.code != 0
    assert "gcc-arm-none-eabi" in ran.err
