#!/bin/sh
# Installs the peers: Python into $PEERS_VENV, Rust and C++ into $PEERS_TARGET. README.md names the Debian packages
# that must be there first.
set -e
here=$(cd "$(dirname "$0")" && pwd)
: "${PEERS_TARGET:=$here/../../target/peers}"
: "${PEERS_VENV:=$PEERS_TARGET/venv}"
mkdir -p "$PEERS_TARGET"
PEERS_TARGET=$(cd "$PEERS_TARGET" && pwd)

# C++ and Rust first: they build in minutes and tell early what is missing.
g++ -O3 -DNDEBUG -march=native -std=c++17 -w -I/usr/include/eigen3 "$here/cpp/peers.cpp" -o "$PEERS_TARGET/peers_cpp" \
    -lOpenMeshTools -lOpenMeshCore -lgmp -lmpfr
cargo build --release --locked --manifest-path "$here/rs/Cargo.toml" --target-dir "$PEERS_TARGET"

python3 -m venv "$PEERS_VENV"
"$PEERS_VENV/bin/pip" install -q --only-binary=:all: -r "$here/requirements.txt"
# sparseqr asks for numpy < 2 but works with 2. It compiles its extension on first import, into the folder one is in.
"$PEERS_VENV/bin/pip" install -q --no-deps sparseqr==1.1.0
cd "$("$PEERS_VENV/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"
"$PEERS_VENV/bin/python" -c 'import sparseqr' >&2
