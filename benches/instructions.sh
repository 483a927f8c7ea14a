#!/usr/bin/env bash
# Fails when the whole instrument, heard from everywhere or from two places, costs more instructions per internal sample
# (96 kHz) than it may, when a screen that watches it costs the audio thread more than 1.2 %, or when growl and vocal tract, or
# several players, cost more than they may.
#
#   benches/instructions.sh [RATE]      host rate, default 48000
#
# Callgrind counts what follows the first half second of a held note, and nothing else. Building the instrument varies from run to run, so it is
# not part of the count: the same program gives the same count to a few instructions in a million. Without valgrind it fails: a gate that
# did not run is not green.
set -euo pipefail
export LC_ALL=C

rate=${1:-48000}
# Of a note that lives and moves, as it does by default.
declare -A most=([avx2]=850 [plain]=1315 ["avx2 places"]=901 ["plain places"]=1390)

# What growl and vocal tract add together. On the plain path it is more, because the voice alone is cheaper there than it was.
declare -A most_techniques=([avx2]=55 [plain]=65)

# Players in unison, in hundredths of the cost of one voice.
# The compiler may lay the loops out in another way, so the limits lie 1 to 2 % above.
declare -A most_players=(["avx2 8"]=535 ["avx2 16"]=1067 ["plain 8"]=670 ["plain 16"]=1340)

if ! command -v valgrind >/dev/null; then
    echo "cannot count instructions without valgrind: apt-get install valgrind" >&2
    exit 1
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
# With the features of the bundle, whose core is then not built again.
(cd "$root" && CARGO_TARGET_DIR=$target cargo build --quiet --profile plugin -p chalumeau -p chalumeau-benches \
    --no-default-features --features chalumeau/plugin,chalumeau/devices --bin instructions)
program=$target/plugin/instructions
log=$(mktemp)
trap 'rm -f "$log"' EXIT

counted() { # SECONDS avx2|plain [watched] [places] [PLAYERS] [techniques] -> instructions of all but the first half second
    local run=("$program" "$1" "$rate" "$2" 0 "${3:-}" "${4:-}" "${5:-1}" "${6:-}")
    if ! valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect='*hold_the_note*' "${run[@]}" \
        >/dev/null 2>"$log"; then
        cat "$log" >&2
        return 1
    fi
    local count
    count=$(sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$log")
    if [[ ! $count || $count == 0 ]]; then
        echo "callgrind did not find hold_the_note in $program" >&2
        return 1
    fi
    echo "$count"
}

paths=(plain)
# Only where the processor has it; elsewhere both runs would take the plain path.
if grep -qw avx2 /proc/cpuinfo 2>/dev/null; then
    paths=(avx2 plain)
fi
failed=0
judged() { # COUNT LIMIT TEXT
    local verdict=ok
    if (($1 > $2)); then
        verdict="too many"
        failed=1
    fi
    echo "$3: $verdict"
}
for path in "${paths[@]}"; do
    alone=$(counted 1.5 "$path")
    cost=$((alone / 96000)) limit=${most[$path]}
    judged $cost "$limit" "$path: $cost instructions per internal sample, at most $limit"
    cost=$(($(counted 1.5 "$path" "" places) / 96000)) limit=${most["$path places"]}
    judged $cost "$limit" "$path: $cost heard from two places, at most $limit"
    more=$((($(counted 1.5 "$path" watched) - alone) * 10000 / alone))
    judged $more 120 "$path: $(printf '%d.%02d' $((more / 100)) $((more % 100))) % more while watched, at most 1.2 %"
    more=$((($(counted 1.5 "$path" "" "" 1 techniques) - alone) / 96000)) limit=${most_techniques[$path]}
    judged $more "$limit" "$path: $more more with growl and vocal tract, at most $limit"
    for players in 8 16; do
        voices=$(($(counted 1.0 "$path" "" "" $players) * 200 / alone)) limit=${most_players["$path $players"]}
        judged $voices "$limit" "$path: $players players cost $voices hundredths of one, at most $limit"
    done
done
exit $failed
