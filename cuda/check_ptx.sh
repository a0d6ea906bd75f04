#!/usr/bin/env bash
# Looks into what nvcc makes of kernels for what no emulation can show. Counts of bits must be there:
# functions of the standard library that are constexpr compile for a device even if what they call
# does not exist there, to nothing and without a warning. And products and sums must be apart where
# the CPU keeps them apart.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
nvcc=${1:-nvcc}
flags=(-std=c++20 --expt-relaxed-constexpr -diag-suppress=20012 -fmad=false -arch=sm_75
    -I . -I ../src -I ../include -ptx -o -)

require() {  # source, then the instructions that its kernels must have
    local ptx instruction
    ptx=$("$nvcc" "${flags[@]}" "$1")
    for instruction in "${@:2}"; do
        grep -qF "$instruction" <<<"$ptx" || { echo "$1: no $instruction" >&2; exit 1; }
    done
}

forbid() {  # source, then an instruction that its kernels must not have
    ! "$nvcc" "${flags[@]}" "$1" | grep -F "$2" || { echo "$1: $2" >&2; exit 1; }
}

require device_references.cu fma.rn.f64  # asked for by name: exact products
require kd_planes.cu popc.b64 atom.shared.add.u32
require kd_step.cu clz.b64
require morton_build.cu clz.b32 clz.b64
forbid kd_planes.cu fma.rn
forbid kd_step.cu fma.rn
echo "the instructions are there"
