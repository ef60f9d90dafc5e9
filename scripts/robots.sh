#!/bin/sh
# Have the URDFs of well-known robots, for the tests of robots that are not our own and for
# `python -m benchmarks.known_robots`: those of the wheel example-robot-data, without their meshes
# (415 MB), in .venv/robots, and for the benchmark the files of repositories that robots.sha256
# lists, whose licences allow it, in .venv/repositories. Nothing if they are there. .venv
# must be set up. ROBOTS_URL=URL replaces the address of OWNER/NAME/COMMIT/PATH.
set -eu
cd "$(dirname "$0")/.."

venv=.venv
robots=$venv/robots
lock=requirements/robots.lock
say() { printf 'robots: %s\n' "$*" >&2; }
give_up() { say "$*; robots that are not our own are not tested"; exit 69; }

fetch_files() {
    "$venv/bin/python" - requirements/robots.sha256 "$venv/repositories" <<'EOF'
import hashlib
import os
import sys
from pathlib import Path
from urllib.request import urlopen

base = os.environ.get("ROBOTS_URL", "https://raw.githubusercontent.com")
listed, folder = map(Path, sys.argv[1:])
for line in listed.read_text().splitlines():
    digest, name = line.split(maxsplit=1)
    owner, repository, _commit, path = name.split("/", 3)
    to = folder / owner / repository / path
    if to.is_file():
        continue
    try:
        content = urlopen(f"{base}/{name}", timeout=20).read()
    except OSError as error:
        sys.exit(f"robots: {name}: {error}; robots of repositories are not in the benchmark")
    if hashlib.sha256(content).hexdigest() != digest:
        print(f"robots: {name}: not the file that robots.sha256 lists; left out", file=sys.stderr)
        continue
    to.parent.mkdir(parents=True, exist_ok=True)
    to.write_bytes(content)
EOF
}

key=$(cat "$lock" scripts/robots.sh | cksum)
if [ "$(cat "$robots/lock" 2>/dev/null)" = "$key" ]; then
    fetch_files || true
    exit 0
fi

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
fetch_files || true
