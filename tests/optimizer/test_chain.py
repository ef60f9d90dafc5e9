"""Digests of a job's history: exact bytes of exact numbers"""

from __future__ import annotations

import hashlib
import math
import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.chain import (
    ChainDocuments,
    Link,
    ask_digest,
    encoded,
    iteration_digest,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns, Reevaluation
from gaitswarm.sim.outcome import Status

# RFC 8949, appendix A; floats always in 64 bits.
PUBLISHED: list[tuple[Any, str]] = [
    (0, "00"),
    (23, "17"),
    (24, "1818"),
    (1000, "1903e8"),
    (1000000, "1a000f4240"),
    (18446744073709551615, "1bffffffffffffffff"),
    (18446744073709551616, "c249010000000000000000"),
    (-18446744073709551616, "3bffffffffffffffff"),
    (-18446744073709551617, "c349010000000000000000"),
    (-1, "20"),
    (-1000, "3903e7"),
    (1.1, "fb3ff199999999999a"),
    (1e300, "fb7e37e43c8800759c"),
    (-4.1, "fbc010666666666666"),
    (False, "f4"),
    (True, "f5"),
    (None, "f6"),
    ("", "60"),
    ("IETF", "6449455446"),
    ("\u00fc", "62c3bc"),
    ("\u6c34", "63e6b0b4"),
    ([], "80"),
    ([1, [2, 3], [4, 5]], "8301820203820405"),
    (list(range(1, 26)), "98190102030405060708090a0b0c0d0e0f101112131415161718181819"),
    ({}, "a0"),
    ({"a": 1, "b": [2, 3]}, "a26161016162820203"),
]


@pytest.mark.parametrize(("value", "expected"), PUBLISHED, ids=str)
def test_documents_are_encoded_as_the_standard_has_it(value: Any, expected: str) -> None:
    assert encoded(value).hex() == expected


def test_keys_are_sorted_by_their_bytes() -> None:
    assert encoded({"bb": 1, "c": 2, "a": 3}) == encoded({"a": 3, "c": 2, "bb": 1})
    assert encoded({"bb": 1, "c": 2}).hex() == "a2" + "616302" + "62626201"


def test_floats_at_once_are_encoded_as_one_by_one() -> None:
    values = [0.1, -0.0, 5e-324, 1e22]
    one_by_one = b"".join(b"\xfb" + struct.pack(">d", value) for value in values)
    assert encoded(values) == b"\x84" + one_by_one
    assert encoded([0.0, 1]) == b"\x82\xfb" + bytes(8) + b"\x01", "a whole number stays one"


def test_an_array_is_its_shape_and_its_numbers() -> None:
    # RFC 8746: 40 is an array of several dimensions, 86 one of little-endian floats of 64 bits.
    array = np.array([[0.5, -2.0]])
    assert encoded(array).hex() == "d82882820102d85650" + struct.pack("<2d", 0.5, -2.0).hex()
    assert encoded(array) != encoded(array.T)


def test_all_non_finite_numbers_are_equal() -> None:
    kinds = [math.nan, math.inf, -math.inf, struct.unpack("<d", b"\1\0\0\0\0\0\xf0\xff")[0]]
    assert len({encoded(np.array([value])) for value in kinds}) == 1


DOCUMENTS = ChainDocuments(
    {"controller": "pi", "seed": 3},
    None,
    [{"from_iteration": 0, "code": "a"}, {"from_iteration": 2, "code": "b"}],
)
LINK = Link(1, np.array([[0.1], [0.2]]), ask_digest(np.array([[0.1], [0.2]]), {"step": 0.5}))
COLUMNS = EvaluationColumns(
    iteration=np.array([1, 1]),
    particle=np.array([0, 1]),
    designs=np.array([[0.1], [0.2]]),
    objectives=np.array([[[1.0, 2.0]], [[3.0, math.nan]]]),
    statuses=np.array([[Status.OK], [Status.FELL]], dtype=np.uint8),
    fitness=np.array([2.0, math.inf]),
)
REEVALUATION = Reevaluation(0, np.array([[1.5, 2.0]]), np.zeros(1, dtype=np.uint8), 2.5)


def digest(
    before: str = "b" * 64,
    documents: ChainDocuments = DOCUMENTS,
    link: Link = LINK,
    columns: EvaluationColumns = COLUMNS,
    reevaluation: Reevaluation | None = REEVALUATION,
) -> str:
    return iteration_digest(before, documents, link, columns, reevaluation)


def test_a_digest_is_as_documented() -> None:
    """Version 1: another encoding needs another version, as digests are stored."""
    parts = [
        "gaitswarm iteration",
        1,
        "b" * 64,
        1,
        LINK.positions,
        COLUMNS.designs,
        COLUMNS.objectives,
    ]
    labels = [Status.FELL.label, Status.OK.label]
    assert labels == sorted(labels)
    statuses = bytes([0x82]) + encoded(labels)
    nested = b"\xd8\x28\x82\x82\x02\x01\xd8\x40\x42\x01\x00"
    tail = [COLUMNS.fitness, LINK.ask_digest, {"from_iteration": 0, "code": "a"}]
    reevaluation = b"\x84\x00" + encoded(np.array([[1.5, 2.0]]))
    reevaluation += b"\x82" + encoded([Status.OK.label]) + b"\xd8\x28\x82\x81\x01\xd8\x40\x41\x00"
    reevaluation += encoded(np.array([2.5]))
    whole = b"\x8c" + b"".join(map(encoded, parts)) + statuses + nested
    whole += b"".join(map(encoded, tail)) + reevaluation
    assert digest() == hashlib.sha256(whole).hexdigest()
    assert DOCUMENTS.digest.startswith("0a57a34d2a75cd42")
    assert digest().startswith("17fd1d620f1fa360")


def one_ulp(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """The same but for the last bit of its first number."""
    changed = array.copy()
    changed.flat[0] = np.nextafter(changed.flat[0], np.inf)
    return changed


def test_one_bit_of_anything_makes_another_digest() -> None:
    better = REEVALUATION._replace(fitness=math.nextafter(2.5, 0.0))
    other_status = np.array([[Status.OK], [Status.DIVERGED]], dtype=np.uint8)
    changed = [
        digest(before="c" * 64),
        digest(documents=DOCUMENTS._replace(provenance=[{"from_iteration": 0, "code": "c"}])),
        digest(link=replace(LINK, iteration=0)),
        digest(link=replace(LINK, positions=one_ulp(LINK.positions))),
        digest(link=replace(LINK, ask_digest="d" * 64)),
        digest(link=replace(LINK, ask_digest=None)),
        digest(columns=replace(COLUMNS, designs=one_ulp(COLUMNS.designs))),
        digest(columns=replace(COLUMNS, objectives=one_ulp(COLUMNS.objectives))),
        digest(columns=replace(COLUMNS, statuses=other_status)),
        digest(columns=replace(COLUMNS, fitness=one_ulp(COLUMNS.fitness))),
        digest(reevaluation=None),
        digest(reevaluation=better),
    ]
    assert len({digest(), *changed}) == 1 + len(changed)
    assert DOCUMENTS._replace(spec={"seed": 4}).digest != DOCUMENTS.digest
    assert DOCUMENTS._replace(lineage={"parent": "x"}).digest != DOCUMENTS.digest
    assert ask_digest(LINK.positions, {"step": 0.5}) != ask_digest(LINK.positions, {"step": 0.25})


def test_the_provenance_of_an_iteration_is_the_last_that_began_by_then() -> None:
    at = [DOCUMENTS.provenance_of(index) for index in range(4)]
    assert [record["code"] for record in at] == ["a", "a", "b", "b"]
    assert ChainDocuments({}).provenance_of(3) is None
    # Resumed with consent twice before anything was committed: the last counts.
    twice = DOCUMENTS._replace(provenance=[*(DOCUMENTS.provenance or ()), {"from_iteration": 2}])
    assert twice.provenance_of(2) == {"from_iteration": 2}
