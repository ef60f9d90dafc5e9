"""`gaitswarm.write_firmware`."""

from __future__ import annotations

from pathlib import Path

import pytest

import gaitswarm
from tests.examples.walks import short_walk

PI = {"P": 0.25, "I": 0.0}
BRIEF = short_walk(cycle_time=0.5, stride=0.04)


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "firmware"
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        gaitswarm.write_firmware(PI, folder, controller="pi", table_bits=(8, 6))
    assert (refused.value.field, str(refused.value)) == (
        "table_bits",
        "table_bits: pi has no table",
    )
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        gaitswarm.write_firmware(PI, folder, controller="pi", scenarios="moonwalk")
    assert refused.value.field == "scenarios.0"
    assert not folder.exists()
    folder.mkdir()
    (folder / "mine.txt").touch()
    with pytest.raises(gaitswarm.InvalidRequest) as refused:
        gaitswarm.write_firmware(PI, folder, controller="pi", scenarios=BRIEF)
    assert refused.value.field == "output"
    assert [path.name for path in folder.iterdir()] == ["mine.txt"]
