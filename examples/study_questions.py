"""The questions of a study: coupled against free, paired, with effect sizes and permutation tests.

Two kinds of measures are compared. QUESTIONS are about the player: what the hand does in degrees and seconds, and what the
player chooses. With equal travel, the same hand gives the same answer on both reeds. OUTCOMES are of reed and hand together:
pressure, sound and torque differ between the reeds even if the hand does the same. They are described, not tested.
"""

import math

import numpy as np
from study_log import H_REFERENCE

# Column of the summary: unit, label for plots.
QUESTIONS = {
    "time_s": ("s", "time spent, s"),
    "angle_rms_deg": ("degrees", "unsteadiness of the hand, degrees rms"),
    "onset_s": ("s", "note to onset, s"),
    "onset_spread_s": ("s", "spread of the onsets, s"),
    "overshoot_deg": ("degrees", "overshoot of the hand, degrees"),
    "silent_share": ("share of notes", "notes that never sounded, share"),
}
OUTCOMES = {
    "gamma_rms": ("1", "unsteadiness of gamma, rms"),
    "pressure_rms_pa": ("Pa", "unsteadiness of pressure, Pa rms"),
    "gamma_overshoot": ("1", "overshoot of gamma at onset"),
    "heard_s": ("s", "note to heard onset, s"),
    "level_rms_db": ("dB", "unsteadiness of level, dB rms"),
    "pitch_rms_cents": ("cents", "unsteadiness of pitch, cents rms"),
    "torque_mean_mnm": ("mNm", "mean of |torque|, mNm"),
    "power_mw": ("mW", "work against the motor, mW"),
}
# With the preference, as many questions are asked of the same rows.
FAMILY = 1 + len(QUESTIONS)
# n equal signs have p = 2^(1 - n). Nine participants are the fewest for which FAMILY times that is at most 0.05.
LEAST_PARTICIPANTS = 9
# An effect of one standard deviation is found in more than 80 of 100 such studies (examples/tests/python_null_study.py).
ENOUGH_PARTICIPANTS = 20
# Up to EXACT_PAIRS pairs all sign patterns are counted; above that, DRAWS random patterns.
EXACT_PAIRS = 40
DRAWS = 100_000


def signed_sums(values):
    """The sums of all values with either sign."""
    sums = np.zeros(1)
    for value in values:
        sums = np.concatenate((sums + value, sums - value))
    return sums


def sign_flip_p(differences):
    """Two-sided p of the mean of paired differences, and the method.

    If the condition had no effect, each difference could equally have the other sign. p is the share of sign patterns
    whose mean is at least as far from 0 as the observed one. All patterns are counted up to EXACT_PAIRS pairs, by pairing the
    sums of one half with those of the other; above that, DRAWS random patterns and the observed one. No distribution is
    assumed. With differences of +1 and -1 this is the sign test.
    """
    d = np.asarray(differences, dtype=float)
    # Sums that are equal but for rounding count as equal.
    seen = abs(d.sum()) - 1e-12 * np.abs(d).sum()
    if len(d) <= EXACT_PAIRS:
        if seen <= 0:
            return 1.0, "exact"
        one, other = signed_sums(d[: len(d) // 2]), np.sort(signed_sums(d[len(d) // 2 :]))
        above = len(other) - np.searchsorted(other, seen - one, side="left")
        below = np.searchsorted(other, -seen - one, side="right")
        return float((above.sum() + below.sum()) / 2.0 ** len(d)), "exact"
    random, hits = np.random.default_rng(1), 1
    for _ in range(10):
        hits += int(np.sum(np.abs(random.choice((-1.0, 1.0), (DRAWS // 10, len(d))) @ d) >= seen))
    return hits / (DRAWS + 1), f"{DRAWS} draws"


def holm(p_values, asked=None):
    """Holm's (1979) adjustment of p for several questions asked of the same data; `asked` is their number."""
    asked = max(asked or 0, len(p_values))
    order, worst, adjusted = np.argsort(p_values), 0.0, [math.nan] * len(p_values)
    for rank, index in enumerate(order):
        worst = max(worst, min(1.0, (asked - rank) * p_values[index]))
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
        values = {name: (coupled[name], free[name]) for name in (*QUESTIONS, *OUTCOMES)}
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


def compare_group(scope, units, opening):
    """Rows of one group of openings; `units` are the trials of each thing that counts once."""
    rows = []
    for name in ("preference", *QUESTIONS, *OUTCOMES):
        means = []
        for trials in units.values():
            both = [v[name] for h, v in trials if belongs(h, opening) and np.isfinite(v[name]).all()]
            if both:
                means.append(np.mean(both, axis=0))
        if not means:
            continue
        coupled, free = np.array(means).T
        d = coupled - free
        is_question = name not in OUTCOMES
        p, method = sign_flip_p(d) if is_question else (math.nan, "none: the reed alone makes it differ")
        sd = float(np.std(d, ddof=1)) if len(d) > 1 else math.nan
        # Differences that are equal except for rounding have no spread.
        has_spread = sd > 1e-9 * np.max(np.abs(d))
        rows.append(
            {
                "scope": scope,
                "opening_h": opening,
                "about": "player" if is_question else "reed and hand",
                "metric": name,
                "unit": {**QUESTIONS, **OUTCOMES}.get(name, ("share of trials",))[0],
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
    asked = [row for row in rows if row["about"] == "player"]
    for row, adjusted in zip(asked, holm([row["p"] for row in asked], FAMILY)):
        row["p_holm"] = adjusted
    return rows


def compare(table):
    """Coupled minus free: over participants, and for each participant over trials; by openings.

    Below the reference H the coupled reed is the stiffer one, above it the softer one. Effects on the hand may have
    opposite signs there and cancel over all openings.
    """
    pairs = pairs_of(table)
    openings = sorted({h for trials in pairs.values() for h, _ in trials if math.isfinite(h)})
    scopes = [(f"participant {who}", {n: [trial] for n, trial in enumerate(trials)}) for who, trials in pairs.items()]
    if len(pairs) > 1:
        # Trials of one person are not independent: over participants, each person counts once, with the mean of their trials.
        scopes.insert(0, ("participants", pairs))
    return [
        row
        for scope, units in scopes
        for opening in ["all", "below", "above", *openings]
        for row in compare_group(scope, units, opening)
    ]
