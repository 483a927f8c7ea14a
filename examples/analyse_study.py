#!/usr/bin/env python3
"""Analyses the logs of a study: writes a table, a comparison and plots.

    python analyse_study.py take-*.csv --out results

The logs are takes recorded with Study on (docs/study.md). Needs numpy and matplotlib. Files written to --out:

    summary.csv      one line for each participant, trial and side
    comparison.csv   coupled against free, paired by trial, with effect size and permutation test
    paired.png       the two sides of every trial, by opening H
    phase_*.png      torque against angle, one file for each participant
    timeline_*.png   angle, gamma and torque against time, one file for each trial

Logs are read in the order given: the last side of a trial is the last one in the last log that contains the trial.
docs/study.md explains each column. Exit code 0: done; 2: a file cannot be used, and the message says why.
"""

import argparse
import csv
import math
import pathlib
import sys

from study_log import H_REFERENCE, BadInput, Onset, read_log
from study_measures import by_trial, summarise
from study_questions import ENOUGH_PARTICIPANTS, FAMILY, LEAST_PARTICIPANTS, compare, pairs_of


def write_csv(path, rows):
    def cell(value):
        return ("" if math.isnan(value) else f"{value:.6g}") if isinstance(value, float) else value

    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: cell(value) for name, value in row.items()} for row in rows)


def report(rows):
    """Prints the comparison as a table with remarks on standard output."""
    scope = rows[0]["scope"]
    chosen = [row for row in rows if row["scope"] == scope and row["opening_h"] == "all"]
    counted = "participants" if scope == "participants" else f"trials of {scope}"
    print(f"coupled less free, all openings, n counts {counted}")
    print(f"{'metric':<17}{'n':>4}{'coupled':>11}{'free':>11}{'difference':>12}{'dz':>8}{'p':>9}{'p Holm':>9}")
    for row in chosen:
        numbers_ = f"{row['coupled']:>11.4g}{row['free']:>11.4g}{row['difference']:>12.4g}{row['dz']:>8.2f}"
        tests = f"{row['p']:>9.4f}{row['p_holm']:>9.4f}" if row["about"] == "player" else "  reed and hand"
        print(f"{row['metric']:<17}{row['n']:>4}{numbers_}{tests}")
    n = max(row["n"] for row in chosen)
    least = min(1.0, FAMILY * 2.0 ** (1 - n))
    if least > 0.05:
        print(
            f"after Holm, {n} pairs cannot give a p below {least:.3g}, whatever they say: {LEAST_PARTICIPANTS} are the fewest, "
            f"and {ENOUGH_PARTICIPANTS} are advised"
        )
    print(f"by opening (coupled is stiffer below H = {H_REFERENCE:.3f} and softer above): comparison.csv")
    if scope != "participants":
        print("one participant: this says something about that person only")


def main():
    words, _, rest = __doc__.partition("\n")
    parser = argparse.ArgumentParser(
        description=words, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("takes", nargs="+", metavar="TAKE.csv", help="logs of the study, in order of time")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the results; created if missing")
    parser.add_argument(
        "--thresholds", metavar="CSV",
        help="for logs without the column gamma_sounding: gamma_on of every note, from `chalumeau haptic --all --zeta Z "
        "--csv CSV` [default: 1/3 for all notes]",
    )
    parser.add_argument(
        "--least", type=float, default=2.0, metavar="S",
        help="compare a trial if each side was held at least this long, seconds [default: 2]",
    )
    parser.add_argument("--no-timelines", action="store_true", help="leave out the plots of single trials")
    args = parser.parse_args()
    if not args.least >= 0:
        parser.error(f"--least must be 0 or more seconds, got {args.least}")
    try:
        run(args)
    except BadInput as reason:
        print(f"analyse_study: {reason}", file=sys.stderr)
        return 2
    return 0


def trial_names(keys):
    return ", ".join(f"{participant}/{trial}" for participant, trial in keys)


def warn(trials, table):
    """Says what is wrong with the logs."""
    stuck = sorted({(row["participant"], row["trial"]) for row in table if row["feel_followed"] == "no"})
    if stuck:
        print(
            f"WARNING: the feel did not follow the switch in {len(stuck)} of {len(trials)} trials (participant/trial): "
            f"{trial_names(stuck)}\n  the knob refused it (see the plugin's Knob status) or cannot take one; there the "
            "hand compared nothing"
        )
    unarmed = sorted({(row["participant"], row["trial"]) for row in table if row["unarmed_s"] > 0})
    if unarmed:
        print(
            f"WARNING: the knob was not armed for part of {len(unarmed)} of {len(trials)} trials (participant/trial): "
            f"{trial_names(unarmed)}\n  this time is left out, see unarmed_s in summary.csv"
        )
    still = sorted({(row["participant"], row["trial"]) for row in table if row["torque_peak_mnm"] == 0})
    if still:
        print(f"WARNING: no torque at all on a side, knob not armed? (participant/trial): {trial_names(still)}")


def run(args):
    twice = {path for path in args.takes if args.takes.count(path) > 1}
    if twice:
        raise BadInput(f"{min(twice)}: given twice")
    onset = Onset(args.thresholds)
    logs = [read_log(path, log, onset) for log, path in enumerate(args.takes)]
    trials = by_trial([piece for log in logs for piece in log])
    table = summarise(trials, args.least)
    # Loading matplotlib takes a second: what is wrong with a log is said before.
    from study_plots import plot_paired, plot_phase, plot_timeline

    out = pathlib.Path(args.out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        raise BadInput(f"--out {out}: cannot be made: {reason.strerror}") from reason
    write_csv(out / "summary.csv", table)
    participants = sorted({participant for participant, _ in trials})
    for participant in participants:
        plot_phase(out / f"phase_p{participant:04}.png", participant, trials)
    if not args.no_timelines:
        for (participant, trial), own in trials.items():
            title = f"Participant {participant}, trial {trial}, H = {own[0].h:g}"
            plot_timeline(out / f"timeline_p{participant:04}_t{trial:02}.png", title, own)
    skipped = sorted({(row["participant"], row["trial"]) for row in table if row["compared"] == "no"})
    print(f"{len(trials)} trials of {len(participants)} participants; {out / 'summary.csv'}")
    if skipped:
        print(f"not compared, less than {args.least:g} s on one side (participant/trial): {trial_names(skipped)}")
    warn(trials, table)
    if not args.thresholds and not all(piece.has_threshold for log in logs for piece in log):
        print("gamma_on is taken as 1/3 where the log has no gamma_sounding; --thresholds gives each note its own")
    rows = compare(table)
    if not rows:
        print("no trial has both sides: nothing to compare")
        return
    write_csv(out / "comparison.csv", rows)
    plot_paired(out / "paired.png", pairs_of(table))
    report(rows)


if __name__ == "__main__":
    sys.exit(main())
