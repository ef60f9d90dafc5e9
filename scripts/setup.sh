#!/bin/sh
# Make .venv hold what one lock file says, and nothing half-installed: setup.sh run|dev|manual
#
# Does nothing if it already does. Needs a Python with venv and pip, and a package index that its
# pip is configured for; PYTHON=/path/to/python overrides which Python is taken.
set -eu
cd "$(dirname "$0")/.."

lock="requirements/${1:?which lock: run, dev or manual}.lock"
venv=.venv
say() { printf 'set-up: %s\n' "$*" >&2; }

is_suitable() {
    "$1" -c '
import sys
import ensurepip, venv
sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 15))' >/dev/null 2>&1
}

find_python() {
    if [ -n "${PYTHON:-}" ]; then
        is_suitable "$PYTHON" && { echo "$PYTHON"; return; }
        say "PYTHON=$PYTHON is not a Python 3.11 to 3.14 with its venv and ensurepip modules"
        exit 1
    fi
    for candidate in python3 python3.13 python3.14 python3.12 python3.11 python; do
        is_suitable "$candidate" && { echo "$candidate"; return; }
    done
    say "no Python 3.11 to 3.14 with its venv and ensurepip modules was found."
    say "Install one (Debian, Ubuntu: apt install python3 python3-venv), or name it: make PYTHON=/path/to/python3"
    exit 1
}

has_compiler() {
    for compiler in "${CC:-}" cc gcc clang; do
        [ -n "$compiler" ] && command -v "$compiler" >/dev/null 2>&1 && return 0
    done
    return 1
}

# Old pips know nothing of some of these; they are then without effect.
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_USER=0 PIP_NO_INPUT=1 PIP_ROOT_USER_ACTION=ignore
install() { "$venv/bin/python" -m pip install --quiet --no-deps --no-compile "$@"; }

install_locked() { install_with_uv "$1" || install_with_pips "$1"; }

# By uv, which unpacks in a fifth of pip's time. It asks the index that pip is configured for, but
# knows no more of pip's settings; where that does not do, the pips tell what is wrong.
install_with_uv() {
    install --target "$scratch/uv" --require-hashes --only-binary :all: -r requirements/installer.lock \
        >/dev/null 2>&1 || return 1
    index=${PIP_INDEX_URL:-$("$venv/bin/python" -m pip config get global.index-url 2>/dev/null || true)}
    # The cache is next to the environment, so that files are linked, not copied; few and short retries.
    env ${index:+"UV_DEFAULT_INDEX=$index"} UV_HTTP_TIMEOUT=30 UV_HTTP_RETRIES=1 \
        UV_CACHE_DIR="$scratch/cache" "$scratch/uv/bin/uv" --no-config --quiet pip install \
        --python "$venv/bin/python" --no-deps --require-hashes --only-binary :all: -r "$1" 2>/dev/null
}

# By one pip for each processor: most of the time is unpacking, which a pip does on one.
install_with_pips() {
    processors=$(getconf _NPROCESSORS_ONLN)
    mkdir "$scratch/parts"
    awk -v folder="$scratch/parts" -v parts="$((processors < 8 ? processors : 8))" '
        /^[[:alnum:]]/ { requirement++ }
        requirement { print > (folder "/" requirement % parts ".txt") }' "$1"
    find "$scratch/parts" -name '*.txt' -print0 | xargs -0 -n 1 -P 8 \
        "$venv/bin/python" -m pip install --quiet --no-deps --no-compile \
        --require-hashes --only-binary :all: -r
}

key="$(cat "$lock" requirements/compiler.lock requirements/installer.lock pyproject.toml research/pyproject.toml \
    scripts/setup.sh | cksum) $PWD ${PYTHON:-}"
stamp="$venv/installed-$1"
if [ -x "$venv/bin/gaitswarm" ] && is_suitable "$venv/bin/python" \
    && [ "$(cat "$stamp" 2>/dev/null)" = "$key" ]; then
    exit 0
fi

started=$(date +%s)
python=$(find_python)
# A virtual environment of another Python, or one that was moved, is of no use.
if ! is_suitable "$venv/bin/python" || [ "$(cat "$venv/home" 2>/dev/null)" != "$PWD ${PYTHON:-}" ]; then
    rm -rf "$venv"
    say "making a virtual environment in $venv with $("$python" --version)"
    "$python" -m venv "$venv"
    echo "$PWD ${PYTHON:-}" > "$venv/home"
fi
rm -f "$stamp"
scratch=$(mktemp -d "$venv/set-up.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
say "installing $lock; the first time this takes a minute or two"
install_locked "$lock"
if ! has_compiler; then
    say "no C compiler found: installing the one of the ziglang wheel, so that simulation is fast"
    install --require-hashes --only-binary :all: -r requirements/compiler.lock \
        || say "that failed; simulation falls back to the slow reference interpreter"
fi
install --no-build-isolation --editable .
if [ "$1" = dev ]; then install --no-build-isolation --editable ./research; fi
# On all processors, which pip does on one. What cannot be compiled is never imported, nor are the
# tests that packages bring, Ray's libraries for learning, what is compiled to C besides, and
# parts that nothing here asks for.
never='[/\\](tests?|ray[/\\](rllib|data|serve|tune|train|llm)|mypyc?|setuptools|pkg_resources|pip'
never=$never'|networkx|fontTools|sqlalchemy[/\\](orm|testing)|numpy[/\\]distutils)[/\\]'
"$venv/bin/python" -m compileall -q -j 0 -x "$never" "$venv/lib" >/dev/null 2>&1 || true
echo "$key" > "$stamp"
say "done in $(($(date +%s) - started)) s"
