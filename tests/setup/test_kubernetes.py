"""The manifests in deploy/kubernetes name commands, settings, versions and objects that exist.

They are checked as texts, together with those of Compose: applying them takes a cluster.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from gaitswarm.services.worker import ray_node
from gaitswarm.settings import Settings, is_loopback
from tests.examples.api_document import api_document
from tests.examples.paths import ROOT
from tests.setup import command_line, settings_classes
from tests.setup.compose import CLUSTER

FOLDER = ROOT / "deploy" / "kubernetes"
KUSTOMIZATION: dict[str, Any] = yaml.safe_load(
    (FOLDER / "kustomization.yaml").read_text(encoding="utf-8")
)
MANIFESTS: list[dict[str, Any]] = [
    manifest
    for name in KUSTOMIZATION["resources"]
    for manifest in yaml.safe_load_all((FOLDER / name).read_text(encoding="utf-8"))
]
EXAMPLE = (FOLDER / "secrets.env.example").read_text(encoding="utf-8")
SECRETS = set(re.findall(r"^(\w+)=$", EXAMPLE, re.MULTILINE))


def _of_kind(kind: str) -> dict[str, Any]:
    return {m["metadata"]["name"]: m["spec"] for m in MANIFESTS if m["kind"] == kind}


def _pods() -> dict[str, Any]:
    """Specifications of pods, by what makes them."""
    (cluster,) = _of_kind("RayCluster").values()
    pods = {name: spec["template"]["spec"] for name, spec in _of_kind("Deployment").items()}
    pods |= {name: spec["template"]["spec"] for name, spec in _of_kind("StatefulSet").items()}
    pods["head"] = cluster["headGroupSpec"]["template"]["spec"]
    for group in cluster["workerGroupSpecs"]:
        pods[group["groupName"]] = group["template"]["spec"]
    return pods


PODS = _pods()
CONTAINERS = {name: pod["containers"][0] for name, pod in PODS.items()}
OURS = {n: c for n, c in CONTAINERS.items() if c["image"].partition(":")[0] == "gaitswarm"}
RAY_NODES = {name: OURS[name] for name in ("head", "walkers", "gaitswarm-runner")}


def _variables(container: dict[str, Any]) -> dict[str, Any]:
    return {entry["name"]: entry for entry in container.get("env", [])}


def test_there_is_everything_that_a_cluster_needs() -> None:
    assert set(PODS) == {
        *("gaitswarm-postgres", "gaitswarm-runner", "gaitswarm-api", "head", "walkers")
    }
    assert set(PODS) - set(OURS) == {"gaitswarm-postgres"}
    written = {path.name for path in FOLDER.glob("*.yaml")}
    assert written == {*KUSTOMIZATION["resources"], "kustomization.yaml", "images.yaml"}


def test_images_are_those_of_docker_compose() -> None:
    ours, theirs = CLUSTER["services"]["server"]["image"], CLUSTER["services"]["postgres"]["image"]
    assert {container["image"] for container in OURS.values()} == {ours}
    assert CONTAINERS["gaitswarm-postgres"]["image"] == theirs
    (chosen,) = KUSTOMIZATION["images"]
    assert f"{chosen['name']}:{chosen['newTag']}" == ours
    paths = yaml.safe_load((FOLDER / "images.yaml").read_text(encoding="utf-8"))["images"]
    assert {p["path"].split("/")[1] for p in paths} == {"headGroupSpec", "workerGroupSpecs"}


def test_the_cluster_has_the_version_of_ray_that_the_image_has() -> None:
    lock = (ROOT / "requirements" / "image.lock").read_text(encoding="utf-8")
    (version,) = re.findall(r"^ray==([\d.]+)", lock, re.MULTILINE)
    assert _of_kind("RayCluster")["gaitswarm"]["rayVersion"] == version


def test_commands_are_those_of_docker_compose_and_exist() -> None:
    services = CLUSTER["services"]
    assert OURS["gaitswarm-api"]["command"] == services["server"]["command"]
    assert OURS["gaitswarm-runner"]["command"] == services["runner"]["command"]
    probes = [
        container[kind]["exec"]["command"]
        for container in OURS.values()
        for kind in ("readinessProbe", "livenessProbe")
        if "exec" in container.get(kind, {})
    ]
    for program, *arguments in [c["command"] for c in OURS.values() if "command" in c] + probes:
        assert program in ("gaitswarm", "ray", "sh")
        assert program != "gaitswarm" or command_line.problem(arguments) is None


def test_a_node_is_alive_while_its_raylet_is_and_the_head_answers() -> None:
    (cluster,) = _of_kind("RayCluster")
    address = f"{cluster}-head-svc:6379"
    for name in ("head", "walkers"):
        ready, alive = (OURS[name][kind] for kind in ("readinessProbe", "livenessProbe"))
        assert ready["exec"]["command"] == ["ray", "health-check", f"--address={address}"]
        asked = (
            f"python -m {ray_node.__name__} --check 6379 && ray health-check --address={address}"
        )
        assert alive == ready | {"exec": {"command": ["sh", "-c", asked]}}


def test_probes_ask_routes_that_exist() -> None:
    paths = set(api_document()["paths"])
    api, runner = OURS["gaitswarm-api"], OURS["gaitswarm-runner"]
    for kind in ("readinessProbe", "livenessProbe"):
        assert api[kind]["httpGet"]["path"] in paths
        assert api[kind]["httpGet"]["port"] == api["ports"][0]["containerPort"]
    port = int(_variables(runner)["GAITSWARM_METRICS_PORT"]["value"])
    assert runner["livenessProbe"]["httpGet"] == {"path": "/healthz", "port": port}
    assert runner["ports"] == [{"containerPort": port}]
    assert not is_loopback(_variables(runner)["GAITSWARM_METRICS_HOST"]["value"])


def test_a_runner_has_time_to_commit_what_is_under_way() -> None:
    seconds = PODS["gaitswarm-runner"]["terminationGracePeriodSeconds"]
    assert seconds >= 1.25 * Settings().drain_seconds


def test_settings_of_ours_exist() -> None:
    given = {name for container in OURS.values() for name in _variables(container)}
    ours = {name for name in given if name.startswith("GAITSWARM_")}
    assert {"GAITSWARM_DB", "GAITSWARM_RAY_ADDRESS"} <= ours
    assert ours <= settings_classes.variables()


def test_secrets_are_never_written_and_are_in_the_example() -> None:
    used = {
        reference["key"]
        for container in CONTAINERS.values()
        for entry in container.get("env", [])
        if (reference := entry.get("valueFrom", {}).get("secretKeyRef"))
    }
    assert used == SECRETS
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    assert "deploy/kubernetes/secrets.env" in ignored
    for container in CONTAINERS.values():
        for entry in container.get("env", []):
            assert not (set(entry) >= {"value"} and entry["name"] in SECRETS)


@pytest.mark.parametrize(
    "variable", ["RAY_AUTH_MODE", "RAY_AUTH_TOKEN", "NPY_DISABLE_CPU_FEATURES"]
)
def test_all_nodes_and_the_runner_are_given_the_same(variable: str) -> None:
    given = [_variables(container)[variable] for container in RAY_NODES.values()]
    assert given[1:] == given[:-1]
    nodes = [CLUSTER["services"][n]["environment"] for n in ("ray-head", "ray-worker", "runner")]
    assert len({node[variable] for node in nodes}) == 1


def test_the_runner_is_inside_the_cluster_and_the_head_has_no_slots() -> None:
    (name,) = _of_kind("RayCluster")
    address = _variables(OURS["gaitswarm-runner"])["GAITSWARM_RAY_ADDRESS"]["value"]
    assert address == f"{name}-head-svc:6379"
    assert not CLUSTER["services"]["runner"]["environment"]["GAITSWARM_RAY_ADDRESS"].count("//")
    head = _of_kind("RayCluster")[name]["headGroupSpec"]
    assert head["rayStartParams"]["num-cpus"] == "0"
    for group in (head, *_of_kind("RayCluster")[name]["workerGroupSpecs"]):
        assert all(isinstance(value, str) for value in group["rayStartParams"].values())


def test_the_api_asks_for_a_token_where_it_listens_to_all() -> None:
    api = OURS["gaitswarm-api"]
    assert api["command"][api["command"].index("--host") + 1] == ".".join("0000")
    assert _variables(api)["GAITSWARM_API_ACCESS"]["value"] == "token"


@pytest.mark.parametrize("name", PODS)
def test_every_pod_runs_without_root(name: str) -> None:
    security = PODS[name]["securityContext"]
    assert security["runAsNonRoot"] is True
    assert security["runAsUser"] > 0
    container = CONTAINERS[name]
    assert security["seccompProfile"] == {"type": "RuntimeDefault"}
    assert container["securityContext"]["allowPrivilegeEscalation"] is False
    assert container["securityContext"]["capabilities"] == {"drop": ["ALL"]}
    assert "privileged" not in container["securityContext"]
    mounted = {mount["name"] for mount in container["volumeMounts"]}
    volumes = {volume["name"] for volume in PODS[name].get("volumes", [])}
    claims = _of_kind("StatefulSet").get(name, {}).get("volumeClaimTemplates", [])
    assert mounted == volumes | {claim["metadata"]["name"] for claim in claims}


def test_a_policy_lets_in_who_uses_a_pod_and_nobody_else() -> None:
    policies = _of_kind("NetworkPolicy")
    labels = {
        name: pod["metadata"]["labels"]
        for kind in ("Deployment", "StatefulSet")
        for name, pod in ((n, spec["template"]) for n, spec in _of_kind(kind).items())
    }
    # KubeRay labels the pods of a cluster.
    (cluster,) = _of_kind("RayCluster")
    labels["gaitswarm-ray"] = {"ray.io/cluster": cluster}
    assert {n: p["podSelector"]["matchLabels"] for n, p in policies.items()} == labels
    (database,) = policies["gaitswarm-postgres"]["ingress"]
    (users,) = database["from"][0]["podSelector"]["matchExpressions"]
    given = {name for name, c in CONTAINERS.items() if "GAITSWARM_DB" in _variables(c)}
    assert set(users["values"]) == given and users["operator"] == "In"
    for name, policy in policies.items():
        ports = {port["port"] for rule in policy["ingress"] for port in rule.get("ports", [])}
        container = CONTAINERS.get(name, {"ports": []})
        assert ports <= {port["containerPort"] for port in container["ports"]}


def test_services_lead_to_pods_and_ports_that_exist() -> None:
    for name, service in _of_kind("Service").items():
        made = {**_of_kind("Deployment"), **_of_kind("StatefulSet")}[name]
        assert made["template"]["metadata"]["labels"] == service["selector"]
        assert made["selector"]["matchLabels"] == service["selector"]
        ports = {p["containerPort"] for p in made["template"]["spec"]["containers"][0]["ports"]}
        assert {port.get("targetPort", port["port"]) for port in service["ports"]} <= ports


def test_the_user_is_that_of_the_image() -> None:
    dockerfile = Path(ROOT, "Dockerfile").read_text(encoding="utf-8")
    (user,) = re.findall(r"--uid (\d+)", dockerfile)
    assert {PODS[name]["securityContext"]["runAsUser"] for name in OURS} == {int(user)}
