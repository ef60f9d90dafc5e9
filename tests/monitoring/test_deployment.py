"""Dashboards and rules for Grafana and Prometheus use existing metrics and labels."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
import yaml

from gaitswarm.settings import is_loopback
from tests.examples.paths import ROOT
from tests.monitoring.scraped import Scrape
from tests.setup.compose import CLUSTER

DASHBOARD: dict[str, Any] = json.loads(
    (ROOT / "deploy" / "grafana" / "gaitswarm.json").read_text(encoding="utf-8")
)
PROMETHEUS = ROOT / "deploy" / "prometheus"
RULES: list[dict[str, Any]] = [
    rule
    for group in yaml.safe_load((PROMETHEUS / "alerts.yml").read_text(encoding="utf-8"))["groups"]
    for rule in group["rules"]
]
OPERATIONS = (ROOT / "docs" / "operations.md").read_text(encoding="utf-8")
METRICS = (ROOT / "docs" / "reference" / "metrics.md").read_text(encoding="utf-8")

TARGET_LABELS = {"job", "instance", "le"}
"""Prometheus adds the first two to all that it reads; the third is of every histogram."""


def shown() -> Iterator[str]:
    for panel in DASHBOARD["panels"]:
        for target in panel.get("targets", ()):
            yield target["expr"]


QUERIES = [*shown(), *(rule["expr"] for rule in RULES)]


def metrics_of(query: str) -> set[str]:
    """Names that a query selects; `up` is Prometheus's own."""
    return set(re.findall(r"\b(?:gaitswarm|process)_[a-z_]+", query))


def labels_of(query: str) -> set[str]:
    """Labels that it matches or groups by."""
    grouped = re.findall(r"\bby \(([^)]*)\)", query)
    matched = re.findall(r"[{,]\s*([a-z_]+)\s*(?:=~|!~|!=|=)", query)
    return {name.strip() for names in grouped for name in names.split(",")} | set(matched)


def documented() -> dict[str, set[str]]:
    """Labels of every metric of the table in docs/reference/metrics.md, by name."""
    found: dict[str, set[str]] = {}
    rows = re.findall(r"^\| (`gaitswarm_[^|]*)\|([^|]*)\|", METRICS, re.MULTILINE)
    for names, labels in rows:
        first, *others = re.findall(r"`([a-z_]+)`", names)
        for name in (first, *(f"{first.removesuffix('_slots')}{other}" for other in others)):
            found[name] = set(re.findall(r"`([a-z]+)`", labels))
    return found


def exposed(scrape: Scrape) -> dict[str, str]:
    """Type of every metric by each name that a query may give it."""
    found: dict[str, str] = {}
    for family in scrape.families:
        suffixes = {"counter": ("_total",), "histogram": ("_bucket", "_count", "_sum")}
        for suffix in suffixes.get(family.type, ("",)):
            found[family.name + suffix] = family.type
    return found


def test_prometheus_reads_what_docker_compose_opens() -> None:
    services = CLUSTER["services"]
    (job,) = yaml.safe_load((PROMETHEUS / "prometheus.yml").read_text(encoding="utf-8"))[
        "scrape_configs"
    ]
    (api, api_port), (runner, runner_port) = (
        target.split(":") for target in job["static_configs"][0]["targets"]
    )
    command = services[api]["command"]
    assert command[command.index("--port") + 1] == api_port
    for name in (api, runner):
        assert services[name]["environment"]["GAITSWARM_API_ALLOWED_HOSTS"] == name
    assert services[runner]["environment"]["GAITSWARM_METRICS_PORT"] == runner_port
    assert not is_loopback(services[runner]["environment"]["GAITSWARM_METRICS_HOST"])
    assert f":{runner_port}/healthz" in str(services[runner]["healthcheck"]["test"])
    # One network leads to both.
    assert all("monitoring" in services[name]["networks"] for name in (api, runner, "prometheus"))


def test_every_query_asks_for_existing_metrics(walked: tuple[str, Scrape]) -> None:
    known = exposed(walked[1])
    for query in QUERIES:
        asked = metrics_of(query)
        assert asked or query.startswith("up{")
        assert asked - set(known) == set(), query
        assert query.count("(") == query.count(")"), query
        rated = set(re.findall(r"(?:rate|increase)\(([a-z_]+)", query))
        assert {known[name] for name in rated} <= {"counter", "histogram"}, query
        assert {name for name in asked if known[name] == "counter"} <= rated, query


def test_every_query_asks_for_labels_that_its_metrics_have() -> None:
    known = documented()
    for query in QUERIES:
        asked = {re.sub("_(bucket|count|sum)$", "", name) for name in metrics_of(query)}
        labels = [known[name] for name in asked if name.startswith("gaitswarm_")]
        assert labels_of(query) <= TARGET_LABELS.union(*labels), query


def test_every_metric_is_documented_with_its_labels(walked: tuple[str, Scrape]) -> None:
    known = documented()
    own = {
        family.name + ("_total" if family.type == "counter" else ""): family
        for family in walked[1].families
        if family.name.startswith("gaitswarm_")
    }
    assert set(own) == set(known)
    for name, family in own.items():
        for sample in family.samples:
            assert set(sample.labels) - {"le"} == known[name], name


def test_panels_have_distinct_titles_and_descriptions() -> None:
    panels = DASHBOARD["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels) > 20
    places = {(p["gridPos"]["x"], p["gridPos"]["y"]) for p in panels}
    assert len(places) == len(panels)
    assert all(p["gridPos"]["x"] + p["gridPos"]["w"] <= 24 for p in panels)
    assert all(p["description"] for p in panels if p["type"] != "row")
    variables = {variable["name"] for variable in DASHBOARD["templating"]["list"]}
    used = set(re.findall(r"\$\{?(\w+)", json.dumps(panels))) - {"__rate_interval"}
    assert used == variables


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule["alert"])
def test_an_alert_says_how_bad_it_is_and_what_to_do(rule: dict[str, Any]) -> None:
    assert rule["labels"]["severity"] in ("warning", "critical")
    assert set(rule["annotations"]) == {"summary", "description"}
    assert f"`{rule['alert']}`" in OPERATIONS


def test_prometheus_reads_the_alerts_and_sends_a_token() -> None:
    config = yaml.safe_load((PROMETHEUS / "prometheus.yml").read_text(encoding="utf-8"))
    assert all((PROMETHEUS / name).is_file() for name in config["rule_files"])
    (scrape,) = config["scrape_configs"]
    assert scrape["job_name"] == "gaitswarm"
    assert scrape.get("metrics_path", "/metrics") == "/metrics"
    assert "credentials_file" in scrape["authorization"]
