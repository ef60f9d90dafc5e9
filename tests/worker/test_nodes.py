"""Placement of tasks on nodes."""

from __future__ import annotations

import pytest

from gaitswarm.services.worker.cluster.nodes import Node, OwnNode, Wanted, chosen

WANTED = Wanted(frozenset(), "")
OTHER = Wanted(frozenset(), "other")


def node(name: str, *, cpus: int = 1, flying: int = 0, ready: bool = True) -> Node:
    found = Node(name, name, cpus, ("", 0), flying=flying)
    if ready:
        found.prepared.add(WANTED)
    return found


def preparing(name: str, wanted: Wanted | None) -> Node:
    found = node(name, ready=False)
    found.asked[object()] = wanted
    return found


@pytest.mark.parametrize(
    ("nodes", "avoid", "expected"),
    [
        ([node("a", flying=1), node("b")], "", "b"),
        ([node("a", flying=1), node("b", cpus=4, flying=3)], "", "b"),
        ([node("a", flying=2), node("b", flying=2)], "", None),
        ([node("a"), node("b", flying=1)], "a", "b"),
        ([node("a"), node("b", flying=2)], "a", None),
        ([node("a"), node("b", flying=1), node("c")], "ac", "b"),
        ([node("a", flying=1), node("b")], "ab", "b"),
        ([node("a")], "a", "a"),
        ([node("a"), preparing("b", WANTED)], "a", None),
        ([node("a"), preparing("b", None)], "a", None),
        ([node("a"), preparing("b", OTHER)], "a", "a"),
        ([node("a"), node("b", ready=False)], "a", "a"),
        ([preparing("a", WANTED), node("b", flying=1)], "", "b"),
        ([], "a", None),
    ],
    ids=[
        "with more room",
        "with more room for its size",
        "no room",
        "not where a worker died",
        "busy for a while, so that it is waited for",
        "the last that is not avoided",
        "all are avoided",
        "the only one",
        "one is being prepared, and waited for",
        "one is about to be",
        "another one is being prepared for something else",
        "another one is refused",
        "not the one that is being prepared",
        "there is none",
    ],
)
def test_a_task_is_sent_to_the_node(nodes: list[Node], avoid: str, expected: str | None) -> None:
    found = chosen(nodes, WANTED, frozenset(avoid))
    assert (found and found.id) == expected


def test_the_only_machine_of_an_embedded_cluster_is_never_avoided() -> None:
    nodes = OwnNode(1)
    only = nodes.place(WANTED, frozenset())
    assert only is not None
    assert nodes.place(WANTED, frozenset([only.id])) is only
