#!/usr/bin/env bash
# Installs what Espalier is built from, on Debian 12 and its relatives. Asks nothing, and needs neither network nor
# root where everything is there already.
#   Samples/install.sh           what the library, the command and the samples need
#   Samples/install.sh --tests   also what only the tests need
#   Samples/install.sh --acceptance   also Blender, 1 GB, which only Tests/run.sh --acceptance needs
set -euo pipefail

packages=(g++ make cmake libglm-dev libtinygltf-dev libembree-dev libtbb-dev nlohmann-json3-dev libexpected-dev
    libcli11-dev libstb-dev libpng-dev libmeshoptimizer-dev)
case "${1:-}" in
    "") ;;
    --tests | --acceptance)
        packages+=(libgtest-dev libbenchmark-dev clang libclang-rt-14-dev clang-format glslang-tools)
        # Debian's npm brings 500 MB; a Node.js from elsewhere serves as well.
        if ! command -v node > /dev/null || ! command -v npm > /dev/null; then
            packages+=(nodejs npm ca-certificates)
        fi
        # Blender's glTF importer wants NumPy, which Debian only recommends.
        [ "$1" = --tests ] || packages+=(blender python3-numpy)
        ;;
    *)
        echo "usage: $0 [--tests | --acceptance]" >&2
        exit 2
        ;;
esac

if ! command -v dpkg-query > /dev/null || ! command -v apt-get > /dev/null; then
    echo "Warning: this script knows Debian's packages only and installs nothing here. CMake will say what is missing of" \
        "what they hold: ${packages[*]}" >&2
    exit 0
fi

missing=()
for package in "${packages[@]}"; do
    # Not by exit status alone: a package that was removed leaves its settings, and dpkg-query still knows it.
    status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2> /dev/null || true)
    [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    echo "All ${#packages[@]} packages are installed."
    exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    # Without -n a sudo that wants a password would wait for one.
    as_root=(sudo -n)
    if ! "${as_root[@]}" true 2> /dev/null; then
        echo "Neither root nor a sudo that needs no password. As root run:" >&2
        echo "    apt-get update && apt-get install --no-install-recommends ${missing[*]}" >&2
        exit 1
    fi
fi
echo "Installing ${#missing[@]} of ${#packages[@]} packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends "${missing[@]}"
