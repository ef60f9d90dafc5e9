"""Robots of one's own over HTTP: proposed from a URDF by anybody, and looked at."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from gaitswarm.sim.errors import ProcessEnded
from gaitswarm.sim.limited_process import LimitedProcesses
from gaitswarm.sim.proposal import document
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.robot.robot import parse_robot
from tests.examples.hostile import chain
from tests.robots.test_formats import ALONE, DOG, MJCF
from tests.robots.test_proposal import STATUE, dog

pytestmark = pytest.mark.slow


def refused(client: httpx2.Client, path: str, **body: Any) -> dict[str, str]:
    answer = client.post(f"/v1/robots/{path}", json=body)
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"]
    return dict(error)


def test_a_urdf_becomes_a_robot_that_stands_and_can_be_submitted(client: httpx2.Client) -> None:
    body = {"name": "dog", "urdf": dog(foot="cylinder"), "actuator": "torque"}
    answer = client.post("/v1/robots/drafts", json=body)
    assert answer.status_code == 200, answer.text
    draft = answer.json()
    mine = propose_robot(dog(foot="cylinder"), "dog", "torque")
    assert (draft["toml"], draft["urdf"], draft["job"]) == (mine.toml, mine.urdf, mine.job)
    assert draft["guesses"] == list(mine.guesses)

    robot = {"toml": draft["toml"], "urdf": draft["urdf"]}
    answer = client.post("/v1/robots/checks", json=robot)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["guesses"] == draft["guesses"]
    assert (found["name"], found["joints"], len(found["legs"])) == ("dog", 12, 4)
    standing = found["standing"]
    assert standing["normal_forces"] == pytest.approx(standing["weight"], rel=0.02)
    assert standing["weight"] == pytest.approx(9.81 * found["mass"], rel=0.001)

    job = {"robot": robot, **draft["job"], "iterations": 2}
    assert client.post("/v1/estimates", json=job).status_code == 200


def test_a_draft_has_the_actuators_that_are_named_by_joint(client: httpx2.Client) -> None:
    body = {"urdf": dog(), "actuators": {"*": "mx64", "*_hip_joint": "mx106"}}
    draft = client.post("/v1/robots/drafts", json=body).json()
    assert 'actuators = ["mx106", "mx64", "mx64"]' in draft["toml"]
    error = refused(client, "drafts", urdf=dog(), actuators={"*": "mx46"})
    assert "did you mean 'mx64'" in error["message"]


def test_a_robot_that_faces_y_is_turned_when_that_is_said(client: httpx2.Client) -> None:
    quarter = '<joint name="w" type="fixed"><parent link="file"/><child link="trunk"/><origin rpy'
    left = dog().replace(
        "</robot>", f'<link name="file"/>{quarter}="0 0 1.570796"/></joint></robot>'
    )
    drafts = [
        client.post("/v1/robots/drafts", json={"urdf": left, **said}).json()
        for said in ({}, {"forward": "y"})
    ]
    assert ["it seems to face y" in str(draft["guesses"]) for draft in drafts] == [True, False]
    assert "robot_frame" in drafts[1]["urdf"]
    assert drafts[1]["name"] == "dog", "as the URDF has it"
    feet = [draft["job"]["scenarios"][0]["radius"] for draft in drafts]
    straight = propose_robot(dog(), "dog").job["scenarios"][0]["radius"]
    assert feet[1] == pytest.approx(straight, abs=1e-3) != feet[0]


@pytest.mark.parametrize(("text", "name"), [(ALONE, "dog"), (MJCF, "cat")], ids=["xacro", "mjcf"])
def test_xacro_and_mjcf_become_robots_too(client: httpx2.Client, text: str, name: str) -> None:
    body = {"urdf": text, "feet": {"FL_calf": [0.0, 0.0, -0.21]}, "mass": 9.0}
    draft = client.post("/v1/robots/drafts", json=body).json()
    assert draft["name"] == name
    robot = parse_robot(draft["toml"], draft["urdf"])
    assert robot.mass == pytest.approx(9.0)
    lengths = [leg.lengths[2] for leg in robot.legs]
    assert lengths[0] > lengths[1] == pytest.approx(lengths[2])


def test_what_no_body_has_is_reported_by_a_check(client: httpx2.Client) -> None:
    made = propose_robot(dog().replace('ixx="1e-3"', 'ixx="1e-2"'), "dog")
    found = client.post("/v1/robots/checks", json={"toml": made.toml, "urdf": made.urdf}).json()
    assert "cannot have the principal moments" in found["warnings"][0]


@pytest.mark.parametrize(
    ("change", "field", "said"),
    [
        ({"urdf": "<robot"}, "urdf", "not well-formed XML"),
        ({"urdf": " "}, "urdf", "is empty; it must contain the URDF"),
        ({"urdf": chain(4500)}, "urdf", "more than 256 links"),
        ({"urdf": STATUE}, "urdf", "no movable joint"),
        ({"urdf": dog(joints=2)}, "urdf", "three revolute joints"),
        ({"urdf": DOG}, "urdf", "<xacro:include> needs other files; convert it next to them"),
        ({"locks": {"tail": 0.0}}, "urdf", "no movable joint 'tail' to lock"),
        ({"feet": {"tail": [0.0, 0.0, "x"]}}, "feet.tail.2", "must be a number"),
        ({"mass": 0.0}, "mass", "greater than 0"),
        ({"urdf": dog().replace("-2.7", "-120")}, "urdf", "in degrees"),
        ({"urdf": "x" * 800_001}, "urdf", "800000 characters"),
        ({"name": "../dog"}, "name", "cannot name a robot"),
        ({"actuator": "steam"}, "actuator", "auto"),
        ({"up": "w"}, "up", "'-z'"),
        ({"up": "-x", "forward": "x"}, "forward", "at right angles to it"),
    ],
)
def test_a_draft_is_refused_by_field_with_the_way_out(
    client: httpx2.Client, change: dict[str, Any], field: str, said: str
) -> None:
    error = refused(client, "drafts", **{"name": "dog", "urdf": dog(), **change})
    assert error["field"] == field
    assert any(part in error["message"] for part in said.split("|")), error


def test_a_check_is_refused_with_file_and_line(client: httpx2.Client) -> None:
    made = propose_robot(dog(), "dog")
    error = refused(client, "checks", toml=made.toml.replace("[contact]", "["), urdf=made.urdf)
    line = made.toml.splitlines().index("[contact]") + 1
    assert error["field"] == "robot.toml" and f"at line {line}" in error["message"]


def test_a_robot_that_is_larger_than_walks_may_be_is_refused(client: httpx2.Client) -> None:
    made = propose_robot(dog(), "dog")
    tall = made.urdf.replace('xyz="0 0 -0.2"', 'xyz="0 0 -20.0"')
    error = refused(client, "checks", toml=made.toml, urdf=tall)
    assert "robot.toml: a walk of this robot has a hip_height of" in error["message"]
    giant = dog().replace("0 0 -0.2", "0 0 -20")
    error = refused(client, "drafts", name="dog", urdf=giant, mass=11.6)
    assert "should be less than or equal to 10; lengths are in metres" in error["message"]


def test_a_proposal_that_takes_too_much_is_ended(
    client: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    processes = LimitedProcesses(
        "gaitswarm.sim.proposal.document", count=1, seconds=0.01, cpu_seconds=1, memory=2 << 30
    )
    monkeypatch.setattr(document, "PROCESSES", processes)
    with pytest.raises(ProcessEnded):
        processes.ask({"text": dog(), "name": "dog", "actuator": "auto"})
    error = refused(client, "drafts", name="dog", urdf=dog())
    assert error["field"] == "urdf" and "took more than 0.01 s; write one" in error["message"]
    processes.close()
