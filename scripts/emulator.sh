#!/bin/sh
# Have what the tests of kernels for aarch64 need: a C compiler for it, and qemu's user emulation.
# Nothing if the machine has them; else they are put into .venv/cross, which takes no root:
# ziglang's wheel by pip, the emulator out of Debian's package. .venv must be set up.
set -eu
cd "$(dirname "$0")/.."

venv=.venv
cross=$venv/cross
say() { printf 'emulator: %s\n' "$*" >&2; }
give_up() { say "$*; kernels for aarch64 are not tested"; exit 69; }
has() { command -v "$1" >/dev/null 2>&1 || [ -x "$cross/$1" ]; }

mkdir -p "$cross"
if ! has aarch64-linux-gnu-gcc && ! has zig; then
    say "installing the compiler of the ziglang wheel into $cross"
    PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PIP_ROOT_USER_ACTION=ignore \
        "$venv/bin/python" -m pip install --quiet --target "$cross" --upgrade --no-deps \
        --require-hashes --only-binary :all: -r requirements/compiler.lock >/dev/null 2>&1 \
        || give_up "no compiler for aarch64 can be had"
    ln -sf ziglang/zig "$cross/zig"
fi

if ! has qemu-aarch64 && ! has qemu-aarch64-static; then
    for tool in apt-get dpkg-deb; do
        command -v $tool >/dev/null 2>&1 || give_up "there is no qemu-aarch64, and no $tool"
    done
    say "unpacking qemu-aarch64 of Debian's qemu-user-static into $cross"
    [ "$(id -u)" != 0 ] || apt-get update -qq || say "the list of packages may be old"
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    (cd "$scratch" && apt-get download -qq qemu-user-static >/dev/null 2>&1) \
        || give_up "qemu-user-static cannot be downloaded"
    dpkg-deb --fsys-tarfile "$scratch"/*.deb \
        | tar -x -C "$scratch" ./usr/bin/qemu-aarch64-static
    mv "$scratch/usr/bin/qemu-aarch64-static" "$cross/"
fi
