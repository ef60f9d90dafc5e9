#!/bin/sh
# Have the URDFs of well-known robots, for the tests of robots that are not our own and for
# `python -m benchmarks.known_robots`: those of the wheel example-robot-data, without their meshes
# (415 MB), in .venv/robots. Nothing if they are there. .venv must be set up.
set -eu
cd "$(dirname "$0")/.."

venv=.venv
robots=$venv/robots
lock=requirements/robots.lock
say() { printf 'robots: %s\n' "$*" >&2; }
give_up() { say "$*; robots that are not our own are not tested"; exit 69; }

key=$(cat "$lock" scripts/robots.sh | cksum)
[ "$(cat "$robots/lock" 2>/dev/null)" != "$key" ] || exit 0

say "fetching URDFs of well-known robots (131 MB)"
scratch=$(mktemp -d "$venv/robots.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 "$venv/bin/python" -m pip download --quiet \
    --dest "$scratch" --no-deps --require-hashes --only-binary :all: -r "$lock" >/dev/null 2>&1 \
    || give_up "the wheel example-robot-data cannot be had"
mkdir "$scratch/robots"
"$venv/bin/python" - "$scratch" <<'EOF'
import sys
from pathlib import Path
from zipfile import ZipFile

scratch = Path(sys.argv[1])
inside = "cmeel.prefix/share/example-robot-data/robots/"
(wheel,) = scratch.glob("example_robot_data-*.whl")
with ZipFile(wheel) as files:
    for name in files.namelist():
        if name.startswith(inside) and name.endswith(".urdf"):
            to = scratch / "robots" / name.removeprefix(inside)
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_bytes(files.read(name))
EOF
echo "$key" > "$scratch/robots/lock"
rm -rf "$robots"
mv "$scratch/robots" "$robots"
