"""An interruption never leaves a module half imported."""

from __future__ import annotations

import importlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gaitswarm.services.worker.cluster.interrupts import interrupted_outside_imports

MODULE = "gaitswarm_interrupted_module"
LINES = "import signal\nfirst = 1\nsignal.raise_signal(signal.SIGINT)\nlast = 2\n"


@pytest.fixture(params=["package", "module"])
def interrupted(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[str]:
    """The name of a module that is interrupted in the midst of its import."""
    if request.param == "module":
        (tmp_path / f"{MODULE}.py").write_text(LINES)
    else:
        (tmp_path / MODULE).mkdir()
        (tmp_path / MODULE / "part.py").write_text(LINES)
        (tmp_path / MODULE / "__init__.py").write_text("from .part import last\nthen = last\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield MODULE
    for name in [name for name in sys.modules if name.split(".")[0] == MODULE]:
        del sys.modules[name]


@pytest.fixture(params=[signal.default_int_handler, signal.SIG_IGN], ids=["handled", "ignored"])
def before(request: pytest.FixtureRequest) -> Iterator[Callable[..., object]]:
    """What becomes of SIGINT in the process otherwise."""
    own = signal.signal(signal.SIGINT, request.param)
    yield request.param
    signal.signal(signal.SIGINT, own)


def import_and_go_on(module: str) -> None:
    with interrupted_outside_imports():
        importlib.import_module(module)
        until = time.monotonic() + 10.0
        while time.monotonic() < until:
            time.sleep(0.01)


def test_an_import_ends_before_what_imports_is_interrupted(
    interrupted: str, before: Callable[..., object]
) -> None:
    with pytest.raises(KeyboardInterrupt):
        import_and_go_on(interrupted)
    assert sys.modules[interrupted].last == 2
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_imports_and_ends_at_once_is_not_interrupted_afterwards(interrupted: str) -> None:
    try:
        with interrupted_outside_imports():
            module = importlib.import_module(interrupted)
        time.sleep(0.1)
    except KeyboardInterrupt:
        pytest.fail("it was interrupted")
    assert module.last == 2


def test_in_another_thread_signals_are_left_as_they_are() -> None:
    own, found = signal.getsignal(signal.SIGINT), []

    def look() -> None:
        with interrupted_outside_imports():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert found == [own]
