"""Forms of identification and calibration, from upload to submission."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from gaitswarm.sim.measurement.measured_log import MeasuredWalk
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotFiles, load_robot
from gaitswarm.sim.robot.identifiable import identifiable_variables
from gaitswarm.sim.scenario import find_scenario
from scripts.measured_logs import format_measured_log
from tests.examples.paths import QUADRUPED
from tests.examples.servers import Server, ServerProcess
from tests.examples.walks import PUBLISHED_A
from tests.web.test_views import findings
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

PASTE = """(field, text) => {
  const clipboardData = new DataTransfer()
  clipboardData.setData('text', text)
  const options = { clipboardData, cancelable: true, bubbles: true }
  field.dispatchEvent(new ClipboardEvent('paste', options))
}"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Log of one cycle of the first preset with the form's initial design."""
    scenario = find_scenario("normal-fast").model_copy(update={"cycles": 1.0})
    walk = MeasuredWalk.of(load_robot(DEFAULT_ROBOT), scenario, "fuzzy-pi", PUBLISHED_A)
    path = tmp_path_factory.mktemp("log") / "walk.csv"
    path.write_text(format_measured_log(walk.simulated()), encoding="utf-8")
    return path


def upload(page: Page, log: Path) -> None:
    page.get_by_label("Log").set_input_files(log)
    page.get_by_role("button", name="Upload the log").click()


def submitted(page: Page) -> str:
    """Submit the form; returns the id of the job."""
    page.get_by_role("button", name="Submit the job").click()
    expect(page).to_have_url(re.compile(r"/jobs/(?!new)[^/?]+$"))
    return page.url.rsplit("/", 1)[1]


def test_a_log_is_uploaded_and_an_identification_submitted(
    start_server: Callable[..., Server], log: Path, tmp_path: Path, visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url, allowed="422").go("/jobs/new")
    page.get_by_role("link", name="an identification from measured walks").click()
    # Errors of a log are shown at its field.
    page.get_by_role("button", name="Upload the log").click()
    expect(page.get_by_label("Log")).to_have_accessible_description("choose a file first")
    lines = log.read_text(encoding="utf-8").splitlines()
    broken = tmp_path / "broken.csv"
    broken.write_text("\n".join([*lines[:9], "warp" + lines[9], *lines[10:]]), encoding="utf-8")
    upload(page, broken)
    message = re.compile(r"line 10, column 'time \[s\]': 'warp.*' is not a number")
    expect(page.get_by_label("Log")).to_have_accessible_description(message)

    page.get_by_label("Cycles").fill("2")
    upload(page, log)
    read = page.get_by_role("region", name="Log summary")
    expect(read).to_contain_text(
        "1.500 s in 750 rows. The walk starts 0 s into the log. 1 complete"
    )
    expect(read).to_contain_text(re.compile("The log (validates|does not validate) the model"))
    expect(read.get_by_role("row").filter(has_text="I_M")).to_contain_text("18")
    recording = str(read.get_attribute("data-recording"))
    selected = page.locator(f"[data-item='{recording}']")
    expect(selected).to_contain_text("1.50 s of normal-fast")

    # The recording remains stored and can be selected again.
    page.get_by_role("button", name=f"Remove {recording[:12]}").click()
    expect(selected).to_have_count(0)
    field = page.get_by_role("combobox", name="Stored recordings")
    field.fill("NORMAL-F")
    offered = page.get_by_role("option", name=re.compile(recording[:12]))
    expect(offered).to_contain_text("18 joints")
    offered.click()
    expect(selected).to_contain_text("1.50 s of normal-fast")
    field.fill(recording)
    expect(page.get_by_text("No matches.")).to_be_visible()
    field.press("Escape")
    page.get_by_role("button", name=f"Remove {recording[:12]}").click()
    expect(selected).to_have_count(0)
    field.evaluate(PASTE, f"{recording}\n{recording}")
    expect(selected).to_have_count(1)

    page.get_by_role("button", name="Fit none").click()
    for name in ("body_mass", "battery_voltage"):
        page.get_by_label(f"Treatment of {name}", exact=True).select_option("fitted")
    mass = page.get_by_label("Lower bound of body_mass")
    expect(mass).to_have_value("2")
    mass.fill("light")
    expect(mass).to_have_attribute("aria-invalid", "true")
    mass.fill("3")
    page.get_by_label("Links").fill("1, 2")
    spec = server.job(submitted(page))["spec"]
    assert (spec["kind"], spec["recordings"], spec["links"]) == (
        "identification",
        [recording],
        [1, 2],
    )
    assert [(v["name"], v["low"]) for v in spec["variables"]] == [
        ("battery_voltage", 8.0),
        ("body_mass", 3.0),
    ]


def test_a_calibration_has_targets_of_a_log_and_typed_ones(
    start_server: Callable[..., Server], log: Path, visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url, allowed="422").go("/jobs/new?kind=calibration")
    page.get_by_label("Cycles").fill("1")
    upload(page, log)
    value = page.get_by_label("value of target 1")
    expect(value).not_to_have_value("")
    page.get_by_label("tolerance of target 2").fill("0.3")
    page.get_by_role("button", name="Add target").click()
    page.get_by_label("value of target 3").fill("fast")
    expect(page.get_by_text("entry 3, value:")).to_be_visible()
    page.get_by_label("value of target 3").fill("0.15")
    measured = float(value.input_value())
    spec = server.job(submitted(page))["spec"]
    assert spec["kind"] == "calibration"
    assert [(t["quantity"], t["tolerance"], t["use"]) for t in spec["targets"]] == [
        ("mean_current", 0.1, "fit"),
        ("peak_current", 0.3, "predict"),
        ("speed", 0.1, "fit"),
    ]
    assert spec["targets"][0]["value"] == measured
    assert spec["walks"][0]["design"] == PUBLISHED_A
    assert spec["walks"][0]["scenarios"][0]["cycles"] == 1.0


@pytest.mark.thorough("test_a_calibration_has_targets_of_a_log_and_typed_ones, of a table")
def test_a_calibration_has_targets_of_a_table_without_a_log(
    start_server: Callable[..., Server], tmp_path: Path, visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url, allowed="422").go("/jobs/new?kind=calibration")
    table = tmp_path / "targets.csv"
    table.write_text(
        "scenario,quantity,value,tolerance,use\n"
        "normal-fast,speed,0.05,0.05\nnormal-fast,mean current,0.4,,predict\n"
        "slope-fast,energy,90\n",
        encoding="utf-8",
    )
    page.get_by_label("Table", exact=True).set_input_files(table)
    typed = page.get_by_label("Targets, one per line")
    expect(page.get_by_label("value of target 3")).to_have_value("90")
    typed.press("End")
    typed.press_sequentially("normal-slow")
    expect(typed).to_have_accessible_description(re.compile("is not: scenario, quantity, value"))
    typed.press_sequentially(", speed, 0.03")
    expect(page.get_by_label("value of target 4")).to_have_value("0.03")
    spec = server.job(submitted(page))["spec"]
    assert [walk["scenarios"][0]["name"] for walk in spec["walks"]] == [
        *("normal-fast", "slope-fast", "normal-slow")
    ]
    assert [(t["walk"], t["quantity"], t["tolerance"], t["use"]) for t in spec["targets"]] == [
        ("walk-1", "speed", 0.05, "fit"),
        ("walk-1", "mean_current", 0.1, "predict"),
        ("walk-2", "energy", 0.1, "fit"),
        ("walk-3", "speed", 0.1, "fit"),
    ]
    assert spec["walks"][0]["design"] == PUBLISHED_A


@pytest.mark.thorough("test_views_are_accessible_at_every_width")
def test_targets_of_a_log_are_accessible_at_every_width(
    server: ServerProcess, log: Path, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url, allowed="422", bypass_csp=True).go("/jobs/new?kind=calibration")
    page.get_by_label("Cycles").fill("1")
    upload(page, log)
    expect(page.get_by_label("value of target 1")).not_to_have_value("")
    assert findings(page) == {}


@pytest.mark.thorough("test_a_log_is_uploaded_and_an_identification_submitted")
def test_parameters_of_a_custom_robot_are_those_of_its_legs(
    server: ServerProcess, log: Path, visit: Callable[..., Visit]
) -> None:
    read = server.client.post(
        "/v1/measured-walks",
        json={
            "robot": DEFAULT_ROBOT,
            "scenario": find_scenario("normal-fast").model_dump(mode="json") | {"cycles": 1.0},
            "controller": "fuzzy-pi",
            "design": PUBLISHED_A,
            "log": log.read_text(encoding="utf-8"),
        },
    )
    recording = read.json()["recording"]["id"]
    page = visit(server.url, allowed="422").go(
        f"/jobs/new?kind=identification&recordings={recording}"
    )
    # Six legs with a foot and three gearheads each, battery and body.
    parameters = page.locator("summary").filter(has_text="Parameters:")
    expect(parameters).to_have_text("Parameters: 45 of 45 fitted")
    page.get_by_role("button", name="My robot", exact=True).click()
    page.get_by_text("Actuators, robot.toml and job.json").click()
    page.get_by_label("URDF, xacro or MJCF").set_input_files(QUADRUPED / "robot.urdf")
    page.get_by_label("robot.toml").set_input_files(QUADRUPED / "robot.toml")
    toml, urdf = (
        (QUADRUPED / name).read_text(encoding="utf-8") for name in ("robot.toml", "robot.urdf")
    )
    robot = load_robot(RobotFiles(toml=toml, urdf=urdf))
    fitted = len(identifiable_variables(robot))
    expect(parameters).to_have_text(f"Parameters: {fitted} of {fitted} fitted")
