#!/usr/bin/env bash
# Installs the C library: header, shared and static library, pkg-config file and CMake package.
#
#   ipc/c/install.sh [--libraries FOLDER] [PREFIX]
#
# PREFIX defaults to /usr/local. DESTDIR is put in front of it. The script first builds the libraries in their own
# target folder. With --libraries it installs the libraries of that folder instead.
set -euo pipefail

libraries=
if [ "${1:-}" = --libraries ]; then
    libraries=$(realpath "$2")
    shift 2
fi
cd "$(dirname "$0")"
prefix=${1:-/usr/local}
case $prefix in
    /*) ;;
    *) echo "PREFIX is $prefix, must be an absolute path" >&2; exit 2 ;;
esac

if [ -z "$libraries" ]; then
    target=${CARGO_TARGET_DIR:-../../target}/c
    cargo build --release --locked --package bench-dragon-c --target-dir "$target"
    libraries=$target/release
fi

version=$(sed -n 's/^version = "\(.*\)"$/\1/p' ../../Cargo.toml | head -1)
root=${DESTDIR:-}$prefix
lib=$root/lib

install -D --mode 0644 include/bench_dragon.h "$root/include/bench_dragon.h"
install -D --mode 0644 "$libraries/libbench_dragon_c.a" "$lib/libbench_dragon_c.a"
install -D --mode 0755 "$libraries/libbench_dragon_c.so" "$lib/libbench_dragon_c.so.$version"
# Debug information of source lines is nine tenths of the libraries' size, and the sources are not installed.
strip --strip-debug "$lib/libbench_dragon_c.a" "$lib/libbench_dragon_c.so.$version"
ln --symbolic --force "libbench_dragon_c.so.$version" "$lib/libbench_dragon_c.so.0"
ln --symbolic --force libbench_dragon_c.so.0 "$lib/libbench_dragon_c.so"

package=$lib/cmake/bench_dragon
mkdir -p "$package" "$lib/pkgconfig"
install --mode 0644 bench_dragon-config.cmake "$package"
fill() { sed -e "s|@PREFIX@|$prefix|" -e "s|@VERSION@|$version|" "$1"; }
fill bench_dragon-config-version.cmake.in > "$package/bench_dragon-config-version.cmake"
fill bench-dragon.pc.in > "$lib/pkgconfig/bench-dragon.pc"
