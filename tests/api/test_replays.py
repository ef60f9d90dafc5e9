"""A walk as bytes, read as docs/reference/http.md says."""

from __future__ import annotations

import json
from typing import Any

import httpx2
import jsonschema
import numpy as np
import pytest

from gaitswarm.sim.outcome import OBJECTIVE_NAMES
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.api_document import api_document
from tests.examples.hostile import TOML, chain
from tests.examples.paths import QUADRUPED
from tests.examples.servers import unframed
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, quadruped_files

pytestmark = pytest.mark.slow


REQUEST: dict[str, Any] = {"design": PUBLISHED_A, "scenario": SHORT_WALK}


def replayed(client: httpx2.Client, **body: Any) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header, and the numbers of every channel by name: (frames, *shape)."""
    answer = client.post("/v1/replays", json=REQUEST | body)
    assert answer.status_code == 200, answer.text
    assert answer.headers["Content-Type"] == "application/octet-stream"
    assert answer.headers["Cache-Control"] == "no-store"
    header, numbers = unframed(answer.content)
    frames = numbers.reshape(header["frames"], -1)
    channels = {}
    for channel in header["channels"]:
        begin, size = channel["offset"], int(np.prod(channel["shape"]))
        channels[channel["name"]] = frames[:, begin : begin + size].reshape(-1, *channel["shape"])
    return header, channels


def refused(client: httpx2.Client, **change: Any) -> dict[str, Any]:
    answer = client.post("/v1/replays", json=REQUEST | change)
    assert answer.status_code == 422, answer.text
    problem: dict[str, Any] = answer.json()
    return problem


def test_channels_fill_a_frame_one_after_the_other(client: httpx2.Client) -> None:
    header, channels = replayed(client)
    offset = 0
    for channel in header["channels"]:
        assert channel["offset"] == offset
        assert len(channel["labels"]) in (0, channel["shape"][0])
        offset += int(np.prod(channel["shape"]))
    robot = header["robot"]
    links, legs, joints = (len(robot[part]) for part in ("links", "legs", "joints"))
    assert {name: values.shape[1:] for name, values in channels.items()} == {
        "time": (1,),
        "link_pose": (links, 7),
        "foot_position": (legs, 3),
        "foot_force": (legs, 3),
        "joint_angle": (joints,),
        "desired_angle": (joints,),
        "motor_angle": (joints,),
        "current": (joints,),
        "voltage": (joints,),
        "load_torque": (joints,),
        "body_acceleration": (3,),
        "body_velocity": (6,),
        "supply": (1,),
    }
    # Nothing comes after the last channel.
    assert offset == sum(int(np.prod(values.shape[1:])) for values in channels.values())


def test_the_header_is_as_the_openapi_document_says(client: httpx2.Client) -> None:
    header, _ = replayed(client)
    document = api_document()
    schema = {"$ref": "#/components/schemas/ReplayHeaderView", "components": document["components"]}
    jsonschema.Draft202012Validator(schema).validate(header)


def test_a_preset_is_replayed_at_the_asked_rate(client: httpx2.Client) -> None:
    header, channels = replayed(client, scenario="1", rate=25)
    assert header["scenario"] == SCENARIOS[0].model_dump(mode="json")
    assert (header["version"], header["rate"], header["frames"]) == (1, 25.0, 113)
    assert header["duration"] == pytest.approx(4.5)
    assert (header["status"], header["explanation"]) == ("ok", "walked to the end")
    assert channels["time"][:, 0] == pytest.approx(np.arange(113) / 25.0)
    assert channels["link_pose"][-1, 0, 0] > 0.25
    assert np.linalg.norm(channels["link_pose"][:, :, 3:], axis=2) == pytest.approx(1.0, abs=1e-6)
    # The battery gives way under its load.
    assert 8.0 < channels["supply"].min() < channels["supply"].max() <= 11.6 + 1e-6


def test_objectives_and_columns_are_the_simulations(client: httpx2.Client) -> None:
    body = {"design": PUBLISHED_A, "scenarios": [SHORT_WALK], "log": True}
    result = client.post("/v1/simulations", json=body).json()["scenarios"]["short"]
    header, channels = replayed(client, rate=500)
    assert header["objectives"] == result["objectives"]
    assert list(header["objectives"]) == list(OBJECTIVE_NAMES)
    assert list(header["objective_units"]) == list(OBJECTIVE_NAMES)
    assert header["objective_units"]["energy"] == "J/m"
    log = {name: np.array(column["values"]) for name, column in result["log"]["columns"].items()}
    for name in ("joint_angle", "desired_angle", "current", "voltage", "load_torque", "foot_force"):
        np.testing.assert_array_equal(channels[name], log[name].astype(np.float32), err_msg=name)
    np.testing.assert_array_equal(
        channels["link_pose"][:, 0, :3], log["base_position"].astype(np.float32)
    )
    np.testing.assert_array_equal(channels["body_velocity"], log["base_velocity"].astype("f4"))


def test_what_is_seen_of_the_robot_is_in_the_header(client: httpx2.Client) -> None:
    header, channels = replayed(client, scenario={**SHORT_WALK, "load": 2.0})
    robot = load_robot("szabadka2")
    assert header["robot"]["joints"] == list(robot.joint_names)
    assert header["robot"]["legs"] == [leg.name for leg in robot.legs]
    shapes = [(link["name"], s) for link in header["robot"]["links"] for s in link["shapes"]]
    roles = [shape["role"] for _, shape in shapes]
    parts = ("body", "coxa", "femur", "tibia", "foot", "load")
    assert [roles.count(part) for part in parts] == [1, 6, 6, 6, 6, 1]
    assert [name for name, shape in shapes if shape["role"] == "load"] == ["body"]
    assert header["load_kg"] == 2.0
    # A sole's sphere, of a size of its own, reaches the ground where the foot is pressed.
    radii = np.array([s["size"][0] for _, s in shapes if s["role"] == "foot"])
    pressed = channels["foot_force"][:, :, 2] > 1.0
    assert pressed.any(axis=0).all()
    assert (channels["foot_position"][:, :, 2] < radii)[pressed].all()


def test_on_a_slope_gravity_is_tilted_and_the_ground_is_not(client: httpx2.Client) -> None:
    slope = {**SHORT_WALK, "slope": 10.0, "slope_direction": 90.0}
    header, channels = replayed(client, scenario=slope)
    assert header["ground"] == {
        "slope_deg": 10.0,
        "slope_direction_deg": 90.0,
        "normal": [0.0, 0.0, 1.0],
        "heights": None,
    }
    # It rises to the left, so that the robot is drawn to the right.
    expected = [0.0, -9.81 * np.sin(np.radians(10.0)), -9.81 * np.cos(np.radians(10.0))]
    assert header["gravity"] == pytest.approx(expected)
    assert channels["link_pose"][-1, 0, 1] < 0.0


def test_uneven_ground_of_a_world_lies_below_the_feet_that_it_carries(
    client: httpx2.Client,
) -> None:
    world = {"roughness": 0.02, "world_seed": 7}
    header, channels = replayed(client, scenario=SHORT_WALK, world=world)
    x, y, z = (np.array(header["ground"]["heights"][axis]) for axis in "xyz")
    assert z.shape == (len(x), len(y)) and 0.01 < np.ptp(z) <= 0.04
    feet = channels["foot_position"][0]
    rows, columns = (np.abs(axis[:, None] - feet[:, k]).argmin(0) for k, axis in enumerate((x, y)))
    above = feet[:, 2] - z[rows, columns]
    # At the start the highest soles carry the robot, pressed into the ground; the others hover.
    assert -0.02 < above.min() < 0.01 and above.max() < 0.05


def test_the_scenario_is_shown_as_the_designs_gait_walked_it(client: httpx2.Client) -> None:
    header, _ = replayed(client, design={**PUBLISHED_A, "cycle_time": 1.2, "fir_ms": 20})
    assert (header["scenario"]["cycle_time"], header["scenario"]["fir_ms"]) == (1.2, 20)
    assert header["duration"] == pytest.approx(1.2)


def test_a_walk_that_fell_is_replayed_up_to_its_end(client: httpx2.Client) -> None:
    header, channels = replayed(client, scenario={**SHORT_WALK, "load": 50.0})
    assert header["status"] == "fell"
    assert set(header["objectives"].values()) == {None}
    assert header["frames"] == len(channels["time"]) < 50
    assert 0.0 < header["duration"] < 1.0
    assert all(np.isfinite(values).all() for values in channels.values())


def test_a_robot_of_ones_own_can_be_watched(client: httpx2.Client) -> None:
    crawl = json.loads((QUADRUPED / "crawl.json").read_text(encoding="utf-8"))
    header, channels = replayed(
        client, robot=quadruped_files().model_dump(), scenario={**crawl, "cycles": 1}
    )
    assert header["robot"]["name"] == "quadruped"
    assert channels["foot_position"].shape == (100, 4, 3)
    assert channels["link_pose"].shape == (100, 17, 7)


@pytest.mark.parametrize(
    ("change", "field", "hint"),
    [
        ({"scenario": "on-the-moon"}, "scenario", "known are"),
        ({"rate": 501}, "rate", "500"),
        ({"rate": 0}, "rate", "1"),
        ({"design": {"I": 0.2}}, "design", "FI1R"),
        ({"design": {**PUBLISHED_A, "FI1R": -5.0}}, "design", "FI1R"),
        ({"design": {**PUBLISHED_A, "stride": 0.9}}, "scenario", "misses its foot trajectory"),
        ({"design": {**PUBLISHED_A, "cycle_time": 1e6}}, "scenario", "40 s allowed with logs"),
        ({"scenarios": ["1"]}, "scenarios", "unknown key"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, change: dict[str, Any], field: str, hint: str
) -> None:
    problem = refused(client, **change)
    assert field in [error["field"] for error in problem["errors"]]
    assert hint in problem["detail"]


def test_a_replay_of_more_poses_than_fit_is_refused_before_the_walk(client: httpx2.Client) -> None:
    walk = {"name": "long", "cycle_time": 1.0, "radius": 0.16, "hip_height": 0.15, "cycles": 39}
    robot = {"toml": TOML, "urdf": chain(200)}
    problem = refused(client, robot=robot, scenario=walk, rate=500)
    assert problem["errors"][0]["field"] == "rate"
    assert "more than 1000000; choose fewer frames" in problem["detail"]
