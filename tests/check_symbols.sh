#!/usr/bin/env bash
# Proves on the binaries that code compiled for a newer CPU cannot run on an older one.
#
#   check_symbols.sh kernels ISA OBJECT…   every symbol that other objects can see names its ISA
#   check_symbols.sh baseline LIBRARY      no AVX instruction outside the ISAs' own objects
#
# An inline function has one name whatever it is compiled for, and the linker keeps any one of its
# copies. If an ISA's object held one without the ISA in its name, all code might get the AVX copy.
set -euo pipefail

# Not code of ours: a pointer to the C++ runtime, and clang's call of std::terminate.
harmless='^DW\.ref\.__gxx_personality_v0$|^__clang_call_terminate$'

check_kernels() {  # ISA, then objects
    # Its own are: the type that kernels are templates over, the ISA's copy of xsimd, and the one
    # function that gives its kernels to the dispatcher.
    local own="\bisa::${1^}\b|\bxsimd_$1::|\bkernel_table_$1\(\)$" symbols leaks
    # Upper case types and u, v, w are those that the linker sees.
    symbols=$(nm -C --defined-only "${@:2}" | sed -nE 's/^[0-9a-f]+ [A-Zuvw] //p')
    [[ -n $symbols ]] || { echo "no symbols in ${*:2}"; exit 1; }
    leaks=$(grep -vP "$own|$harmless" <<<"$symbols" || true)
    [[ -z $leaks ]] || { printf 'not named after %s:\n%s\n' "$1" "$leaks"; exit 1; }
    echo "$(wc -l <<<"$symbols") symbols, all named after $1"
}

check_baseline() {  # library
    local found
    # AVX shows in wide registers, and in narrow ones under a mnemonic that begins with v.
    found=$(objdump -d --no-show-raw-insn "$1" | awk '
        / file format / { object = $1 }
        object !~ /^isa_(sse42|avx2|avx512)/ && /%[yz]mm|\tv[a-z0-9]+ .*%xmm/ { print object $0 }')
    [[ -z $found ]] || { printf 'AVX in baseline code:\n%s\n' "$(head -20 <<<"$found")"; exit 1; }
    echo "no AVX instruction outside the ISAs' own objects"
}

case ${1:-} in
    kernels) check_kernels "${@:2}" ;;
    baseline) check_baseline "$2" ;;
    *) sed -n 's/^#   /usage: /p' "$0" >&2; exit 2 ;;
esac
