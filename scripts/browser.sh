#!/bin/sh
# Have a browser for the tests of the page, Chromium or what is named: browser.sh [firefox]
# Nothing is done if it is there; else it is installed by apt-get, as root.
set -eu

case ${1:-chromium} in
chromium) name=Chromium package=chromium commands="chromium chromium-browser google-chrome" ;;
firefox) name=Firefox package=firefox-esr commands="firefox-esr firefox" ;;
*) echo "browser: $1 is none; name chromium or firefox" >&2; exit 64 ;;
esac
for command in $commands; do
    command -v "$command" >/dev/null 2>&1 && exit 0
done
if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null 2>&1; then
    echo "browser: there is no $name; install it (Debian: apt install $package)" >&2
    exit 69
fi
echo "browser: installing $name by apt-get" >&2
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install --yes -qq --no-install-recommends "$package" fonts-dejavu-core >/dev/null
