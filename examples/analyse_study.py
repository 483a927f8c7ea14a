#!/usr/bin/env python3
"""Analyses the logs of a study: writes a table, a comparison and plots.

    python analyse_study.py take-*.csv --thresholds haptic.csv --out results

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
import dataclasses
import math
import pathlib
import sys

import numpy as np
from study_log import H_REFERENCE, SIDES, BadInput, Onset, read_log
from study_plots import METRICS, plot_paired, plot_phase, plot_timeline

# Steadiness is measured in windows of this length, which begin this long after the note starts to sound or the side is
# switched: the attack does not count as unsteadiness. Both values are judgement.
WINDOW_S = 0.5
SETTLE_S = 0.3
# Fewest rows in such a window: the slowest stream, 25 Hz, has about 12.
WINDOW_ROWS = 10
# The overshoot is measured for this long after the onset: about the reaction time of a person.
OVERSHOOT_S = 0.2
# After this time a feel has certainly been sent, accepted and echoed (5 ms; at most 100 ms on MIDI).
FOLLOWS_S = 0.2
# Up to EXACT_PAIRS pairs all sign patterns are counted; above that, DRAWS random patterns.
EXACT_PAIRS = 16
DRAWS = 100_000


@dataclasses.dataclass
class Notes:
    """Measures of the notes of one piece."""

    rms: list
    onset_s: list
    overshoot: list
    silent: int


def notes_of(piece):
    """Steadiness, onsets and notes that never sounded."""
    found = Notes([], [], [], 0)
    t, gamma, on, written = piece.t_s, piece.gamma, piece.gamma_on, piece.written
    changes = np.flatnonzero(np.nan_to_num(np.diff(np.nan_to_num(written, nan=-1.0))) != 0) + 1
    for begin, end in zip([0, *changes], [*changes, len(t)]):
        if not math.isfinite(on[begin]):
            continue
        above = np.flatnonzero(gamma[begin:end] >= on[begin:end])
        if not above.size:
            # A note cut off by the end of the piece might still have sounded.
            found.silent += begin > 0 and end < len(t)
            continue
        speaks = begin + above[0]
        # Only a note that began in this piece, below its threshold, has an onset here; other notes were slurred or
        # sounded at the switch.
        if begin > 0 and speaks > begin:
            before, after = gamma[speaks - 1] - on[speaks - 1], gamma[speaks] - on[speaks]
            share = -before / (after - before)
            found.onset_s.append(t[speaks - 1] + share * (t[speaks] - t[speaks - 1]) - t[begin])
            soon = (t >= t[speaks]) & (t <= t[speaks] + OVERSHOOT_S)
            soon[:speaks], soon[end:] = False, False
            found.overshoot.append(float(np.max((gamma - on)[soon])))
        start = t[speaks] + SETTLE_S
        while start + WINDOW_S <= t[end - 1]:
            rows = slice(np.searchsorted(t, start), np.searchsorted(t, start + WINDOW_S))
            start += WINDOW_S
            held = gamma[rows]
            if len(held) >= WINDOW_ROWS and np.median(held) >= np.median(on[rows]):
                found.rms.append(float(np.sqrt(np.mean((held - np.median(held)) ** 2))))
    return found


def median(values):
    return float(np.median(values)) if len(values) else math.nan


def integrals(piece):
    """Time, s; integral of |torque|, mNm s; work of the hand against the motor, mJ."""
    dt = np.diff(piece.t_s)
    torque = 0.5 * (piece.torque_mnm[1:] + piece.torque_mnm[:-1])
    size = 0.5 * (np.abs(piece.torque_mnm[1:]) + np.abs(piece.torque_mnm[:-1]))
    # mNm times radians is mJ. The log has the torque of the motor; the hand works against it.
    work = -torque * np.radians(np.diff(piece.angle_deg))
    return np.array([dt.sum(), (size * dt).sum(), work.sum()])


def feel_followed(pieces):
    """Whether every switch between the sides changed the feel of the knob; None if the log does not show it.

    The two sides never have the same feel. A knob that still echoes the old feel refused the new one, never received
    it, or accepts no feels.
    """
    told = []
    for before, now in zip(pieces, pieces[1:]):
        if before.log != now.log or before.side == now.side or now.t_s[-1] - now.t_s[0] < FOLLOWS_S:
            continue
        later = now.feel_id[min(np.searchsorted(now.t_s, now.t_s[0] + FOLLOWS_S), len(now.t_s) - 1)]
        if math.isfinite(before.feel_id[-1]) and math.isfinite(later):
            told.append(before.feel_id[-1] != later)
    return all(told) if told else None


def by_trial(pieces):
    """Pieces by participant and trial. Raises BadInput if two orders of a study are mixed."""
    trials = {}
    for piece in pieces:
        trials.setdefault((piece.participant, piece.trial), []).append(piece)
    for (participant, trial), found in trials.items():
        meant = {(piece.side, piece.condition) for piece in found}
        if len({side for side, _ in meant}) < len(meant) or len({condition for _, condition in meant}) < len(meant):
            raise BadInput(
                f"participant {participant}, trial {trial}: side and condition do not belong together throughout "
                f"({', '.join(f'{side} {condition}' for side, condition in sorted(meant))}); "
                "these are logs of two orders (seeds), analyse each by itself"
            )
    return dict(sorted(trials.items()))


def summarise(trials, least_s):
    """One dictionary for each participant, trial and side."""
    table = []
    for (participant, trial), pieces in trials.items():
        spent = {side: sum(integrals(p)[0] for p in pieces if p.side == side) for side in SIDES}
        tried = all(spent[side] >= least_s for side in SIDES)
        visits = [piece for piece in pieces if piece.is_visit]
        switches = sum(
            now.side != before.side for before, now in zip(visits, visits[1:]) if before.log == now.log
        )
        last, followed = pieces[-1], feel_followed(pieces)
        for side in SIDES:
            own = [piece for piece in pieces if piece.side == side]
            if not own:
                continue
            time_s, torque, work_mj = sum(integrals(piece) for piece in own)
            notes = [notes_of(piece) for piece in own]
            rms, onset_s, overshoot = (
                [value for note in notes for value in getattr(note, name)] for name in ("rms", "onset_s", "overshoot")
            )
            table.append(
                {
                    "participant": participant,
                    "trial": trial,
                    "side": side,
                    "condition": own[0].condition,
                    "h": median([piece.h for piece in own]),
                    "k": median([piece.k for piece in own]),
                    "time_s": time_s,
                    "visits": sum(piece.is_visit for piece in own),
                    "gamma_rms": median(rms),
                    "gamma_windows": len(rms),
                    "onset_s": median(onset_s),
                    "onset_overshoot": median(overshoot),
                    "onsets": len(onset_s),
                    "silent_notes": sum(note.silent for note in notes),
                    "torque_mean_mnm": torque / time_s if time_s else math.nan,
                    "torque_peak_mnm": max(float(np.max(np.abs(piece.torque_mnm))) for piece in own),
                    "work_mj": work_mj,
                    "power_mw": work_mj / time_s if time_s else math.nan,
                    "switches": switches,
                    "last_side": last.side,
                    "last_condition": last.condition,
                    "feel_followed": "" if followed is None else "yes" if followed else "no",
                    "compared": "yes" if tried else "no",
                }
            )
    return table


def sign_flip_p(differences):
    """Two-sided p of the mean of paired differences, and the method.

    If the condition had no effect, each difference could equally have the other sign. p is the share of sign patterns
    whose mean is at least as far from 0 as the observed one. All patterns are counted up to EXACT_PAIRS pairs; above
    that, DRAWS random patterns and the observed one. No distribution is assumed. With differences of +1 and -1 this is
    the sign test.
    """
    d = np.asarray(differences, dtype=float)
    seen = abs(d.sum()) * (1 - 1e-12)
    if len(d) <= EXACT_PAIRS:
        patterns = (np.arange(2 ** len(d))[:, None] >> np.arange(len(d))) & 1
        return float(np.mean(np.abs((1 - 2 * patterns) @ d) >= seen)), "exact"
    random, hits = np.random.default_rng(1), 1
    for _ in range(10):
        hits += int(np.sum(np.abs(random.choice((-1.0, 1.0), (DRAWS // 10, len(d))) @ d) >= seen))
    return hits / (DRAWS + 1), f"{DRAWS} draws"


def holm(p_values):
    """Holm's (1979) adjustment of p for several questions asked of the same data."""
    order, worst, adjusted = np.argsort(p_values), 0.0, [math.nan] * len(p_values)
    for rank, index in enumerate(order):
        worst = max(worst, min(1.0, (len(p_values) - rank) * p_values[index]))
        adjusted[index] = worst
    return adjusted


def pairs_of(table):
    """{participant: [(opening, {metric: (coupled, free)})]} of the trials in which both sides were tried."""
    trials = {}
    for row in table:
        if row["compared"] == "yes":
            trials.setdefault((row["participant"], row["trial"]), {})[row["condition"]] = row
    pairs = {}
    for (participant, _), sides in trials.items():
        coupled, free = sides["coupled"], sides["free"]
        values = {name: (coupled[name], free[name]) for name in METRICS}
        ended = coupled["last_condition"]
        values["preference"] = (float(ended == "coupled"), float(ended == "free"))
        pairs.setdefault(participant, []).append((round(coupled["h"], 3), values))
    return pairs


def belongs(h, opening):
    """Whether a trial at opening `h` belongs to a group of openings."""
    if opening == "below":
        return h < H_REFERENCE
    if opening == "above":
        return h > H_REFERENCE
    return opening in ("all", h)


def compare(table):
    """Coupled minus free: over participants, and for each participant over trials; by openings.

    Below the reference H the coupled reed is the stiffer one, above it the softer one. Effects on torque and hand may
    have opposite signs there and cancel over all openings.
    """
    pairs = pairs_of(table)
    openings = sorted({h for trials in pairs.values() for h, _ in trials if math.isfinite(h)})
    scopes = [(f"participant {who}", {n: [trial] for n, trial in enumerate(trials)}) for who, trials in pairs.items()]
    if len(pairs) > 1:
        # Trials of one person are not independent: over participants, each person counts once, with the mean of their trials.
        scopes.insert(0, ("participants", pairs))
    rows = []
    for scope, units in scopes:
        for opening in ["all", "below", "above", *openings]:
            group = []
            for name in ["preference", *METRICS]:
                means = []
                for trials in units.values():
                    both = [v[name] for h, v in trials if belongs(h, opening) and np.isfinite(v[name]).all()]
                    if both:
                        means.append(np.mean(both, axis=0))
                if not means:
                    continue
                coupled, free = np.array(means).T
                d = coupled - free
                p, method = sign_flip_p(d)
                sd = float(np.std(d, ddof=1)) if len(d) > 1 else math.nan
                # Differences that are equal except for rounding have no spread.
                has_spread = sd > 1e-9 * np.max(np.abs(d))
                group.append(
                    {
                        "scope": scope,
                        "opening_h": opening,
                        "metric": name,
                        "unit": METRICS[name][0] if name in METRICS else "share of trials",
                        "n": len(d),
                        "coupled": float(coupled.mean()),
                        "free": float(free.mean()),
                        "difference": float(d.mean()),
                        "sd": sd,
                        "dz": float(d.mean()) / sd if has_spread else math.nan,
                        "p": p,
                        "p_holm": math.nan,
                        "test": method,
                    }
                )
            for row, adjusted in zip(group, holm([row["p"] for row in group])):
                row["p_holm"] = adjusted
            rows += group
    return rows


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
        print(f"{row['metric']:<17}{row['n']:>4}{numbers_}{row['p']:>9.4f}{row['p_holm']:>9.4f}")
    n = max(row["n"] for row in chosen)
    if 2 ** (1 - n) > 0.05:
        print(f"{n} pairs cannot give a p below {2.0 ** (1 - n):.3g}, whatever they say")
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
        help="gamma_on of every note, from `chalumeau haptic --all --zeta Z --csv CSV` [default: 1/3 for all notes]",
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


def run(args):
    twice = {path for path in args.takes if args.takes.count(path) > 1}
    if twice:
        raise BadInput(f"{min(twice)}: given twice")
    onset = Onset(args.thresholds)
    pieces = [piece for log, path in enumerate(args.takes) for piece in read_log(path, log, onset)]
    trials = by_trial(pieces)
    table = summarise(trials, args.least)
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
    stuck = sorted({(row["participant"], row["trial"]) for row in table if row["feel_followed"] == "no"})
    if stuck:
        print(
            f"WARNING: the feel did not follow the switch in {len(stuck)} of {len(trials)} trials (participant/trial): "
            f"{trial_names(stuck)}\n  the knob refused it (see the plugin's Knob status) or cannot take one; there the "
            "hand compared nothing"
        )
    still = sorted({(row["participant"], row["trial"]) for row in table if row["torque_peak_mnm"] == 0})
    if still:
        print(f"WARNING: no torque at all on a side, knob not armed? (participant/trial): {trial_names(still)}")
    if not args.thresholds:
        print("gamma_on is taken as 1/3 for every note; --thresholds gives each its own")
    rows = compare(table)
    if not rows:
        print("no trial has both sides: nothing to compare")
        return
    write_csv(out / "comparison.csv", rows)
    plot_paired(out / "paired.png", pairs_of(table))
    report(rows)


if __name__ == "__main__":
    sys.exit(main())
