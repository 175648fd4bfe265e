#!/usr/bin/env bash
# Makes the pictures of README.md: one for each grammar beside this script.
#   pictures.sh ESPALIER [NAME...]   all of them, or those of the grammars NAME
set -euo pipefail
if [ $# -lt 1 ]; then
    sed -n '2,3s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
espalier=$(realpath "$1")
shift
cd "$(dirname "${BASH_SOURCE[0]}")"
mkdir -p Pictures
[ $# -gt 0 ] || set -- *.lsys

for grammar; do
    name=$(basename "$grammar" .lsys)
    size=(--width 360 --height 400)
    case $name in
        # Drawn with a pen: curves, and plants of lines.
        Algae) size=(--width 360 --height 24) look=(--paper --lines 1 -n 0..6 --sheet --columns 1) ;;
        CantorSet) size=(--width 360 --height 24) look=(--paper --lines 1 -n 0..4 --sheet --columns 1) ;;
        Abop1-27) size=(--width 176 --height 184) look=(--paper --lines 1.5 --seed 1..4 --sheet --columns 2) ;;
        Abop1-30?) size=(--width 86 --height 200) look=(--paper --lines 3 -n 0..3 --sheet --columns 4) ;;
        Abop1-37?) size=(--width 360 --height 180) look=(--paper --lines 1) ;;
        KochCurve) size=(--width 360 --height 200) look=(--paper --lines 1.8) ;;
        DragonCurve) size=(--width 360 --height 260) look=(--paper --lines 1.5) ;;
        BinaryTree | Sierpinski* | FractalPlant*) look=(--paper --lines 1.5) ;;
        Abop1-24? | Abop1-31? | Abop5-1*) look=(--paper --lines 1.2) ;;
        # Figures in colour.
        Abop1-35) size=(--width 360 --height 260) look=(--paper --lines 1) ;;
        Abop1-2[56] | Abop2-[67]? | Abop5-5) look=(--paper) ;;
        # In the meadow.
        Fern) look=(--seed 2 --elevation 15) ;;
        Shrub) look=(--seed 1) ;;
        SunflowerHead) look=(--elevation 2) ;;
        *) look=() ;;
    esac
    "$espalier" render "$name.lsys" -o "Pictures/$name.png" "${size[@]}" ${look[@]+"${look[@]}"}
done
