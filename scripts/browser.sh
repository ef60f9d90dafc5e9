#!/bin/sh
# Have a browser for the tests of the page, Chromium or what is named: browser.sh [firefox]
# Nothing is done if it is there; else it is installed by apt-get, as root. Of Chromium that is the
# headless shell, which takes less of the machine; where it cannot be had, the browser does.
set -eu

case ${1:-chromium} in
chromium)
    name=Chromium package=chromium-headless-shell
    good=chromium-headless-shell enough="chromium chromium-browser google-chrome"
    ;;
firefox)
    name=Firefox package=firefox-esr
    good="firefox-esr firefox" enough=
    ;;
*) echo "browser: $1 is none; name chromium or firefox" >&2; exit 64 ;;
esac

any_of() {
    for command; do
        command -v "$command" >/dev/null 2>&1 && return
    done
    return 1
}

installed() {
    [ "$(id -u)" = 0 ] && any_of apt-get || return
    echo "browser: installing $package by apt-get" >&2
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq &&
        apt-get install --yes -qq --no-install-recommends "$package" fonts-dejavu-core >/dev/null
}

if any_of $good || installed || any_of $enough; then exit 0; fi
echo "browser: there is no $name; install it (Debian: apt install $package)" >&2
exit 69
