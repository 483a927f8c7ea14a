#!/usr/bin/env bash
# What the instructions of one voice and of eight players are: how many compute, how many only move numbers, and how many keep
# account of places, turns and calls. So it shows what no layout of the same computation can save.
#
#   benches/arithmetic.sh [avx2|plain]
#
# Counted by callgrind for each instruction of the program, as the difference of two run lengths, and named by objdump.
set -euo pipefail
export LC_ALL=C

path=${1:-avx2}
for tool in valgrind objdump; do
    if ! command -v "$tool" >/dev/null; then
        echo "cannot count without $tool: apt-get install valgrind binutils" >&2
        exit 1
    fi
done
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
(cd "$root" && CARGO_TARGET_DIR=$target cargo build --quiet --profile plugin -p chalumeau-benches --bin instructions)
program=$target/plugin/instructions
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
objdump -d --no-show-raw-insn "$program" >"$folder/program"

counted() { # SECONDS PLAYERS -> counts of all instructions, in a file
    local out=$folder/$1-$2
    valgrind --tool=callgrind --dump-instr=yes --compress-pos=no --callgrind-out-file="$out" \
        "$program" "$1" 48000 "$path" 0 "" "" "$2" >"$folder/log" 2>&1 || { cat "$folder/log" >&2; exit 1; }
    echo "$out"
}

for players in 1 8; do
    short=$(counted 0.5 "$players")
    long=$(counted 0.75 "$players")
    # Internal samples of a quarter of a second.
    awk -v players="$players" -v samples=24000 '
        FNR == 1 { file++ }
        file < 3 {
            # The line after a call tells what was called.
            if (/^calls=/) { skip = 1; next }
            if (!/^0x/) next
            if (skip) { skip = 0; next }
            cost = file == 1 ? -$NF : $NF
            count[substr($1, 3)] += cost
            all += cost
            next
        }
        /^ +[0-9a-f]+:/ {
            sub(":", "", $1)
            if (!($1 in count)) next
            name = $2
            sub("^v", "", name)
            operands = $0
            if (name ~ /^(mov|broadcast|insert|extract|shuf|unpck|perm|pinsr|pextr|pshuf|punpck|pack|pmov|pbroadcast)/) {
                # Moves of numbers, and of whole numbers in general registers.
                kind = operands ~ /%[xyz]mm/ ? "move" : "other"
            } else if (operands ~ /%[xyz]mm/) {
                kind = name ~ /(ss|sd)$/ || name ~ /^(cvt.*s[sd]|ucomi|comi)/ ? "single" : "vector"
            } else {
                kind = "other"
            }
            sum[kind] += count[$1]
            named += count[$1]
        }
        END {
            printf "%d player%s: %d instructions for an internal sample\n", players, (players > 1 ? "s" : ""), all / samples
            printf "  %5d compute with vectors\n", sum["vector"] / samples
            printf "  %5d compute with single numbers\n", sum["single"] / samples
            printf "  %5d move numbers of these: between memory, registers and lanes\n", sum["move"] / samples
            printf "  %5d find places, count, jump and call\n", sum["other"] / samples
            printf "  %5d are in libraries\n", (all - named) / samples
        }
    ' "$short" "$long" "$folder/program"
done
