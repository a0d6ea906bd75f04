#!/usr/bin/env bash
# Simulates what incoherent rays fetch from beyond a cache, by cachegrind (package valgrind): bytes a
# ray, in lines of 64, read or written. A scene is traced once and twice by the same rays; the
# difference is what one pass takes, without loading and building. AVX2, since valgrind knows no AVX-512.
#
#   bench/count_cache_misses.sh [KIND TRIANGLES SIDE CACHE_BYTES TREELET_BYTES]
#
# of a scene that packet makes, for SIDE * SIDE random rays. The cache that all misses go beyond has
# 16 ways; by default it is this machine's second level. One that is smaller lets a smaller scene
# stand for one beyond the last level.
set -euo pipefail
cd "$(dirname "$0")/.."
kind=${1:-terrain} triangles=${2:-100000} side=${3:-512}
cache=${4:-$(getconf LEVEL2_CACHE_SIZE)} treelet=${5:-262144}
packet=${PACKET:-build/release/bin/packet}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export PACKET_ISA=avx2
"$packet" make "$kind" --triangles "$triangles" -o "$work/scene.glb" >/dev/null
"$packet" rays "$work/scene.glb" random --size "${side}x$side" -o "$work/rays.npy" >/dev/null

lines() {  # mode, passes: lines fetched into the cache and its first level in all
    valgrind --tool=cachegrind --cache-sim=yes --cachegrind-out-file="$work/out" --I1=32768,8,64 \
        --D1="$(getconf LEVEL1_DCACHE_SIZE),$(getconf LEVEL1_DCACHE_ASSOC),64" \
        --LL="$cache,16,64" "$packet" trace "$work/scene.glb" "$work/rays.npy" --accel bvh \
        --mode "$1" --treelet-bytes "$treelet" --threads 1 --repeat "$2" >"$work/log" 2>&1 ||
        { cat "$work/log" >&2; exit 1; }
    # The totals in the order of the events: Ir I1mr ILmr Dr D1mr DLmr Dw D1mw DLmw.
    awk '/^summary:/ { print $3 + $6 + $9, $4 + $7 + $10, $2 }' "$work/out"
}

echo "$kind, $triangles triangles, $((side * side)) random rays, cache of $cache bytes"
printf '%-9s%18s%18s%18s\n' mode 'beyond L1, B/ray' 'beyond it, B/ray' instructions/ray
for mode in single stream treelet; do
    read -r near1 far1 work1 < <(lines "$mode" 1)
    read -r near2 far2 work2 < <(lines "$mode" 2)
    awk -v mode="$mode" -v rays=$((side * side)) -v near=$((near2 - near1)) \
        -v far=$((far2 - far1)) -v work=$((work2 - work1)) 'BEGIN {
            printf "%-9s%18.0f%18.0f%18.0f\n", mode, 64 * near / rays, 64 * far / rays, work / rays }'
done
