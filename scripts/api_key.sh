#!/bin/sh
# A checksum of all that the API's document may depend on: telling that nothing changed must not
# take the seconds that deriving the document takes.
set -eu
cd "$(dirname "$0")/.."
find api gaitswarm services sim \( -name '*.py' -o -name '*.toml' \) -type f | LC_ALL=C sort | xargs cksum | cksum
