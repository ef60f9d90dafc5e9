#!/bin/sh
# Build the page from web/ into api/page, unless it is up to date: page.sh [--if-possible]
#
# With --if-possible a page that cannot be built is no failure, as all else works without it;
# GAITSWARM_REQUIRE_PAGE makes it one.
set -eu
cd "$(dirname "$0")/.."

say() { printf 'page: %s\n' "$*" >&2; }

optional=
[ "${1:-}" != --if-possible ] || [ -n "${GAITSWARM_REQUIRE_PAGE:-}" ] || optional=yes
give_up() {
    if [ -f api/page/index.html ]; then
        say "the page was not rebuilt; the previous build is served"
    else
        say "it was not built; the service runs without it"
    fi
    [ -n "$optional" ] && exit 0
    exit 1
}

stamp=web/node_modules/.page
built() { [ -f api/page/index.html ] && [ "$(sed -n "$1p" "$stamp" 2>/dev/null)" = "$2" ]; }
keep() { printf '%s\n' "$sources $api" "$sources $document" > "$stamp"; }

sources=$(find web -name node_modules -prune -o -type f ! -name openapi.json ! -name schema.d.ts \
    ! -path 'web/tests/*' -print | LC_ALL=C sort | xargs cksum | cksum)
api=$(scripts/api_key.sh)
if built 1 "$sources $api"; then exit 0; fi

started=$(date +%s)
scripts/npm.sh || give_up
# Most changes of the API's sources do not change its document.
document=$(cksum < web/openapi.json)
if built 2 "$sources $document"; then keep; exit 0; fi
say "building it from web/"
scripts/npm.sh run build -- --logLevel warn >&2 || give_up
keep
say "done in $(($(date +%s) - started)) s"
