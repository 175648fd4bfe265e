#!/usr/bin/env bash
# The command as its users meet it: the main job, exit codes, messages with places, and no output touched by a failure.
set -uo pipefail
espalier=$1
repository=$2
content=$repository/Content
failures=0

# expect TITLE CODE TEXT COMMAND...: the command ends with CODE and its output, stderr included, holds TEXT.
expect()
{
    local title=$1 code=$2 text=$3 output status=0
    shift 3
    output=$("$@" 2>&1) || status=$?
    if [ $status -ne "$code" ] || ! grep -qF -- "$text" <<< "$output"; then
        printf 'FAILED %s\n  $ %s\n  exit %d, expected %d with "%s"; it said:\n%s\n' "$title" "$*" $status "$code" "$text" \
            "$(head -c 2000 <<< "$output")"
        failures=$((failures + 1))
    fi
}

same()
{
    [ -s "$2" ] && cmp -s "$2" "$3" && return
    printf 'FAILED %s: %s and %s differ\n' "$1" "$2" "$3"
    failures=$((failures + 1))
}

rm -rf work
mkdir work
cd work || exit

# The main job.
expect "facts of the drawn tree" 0 '"segments": 55' "$espalier" measure "$content/Thesis.archetype" --json
expect "facts of the drawn tree" 0 '"instances": 17' "$espalier" measure "$content/Thesis.archetype" --json
for archetype in "$content"/*.archetype; do
    tree=$(basename "$archetype" .archetype)
    expect "infer" 0 "" "$espalier" infer "$content/$tree.archetype" -o $tree.species
    expect "infer at weight 0" 0 "" "$espalier" infer "$content/$tree.archetype" --merge-weight 0 -o $tree-0.species
    "$espalier" measure "$content/$tree.archetype" --json > drawn.json
    for seed in 0 1 18446744073709551615; do
        "$espalier" measure $tree-0.species --seed $seed --json | grep -v '"seed"' > grown.json
        same "weight 0 gives the archetype back, seed $seed" drawn.json grown.json
    done
    expect "grow" 0 "$tree-2.glb" "$espalier" grow $tree.species --seed 1..2 -o $tree.glb
    expect "grow again" 0 "again.glb" "$espalier" grow $tree.species --seed 2 -o again.glb
    same "one seed, the same bytes" $tree-2.glb again.glb
    expect "overlap" 0 '"count"' "$espalier" overlap $tree.species --seed 1..2 --json
done
# The trees of Content/ as they ship have relatives enough, all of them about as large, and these stand on the ground.
for tree in Oak Spruce Willow Palm Birch; do
    "$espalier" infer "$content/$tree.archetype" -o noted.species > /dev/null 2> infer.note
    [ ! -s infer.note ] || { printf 'FAILED %s: %s\n' $tree "$(cat infer.note)"; failures=$((failures + 1)); }
    drawn=$("$espalier" measure "$content/$tree.archetype" --json | awk -F'[:,]' '/"segments"/ { print $2 }')
    "$espalier" measure $tree.species --seed 1..40 --json | grep -oE '"(segments|minY)": *[-0-9.e]+' |
        awk -F: -v drawn="$drawn" -v tree=$tree '
        /segments/ { ++trees; if ($2 < drawn / 2 || $2 > 1.5 * drawn) ++odd }
        /minY/ { if ($2 < -0.05) ++sunk }
        END { if (trees != 40 || odd > 2 || sunk > 2) { printf "%s: of %d trees %d of another size, %d sunk\n", tree, trees, odd, sunk; exit 1 } }
    ' || { printf 'FAILED the relatives of %s\n' $tree; failures=$((failures + 1)); }
done
# The oak is a small file, the thesis' example is the published one.
if [ "$(stat -c %s Oak.species)" -ge 65536 ]; then
    printf 'FAILED a species of the oak has %s bytes\n' "$(stat -c %s Oak.species)"
    failures=$((failures + 1))
fi
"$espalier" infer "$content/Thesis.archetype" --preset helberg --rule-weight 0.5 --merge-weight 0.5 --trace |
    awk '/^# generalize/ { exit } / -> /' > rules.txt
same "the published rules, inferred and compressed" rules.txt "$(dirname "${BASH_SOURCE[0]}")/thesis-rules.txt"

expect "every verb is named" 2 "infer, compare, grammar" "$espalier" grw
expect "a range is an array" 0 "[" "$espalier" measure Thesis.species --seed 3..4 --json
expect "helberg" 0 "L -> F[-FF+FF[+F]F[-F]F]+F" "$espalier" infer "$content/Thesis.archetype" --preset helberg --trace
expect "picture" 0 "p.png" "$espalier" render Thesis.species --seed 3 --samples 1 --width 64 --height 64 -o p.png
expect "contact sheet" 0 "s.png" "$espalier" render "$content/Thesis.archetype" Thesis.species --seed 1..3 --sheet \
    --samples 1 --width 64 --height 64 -o s.png

koch=$content/Grammars/KochCurve.lsys
expect "a figure on paper" 0 "k.png" "$espalier" render "$koch" --paper --lines 1 --samples 1 --width 64 --height 64 -o k.png
expect "step by step" 0 "k.png: 200 x 79" "$espalier" render "$koch" --paper --lines 1 -n 0..2 --sheet --samples 1 --width 64 \
    --height 64 -o k.png
expect "several steps need a sheet" 2 "need --sheet" "$espalier" render "$koch" -n 0..2 -o k.png
expect "steps backwards" 2 "the lower number first" "$espalier" render "$koch" -n 2..0 --sheet -o k.png
expect "steps that are no number" 2 "a range such as 0..7" "$espalier" render "$koch" -n two -o k.png
expect "steps and seeds" 2 "not both" "$espalier" render "$koch" -n 0..2 --seed 1..2 --sheet -o k.png

# The first tree that Samples/README.md draws has relatives.
"$espalier" infer "$repository/Samples/FirstTree/first.archetype" -o first.species 2> first.note
[ -s first.species ] && [ ! -s first.note ] || { printf 'FAILED the first tree: %s\n' "$(cat first.note)"; failures=$((failures + 1)); }

# A grammar goes out, is edited and comes back.
"$espalier" grammar Thesis.species > edited.lsys
cp Thesis.species before.species
expect "put the same grammar back" 0 "" "$espalier" grammar Thesis.species --set edited.lsys
same "the same grammar changes nothing" Thesis.species before.species
sed 's/^let w = .*/let w = 7/' edited.lsys > seven.lsys
expect "weights that cannot be" 3 "seven.lsys:" "$espalier" grammar Thesis.species --set seven.lsys
same "weights that cannot be change nothing" Thesis.species before.species
sed -i 's/^let w = .*/let w = /' edited.lsys
expect "a broken grammar names its line" 3 "edited.lsys:" "$espalier" grammar Thesis.species --set edited.lsys
same "a broken grammar changes nothing" Thesis.species before.species

# Why the rules are what they are.
expect "reasons for the rules" 0 "bits as drawn" "$espalier" infer "$content/Willow.archetype" --explain
expect "limbs that share a rule" 0 "share a rule: scaling" "$espalier" infer "$content/Willow.archetype" --explain
expect "the classes that were tried" 0 "chosen" "$espalier" infer "$content/Willow.archetype" --explain
expect "no reasons of helberg" 2 "tells of the preset kin" "$espalier" infer "$content/Thesis.archetype" --preset helberg --explain

# An attempt is told and can be pinned.
attempt=$("$espalier" grow Thesis.species --seed 3 -o attempt.glb --json | sed -n 's/.*"attempt": \([0-9]*\).*/\1/p')
expect "the attempt is told" 0 "attempt $attempt" "$espalier" grow Thesis.species --seed 3 -o told.glb
expect "the accepted attempt, pinned" 0 "attempt $attempt" "$espalier" grow Thesis.species --seed 3 --attempt "$attempt" -o pinned.glb
same "the accepted attempt is what grows anyway" attempt.glb pinned.glb
expect "another attempt" 0 '"attempt": 31' "$espalier" measure Thesis.species --seed 3 --attempt 31 --json
expect "an attempt beyond all" 2 "attempt" "$espalier" grow Thesis.species --attempt 1024 -o pinned.glb
expect "an archetype has no attempts" 2 "expected no --attempt" "$espalier" measure "$content/Thesis.archetype" --attempt 1
expect "the drawn tree is one" 2 "expected no --attempt" "$espalier" grow Thesis.species --seed exemplar --attempt 1 -o pinned.glb

# Edits survive inferring again, whatever the dial says; what cannot be carried over is told and kept.
rule='VIII(1, 0) : (i==2)*(1-w)+w/4 : ~ III(2)'
thesis=$content/Thesis.archetype
cp "$thesis" "$repository/Templates/thesis.templates" .
# On classes that are given: what is chosen for the tree may have other rules.
given="--rule-weight 0.5"
"$espalier" infer Thesis.archetype $given -o Edited.species > /dev/null
expect "rules know where they were drawn" 0 "$rule  # 1 drawn: 0:11" "$espalier" grammar Edited.species
"$espalier" grammar Edited.species | sed 's/: (i==2)\*(1-w)+w\/4 : ~ III(2)/: 2*((i==2)*(1-w)+w\/4) : ~ III(2)/' > edited.lsys
expect "a doubled weight" 0 "14 kept, 1 weight changed, 0 rules changed" "$espalier" grammar Edited.species --set edited.lsys
expect "inferring again keeps it" 0 "1 edit and 0 locks kept" "$espalier" infer Thesis.archetype $given -o Edited.species
expect "it is still doubled" 0 "2*((i==2)*(1-w)+w/4) : ~ III(2)  # 1 drawn: 0:11; edited" "$espalier" grammar Edited.species
expect "on other settings too" 0 "1 edit and" "$espalier" infer Thesis.archetype --merge-weight 0.3 --rule-weight 0 -o Edited.species
expect "under its new name" 0 "2*((i==1)*(1-w)+w/3) : ~ III(2)  # 1 drawn: 0:11; edited" "$espalier" grammar Edited.species
expect "an edited species grows" 0 '"segments"' "$espalier" measure Edited.species --seed 1 --json
expect "another preset cannot take edits" 3 "name another output, or say --fresh" \
    "$espalier" infer Thesis.archetype --preset helberg -o Edited.species
expect "a lock" 0 "1 locked" "$espalier" grammar Edited.species --lock "III2(0)"
expect "a lock shows" 0 "; locked" "$espalier" grammar Edited.species
expect "a lock on nothing" 3 'no inferred rule is called "IX"' "$espalier" grammar Edited.species --lock IX
# The locked rule keeps its w/3, though its class has four limbs again: an edit of what is inferred.
expect "back to the former settings" 0 "2 edits and 1 lock kept" "$espalier" infer Thesis.archetype $given -o Edited.species
sed 's/{"template": "III", "scaling": 2,/{"template": "VI", "scaling": 2,/' Thesis.archetype > Less.archetype
cp Edited.species Less.species
expect "a conflict is told" 0 "is not carried over: what it stands for is no longer drawn" \
    "$espalier" infer Less.archetype $given -o Less.species
expect "conflicts are kept" 0 "# conflict: " "$espalier" grammar Less.species
expect "conflicts are settled" 0 "productions: " "$espalier" grammar Less.species --dismiss
expect "what is dropped is told" 0 "dropped 2 edits, 1 lock and 0 conflicts" "$espalier" infer Thesis.archetype $given --fresh -o Edited.species
expect "dropped it is" 0 "15 kept, 0 weights changed" "$espalier" grammar Edited.species --dismiss
printf '{"espalier":"species","version":1,"grammar":["axiom: F"]}' > hand.species
expect "a hand-written species is not overwritten" 3 "written by hand" "$espalier" infer Thesis.archetype -o hand.species
sed 's/"let w = .*"/"let w = 0.5"/' Edited.species > inside.species
expect "edits inside the file are not lost" 3 "edited in the file itself" "$espalier" infer Thesis.archetype -o inside.species
sed '/"rules": \[/,/^  \]/d; s/"grammar": "[0-9a-f]*", //' before.species | sed 's/^\(  "provenance".*}\),$/\1/' > earlier.species
expect "an earlier version's file grows" 0 '"segments"' "$espalier" measure earlier.species --json
expect "and can be inferred again" 0 "written by an earlier version" "$espalier" infer Thesis.archetype -o earlier.species
printf old > none.species
expect "what is no species is not overwritten" 3 "no species that can be read" "$espalier" infer Thesis.archetype -o none.species
expect "unless told" 0 "none.species: overwritten" "$espalier" infer Thesis.archetype --fresh -o none.species

# Grammars by themselves.
cat > plant.lsys << 'EOF'
angle: 25
iterations: 3
axiom: X
X -> F+[[X]-X]-F[-FX]+X
F -> FF
EOF
cat > shoot.lsys << 'EOF'
axiom: A(1)
A(x) -> F(x/3) [+A(x*0.7)] : 2
A(x) -> F(x) : 1
EOF
expect "a word" 0 'F+[[X]-X]-F[-FX]+X' "$espalier" derive plant.lsys -n 1
expect "the grammar's own iterations" 0 '"iterations":3,"seed":1,"length":379' "$espalier" derive plant.lsys --json --no-word
expect "parameters have 6 digits" 0 '"word":"F(0.333333)[+A(0.7)]"' "$espalier" derive shoot.lsys -n 1 --json --seed 1
expect "a range of seeds is an array" 0 '[{"iterations":2,"seed":4,' "$espalier" derive shoot.lsys -n 2 --seed 4..5 --json
"$espalier" derive shoot.lsys -n 9 --seed 12 > first.word
"$espalier" derive shoot.lsys -n 9 --seed 12 > second.word
same "one seed, the same word" first.word second.word
expect "facts of a grammar's plant" 0 '"segments": 97920' "$espalier" measure plant.lsys -n 8 --json
expect "overlaps of a grammar's plant" 0 '"count"' "$espalier" overlap plant.lsys -n 3 --json
expect "a grammar grows" 0 "lsys-2.glb" "$espalier" grow plant.lsys --seed 1..2 -o lsys.glb
expect "picture of a grammar" 0 "l.png" "$espalier" render plant.lsys -n 4 --samples 1 --width 64 --height 64 -o l.png
printf 'axiom: A(1)\nA(x) -> F(1/(2-x))A(x+1)\n' > tried.lsys
expect "check tells the growth" 0 "by a factor of 4 a step" "$espalier" check plant.lsys
expect "check tells the size" 0 "modules after 8 steps: 403751" "$espalier" check plant.lsys -n 8
expect "check tells the segments" 0 "segments: 97920" "$espalier" check plant.lsys -n 8
expect "check tells what fits" 0 '"safeIterations": 9' "$espalier" check plant.lsys --json
printf 'axiom: A\nA -> F A\nA -> G\nB -> F\n' > useless.lsys
expect "check names what cannot be taken" 0 'useless.lsys:3:1: note: the production `A -> G` can never be taken: the production of line 2' "$espalier" check useless.lsys
expect "check names what cannot be reached" 0 'useless.lsys:4:1: note: the symbol `B` cannot be reached' "$espalier" check useless.lsys
printf 'axiom: F%%F~F[F]\nF -> FF\n' > cut.lsys
expect "check calls segments a bound where some may be cut" 0 "segments: at most 16" "$espalier" check cut.lsys -n 2
expect "of which fewer are drawn" 0 "segments of seed 1: 4" "$espalier" check cut.lsys -n 2
expect "check tries what the rules do not tell" 0 'tried.lsys:2:11: at -n 2, seed 1: an expression' "$espalier" check tried.lsys -n 2
expect "check asks for steps" 0 "no line \`iterations:\`" "$espalier" check tried.lsys
printf 'axiom: ~L(1)\n' > leaf.lsys
expect "a leaf alone is drawn" 0 "leaf.png" "$espalier" render leaf.lsys --samples 1 --width 64 --height 64 -o leaf.png
expect "a leaf alone is baked" 0 "0 segments" "$espalier" grow leaf.lsys -o leaf.glb
expect "nothing drawn, and why" 3 "nothing is drawn after 0 steps" "$espalier" render plant.lsys -n 0 -o no.png
expect "nothing to bake, and why" 3 "nothing is drawn after 0 steps" "$espalier" grow plant.lsys -n 0 -o no.glb
expect "a sheet leaves out what is empty" 0 "seed 1 is left out" "$espalier" render plant.lsys -n 0..1 --sheet --samples 1 --width 64 --height 64 -o s.png

# Any skeleton becomes an archetype: what a grammar draws, a traced root, bones.
data=$(dirname "${BASH_SOURCE[0]}")/Data
near() # TITLE FILE EXPECTED: the largest distance that `fit --json` left in FILE is at most EXPECTED metres
{
    awk -F': *' -v most="$3" '/"largestDistance"/ { found = 1; sub(",", "", $2); if ($2 + 0 > most + 0) exit 1 }
        END { if (!found) exit 1 }' "$2" && return
    printf 'FAILED %s: farther than %s m\n' "$1" "$3"
    failures=$((failures + 1))
}
for tree in TernaryTree:0.001:9841 Shrub:0.001:1740 Abop2-6a:0.001:1023 Fern:0.003:516; do
    IFS=: read -r name most instances <<< "$tree"
    expect "the skeleton of $name" 0 "$name.swc" "$espalier" grow "$content/Grammars/$name.lsys" --seed 1 --skeleton -o $name.swc
    expect "$name is fitted" 0 "$name.archetype" "$espalier" fit $name.swc -o $name.archetype --json
    "$espalier" fit $name.swc -o $name.archetype --json > $name.fit
    near "$name is met" $name.fit "$most"
    expect "$name in so many pieces" 0 "\"instances\": $instances" cat $name.fit
    expect "$name drawn" 0 "\"instances\": $instances" "$espalier" measure $name.archetype --json
    expect "$name inferred" 0 "" "$espalier" infer $name.archetype --merge-weight 0 -o $name.species
    "$espalier" measure $name.archetype --json > drawn.json
    "$espalier" measure $name.species --seed 5 --json | grep -v '"seed"' > grown.json
    same "$name grown at weight 0 is what was fitted" drawn.json grown.json
done
"$espalier" fit TernaryTree.swc -o exemplar.archetype > /dev/null && "$espalier" infer exemplar.archetype -o exemplar.species > /dev/null
expect "the drawn tree's skeleton" 0 "e.swc" "$espalier" grow exemplar.species --seed exemplar -o e.swc
expect "it is the drawn tree, whatever a seed would grow" 0 "exemplar" cat e.swc
"$espalier" measure exemplar.archetype --json > drawn.json
"$espalier" fit e.swc --tolerance 0 -o again.archetype > /dev/null && "$espalier" measure again.archetype --json > again.json
for key in segments tips forks strahler; do
    [ "$(grep -o "\"$key\": [0-9]*" drawn.json)" = "$(grep -o "\"$key\": [0-9]*" again.json)" ] || {
        printf 'FAILED the drawn tree comes back with other %s\n' $key; failures=$((failures + 1)); }
done
expect "a range of skeletons" 0 "t-3.swc" "$espalier" grow TernaryTree.species --seed 2..3 -o t.swc
expect "a skeleton says its species and seed" 0 "# species TernaryTree, seed 3" cat t-3.swc
expect "a traced root" 0 '"internodes": 5' "$espalier" fit "$data/root.swc" -o root.archetype --json
expect "the root reaches down" 0 '"minY": -0.4500' "$espalier" measure root.archetype --json
expect "a root of centimetres, Z up" 0 "2 templates" "$espalier" fit "$data/root.swc" --scale 100 --up z --templates 2 -o z.archetype
expect "every point" 0 '"instances": 8' "$espalier" fit "$data/root.swc" --tolerance 0 -o all.archetype --json
expect "a coarse one" 0 '"instances": 5' "$espalier" fit "$data/root.swc" --tolerance 0.1 -o few.archetype --json
expect "a root inferred" 0 "root.species" "$espalier" infer root.archetype -o root.species
expect "a root grown" 0 "root.glb" "$espalier" grow root.species -o root.glb
expect "bones" 0 '"segments": 5' "$espalier" fit "$data/bones.gltf" -o bones.archetype --json
expect "bones stand where their transforms say" 0 '"maxRadius": 1.1180' "$espalier" measure bones.archetype --json
expect "a mesh's nodes are no plant" 3 "no segment with a length" "$espalier" fit again.glb -o mesh.archetype
{ printf '1 2 0 0 0 1 -1\n'; for ((i = 2; i <= 5000; ++i)); do printf '%d 2 %d.%d %d 0 1 %d\n' $i $((i % 2)) $((i % 7)) $i $((i - 1)); done; } > long.swc
expect "a chain of thousands" 0 '"depth": 4999' timeout 20 "$espalier" fit long.swc --tolerance 0 -o long.archetype --json
expect "a chain of thousands is read" 0 '"segments": 4999' timeout 20 "$espalier" measure long.archetype --json
printf '1 2 0 0 0 1 2\n2 2 0 1 0 1 1\n' > cycle.swc
printf '1 2 0 0 0 1 -1\n2 2 0 x 0 1 1\n' > word.swc
printf 'old' > kept.archetype
expect "a cycle" 3 "cycle.swc:1:13: the point 1 hangs on itself" "$espalier" fit cycle.swc -o kept.archetype
expect "no number" 3 "word.swc:2:7: \`x\` is no number" "$espalier" fit word.swc -o kept.archetype
expect "a failed fit leaves the output" 0 "old" cat kept.archetype
expect "a broken glb" 3 "glTF" bash -c "head -c 16 again.glb > cut.glb; '$espalier' fit cut.glb -o kept.archetype"
expect "a missing skeleton" 1 "none.swc" "$espalier" fit none.swc -o kept.archetype
expect "no skeleton" 2 ".swc, .gltf or .glb" "$espalier" fit plant.lsys -o kept.archetype
expect "an archetype ends so" 2 ".archetype" "$espalier" fit "$data/root.swc" -o root.txt
expect "a skeleton ends in .swc" 2 ".swc" "$espalier" grow plant.lsys --skeleton -o plant.glb
expect "a scale above none" 2 "--scale" "$espalier" fit "$data/root.swc" --scale 0 -o kept.archetype

# What a grammar gets wrong has its place; what would explode is refused at once.
printf 'axiom: A(1)\nA(x) -> F(1/(x-1))\n' > divide.lsys
printf 'axiom: A\nA -> AA\n' > explode.lsys
printf 'axiom: A\nA(x) -> F(y)\nB = 3\n< A -> F\nignore: +\nA > + -> F\n' > wrong.lsys
{ printf 'axiom: '; head -c 1000000 /dev/zero | tr '\0' '['; } > brackets.lsys
{ printf 'axiom: '; head -c 1000000 /dev/zero | tr '\0' 'F'; printf '\n'; } > long.lsys
{ printf 'axiom: A\n'; for ((i = 0; i < 100000; ++i)); do printf 'A -> F\n'; done; } > many.lsys
expect "division by zero" 3 "divide.lsys:2:11: " "$espalier" derive divide.lsys -n 1
expect "division by zero, drawn" 3 "divide.lsys:2:11: " "$espalier" measure divide.lsys -n 1
for verb in derive measure "render -o no.png" "grow -o no.glb" overlap; do
    # shellcheck disable=SC2086
    expect "$verb refuses what explodes" 3 "explode.lsys:1:8: step 23 makes a word of 8388608 modules; expected at most 4194304" \
        timeout 10 "$espalier" ${verb%% *} explode.lsys -n 64 $([ "$verb" = "${verb#* }" ] || echo "${verb#* }")
done
for place in "wrong.lsys:2:11: " "wrong.lsys:3:" "wrong.lsys:4:" "wrong.lsys:6:5: "; do
    expect "all mistakes at once" 3 "$place" "$espalier" check wrong.lsys
done
expect "a million brackets" 3 "the limit bracketDepth" timeout 10 "$espalier" check brackets.lsys
expect "a line of a megabyte" 3 "the limit templateModules" timeout 10 "$espalier" derive long.lsys
expect "100,000 productions" 3 "many.lsys:4098:1: more than 4096 productions" timeout 10 "$espalier" check many.lsys
expect "a grammar for a species" 2 ".species" "$espalier" grammar plant.lsys

# Levels of detail.
expect "a level of detail" 0 "for pixels of " "$espalier" grow Thesis.species --lod 3 -o lod.glb
expect "what a level comes to" 0 '"error": ' "$espalier" grow Thesis.species --lod 2 -o lod.glb --json
expect "a level that there is none of" 2 "lod" "$espalier" grow Thesis.species --lod 13 -o lod.glb
expect "levels side by side" 0 "pixels" "$espalier" render Thesis.species --lod 0..3 --sheet --width 64 --height 64 --samples 1 -o lod.png
expect "levels that there are none of" 2 "a level from 0 to 12" "$espalier" render Thesis.species --lod 11..13 --sheet -o lod.png

# How a species looks.
"$espalier" infer "$content/Oak.archetype" -o look.species > /dev/null
cp look.species bare.species
expect "a look for a species" 0 "1 kind of leaves, 3 seasons" "$espalier" appearance look.species --set "$content/Oak.appearance"
expect "a look is printed" 0 '"shape": "lobed"' "$espalier" appearance look.species
"$espalier" appearance look.species > printed.appearance
cp look.species before.species
expect "a printed look goes back" 0 "1 kind" "$espalier" appearance look.species --set printed.appearance
same "a printed look goes back" before.species look.species
expect "a look at once" 0 "" "$espalier" infer "$content/Oak.archetype" --appearance "$content/Oak.appearance" -o dressed.species
same "a look at once" look.species dressed.species
expect "inferring again keeps the look" 0 "" "$espalier" infer "$content/Oak.archetype" -o dressed.species
same "inferring again keeps the look" look.species dressed.species
for appearance in "$content"/*.appearance; do
    expect "a look of every kind" 0 "triangles" "$espalier" grow bare.species --appearance "$appearance" --lod 3 --textures 16 -o kind.glb
done
expect "a season" 0 "triangles" "$espalier" grow look.species --season autumn --textures 16 --lod 4 -o autumn.glb
expect "a season that there is none of" 2 "expected summer (the plain look), spring, autumn or winter" "$espalier" grow look.species --season fall -o x.glb
expect "a season of a bare tree" 2 "has no seasons" "$espalier" grow bare.species --season autumn -o x.glb
"$espalier" grow look.species --no-leaves --textures 0 --lod 4 -o wood-a.glb > /dev/null
expect "leaves are baked" 1 "" cmp -s wood-a.glb autumn.glb
expect "seasons on a sheet" 0 "pixels" "$espalier" render look.species --seasons --sheet --lod 5 --width 64 --height 64 --samples 1 -o s.png
expect "a season among seasons" 2 "neither --season" "$espalier" render look.species --seasons --season winter --sheet -o s.png
expect "a gust" 0 "pixels" "$espalier" render look.species --gust 3 --sheet --lod 5 --width 64 --height 64 --samples 1 -o s.png
expect "a close-up" 0 "pixels" "$espalier" render look.species --focus 0,1,0,1 --lod 5 --width 64 --height 64 --samples 1 -o s.png
expect "a close-up of nowhere" 3 "focus.y" "$espalier" render look.species --focus 0,nan,0,1 --lod 5 --width 64 --height 64 -o s.png
# Pictures of one's own, which may begin with the generated ones.
mkdir painted
cp look.species painted/own.species
"$espalier" appearance look.species --pictures painted > painted/own.appearance 2> told.txt
expect "pictures to paint over" 0 "6 pictures" cat told.txt
expect "pictures are not painted over" 2 "is there already" "$espalier" appearance look.species --pictures painted
expect "a look with pictures" 0 "1 kind" "$espalier" appearance painted/own.species --set painted/own.appearance
expect "grow with pictures" 0 "triangles" "$espalier" grow painted/own.species --lod 4 -o painted/own.glb
expect "a picture of pictures" 0 "pixels" "$espalier" render painted/own.species --lod 4 --width 64 --height 64 --samples 1 -o own.png
expect "a look whose pictures are elsewhere" 0 "not beside it: bark-colour.png" "$espalier" appearance look.species --set painted/own.appearance
expect "pictures that are not there" 1 "bark-colour.png" "$espalier" grow look.species --lod 4 -o none.glb
expect "the look as it was" 0 "1 kind" "$espalier" appearance look.species --set printed.appearance
expect "pictures in a new folder" 0 "6 pictures" "$espalier" appearance look.species --pictures brushes
expect "pictures in no folder" 1 "cannot be made" "$espalier" appearance look.species --pictures none/of/these
printf '{"espalier": "appearance", "version": 1,\n "leaves": [{"shape": "round"}]}' > round.appearance
expect "a shape that there is none of" 3 "round.appearance:2:23: shape is" "$espalier" appearance look.species --set round.appearance
same "the earlier look stays" before.species look.species

cp look.species part.species
printf '{"espalier": "appearance", "version": 1,\n "bark": {"colour": [0.2, 0.1, 0.1]}}' > part.appearance
expect "what a look leaves out" 0 "part.species has lost leaves, seasons, bark." "$espalier" appearance part.species --set part.appearance
"$espalier" appearance look.species --set printed.appearance 2> told.txt > /dev/null
expect "of a whole look nothing is told" 1 "" test -s told.txt
cp look.species kept.species
expect "a look that is kept" 0 "kept.species: keeps the look that it had, 1 kind of leaves" \
    "$espalier" infer "$content/Palm.archetype" -o kept.species
expect "seasons are written as one likes" 0 "triangles" "$espalier" grow look.species --season AUTUMN --textures 16 --lod 4 -o again.glb
same "seasons are written as one likes" autumn.glb again.glb
expect "summer" 0 "triangles" "$espalier" grow look.species --season Summer --textures 0 --lod 4 -o summer.glb
"$espalier" grow look.species --textures 0 --lod 4 -o plain.glb > /dev/null
same "summer is the plain look" plain.glb summer.glb
expect "whose seasons" 2 "Palm.appearance has no seasons" "$espalier" render look.species --appearance "$content/Palm.appearance" \
    --seasons --sheet -o s.png

# What is baked, and how.
expect "every profile" 0 "triangles" "$espalier" grow look.species --lod 4 --profile quantized --textures 16 --wind bones -o q.glb
expect "every profile" 0 "triangles" "$espalier" grow look.species --lod 4 --profile compressed --textures 16 --wind generic -o c.glb
expect "how a plant answers the wind" 0 '"trunkAngle"' grep -a -o '"trunkAngle"' c.glb
expect "how levels look" 0 "outline off by" "$espalier" grow look.species --lod 5 --differences --textures 16 -o d.glb
expect "a file a level" 0 "levels-lod5.glb" "$espalier" grow look.species --lod 3..5 --textures 16 -o levels.glb
expect "where a level takes over" 0 " m on (1080 lines, 60 degrees)" "$espalier" grow look.species --lod 5 --textures 0 -o d.glb
expect "levels in one file" 0 '"levels"' "$espalier" grow look.species --lod 3..5 --together --textures 16 --json -o together.glb
expect "one level in one file" 2 "--together needs a range of levels" "$espalier" grow look.species --together -o x.glb
expect "levels the wrong way round" 2 "the lower level first" "$espalier" grow look.species --lod 3..1 -o x.glb
expect "collision shapes" 0 "c.collision.json: " "$espalier" grow look.species --lod 4 --collision --textures 16 -o c.glb
expect "one closed surface" 0 "triangles" "$espalier" grow look.species --lod 4 --branches weld --no-leaves --textures 0 -o w.glb
expect "cards" 0 "cards-impostor.glb: 32 vertices, 16 triangles" "$espalier" grow look.species --lod 5 --impostor cards --atlas 64 --textures 0 -o cards.glb
expect "cards beside a chain" 0 '"texels": 64' "$espalier" grow look.species --lod 4..5 --together --impostor cards --atlas 64 --textures 0 --json -o chain.glb
expect "an octahedral impostor" 0 "oct-impostor.json: 64 frames" "$espalier" grow look.species --lod 5 --impostor octahedral --atlas 64 --textures 0 -o oct.glb
expect "how an impostor looks" 0 " %, as bright as " "$espalier" grow look.species --lod 5 --impostor octahedral --atlas 256 --textures 0 --differences -o oct.glb
expect "its pictures are named" 0 "with oct-impostor-colour.png, oct-impostor-normal.png, oct-impostor-roughness.png" \
    "$espalier" grow look.species --lod 5 --impostor octahedral --frames 6 --atlas 96 --textures 0 -o oct.glb
expect "finer or coarser" 0 '"side": 6' cat oct-impostor.json
expect "too few frames" 2 "frames" "$espalier" grow look.species --impostor octahedral --frames 5 -o x.glb
expect "frames of cards" 2 "--frames needs --impostor octahedral" "$espalier" grow look.species --impostor cards --frames 8 -o x.glb
expect "an impostor of no kind" 2 "--impostor" "$espalier" grow look.species --impostor sphere -o x.glb
expect "cards on a sheet" 0 "pixels" "$espalier" render look.species --lod 5 --impostor --takeover --sheet --width 64 --height 64 --samples 1 -o s.png
expect "an atlas of nothing" 2 "--atlas needs --impostor cards or octahedral" "$espalier" grow look.species --atlas 64 -o x.glb
expect "a gust of cards" 2 "expected neither" "$espalier" render look.species --gust 3 --impostor --sheet -o s.png
expect "cards without a sheet" 2 "--impostor needs --sheet" "$espalier" render look.species --impostor -o s.png
expect "a table of pivots" 0 "with p-pivots-position.exr, p-pivots-direction.png" "$espalier" grow look.species --lod 4..5 --wind pivots --textures 0 -o p.glb
expect "that says where they are" 0 '"positionTexture":"p-pivots-position.exr"' cat p-pivots.json
expect "and which texel is a vertex' own" 0 TEXCOORD_1 grep -a -o TEXCOORD_1 p-lod4.glb
expect "an OBJ" 0 "triangles" "$espalier" grow look.species --lod 4 --textures 16 -o o.obj
expect "an OBJ's pictures" 0 "o-bark-colour.png" cat o.mtl
expect "an OBJ's files" 0 "with the_oak.mtl, the_oak-bark-colour.png" "$espalier" grow look.species --lod 5 --textures 16 -o "the oak.obj"
expect "an OBJ's leaves" 0 "the_oak-leaves0-colour.png" sed -n '/newmtl Oak_leaves_0/,$p' the_oak.mtl
expect "an OBJ's materials" 0 "mtllib the_oak.mtl" grep mtllib "the oak.obj"
for seeds in 3 3..3; do
    "$espalier" grow look.species --seed $seeds --lod 4..5 --collision --textures 0 --json -o j.glb > grown.json
    expect "three files" 0 3 grep -c '"file"' grown.json
    expect "one seed an object, a range an array" 0 "$([ $seeds = 3 ] && echo "{" || echo "[")" head -c 1 grown.json
done
expect "an OBJ in the wind" 2 "OBJ knows no" "$espalier" grow look.species --wind generic -o o.obj
expect "a skeleton in the wind" 2 "a skeleton knows no --wind" "$espalier" grow look.species --wind generic -o o.swc

# No option is without effect in silence, and none takes another for its value.
while IFS='|' read -r text command; do
    # shellcheck disable=SC2086
    expect "told of $command" 2 "$text" "$espalier" $command
done << 'END'
--joints needs --wind bones|grow look.species --joints 8 -o x.glb
--translucent needs leaves|grow look.species --no-leaves --translucent -o x.glb
--season needs leaves|render look.species --no-leaves --season winter -o x.png
--takeover needs coarse levels|render look.species --takeover -o x.png
--columns needs --sheet|render look.species --columns 2 -o x.png
--templates needs an A.archetype|render look.species --templates . -o x.png
/nope|render look.species --templates /nope -o x.png
--focus needs a radius above 0|render look.species --focus 0,1,0,0 -o x.png
--plain needs|grammar look.species --plain --dismiss
--fresh needs -o|infer Thesis.archetype --fresh --trace
expected either that or --skeleton|grow look.species --skeleton --lod 1 -o x.swc
a skeleton knows no --season|grow look.species --season winter -o x.swc
--impostor needs cards or octahedral|grow look.species --impostor --atlas 256 -o x.glb
--atlas needs a number from 64 to 4096|grow look.species --impostor cards -o x.glb --atlas
there is no option --sed (did you mean --seed?)|grow look.species --sed 3
there is no option --transl (did you mean --translucent?)|grow look.species --transl
there is no option -x;|render -x
there is no verb grwo (did you mean grow?)|grwo
there is no verb grwo (did you mean grow?)|help grwo
--output is required|grow look.species
END
for name in x.glb x.png x.swc; do
    expect "no $name was written" 1 "" test -e "$name"
done

# Names that are not quite those of files.
expect "a name alone" 2 "did you mean look.species?" "$espalier" grow look -o x.glb
cp "$content/Palm.archetype" Palmlike.archetype
expect "a drawing's name alone" 2 'infer Palmlike.archetype -o Palmlike.species` makes one' "$espalier" grow Palmlike -o x.glb
expect "a look that ends otherwise" 2 "ends in .appearance or .species" "$espalier" appearance look.species --set told.txt
expect "a look alone" 2 "appearance S.species --set printed.appearance" "$espalier" appearance printed.appearance

# Help.
"$espalier" > bare.txt 2> bare.help
"$espalier" help > asked.help
same "no verb: how the command is used" asked.help bare.help
expect "and nothing else" 1 "" test -s bare.txt
"$espalier" help grow > asked.help
"$espalier" grow --help > grow.help
same "help of a verb" asked.help grow.help
expect "the version" 0 "espalier 0" "$espalier" --version

# Wrong usage is 2.
expect "steps of a drawn tree" 2 "expected no -n" "$espalier" measure "$content/Thesis.archetype" -n 3
expect "steps below none" 2 "iterations" "$espalier" derive plant.lsys -n -1
expect "derive wants a grammar" 2 ".lsys" "$espalier" derive Thesis.species
expect "no verb" 2 "" "$espalier"
expect "unknown verb" 2 "no verb prune" "$espalier" prune
expect "a species ends in .species" 2 ".species" "$espalier" infer "$content/Thesis.archetype" -o x.txt
expect "unknown ending" 2 ".species" "$espalier" measure tree.txt
expect "empty range" 2 "range is empty" "$espalier" measure Thesis.species --seed 9..3
expect "no number" 2 "--seed" "$espalier" measure Thesis.species --seed one
expect "weight out of range" 2 "merge-weight" "$espalier" infer "$content/Thesis.archetype" --merge-weight 1.5 -o x.species
expect "no jitter" 0 "w = " "$espalier" infer "$content/Thesis.archetype" --jitter 0 --trace
expect "jitter out of range" 2 "jitter" "$espalier" infer "$content/Thesis.archetype" --jitter -0.1 -o x.species
expect "jitter of a preset that has none" 3 "moves no parameters" "$espalier" infer "$content/Thesis.archetype" --preset helberg \
    --jitter 0.5 -o x.species
"$espalier" infer "$content/Thesis.archetype" --spatial phyllotaxis,random -o spatial.species > /dev/null
expect "a planar tree with depth" 0 '"spatial": "phyllotaxis,random"' cat spatial.species
expect "compared with what it was learned from" 0 '"azimuth"' "$espalier" compare "$content/Thesis.archetype" spatial.species --seeds 1..20 --json
expect "as it was inferred before" 0 "as before, with --spatial phyllotaxis,random" \
    "$espalier" infer "$content/Thesis.archetype" -o spatial.species
expect "until something else is said" 0 "spatial.species: 17 instances" \
    "$espalier" infer "$content/Thesis.archetype" --spatial drawn -o spatial.species
expect "flat again" 1 "" grep "spatial.*phyllotaxis" spatial.species
expect "mirror images" 0 "" "$espalier" infer "$content/Thesis.archetype" --mirror -o mirror.species
expect "that are remembered" 0 "as before, with --mirror" "$espalier" infer "$content/Thesis.archetype" -o mirror.species
expect "whose rules say so" 0 "mirrored" "$espalier" grammar mirror.species
expect "compared with mirror images" 0 '"exemplars": 2' "$espalier" compare "$content/Thesis.archetype" mirror.species --seeds 1..20 --json
expect "and without them again" 0 "17 instances" "$espalier" infer "$content/Thesis.archetype" --no-mirror -o mirror.species
"$espalier" infer "$content/Oak.archetype" -o oak.species > /dev/null
"$espalier" grammar oak.species --plain > oak.lsys
sed '0,/Bough(0,/s//Bouhg(0,/' oak.lsys > typo.lsys
expect "a name that was written wrongly" 0 "Bouhg\` draws nothing, and no rule rewrites it" "$espalier" grammar oak.species --set typo.lsys
expect "drawings that a species does not come from" 0 "from other drawings" \
    "$espalier" compare "$content/Palm.archetype" oak.species --seeds 1..2
expect "what may help" 0 "what may help: " "$espalier" compare "$content/Palm.archetype" oak.species --seeds 1..2
expect "azimuths that are none" 2 "phyllotaxis, random or drawn" "$espalier" infer "$content/Thesis.archetype" --spatial spiral -o x.species
expect "weights of archetypes" 0 " : 3" "$espalier" infer "$content/Thesis.archetype" "$repository/Tests/Golden/Data/Thesis.archetype" \
    --weights 3,1 --trace
expect "a weight for each archetype" 2 "a number for each of the 1 archetype" "$espalier" infer "$content/Thesis.archetype" \
    --weights 3,1 -o x.species
expect "weight of an archetype out of range" 2 "weights" "$espalier" infer "$content/Thesis.archetype" --weights 0 -o x.species
expect "unknown preset" 2 "preset" "$espalier" infer "$content/Thesis.archetype" --preset best -o x.species

# Bad input is 3, with its place, and what was there stays.
head -c 300 "$content/Thesis.archetype" > truncated.archetype
: > empty.archetype
printf '\xff\xfe' > bytes.archetype
cp "$repository/Templates/thesis.templates" .
printf '{"espalier":"archetype","version":1,"library":"thesis.templates",\n "trees":[{"template":"VII","scale":2}]}' > key.archetype
printf '{"espalier":"archetype","version":1,"library":"thesis.templates",\n "trees":[{"template":"VII","scaling":1e400}]}' > huge.archetype
printf '{"espalier":"archetype","version":1,"library":"thesis.templates",\n "trees":[{"template":"VII","scaling":0}]}' > zero.archetype
printf '{"espalier":"archetype","version":1,"library":"../thesis.templates","trees":[{"template":"VII"}]}' > leave.archetype
printf '{"espalier":"archetype","version":2,"library":"thesis.templates","trees":[{"template":"VII"}]}' > newer.archetype
printf '{"espalier":"archetype","version":1,"library":"thesis.templates","trees":[{"template":"I","children":{"Y":{"template":"I"}}}]}' > anchor.archetype
printf '{"espalier":"archetype","version":1,"library":"thesis.templates","trees":[{"template":"I","children":{"X":null,"X":null}}]}' > twice.archetype
head -c 200000 /dev/zero | tr '\0' '[' > nested.archetype
truncate -s 600000000 large.archetype
printf old > out.species
expect "empty" 3 "empty.archetype:1:1" "$espalier" infer empty.archetype -o out.species
expect "truncated" 3 "truncated.archetype:" "$espalier" infer truncated.archetype -o out.species
expect "not UTF-8" 3 "bytes.archetype:1:1" "$espalier" infer bytes.archetype -o out.species
expect "unknown key" 3 'key.archetype:2:29' "$espalier" infer key.archetype -o out.species
expect "1e400" 3 "huge.archetype:2:39" "$espalier" infer huge.archetype -o out.species
expect "scaling 0" 3 "zero.archetype:2:39" "$espalier" infer zero.archetype -o out.species
expect "library outside" 3 "leaves the folders" "$espalier" infer leave.archetype -o out.species
expect "newer version" 3 "version 2" "$espalier" infer newer.archetype -o out.species
expect "no such anchor" 3 'no anchor "Y"' "$espalier" infer anchor.archetype -o out.species
expect "two children at one anchor" 3 "second time" "$espalier" infer twice.archetype -o out.species
expect "nested 200,000 deep" 3 "jsonDepth" "$espalier" infer nested.archetype -o out.species
expect "600 MB" 3 "fileBytes" "$espalier" infer large.archetype -o out.species
expect "the earlier output stays" 0 "old" cat out.species

# Anything else is 1.
expect "missing file" 1 "missing.archetype" "$espalier" infer missing.archetype -o out.species
expect "missing folder" 1 "nowhere" "$espalier" infer "$content/Thesis.archetype" -o nowhere/out.species
expect "a folder for a file" 1 "folder.archetype" bash -c "mkdir folder.archetype; '$espalier' measure folder.archetype"

[ $failures -eq 0 ] && echo "the command does what it says"
exit $failures
