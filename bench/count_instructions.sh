#!/usr/bin/env bash
# Counts the instructions of a child's box test and of a triangle test, as the release build compiles
# them: all, those on vectors, and wide stores to and reads from the stack. CXX picks the compiler.
#
#   bench/count_instructions.sh
set -euo pipefail
cd "$(dirname "$0")/.."
object=$(mktemp)
trap 'rm -f "$object"' EXIT

avx2='-msse4.2 -mpopcnt -mavx2 -mfma -mbmi -mbmi2'
avx512="$avx2 -mavx512f -mavx512cd -mavx512dq -mavx512vl -mavx512bw"

count() {  # ISA, flags
    # shellcheck disable=SC2086
    "${CXX:-g++}" -std=c++20 -O3 -DNDEBUG -ffp-contract=off -w -Iinclude -Isrc -DISA="$1" $2 \
        -c bench/instruction_probe.cpp -o "$object"
    objdump -dC --no-show-raw-insn "$object" | awk -F'\t' -v isa="$1" '
        /^[0-9a-f]+ <.*>:$/ {
            mixed = /Directions\)1/ ? "mixed" : "shared"
            lanes = /, 16, / ? 16 : 8
            name = ""
            if (match($0, /::(visit_child|rays_meet_triangle|rays_hit_triangle|ray_meets_block)/))
                name = sprintf("%-8s%-20s%-8s%4d", isa, substr($0, RSTART + 2, RLENGTH - 2), mixed,
                               lanes)
            next
        }
        name == "" || $2 == "" || $2 ~ /^(nop|data16|cs nop|xchg +%ax)/ { next }
        { all[name]++ }
        $2 ~ /^v.*%[xyzk]/ { vector[name]++ }
        $2 ~ /^vmov[a-z0-9]+ +%[yz]mm[0-9]+,.*\(%r[sb]p/ { stores[name]++; next }
        $2 ~ /^v.*\(%r[sb]p.*%[yz]mm/ { reads[name]++ }
        END {
            for (name in all)
                printf "%s%7d%8d%8d%7d\n", name, all[name], vector[name], stores[name], reads[name]
        }' | sort
}

echo 'ISA     step                rays   lanes    all  vector  stores  reads'
count Avx2 "$avx2"
count Avx512 "$avx512"
