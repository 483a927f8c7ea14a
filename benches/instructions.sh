#!/usr/bin/env bash
# Fails when the whole instrument, heard from everywhere or from two places, costs more instructions per internal sample
# (96 kHz) than it may, when a screen that watches it costs the audio thread more than 1.2 %, or when growl and vocal tract, or
# several players, cost more than they may.
#
#   benches/instructions.sh [RATE]      host rate, default 48000
#
# Counted by callgrind as the difference of a 0.5 s and a 1.5 s run of a held note, so that building the instrument
# cancels. Unlike times, counts repeat on a busy machine. Without valgrind it fails: a gate that did not run is not green.
set -euo pipefail
export LC_ALL=C

rate=${1:-48000}
# Of a note that lives and moves, as it does by default.
declare -A most=([avx2]=850 [plain]=1315 ["avx2 places"]=901 ["plain places"]=1390)

# What growl and vocal tract add together. On the plain path it is more, because the voice alone is cheaper there than it was.
declare -A most_techniques=([avx2]=55 [plain]=65)

# Players in unison, in hundredths of the cost of one voice.
# Both counts vary by half a percent with how memory is given, so the limits lie 1 to 2 % above.
declare -A most_players=(["avx2 8"]=535 ["avx2 16"]=1067 ["plain 8"]=670 ["plain 16"]=1340)

if ! command -v valgrind >/dev/null; then
    echo "cannot count instructions without valgrind: apt-get install valgrind" >&2
    exit 1
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
(cd "$root" && CARGO_TARGET_DIR=$target cargo build --quiet --profile plugin -p chalumeau-core --features fit,threads --example instructions)
program=$target/plugin/examples/instructions
log=$(mktemp)
trap 'rm -f "$log"' EXIT

collected() { # SECONDS avx2|plain [watched] [places] [PLAYERS] [techniques] -> instructions of the whole run
    local run=("$program" "$1" "$rate" "$2" 0 "${3:-}" "${4:-}" "${5:-1}" "${6:-}")
    if ! valgrind --tool=callgrind --callgrind-out-file=/dev/null "${run[@]}" >/dev/null 2>"$log"; then
        cat "$log" >&2
        return 1
    fi
    sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$log"
}

paths=(plain)
# Only where the processor has it; elsewhere both runs would take the plain path.
if grep -qw avx2 /proc/cpuinfo 2>/dev/null; then
    paths=(avx2 plain)
fi
failed=0
for path in "${paths[@]}"; do
    short=$(collected 0.5 "$path")
    long=$(collected 1.5 "$path")
    alone=$((long - short))
    cost=$((alone / 96000))
    verdict=ok
    if ((cost > ${most[$path]})); then
        verdict="too many"
        failed=1
    fi
    echo "$path: $cost instructions per internal sample, at most ${most[$path]}: $verdict"
    short=$(collected 0.5 "$path" "" places)
    long=$(collected 1.5 "$path" "" places)
    cost=$(((long - short) / 96000))
    verdict=ok
    if ((cost > ${most["$path places"]})); then
        verdict="too many"
        failed=1
    fi
    echo "$path: $cost heard from two places, at most ${most["$path places"]}: $verdict"
    short=$(collected 0.5 "$path" watched)
    long=$(collected 1.5 "$path" watched)
    more=$(((long - short - alone) * 10000 / alone))
    verdict=ok
    if ((more > 120)); then
        verdict="too many"
        failed=1
    fi
    echo "$path: $(printf '%d.%02d' $((more / 100)) $((more % 100))) % more while watched, at most 1.2 %: $verdict"
    short=$(collected 0.5 "$path" "" "" 1 techniques)
    long=$(collected 1.5 "$path" "" "" 1 techniques)
    more=$(((long - short - alone) / 96000))
    verdict=ok
    if ((more > ${most_techniques[$path]})); then
        verdict="too many"
        failed=1
    fi
    echo "$path: $more more with growl and vocal tract, at most ${most_techniques[$path]}: $verdict"
    for players in 8 16; do
        short=$(collected 0.5 "$path" "" "" $players)
        long=$(collected 1.0 "$path" "" "" $players)
        voices=$(((long - short) * 200 / alone))
        verdict=ok
        if ((voices > ${most_players["$path $players"]})); then
            verdict="too many"
            failed=1
        fi
        echo "$path: $players players cost $voices hundredths of one, at most ${most_players["$path $players"]}: $verdict"
    done
done
exit $failed
