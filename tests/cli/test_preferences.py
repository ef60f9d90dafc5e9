"""`gaitswarm preferences`: preferences with robust winners."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Finished, Gaitswarm

pytestmark = pytest.mark.slow


def test_winners_are_listed_by_how_robust_they_are(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    asked = (
        "preferences", finished.id, "--db", finished.db, "--drawn", 32, "--candidates", 2,
        "--samples", 40,
    )  # fmt: skip
    result = gaitswarm(*asked, "--json")
    assert result.code == 0, result.err
    view = result.json
    candidates = view["candidates"]
    assert (view["drawn"], view["samples"]) == (32, 40)
    assert 1 <= len(candidates) <= view["winners"]
    assert sorted(name for found in candidates for name in found["named"]) == ["A", "B", "C"]
    indices = [found["index"]["value"] for found in candidates]
    assert indices == sorted(indices)

    # By the reported preference, the design is the best of the job; its index is that of
    # `robustness`.
    first = candidates[0]
    by_a = next(found for found in candidates if "A" in found["named"])
    assert by_a["loss"] == 0.0
    ranked = gaitswarm(
        "rank", finished.id, "--db", finished.db, "--json",
        "--preference", str(first["preference"]).replace("'", '"'),
    ).json["top"][0]  # fmt: skip
    assert (ranked["iteration"], ranked["particle"]) == (first["iteration"], first["particle"])
    own = gaitswarm("robustness", finished.id, "--db", finished.db, "--samples", 40, "--json").json
    assert by_a["index"] == own["index"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--drawn", "0"), "drawn: must be at least 1"),
        (("--samples", "9"), "samples: 8 variables require at least 36"),
        (("--precision", "half"), "precision"),
    ],
)
def test_invalid_input_is_named(
    gaitswarm: Gaitswarm, finished: Finished, options: tuple[str, str], said: str
) -> None:
    result = gaitswarm("preferences", finished.id, "--db", finished.db, *options)
    assert result.code == 2
    assert said in result.err


def test_a_job_without_a_design_is_a_conflict(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    job = gaitswarm("submit", "--spec", small_spec, "--db", db, "--json").json
    assert gaitswarm("preferences", job["id"], "--db", db).code == 4
