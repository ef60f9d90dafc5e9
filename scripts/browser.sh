#!/bin/sh
# Have Chromium for the tests of the page: nothing if it is there, else by apt-get, as root.
set -eu

for name in chromium chromium-browser google-chrome; do
    command -v "$name" >/dev/null 2>&1 && exit 0
done
if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null 2>&1; then
    echo "browser: there is no Chromium; install it (Debian: apt install chromium)" >&2
    exit 69
fi
echo "browser: installing Chromium by apt-get" >&2
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install --yes -qq --no-install-recommends chromium fonts-dejavu-core >/dev/null
