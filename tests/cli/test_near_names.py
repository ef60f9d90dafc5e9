"""Suggestions for misspelled names."""

from __future__ import annotations

from typing import Any

import pytest

from tests.cli.conftest import Gaitswarm, WriteJson

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ({"particles": 5}, "particles: unknown key; did you mean 'optimizer.particles'?"),
        ({"iteration": 5}, "iteration: unknown key; did you mean 'iterations'?"),
        ({"aggregate": "mean"}, "aggregate: unknown key; did you mean 'worlds.aggregate'?"),
        (
            {"optimizer": {"name": "pso", "partcles": 5}},
            "optimizer.partcles: no setting of pso; did you mean 'particles'?",
        ),
        ({"optimizer": "psoo"}, "optimizer: unknown optimizer 'psoo'; did you mean 'pso'?"),
        (
            {"optimizer": {"name": "cma_es"}},
            "optimizer: unknown method 'cma_es'; did you mean 'cma-es'?",
        ),
        ({"fixed": {"strid": 0.1}}, "fixed: unknown variable 'strid'; did you mean 'stride'?"),
        ({"variables": ["fi1r"]}, "variables: unknown variable 'fi1r'; did you mean 'FI1R'?"),
        (
            {"scenarios": ["normal-fats"]},
            "scenarios.0: unknown scenario 'normal-fats'; did you mean 'normal-fast'?",
        ),
        (
            {"controller": "fuzy-pi"},
            "controller: unknown controller 'fuzy-pi'; did you mean 'fuzzy-pi'?",
        ),
        (
            {"preference": "chapter3"},
            "preference: must be 'A', 'B', 'C' or 'chapter-3'; did you mean 'chapter-3'?",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_in_a_spec(gaitswarm: Gaitswarm, write_json: WriteJson, spec: Any, said: str) -> None:
    refused = gaitswarm("submit", "--spec", write_json(spec))
    assert (refused.code, refused.err.strip()) == (2, f"gaitswarm: {said}")


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (
            ("simulate", "--controller", "pi", "--design", '{"P": 1, "I": 1, "strid": 1}'),
            "design.strid: unknown variable; did you mean 'stride'?",
        ),
        (
            ("simulate", "--design", "published:a"),
            "design: no published design 'a' of fuzzy-pi; did you mean 'A'?",
        ),
        (
            ("simulate", "--design", "published:A", "--world", '{"friction_facto": 1}'),
            "world.friction_facto: unknown perturbation; did you mean 'friction_factor'?",
        ),
        (("gaits", "crwl"), "gait: unknown gait 'crwl'; did you mean 'crawl'?"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_in_a_command(gaitswarm: Gaitswarm, command: tuple[str, ...], said: str) -> None:
    refused = gaitswarm(*command)
    assert (refused.code, refused.err.strip()) == (2, f"gaitswarm: {said}")


def test_where_none_is_alike_all_are_named(gaitswarm: Gaitswarm) -> None:
    refused = gaitswarm("simulate", "--design", "published:Z")
    assert refused.err.strip().endswith("no published design 'Z' of fuzzy-pi; known are A, B, C")
