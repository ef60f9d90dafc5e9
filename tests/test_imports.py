"""Importing a module does nothing: no file, no thread, no network, no environment needed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.examples.paths import ROOT

PROGRAM = """
import importlib, json, pkgutil, sys, threading

written, reached = [], []

def watch(event, arguments):
    if event == "open" and isinstance(arguments[2], int) and arguments[2] & 0o3:
        written.append(str(arguments[0]))
    elif event in ("os.mkdir", "os.rename", "os.remove", "subprocess.Popen", "os.posix_spawn"):
        written.append(f"{event} {arguments[0]}")
    elif event in ("socket.connect", "socket.bind", "sqlite3.connect"):
        reached.append(f"{event} {arguments[1:]}")

sys.addaudithook(watch)
names = []
root = importlib.import_module("gaitswarm")
names += ["gaitswarm", *(m.name for m in pkgutil.walk_packages(root.__path__, "gaitswarm."))]
for name in names:
    # Alembic runs these two itself, with its own context around them.
    if ".migrations" not in name and name != "gaitswarm.__main__":
        importlib.import_module(name)
threads = [t.name for t in threading.enumerate() if t is not threading.main_thread()]
print(json.dumps({"written": written, "reached": reached, "threads": threads, "n": len(names)}))
"""


@pytest.mark.thorough("every module in a fresh process")
@pytest.mark.slow
def test_importing_every_module_has_no_side_effects(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-B", "-W", "ignore", "-c", PROGRAM],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT), "HOME": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[-1])
    assert seen["n"] > 80
    assert seen["written"] == []
    assert seen["reached"] == []
    assert seen["threads"] == []
    assert list(tmp_path.iterdir()) == []
