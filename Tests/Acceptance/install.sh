#!/usr/bin/env bash
# The installed package serves a project that knows nothing else of ours: a tool infers a species, a game grows it. A
# game needs neither the authoring library nor what that stands on.
#   install.sh ESPALIER REPOSITORY BUILD   (ctest gives them)
set -euo pipefail
repository=$2
build=$3
here=$(mktemp -d)
trap 'rm -rf "$here"' EXIT

fail()
{
    echo "$*" >&2
    exit 1
}

# consumer NAME PREFIX [CMAKE OPTION...]: somebody's project, built against what is installed at PREFIX.
consumer()
{
    local name=$1 prefix=$2
    shift 2
    cmake -S "$repository/Tests/Acceptance/InstalledConsumer" -B "$here/$name" -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_PREFIX_PATH="$prefix" "$@"
    cmake --build "$here/$name"
}

# finds PREFIX REQUEST [CMAKE OPTION...]: whether find_package(Espalier REQUEST) succeeds.
finds()
{
    local prefix=$1 request=$2
    shift 2
    rm -rf "$here/finder"
    mkdir "$here/finder"
    printf 'cmake_minimum_required(VERSION 3.25)\nproject(Finder LANGUAGES CXX)\nfind_package(Espalier %s)\n' \
        "REQUIRED $request" > "$here/finder/CMakeLists.txt"
    cmake -S "$here/finder" -B "$here/finder/build" -DCMAKE_PREFIX_PATH="$prefix" "$@" > "$here/finder.log" 2>&1
}

# All of it.
cmake --install "$build" --prefix "$here/prefix" > "$here/install.log"
share=$here/prefix/share/espalier
consumer studio "$here/prefix"
"$here/studio/tool" "$share/Content/Thesis.archetype" "$share/Templates" "$here/thesis.species" "$here/tree.glb" \
    "$here/tree.png"
[ -s "$here/tree.glb" ] && [ -s "$here/tree.png" ]
"$here/studio/game" "$here/thesis.species" | tee "$here/trees"

"$here/prefix/bin/espalier" --version
for folder in Templates Content; do
    diff -r "$repository/$folder" "$share/$folder"
done
if grep -rnF "$repository" "$here/prefix/lib" --include='*.cmake'; then
    fail "the installed package points back at $repository"
fi

# Where TinyGLTF is missing there is the runtime, and nobody is told that there is more.
lacking=-DCMAKE_DISABLE_FIND_PACKAGE_TinyGLTF=ON
finds "$here/prefix" "" || fail "$(cat "$here/finder.log")"
finds "$here/prefix" "COMPONENTS runtime authoring" || fail "$(cat "$here/finder.log")"
finds "$here/prefix" "" $lacking || fail "$(cat "$here/finder.log")"
! finds "$here/prefix" "COMPONENTS authoring" $lacking || fail "authoring is said to be found without TinyGLTF"
! finds "$here/prefix" "COMPONENTS forest" || fail "a component that does not exist is said to be found"

# The runtime alone, without Embree, grows the same trees.
cmake -S "$repository" -B "$here/runtime" -DCMAKE_BUILD_TYPE=Release -DESPALIER_WITH_AUTHORING=OFF \
    -DESPALIER_WITH_EMBREE=OFF
cmake --build "$here/runtime"
cmake --install "$here/runtime" --prefix "$here/small" > "$here/install.log"
! finds "$here/small" "COMPONENTS authoring" || fail "authoring is said to be found where it was not built"
consumer game "$here/small" --no-warn-unused-cli -DCMAKE_DISABLE_FIND_PACKAGE_embree=ON
[ ! -e "$here/game/tool" ]
"$here/game/game" "$here/thesis.species" | diff "$here/trees" -
