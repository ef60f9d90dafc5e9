"""`gaitswarm firmware` of published designs, files and jobs, and the way back from the robot."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from gaitswarm.sim.firmware.folder import MANIFEST
from gaitswarm.sim.scenario import SCENARIOS
from tests.cli.conftest import Finished, Gaitswarm, WriteJson
from tests.examples.commands import synthesize
from tests.examples.walks import PUBLISHED_A, SHORT_WALK
from tests.firmware.conftest import make

pytestmark = pytest.mark.slow


def test_json_lists_files_sizes_and_samples(gaitswarm: Gaitswarm, tmp_path: Path) -> None:
    folder = tmp_path / "firmware"
    done = gaitswarm("firmware", "published:A", "--output", folder, "--scenarios", "1,6", "--json")
    assert done.code == 0, done.err
    found = {
        path.relative_to(folder).as_posix(): path.stat().st_size
        for path in folder.rglob("*")
        if path.is_file()
    }
    assert done.json["files"] == found
    assert [walk["scenario"] for walk in done.json["walks"]] == ["normal-fast", "turn-right-fast"]
    assert done.json["samples"] == 2 * 2250 * 18
    assert done.json["tables"] == [{"name": "direct", "shape": [1024, 64, 1], "bytes": 65536}]
    assert [t["columns"] for t in done.json["trajectories"]] == [6, 12]
    memory = done.json["memory"]
    assert (memory["flash"], memory["ram"], memory["cycles"]) == (116 << 10, 8 << 10, 32_000)
    assert memory["fits"] is True and memory["remarks"] == []


def test_all_six_scenarios_are_written_unless_some_are_named(
    gaitswarm: Gaitswarm, tmp_path: Path
) -> None:
    done = gaitswarm("firmware", "published:A", "-o", tmp_path / "firmware")
    assert done.code == 0, done.err
    assert all(scenario.name in done.out for scenario in SCENARIOS)
    assert "65536 B of the 118784 B of flash" in done.out
    assert "does not fit" not in done.out
    assert "make -C" in done.err


def test_tables_that_do_not_fit_are_reported(gaitswarm: Gaitswarm, tmp_path: Path) -> None:
    walk = ("--controller", "fuzzy-pi-3", "--scenarios", "1", "-o", tmp_path / "firmware")
    done = gaitswarm("firmware", "published:fuzzy-pso-ps", *walk)
    assert done.code == 0, done.err
    assert "does not fit: tables of 131072 B" in done.out
    assert "does not fit:** tables of 131072 B" in (tmp_path / "firmware" / "README.md").read_text()


def test_a_job_gives_its_best_its_robot_and_its_scenarios(
    finished: Finished, gaitswarm: Gaitswarm, tmp_path: Path
) -> None:
    folder = tmp_path / "firmware"
    done = gaitswarm("firmware", finished.id, "--db", finished.db, "-o", folder, "--json")
    assert done.code == 0, done.err
    assert done.json["controller"] == finished.job["spec"]["controller"]
    assert done.json["design"] == finished.job["best"]["design"]
    walked = [s if isinstance(s, str) else s["name"] for s in finished.job["spec"]["scenarios"]]
    assert [walk["scenario"] for walk in done.json["walks"]] == walked
    manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    assert manifest["robot"] == finished.job["spec"]["robot"]
    tested = make(folder, "test")
    assert tested.code == 0, tested.out + tested.err


@pytest.mark.variants("robot0")
@pytest.mark.parametrize(
    "robot",
    [(), ("--robot", '{"contact_law": "linear_zone"}')],
)
def test_the_way_back_is_one_command(
    robot: tuple[str, ...],
    gaitswarm: Gaitswarm,
    write_json: WriteJson,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walk = str(write_json(SHORT_WALK | {"cycles": 2, "cycle_time": 0.6}, "short.json"))
    design = str(write_json({"P": 0.4, "I": 0.1}, "stiff.json"))
    own = ("--controller", "pi", *robot)
    assert gaitswarm("firmware", design, "--scenarios", walk, *own, "-o", tmp_path / "fw").code == 0
    # What the robot would record if it differed in its mass alone, and with its sensors' noise.
    heavier = str(write_json({"body_mass": 3.5}, "heavier.json"))
    measured = tmp_path / "fw" / "build" / "measured.csv"
    measured.parent.mkdir()
    recorded = synthesize(
        *("--design", design, "--scenario", walk, "-o", measured),
        *(*own, "--parameters", heavier),
    )
    assert recorded.code == 0, recorded.err
    text = (tmp_path / "fw" / "README.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^gaitswarm (validate .*)$", text, re.MULTILINE)
    monkeypatch.chdir(tmp_path / "fw")
    words = [str(measured) if w == "measured.csv" else w for w in shlex.split(command)]
    done = gaitswarm(*words, "--json")
    assert done.code == 0, done.err
    angles = next(q for q in done.json["quantities"] if q["quantity"] == "q_D")
    assert angles["whole"]["mae"] < 1e-4


def test_the_angles_of_a_job_are_written_for_servos(
    finished: Finished, gaitswarm: Gaitswarm, tmp_path: Path
) -> None:
    arguments = ("trajectories", finished.id, "--db", finished.db, "--rate", "20", "-o")
    done = gaitswarm(*arguments, tmp_path / "json", "--json")
    assert done.code == 0, done.err
    scenarios = [s if isinstance(s, str) else s["name"] for s in finished.job["spec"]["scenarios"]]
    assert [of["scenario"] for of in done.json["scenarios"]] == scenarios
    assert set(done.json["files"]) == {path.name for path in (tmp_path / "json").iterdir()}
    said = gaitswarm(*arguments, tmp_path / "text")
    assert "rad/s" in said.out and scenarios[0] in said.out
    assert f"{4 * len(scenarios) + 1} files of 18 joints" in said.err


def test_a_folder_of_something_else_is_refused(gaitswarm: Gaitswarm, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    done = gaitswarm("firmware", "published:A", "-o", tmp_path)
    assert done.code == 2
    assert "not empty" in done.err and "output" in done.err
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("published:Z",), "known are A, B, C"),
        (("published:A", "--scenarios", "moonwalk"), "unknown scenario"),
        (("published:A", "--controller", "pi"), "pi-pso-ps"),
        (("published:A", "--robot", "unknown"), "unknown robot"),
        (("published:A", "--table-bits", "8"), "table_bits: '8' is not a resolution such as 8x6"),
        (
            ("published:A", "--table-bits", "18x6"),
            "table_bits: 18 bits of angle error: must be 2 to",
        ),
        (
            ("published:2011", "--controller", "p", "--table-bits", "8x6"),
            "table_bits: p has no table",
        ),
    ],
)
def test_bad_input_lists_the_choices(
    arguments: tuple[str, ...], said: str, gaitswarm: Gaitswarm, tmp_path: Path
) -> None:
    done = gaitswarm("firmware", *arguments, "-o", tmp_path / "firmware")
    assert done.code == 2
    assert said in done.err
    assert not (tmp_path / "firmware").exists()


def test_a_missing_job_is_not_found(gaitswarm: Gaitswarm, db: Path) -> None:
    done = gaitswarm("firmware", "nothing", "--db", db, "-o", db.with_name("firmware"))
    assert done.code == 3, done.err


def test_a_design_of_the_published_values_is_the_published_one(
    gaitswarm: Gaitswarm, write_json: WriteJson, tmp_path: Path
) -> None:
    own = str(write_json(PUBLISHED_A, "own.json"))
    for name, design in (("a", "published:A"), ("b", own)):
        assert gaitswarm("firmware", design, "--scenarios", "1", "-o", tmp_path / name).code == 0
    for file in ("law.h", "tables.c", "trajectories.c", "test/walks/normal-fast.walk"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
