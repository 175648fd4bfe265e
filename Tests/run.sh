#!/usr/bin/env bash
# Builds and tests everything, and closes with the line "N passed, N failed". Asks nothing.
#   Tests/run.sh           all tests optimised and under sanitizers, the same bits from each compiler, the quickstart,
#                          GLB files in the Khronos validator, the sources' format
#   Tests/run.sh --quick   all tests optimised, nothing else
#   Tests/run.sh --fuzz    each fuzz target for 30 seconds, nothing else
#   Tests/run.sh --acceptance   trees in leaf in all their levels and profiles, before Blender, the Khronos validator and
#                          other readers: an hour and 5 GB, Blender itself among them; nothing else
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit
jobs=$(nproc)
passed=0
failed=0
skipped=0

# step TITLE COMMAND...: runs it under a headline and says how long it took. A step that counts no tests of its own
# is one failure if it fails.
step()
{
    local title=$1 start=$SECONDS status=0
    shift
    printf '\n=== %s\n' "$title"
    "$@" || status=$?
    printf '=== %s: %s after %d s\n' "$title" "$([ $status -eq 0 ] && echo good || echo FAILED)" $((SECONDS - start))
    return $status
}

must()
{
    step "$@" || failed=$((failed + 1))
}

# build PRESET TARGET
build()
{
    cmake --preset "$1" && cmake --build --preset "$1" --parallel "$jobs" --target "$2"
}

# check PRESET [CTEST OPTION...]: runs tests and adds them up.
check()
{
    local preset=$1 report=$PWD/Build/$1/ctest.xml status=0
    shift
    rm -f "$report"
    ctest --preset "$preset" --parallel "$jobs" --no-tests=error --output-junit "$report" "$@" || status=$?
    local tests failures idle
    tests=$(attribute tests "$report")
    failures=$(attribute failures "$report")
    idle=$(($(attribute disabled "$report") + $(attribute skipped "$report")))
    # A run that broke down must not look like success.
    if [ $status -ne 0 ] && [ "$failures" -eq 0 ]; then
        failures=1 tests=$((tests + 1))
    fi
    failed=$((failed + failures))
    skipped=$((skipped + idle))
    passed=$((passed + tests - failures - idle))
    [ "$failures" -eq 0 ]
}

# attribute NAME FILE: a number from the head of ctest's report; 0 without one.
attribute()
{
    local value
    value=$(grep -om1 "\b$1=\"[0-9]*\"" "$2" 2> /dev/null | grep -o '[0-9]*')
    echo "${value:-0}"
}

# suite PRESET TARGET [CTEST OPTION...]: builds the target and runs its tests.
suite()
{
    local preset=$1 target=$2
    shift 2
    if step "Build, preset $preset" build "$preset" "$target"; then
        step "Test, preset $preset" check "$preset" "$@"
    else
        failed=$((failed + 1))
    fi
}

# npm_install FOLDER
npm_install()
(
    cd "$1" || exit
    # npm leaves this file when it has finished; while it is younger than the list there is nothing to do.
    [ node_modules/.package-lock.json -nt package-lock.json ] && exit
    npm ci --no-audit --no-fund && touch node_modules/.package-lock.json && exit
    echo "$1 is missing what it needs: npm must reach its registry once. See its message above." >&2
    exit 1
)

# The sources are formatted as .clang-format says.
check_format()
{
    find Source Tests Samples \( -name '*.h' -o -name '*.cpp' \) -not -path '*/node_modules/*' -print0 |
        xargs -0 clang-format --dry-run -Werror && passed=$((passed + 1))
}

# The shaders that ship are GLSL.
check_shaders()
{
    local shaders=(Content/Shaders/*)
    glslangValidator "${shaders[@]}" && passed=$((passed + ${#shaders[@]}))
}

# Trees of both presets, for the validator.
bake_trees()
(
    rm -rf Build/release/Trees
    mkdir -p Build/release/Trees || exit
    for archetype in Content/*.archetype; do
        name=Build/release/Trees/$(basename "$archetype" .archetype)
        while read -r preset seeds; do
            Build/release/bin/espalier infer "$archetype" --preset "$preset" -o "$name-$preset.species" || exit
            Build/release/bin/espalier grow "$name-$preset.species" --seed "$seeds" --textures 0 -o "$name-$preset.glb" || exit
        done <<< $'kin 1..50\nhelberg 1..10'
    done
)

# bake_dressed FOLDER SEEDS LEVELS SPECIES...: trees in leaf in every profile and with every kind of wind data.
bake_dressed()
(
    folder=$1 seeds=$2 levels=$3
    shift 3
    rm -rf "$folder"
    mkdir -p "$folder" || exit
    for name; do
        infer_dressed "$name" "$folder/$name.species" || exit
        while read -r profile wind more; do
            # shellcheck disable=SC2086
            Build/release/bin/espalier grow "$folder/$name.species" --seed "$seeds" --lod "$levels" --textures 64 \
                --profile $profile --wind $wind $more -o "$folder/$name-$profile-$wind.glb" || exit
        done <<< $'portable generic --translucent\nquantized bones --impostor cards --atlas 64\ncompressed generic --together\nportable crytek --branches weld'
    done
)

# infer_dressed NAME FILE
infer_dressed()
{
    Build/release/bin/espalier infer "Content/$1.archetype" --appearance "Content/$1.appearance" -o "$2"
}

# The names of what has a look to wear.
dressed_species()
{
    local appearance
    for appearance in Content/*.appearance; do
        basename "$appearance" .appearance
    done
}

# validate FILE...: each file counts as a test.
validate()
{
    printf '%s\0' "$@" | xargs -0 -n 20 -P "$jobs" node Tests/Validator/validate.mjs || return
    passed=$((passed + $#))
}

# read_elsewhere FILE...: each file counts as a test.
read_elsewhere()
{
    printf '%s\0' "$@" | xargs -0 -n 20 -P "$jobs" node Tests/Acceptance/gltf-readers/read.mjs || return
    passed=$((passed + $#))
}

# same_tangents FILE...: as MikkTSpace has them; each file counts as a test.
same_tangents()
{
    node Tests/Acceptance/gltf-readers/mikktspace.mjs "$@" || return
    passed=$((passed + $#))
}

# accept_dressed SEEDS LEVELS SPECIES: bakes, asks all readers, and deletes what they like: a hundred trees of every kind
# would take 25 GB.
accept_dressed()
{
    local folder=Build/release/Dressed/$3-$1 status=0
    bake_dressed "$folder" "$@" || return
    validate "$folder"/*.glb || status=1
    read_elsewhere "$folder"/*.glb || status=1
    if [ $status -eq 0 ]; then
        rm -r "$folder"
    else
        echo "Kept: $folder" >&2
    fi
    return $status
}

# One of each in leaf that Blender can read, seed 1.
bake_for_blender()
(
    folder=Build/release/Blender
    rm -rf $folder
    mkdir -p $folder || exit
    for name in $(dressed_species); do
        infer_dressed "$name" "$folder/$name.species" || exit
        while read -r what options; do
            # shellcheck disable=SC2086
            Build/release/bin/espalier grow "$folder/$name.species" --textures 256 $options -o "$folder/$name-$what.glb" || exit
        done <<< $'full --lod 0 --wind generic --translucent\nmiddle --lod 3 --impostor cards\nweld --lod 2 --branches weld\nbones --lod 2 --wind bones --profile quantized'
    done
)

# render_in_blender FILE...: each file counts as a test. Blender's own chatter goes to a log.
render_in_blender()
{
    local out=Build/release/Blender/Pictures
    mkdir -p $out
    blender -b --factory-startup --python-exit-code 1 --python Tests/Acceptance/blender.py -- $out "$@" 2>&1 |
        tee $out/blender.log | grep -aE --line-buffered '^[^ ]+\.glb: |^[0-9]+ files, ' || {
        echo "Blender found fault with a file, or broke down: see $out/blender.log and the pictures beside it." >&2
        return 1
    }
    echo "Pictures of each: $out"
    passed=$((passed + $#))
}

# fuzz TARGET: 30 seconds, from what ships and the inputs kept for it.
fuzz()
{
    local found=Build/fuzz/Corpus/$1 kept=Tests/Fuzz/Corpus/$1 log=Build/fuzz/$1.log seeds=(Content Templates)
    mkdir -p "$found"
    [ -d "$kept" ] && seeds+=("$kept")
    if Build/fuzz/bin/Fuzz/"$1" "$found" "${seeds[@]}" -max_total_time=30 -timeout=2 -rss_limit_mb=512 \
        -max_len=65536 -artifact_prefix="Build/fuzz/$1-" > "$log" 2>&1; then
        passed=$((passed + 1))
        tail -n 1 "$log"
    else
        tail -n 60 "$log"
        return 1
    fi
}

case "${1:-}" in
    "" | --quick | --fuzz | --acceptance) ;;
    *)
        sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' Tests/run.sh >&2
        exit 2
        ;;
esac

if [ "${1:-}" = --acceptance ]; then
    must "Install what is missing, with Blender" bash Samples/install.sh --acceptance
else
    must "Install what is missing" bash Samples/install.sh --tests
fi
if [ "${1:-}" = --fuzz ]; then
    if step "Build, preset fuzz" build fuzz espalier_fuzzers; then
        for target in Tests/Fuzz/Fuzz*.cpp; do
            target=$(basename "$target" .cpp)
            must "Fuzz $target" fuzz "$target"
        done
    else
        failed=$((failed + 1))
    fi
elif [ "${1:-}" = --acceptance ]; then
    if step "Build, preset release" build release espalier; then
        must "Install the Khronos validator" npm_install Tests/Validator
        must "Install the other readers" npm_install Tests/Acceptance/gltf-readers
        must "Bake one of each in leaf" bake_for_blender
        must "Render GLB files with Blender's Cycles" render_in_blender Build/release/Blender/*.glb
        must "Compare tangents with MikkTSpace's" same_tangents Build/release/Blender/*.glb
        rm -rf Build/release/Dressed
        for seeds in 1..5 6..10 11..15 16..20; do
            for name in $(dressed_species); do
                must "$name in leaf, seeds $seeds, before the Khronos validator, glTF-Transform and Babylon.js" \
                    accept_dressed $seeds 0..5 "$name"
            done
        done
    else
        failed=$((failed + 1))
    fi
else
    suite release all
fi
if [ $# -eq 0 ]; then
    must "Check the format" check_format
    must "Check the shaders" check_shaders
    suite asan all
    suite debug espalier_golden -L golden
    suite clang espalier_golden -L golden
    must "Quickstart, as a newcomer runs it" bash Samples/quickstart.sh
    must "Install the Khronos validator" npm_install Tests/Validator
    must "Bake trees" bake_trees
    # shellcheck disable=SC2046
    must "Bake trees in leaf" bake_dressed Build/release/Dressed 1..1 1..4 $(dressed_species)
    must "Validate GLB files" validate Samples/out/*.glb Build/release/Trees/*.glb Build/release/Dressed/*.glb
fi

printf '\n%d passed, %d failed%s\n' $passed $failed "$([ $skipped -eq 0 ] || echo ", $skipped skipped")"
[ $failed -eq 0 ]
