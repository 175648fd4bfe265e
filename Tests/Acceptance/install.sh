#!/usr/bin/env bash
# The installed package serves a project that knows nothing else of ours: it configures, links and runs.
#   install.sh ESPALIER REPOSITORY BUILD   (ctest gives them)
set -euo pipefail
repository=$2
build=$3
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT

cmake --install "$build" --prefix "$here/prefix" > "$here/install.log"
cmake -S "$repository/Tests/Acceptance/InstalledConsumer" -B "$here/consumer" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_PREFIX_PATH="$here/prefix"
cmake --build "$here/consumer"
"$here/consumer/game"
"$here/consumer/tool"

"$here/prefix/bin/espalier" --version
for folder in Templates Content; do
    diff -r "$repository/$folder" "$here/prefix/share/espalier/$folder"
done
if grep -rqF "$repository" "$here/prefix/lib" --include='*.cmake'; then
    echo "the installed package points back at $repository:" >&2
    grep -rnF "$repository" "$here/prefix/lib" --include='*.cmake' >&2
    exit 1
fi
