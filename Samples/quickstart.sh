#!/usr/bin/env bash
# From a bare Debian 12 to trees in one command: installs what is missing, builds, and does the main job once.
# What it makes lies in Samples/out/ afterwards. Asks nothing; run it as often as you like.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

run()
{
    printf '\n$ %s\n' "$*"
    "$@"
}

bash Samples/install.sh

# The tests need more than this; a folder that was configured with them before keeps them.
tests=OFF
[ -f Build/release/Tests/CTestTestfile.cmake ] && tests=ON
run cmake --preset release -DESPALIER_WITH_TESTS=$tests -DESPALIER_WITH_BENCHMARKS=$tests
run cmake --build --preset release --parallel "$(nproc)" --target espalier espalier_quickstart espalier_lsystem

out=Samples/out
rm -rf "$out"
mkdir -p "$out"
espalier=Build/release/bin/espalier

# A drawn tree becomes a species, a file of some kilobytes: its rules, and how it looks.
for tree in Oak Birch Spruce Willow Palm; do
    run $espalier infer Content/$tree.archetype --appearance Content/$tree.appearance -o $out/${tree,,}.species
done
run $espalier infer Content/Thesis.archetype -o $out/thesis.species

# A species and a seed are a tree: always the same one, and every seed another.
run $espalier grow $out/oak.species --seed 1..8 --lod 1 -o $out/oak.glb
run $espalier grow $out/thesis.species --seed 1..8 -o $out/thesis.glb
run $espalier overlap $out/oak.species --seed 1..8
# What a game takes: levels of detail, wind data, collision shapes.
run $espalier grow $out/birch.species --lod 0..4 --wind generic --collision -o $out/birch.glb

# The drawn tree, it among seven relatives, and one of them from all sides.
run $espalier render Content/Oak.archetype -o $out/oak-drawn.png
run $espalier render Content/Oak.archetype $out/oak.species --seed 1..7 --no-leaves --sheet --samples 16 \
    -o $out/oak-relatives.png
run $espalier render $out/oak.species --seed 3 --turntable 6 --samples 16 -o $out/oak-3-turntable.png
run $espalier render $out/oak.species --seed 1 --seasons --sheet --samples 16 -o $out/oak-seasons.png
run $espalier render Content/Thesis.archetype -o $out/thesis-drawn.png
run $espalier render Content/Thesis.archetype $out/thesis.species --seed 1..7 --sheet \
    -o $out/thesis-relatives.png
for tree in Birch Spruce Willow Palm; do
    run $espalier render $out/${tree,,}.species --seed 1..4 --sheet --samples 12 --width 400 --height 460 \
        -o $out/${tree,,}-relatives.png
done

# The same steps from C++: Samples/QuickStart/main.cpp.
run Build/release/bin/espalier_quickstart $out/quickstart.glb

printf '\nAll of it is in %s:\n' "$PWD/$out"
(cd $out && du -ab --max-depth 1 | sort -k2 | awk '$2 != "." { printf "%10d bytes  %s\n", $1, substr($2, 3) }')
