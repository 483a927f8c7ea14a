#!/usr/bin/env bash
# What one 48 kHz output sample of a held note costs here and in STK's BlowHole and Clarinet.
#
#   benches/peers/run.sh [ROUNDS] [SECONDS]      default 9 rounds of 10 s of sound each
#
# The programs run alternately in one go, so that a busy machine is busy for all of them; medians are compared.
# Instructions are counted by callgrind where valgrind is there: the difference of a 1 s and a 2 s run. Installs nothing.
# CXX and CXXFLAGS choose the compiler of the STK side; STK's own library is the distribution's.
set -euo pipefail
export LC_ALL=C

rounds=${1:-9}
seconds=${2:-10}
for number in "$rounds" "$seconds"; do
    if ! [[ $number =~ ^[1-9][0-9]*$ ]]; then
        echo "usage: $0 [ROUNDS] [SECONDS], whole numbers from 1, got '$number'" >&2
        exit 2
    fi
done

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

cxx=${CXX:-g++}
if ! command -v "$cxx" >/dev/null; then
    echo "no C++ compiler '$cxx': apt-get install g++" >&2
    exit 1
fi
if ! echo '#include <stk/BlowHole.h>' | "$cxx" -E -x c++ - >/dev/null 2>&1; then
    echo "STK's headers are missing: apt-get install libstk-dev" >&2
    exit 1
fi
# shellcheck disable=SC2086 # flags are words
"$cxx" -std=c++17 ${CXXFLAGS:--O3} "$here/stk.cpp" -lstk -o "$scratch/stk"
(cd "$root" && CARGO_TARGET_DIR=$target cargo build --quiet --release -p chalumeau-benches --bin instructions)
ours=$target/release/instructions

names=(chalumeau plain blowhole clarinet) # plain: chalumeau without AVX2
command_of() { # NAME SECONDS
    case $1 in
    chalumeau) command=("$ours" "$2" 48000) ;;
    plain) command=("$ours" "$2" 48000 plain) ;;
    *) command=("$scratch/stk" "$1" "$2" 48000) ;;
    esac
}
play() { # NAME SECONDS
    local command
    command_of "$1" "$2"
    "${command[@]}"
}
median() { sort -n | awk '{ x[NR] = $1 } END { print NR % 2 ? x[(NR + 1) / 2] : (x[NR / 2] + x[NR / 2 + 1]) / 2 }'; }

for ((round = 0; round < rounds; round++)); do
    for name in "${names[@]}"; do
        play "$name" "$seconds" | sed -n 's/.* ns_per_sample //p' >>"$scratch/$name.ns"
    done
done
declare -A ns instructions
for name in "${names[@]}"; do
    if ! [[ -s $scratch/$name.ns ]]; then
        echo "$name: this system does not tell a thread's CPU time (/proc/thread-self/schedstat)" >&2
        exit 1
    fi
    ns[$name]=$(median <"$scratch/$name.ns")
    instructions[$name]=-
done

if command -v valgrind >/dev/null; then
    collected() { # NAME SECONDS -> instructions of the whole run
        local log=$scratch/$1.$2.log command
        command_of "$1" "$2"
        if ! valgrind --tool=callgrind --callgrind-out-file=/dev/null "${command[@]}" >/dev/null 2>"$log"; then
            cat "$log" >&2
            return 1
        fi
        sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$log"
    }
    for name in "${names[@]}"; do
        short=$(collected "$name" 1)
        long=$(collected "$name" 2)
        instructions[$name]=$(((long - short) / 48000))
    done
else
    echo "no instruction counts: apt-get install valgrind" >&2
fi

row() { # NAME
    awk -v name="$1" -v ns="${ns[$1]}" -v ic="${instructions[$1]}" \
        -v base_ns="${ns[blowhole]}" -v base_ic="${instructions[blowhole]}" 'BEGIN {
        printf "%-10s %10.2f %10.2f %14s %10s\n", name, ns, ns / base_ns, ic, ic == "-" ? "-" : sprintf("%.2f", ic / base_ic)
    }'
}
echo "per 48 kHz output sample, median of $rounds alternating runs of $seconds s"
printf '%-10s %10s %10s %14s %10s\n' "" ns /blowhole instructions /blowhole
for name in "${names[@]}"; do row "$name"; done
