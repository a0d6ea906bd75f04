#!/usr/bin/env bash
# Compares the two ways to build the k-d tree by the surface area heuristic: SAH cost and build
# seconds on generated scenes, the medians of runs that take turns.
#
#   bench/compare_kd_builds.sh [TRIANGLES [THREADS [REPEATS]]]
set -euo pipefail
cd "$(dirname "$0")/.."
triangles=${1:-1000000} threads=${2:-2} repeats=${3:-3}
packet=build/release/bin/packet
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Prints seconds and SAH cost of a build.
build() {  # WAY
    "$packet" trace "$folder/scene.glb" "$folder/rays.npy" --accel kd-sah --kd-build "$1" \
        --threads "$threads" --json |
        sed -E 's/.*"build":\{"seconds":([^,]*),.*"sah_cost":([^}]*)\}.*/\1 \2/'
}
median() { sort -g | awk '{ line[NR] = $1 } END { print line[int((NR + 1) / 2)] }'; }

printf '%-10s%14s%14s%8s%12s%12s%8s\n' scene 'sorted s' 'by levels s' ratio \
    'sorted SAH' 'levels SAH' ratio
for kind in terrain city hairball soup; do
    "$packet" make "$kind" -o "$folder/scene.glb" --triangles "$triangles" >"$folder/log"
    "$packet" rays "$folder/scene.glb" primary -o "$folder/rays.npy" --size 8x8 >"$folder/log"
    rm -f "$folder/sorted" "$folder/breadth-first"
    for ((i = 0; i < repeats; ++i)); do
        for way in sorted breadth-first; do build "$way" >>"$folder/$way"; done
    done
    sorted=$(median <"$folder/sorted") levels=$(median <"$folder/breadth-first")
    read -r _ sorted_cost <"$folder/sorted"
    read -r _ levels_cost <"$folder/breadth-first"
    awk -v k="$kind" -v a="$sorted" -v b="$levels" -v c="$sorted_cost" -v d="$levels_cost" 'BEGIN {
        printf "%-10s%14.2f%14.2f%8.2f%12.2f%12.2f%8.3f\n", k, a, b, b / a, c, d, d / c }'
done
