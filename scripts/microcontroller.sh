#!/bin/sh
# Have what the tests of firmware on a microcontroller need: a C compiler for Arm Cortex-M, and qemu's
# emulation of two boards. Nothing if the machine has them; else Debian's packages are unpacked into
# .venv/cross, which takes no root. .venv must be set up.
set -eu
cd "$(dirname "$0")/.."

cross=.venv/cross
say() { printf 'microcontroller: %s\n' "$*" >&2; }
give_up() { say "$*; firmware is not tested on a microcontroller"; exit 69; }
has() { command -v "$1" >/dev/null 2>&1 || [ -x "$cross/$1" ]; }

wanted=
has arm-none-eabi-gcc || wanted="$wanted gcc-arm-none-eabi"
has qemu-system-arm || wanted="$wanted qemu-system-arm"
[ -n "$wanted" ] || exit 0

for tool in apt-get dpkg-deb; do
    command -v $tool >/dev/null 2>&1 || give_up "there is no$wanted, and no $tool"
done
mkdir -p "$cross/microcontroller"
say "unpacking$wanted of Debian and what they need into $cross/microcontroller"
[ "$(id -u)" != 0 ] || apt-get update -qq || say "the list of packages may be old"
# What the machine lacks of what these two depend on, and nothing that it has.
# shellcheck disable=SC2086
packages=$(apt-get install --simulate --no-install-recommends $wanted 2>/dev/null \
    | sed -n 's/^Inst \([^ ]*\).*/\1/p')
[ -n "$packages" ] || give_up "Debian's packages$wanted cannot be had"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# shellcheck disable=SC2086
(cd "$scratch" && apt-get download -qq $packages >/dev/null 2>&1) \
    || give_up "$wanted cannot be downloaded"
# Without C++, link-time optimization, and libraries of other processors, which are most of it.
for package in "$scratch"/*.deb; do
    dpkg-deb --fsys-tarfile "$package" | tar -x -C "$cross/microcontroller" \
        --exclude='*/cc1plus' --exclude='*/lto1' --exclude='*/g++-mapper-server' \
        --exclude='*/thumb/v7-r*' --exclude='*/thumb/v8*' --exclude='*/thumb/v7-a*' \
        --exclude='*/thumb/v7*+fp*' --exclude='*/arm/*' --exclude='./usr/share/doc' \
        --exclude='./usr/share/man'
done

unpacked=$(cd "$cross/microcontroller" && pwd)
for tool in gcc size objdump nm; do
    ln -sf "microcontroller/usr/bin/arm-none-eabi-$tool" "$cross/arm-none-eabi-$tool"
done
if ! has qemu-system-arm; then
    libraries=$(find "$unpacked/usr/lib" "$unpacked/lib" -name '*.so*' -exec dirname {} + 2>/dev/null \
        | sort -u | paste -sd:)
    cat > "$cross/qemu-system-arm" <<EOF
#!/bin/sh
LD_LIBRARY_PATH="$libraries" exec "$unpacked/usr/bin/qemu-system-arm" \\
    -L "$unpacked/usr/share/qemu" "\$@"
EOF
    chmod +x "$cross/qemu-system-arm"
fi
