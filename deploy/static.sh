#!/bin/sh
# Builds a daemon that needs nothing of the system it runs on, not even a C library: one file for any Linux of this architecture.
#
#   deploy/static.sh      builds target/TARGET/release/uwguide and tells its name
#
# Needs rustup and a C compiler for musl (apt-get install musl-tools) for the assembly of the encryption.
set -eu
cd "$(dirname "$0")/.."
target=$(uname -m)-unknown-linux-musl
rustup target list --installed | grep -qx "$target" || rustup target add "$target"
if ! command -v musl-gcc >/dev/null; then
    echo "static.sh: musl-gcc is not there; run: apt-get install musl-tools" >&2
    exit 2
fi
cargo build --release --locked -p uw-daemon --target "$target"
echo "target/$target/release/uwguide"
