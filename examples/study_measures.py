"""Measures of the pieces of a study's log: one row for each participant, trial and side."""

import dataclasses
import math

import numpy as np
from study_log import SIDES, BadInput

# Steadiness is measured in windows of this length, which begin this long after the note starts to sound or the side is
# switched: the attack does not count as unsteadiness. Both values are judgement.
WINDOW_S = 0.5
SETTLE_S = 0.3
# Fewest rows in such a window: the slowest stream, 25 Hz, has about 12.
WINDOW_ROWS = 10
# Fewest windows whose median one restless window does not decide.
HELD_WINDOWS = 3
# The overshoot is measured for this long after the onset: about the reaction time of a person.
OVERSHOOT_S = 0.2
# Fewest onsets whose spread means anything (judgement).
SPREAD_ONSETS = 3
# After this time a feel has certainly been sent, accepted and echoed (5 ms; at most 100 ms on MIDI).
FOLLOWS_S = 0.2
# Closing pressure of the reference reed, Pa: a reed closes at H k times as much.
CLOSING_PA = 6_000.0


@dataclasses.dataclass
class Notes:
    """Measures of the notes of one piece."""

    # Of windows of held notes: rms about the median.
    angle_rms_deg: list = dataclasses.field(default_factory=list)
    gamma_rms: list = dataclasses.field(default_factory=list)
    level_rms_db: list = dataclasses.field(default_factory=list)
    pitch_rms_cents: list = dataclasses.field(default_factory=list)
    # Of notes that began in the piece.
    onset_s: list = dataclasses.field(default_factory=list)
    overshoot_deg: list = dataclasses.field(default_factory=list)
    gamma_overshoot: list = dataclasses.field(default_factory=list)
    heard_s: list = dataclasses.field(default_factory=list)
    sounded: int = 0
    silent: int = 0


LISTS = tuple(field.name for field in dataclasses.fields(Notes) if field.name not in ("sounded", "silent"))


def middle(values):
    """The median of an array that is not empty. On windows of some hundred rows it is much faster than numpy's."""
    ordered = np.sort(values)
    return 0.5 * float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])


def rms_about_median(values):
    """Root mean square about the median; nan where less than WINDOW_ROWS values are known."""
    values = values[np.isfinite(values)]
    if len(values) < WINDOW_ROWS:
        return math.nan
    off = values - middle(values)
    return math.sqrt(np.dot(off, off) / len(off))


def notes_of(piece):
    """Steadiness, onsets and notes that never sounded."""
    found = Notes()
    t, gamma, on, written = piece.t_s, piece.gamma, piece.gamma_on, piece.written
    changes = np.flatnonzero(np.nan_to_num(np.diff(np.nan_to_num(written, nan=-1.0))) != 0) + 1
    for begin, end in zip([0, *changes], [*changes, len(t)]):
        if not math.isfinite(written[begin]) or not math.isfinite(on[begin]):
            continue
        above = np.flatnonzero(gamma[begin:end] >= on[begin:end])
        if not above.size:
            # A note cut off by the end of the piece might still have sounded.
            found.silent += begin > 0 and end < len(t)
            continue
        found.sounded += begin > 0
        speaks = begin + above[0]
        # Only a note that began in this piece, below its threshold, has an onset here; other notes were slurred or
        # sounded at the switch.
        if begin > 0 and speaks > begin:
            measure_onset(found, piece, begin, speaks, end)
        if begin > 0:
            heard = piece.heard_s[begin:end]
            heard = heard[np.isfinite(heard) & (heard >= t[begin])]
            if heard.size:
                found.heard_s.append(float(heard[0] - t[begin]))
        start = t[speaks] + SETTLE_S
        while start + WINDOW_S <= t[end - 1]:
            rows = slice(*np.searchsorted(t, (start, start + WINDOW_S)))
            start += WINDOW_S
            if rows.stop - rows.start >= WINDOW_ROWS and middle(gamma[rows]) >= middle(on[rows]):
                found.angle_rms_deg.append(rms_about_median(piece.angle_deg[rows]))
                found.gamma_rms.append(rms_about_median(gamma[rows]))
                found.level_rms_db.append(rms_about_median(piece.level_db[rows]))
                found.pitch_rms_cents.append(rms_about_median(1200 * np.log2(piece.f0_hz[rows])))
    return found


def measure_onset(found, piece, begin, speaks, end):
    """Adds the onset of a note, whose rows are begin..end and which begins to sound at `speaks`."""
    t, gamma, on, angle = piece.t_s, piece.gamma, piece.gamma_on, piece.angle_deg
    before, after = gamma[speaks - 1] - on[speaks - 1], gamma[speaks] - on[speaks]
    share = -before / (after - before)
    found.onset_s.append(t[speaks - 1] + share * (t[speaks] - t[speaks - 1]) - t[begin])
    soon = slice(speaks, min(end, np.searchsorted(t, t[speaks] + OVERSHOOT_S, side="right")))
    found.gamma_overshoot.append(float(np.max((gamma - on)[soon])))
    # The hand overshoots what it holds afterwards: how far that lies beyond the threshold is how loud the player wants it.
    held = slice(*np.minimum(end, np.searchsorted(t, t[speaks] + np.array([SETTLE_S, SETTLE_S + WINDOW_S]))))
    if held.stop - held.start >= WINDOW_ROWS:
        reached = slice(speaks, min(end, np.searchsorted(t, t[speaks] + SETTLE_S)))
        found.overshoot_deg.append(float(np.max(angle[reached]) - middle(angle[held])))


def median(values, least=1):
    """Median of what is known, or nan if fewer than `least` are."""
    known = [value for value in values if math.isfinite(value)]
    return middle(known) if len(known) >= least else math.nan


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


def row_of(own):
    """The measures of one side of a trial."""
    time_s, torque, work_mj = sum(integrals(piece) for piece in own)
    notes = [notes_of(piece) for piece in own]
    found = {name: [value for note in notes for value in getattr(note, name)] for name in LISTS}
    silent, sounded = (sum(getattr(note, name) for note in notes) for name in ("silent", "sounded"))
    onsets = found["onset_s"]
    gamma_rms = median(found["gamma_rms"], HELD_WINDOWS)
    h, k = (median([getattr(piece, name) for piece in own]) for name in ("h", "k"))
    return {
        "h": h,
        "k": k,
        "time_s": time_s,
        "angle_rms_deg": median(found["angle_rms_deg"], HELD_WINDOWS),
        "held_windows": len(found["angle_rms_deg"]),
        "onset_s": median(onsets),
        "onset_spread_s": float(np.std(onsets, ddof=1)) if len(onsets) >= SPREAD_ONSETS else math.nan,
        "overshoot_deg": median(found["overshoot_deg"]),
        "onsets": len(onsets),
        "silent_notes": silent,
        "silent_share": silent / (silent + sounded) if silent + sounded else math.nan,
        "gamma_rms": gamma_rms,
        "pressure_rms_pa": gamma_rms * CLOSING_PA * h * k,
        "gamma_overshoot": median(found["gamma_overshoot"]),
        "heard_s": median(found["heard_s"]),
        "level_rms_db": median(found["level_rms_db"]),
        "pitch_rms_cents": median(found["pitch_rms_cents"]),
        "torque_mean_mnm": torque / time_s if time_s else math.nan,
        "torque_peak_mnm": max(float(np.max(np.abs(piece.torque_mnm))) for piece in own),
        "work_mj": work_mj,
        "power_mw": work_mj / time_s if time_s else math.nan,
    }


def summarise(trials, least_s):
    """One dictionary for each participant, trial and side."""
    table = []
    for (participant, trial), pieces in trials.items():
        felt = [piece for piece in pieces if piece.is_armed]
        spent = {side: sum(integrals(p)[0] for p in felt if p.side == side) for side in SIDES}
        tried = all(spent[side] >= least_s for side in SIDES)
        visits = [piece for piece in pieces if piece.is_visit]
        switches = sum(
            now.side != before.side for before, now in zip(visits, visits[1:]) if before.log == now.log
        )
        last, followed = pieces[-1], feel_followed(pieces)
        for side in SIDES:
            both = [piece for piece in pieces if piece.side == side]
            if not both:
                continue
            # A side that was never armed has measures of a hand that felt nothing; it is not compared.
            own = [piece for piece in both if piece.is_armed] or both
            table.append(
                {
                    "participant": participant,
                    "trial": trial,
                    "side": side,
                    "condition": own[0].condition,
                    **row_of(own),
                    "visits": sum(piece.is_visit for piece in both),
                    "unarmed_s": sum(integrals(piece)[0] for piece in both if not piece.is_armed),
                    "switches": switches,
                    "last_side": last.side,
                    "last_condition": last.condition,
                    "feel_followed": "" if followed is None else "yes" if followed else "no",
                    "compared": "yes" if tried else "no",
                }
            )
    return table
