#!/usr/bin/env bash
# The gallery of Content/Grammars stays alive: every grammar checks clean and is measured, some are grown, and README.md
# shows a picture of each.
set -uo pipefail
espalier=$1
grammars=$2/Content/Grammars
failures=0

failed()
{
    printf 'FAILED %s\n' "$*"
    failures=$((failures + 1))
}

rm -rf work
mkdir work
cd work || exit

count=0
for grammar in "$grammars"/*.lsys; do
    name=$(basename "$grammar" .lsys)
    count=$((count + 1))
    output=$("$espalier" check "$grammar" 2>&1) || failed "check $name: $output"
    ! grep -qE ': (note|warning|error): ' <<< "$output" || failed "check $name: $output"
    "$espalier" measure "$grammar" --json > facts.json 2>&1 || failed "measure $name: $(cat facts.json)"
    grep -q '"segments": [1-9]' facts.json || failed "measure $name draws nothing: $(cat facts.json)"
    [ -s "$grammars/Pictures/$name.png" ] || failed "$name has no picture"
    grep -qF "](Pictures/$name.png)" "$grammars/README.md" || failed "README.md shows no picture of $name"
    grep -qF "[$name.lsys]($name.lsys)" "$grammars/README.md" || failed "README.md does not link $name.lsys"
done
[ $count -ge 50 ] || failed "only $count grammars in $grammars"

# What README.md names is there.
while read -r path; do
    [ -e "$grammars/$path" ] || failed "README.md names $path, which does not exist"
done < <(grep -oE '\]\([^)#:]+\)' "$grammars/README.md" | sed 's/^](//; s/)$//' | sort -u)

for name in Algae CantorSet KochCurve BinaryTree DragonCurve FractalPlantX Abop1-24a Abop1-26 Abop1-30a Abop1-31b Abop1-35 \
    Abop2-7d Abop5-5 Shrub FloweringSignal SunflowerHead; do
    "$espalier" grow "$grammars/$name.lsys" -o "$name.glb" > grown.txt 2>&1 || failed "grow $name: $(cat grown.txt)"
    [ "$(head -c 4 "$name.glb" 2> /dev/null)" = glTF ] || failed "grow $name wrote no GLB"
done

[ $failures -eq 0 ] && printf '%d grammars, each checked, measured and shown\n' $count
exit $((failures > 0))
