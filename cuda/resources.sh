#!/usr/bin/env bash
# Prints what nvcc gives each kernel: registers, stack, spilled bytes, and how many warps of it a
# multiprocessor holds by its registers. Fails if a kernel spills.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
nvcc=${1:-nvcc}
flags=(-std=c++20 --expt-relaxed-constexpr -diag-suppress=20012 -fmad=false
    -I . -I ../src -I ../include -Xptxas -v -cubin -o /dev/null)

# ptxas tells of a kernel in four lines; names are shortened to what tells kernels apart.
table() {
    c++filt | sed -n 's/.*Compiling entry function .\(.*\). for .\(sm_[0-9]*\)./name \2 \1/p
        s/.* \([0-9]*\) bytes stack frame, \([0-9]*\) bytes spill stores.*/frame \1 \2/p
        s/^\( *[0-9]* bytes stack frame\)/\1/; s/.*Used \([0-9]*\) registers.*/used \1/p' |
        sed 's/packet:://g; s/cuda:://g; s/(anonymous namespace):://g; s/^name \(sm_[0-9]*\) void /name \1 /
             s/(Levels)0/one mesh/; s/(Levels)1/instances/; s/(Query)0/closest/; s/(Query)1/any/
             s/NoCounts/no counts/; s/Counts>/counts>/; /^name/s/\([a-z]\)(.*/\1/; /^name/s/>(.*/>/
             s/unsigned int>/30 bits>/; s/unsigned long>/63 bits>/' |
        awk '/^name/ { arch = $2; sub(/^name sm_[0-9]* /, ""); name = $0; frame = "" }
             /^frame/ && frame == "" { frame = $2; spilled = $3 }
             /^used/ && name != "" {
                 by_registers = int(65536 / (int(($2 + 7) / 8) * 8 * 32))
                 most = arch == "sm_75" ? 32 : 64
                 printf "| %s | `%s` | %d | %d | %d | %d |\n", arch, name, $2, frame, spilled,
                     by_registers < most ? by_registers : most
                 if (spilled > 0) failed = 1
                 name = ""
             }
             END { exit failed }'
}

echo "| GPU | kernel | registers | stack, bytes | spilled, bytes | warps by registers |"
echo "|---|---|---|---|---|---|"
failed=0
for arch in sm_75 sm_90; do
    for source in trace_kernels.cu ray_sort.cu device_references.cu morton_build.cu kd_planes.cu \
        kd_step.cu kd_build.cu kd_numbering.cu lay_out.cu; do
        "$nvcc" "${flags[@]}" -arch=$arch $source 2>&1 | table || failed=1
    done
done
((failed == 0)) || { echo "a kernel spills registers" >&2; exit 1; }
