"""Firmware on this machine reproduces the simulator's outputs for every reading of every walk."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from gaitswarm.firmware import write_firmware
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.emitted.source import kernel_source
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.paths import QUADRUPED, ROOT
from tests.examples.walks import short_walk
from tests.firmware.conftest import make, published, replaced, with_changed_cell

pytestmark = pytest.mark.slow

TRAPPING = "CFLAGS=-O1 -fsanitize=undefined -fsanitize-undefined-trap-on-error"
"""Sums that leave their integers, and places outside of arrays, end the program."""

PID = {"P": 0.4, "I": 0.1, "D": 0.003}


@pytest.mark.variants("fuzzy-pso-ps")
@pytest.mark.parametrize(
    ("controller", "design", "robot"),
    [
        ("fuzzy-pi", published("fuzzy-pi", "A"), "szabadka2-reconstructed"),
        ("fuzzy-pi", published("fuzzy-pi", "B"), "szabadka2-identified"),
        ("fuzzy-pi", published("fuzzy-pi", "C"), "szabadka2"),
        ("fuzzy-pi-3", published("fuzzy-pi-3", "fuzzy-pso-ps"), "szabadka2-reconstructed"),
        ("fuzzy-pi-3", published("fuzzy-pi-3", "fuzzy-pso"), "szabadka2-reconstructed"),
        ("pi", published("pi", "pi-pso-ps"), "szabadka2-reconstructed"),
        ("p", published("p", "2011"), "szabadka2"),
        ("pid", PID, "szabadka2"),
    ],
    ids=["A", "B", "C", "fuzzy-pso-ps", "fuzzy-pso", "pi-pso-ps", "2011", "pid"],
)
def test_every_sample_of_the_six_walks_equals_the_simulators(
    controller: ControllerName, design: Mapping[str, float], robot: str, tmp_path: Path
) -> None:
    view = write_firmware(design, tmp_path / "firmware", controller=controller, robot=robot)
    tested = make(tmp_path / "firmware", "test", TRAPPING)
    assert tested.code == 0, tested.out + tested.err
    files = [f"test/walks/{scenario.name}.walk" for scenario in SCENARIOS]
    assert [name for name, _, _ in tested.compared] == [*files, "all"]
    assert [differing for _, _, differing in tested.compared] == 7 * [0]
    # Six legs of three joints, 500 times a second.
    assert view.samples == sum(18 * walk.ticks for walk in view.walks) > 200_000
    assert tested.compared[-1][1] == view.samples
    assert f"{view.samples} desired angles compared, 0 differing" in tested.out


@pytest.mark.variants("four legs")
@pytest.mark.parametrize(
    "robot",
    [
        RobotVariant(backlash=(2.5, 1.0, 1.0)),
        QUADRUPED,
    ],
    ids=["encoders before the backlash", "four legs"],
)
def test_every_sample_equals_the_simulators_on_other_robots(
    robot: RobotVariant | Path, tmp_path: Path
) -> None:
    gait = short_walk(cycle_time=0.5, stride=0.04, height=0.02)
    if robot is QUADRUPED:
        gait = short_walk(cycle_time=0.5, stride=0.02, height=0.01, radius=0.12, hip_height=0.12)
    design = published("pi", "validation")
    write_firmware(
        design,
        tmp_path / "firmware",
        controller="pi",
        robot=robot,
        scenarios=gait,
    )
    tested = make(tmp_path / "firmware", "test")
    assert tested.code == 0, tested.out + tested.err
    assert tested.compared[-1][2] == 0


@pytest.mark.variants
@pytest.mark.parametrize(
    ("controller", "name"), [("fuzzy-pi", "A"), ("fuzzy-pi-3", "fuzzy-pso-ps")]
)
def test_walks_by_a_coarser_table_are_repeated_too(
    controller: ControllerName, name: str, tmp_path: Path
) -> None:
    folder, design = tmp_path / "firmware", published(controller, name)
    view = write_firmware(
        design, folder, controller=controller, scenarios=["1", "6"], table_bits=(8, 6)
    )
    tested = make(folder, "test")
    assert tested.code == 0, tested.out + tested.err
    assert tested.compared[-1][1:] == (view.samples, 0)
    assert view.tables[0].shape == [256, 64, 1]
    # The remedy for a controller that does not fit otherwise.
    assert view.memory.fits
    assert view.table_difference is not None
    assert all(share is not None and 0.0 < share < 0.5 for share in view.table_difference.values())


@pytest.mark.thorough("test_a_changed_gain_is_detected")
def test_a_changed_cell_that_walks_visit_changes_their_samples(copy_of_a: Path) -> None:
    # No error and no current: every walk begins there.
    with_changed_cell(copy_of_a, 512 * 64)
    tested = make(copy_of_a, "test")
    assert tested.code != 0
    assert tested.compared[-1][2] > 0
    assert "direct table: 65536 cells, CHANGED" in tested.out


def test_a_changed_cell_that_no_walk_visits_is_detected(copy_of_a: Path) -> None:
    with_changed_cell(copy_of_a, 65535)
    tested = make(copy_of_a, "test")
    assert tested.code != 0
    assert tested.compared[-1][2] == 0
    assert "direct table: 65536 cells, CHANGED" in tested.out


def test_a_changed_gain_is_detected(copy_of_a: Path) -> None:
    replaced(copy_of_a / "law.h", "#define INTEGRAL_GAIN 1468879", "#define INTEGRAL_GAIN 1468979")
    tested = make(copy_of_a, "test")
    assert tested.code != 0
    assert tested.compared[-1][2] > 0


@pytest.mark.thorough("test_a_changed_gain_is_detected")
def test_a_changed_trajectory_is_detected(copy_of_a: Path) -> None:
    path = copy_of_a / "trajectories.c"
    replaced(path, '{"normal-fast", rows_0, 755, 5, 6', '{"normal-fast", rows_0, 755, 4, 6')
    tested = make(copy_of_a, "test")
    assert tested.code != 0
    assert tested.compared[-1][2] == 0
    assert "desired angles compared, 0 differing" not in tested.out


@pytest.mark.thorough("test_a_changed_gain_is_detected")
def test_a_truncated_walk_fails(copy_of_a: Path) -> None:
    path = copy_of_a / "test" / "walks" / "slope-fast.walk"
    path.write_bytes(path.read_bytes()[:-1])
    tested = make(copy_of_a, "test")
    assert tested.code != 0
    assert "slope-fast.walk: missing or damaged" in tested.out


def test_integers_that_are_too_narrow_do_not_compile(tmp_path: Path) -> None:
    write_firmware(PID, tmp_path / "firmware", controller="pid", scenarios="1")
    replaced(tmp_path / "firmware" / "law.h", "#define FINE_BITS 64", "#define FINE_BITS 32")
    tested = make(tmp_path / "firmware", "test")
    assert tested.code != 0
    assert "the direct part needs wider integers" in tested.err


def test_firmware_compiles_for_any_label(tmp_path: Path) -> None:
    folder = tmp_path / "firmware"
    gait = short_walk(cycle_time=0.5, stride=0.04)
    label = "*/ #error /* $P ${I} */*/ \u00fc \\"
    write_firmware({"P": 0.25, "I": 0.0}, folder, controller="pi", scenarios=gait, label=label)
    tested = make(folder, "test")
    assert tested.code == 0, tested.out + tested.err


def test_simulator_and_firmware_compile_the_same_source(published_a: Path) -> None:
    text = (published_a / "tick.c").read_text(encoding="utf-8")
    assert text == (ROOT / "sim" / "kernel" / "emitted" / "tick.c").read_text(encoding="utf-8")
    assert text in kernel_source(load_robot("szabadka2"))
