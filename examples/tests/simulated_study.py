"""A study with simulated players, for python_null_study.py.

Both reeds of a trial get the same hand: movements in degrees, against the torque that the program says each reed has. The
hand is a spring that the torque pushes back, it listens and corrects (as the program's own simulated hand,
crates/knob/src/simulator/hand.rs), and it varies from note to note, trial to trial and person to person. How much it varies
is judgement: reaction times and speeds of aimed movements vary by 15 to 20 %, physiological tremor is a few tenths of a
degree. Time is in steps of 10 ms.
"""

import csv
import io
import math
import subprocess

import numpy as np
import study_log
from python_kit import program
from study_log import Piece

STEP_S = 0.01
OPENINGS = (2.0, 2.3, 2.9, 3.3)
WRITTEN = (60, 67, 71, 79)
# A stay on a side has one of each note.
NOTE_S = 1.5
# The hand goes back down so long after the beginning of a note.
HELD_UNTIL_S = 1.3
VISIT_S = NOTE_S * len(WRITTEN)
# Torque of the reference note in a study, and the mark, mNm (src/plugin/knob/feel_design.rs).
TORQUE_MNM, MARK_MNM, MARK_DEG = 45.0, 9.0, 6.0
# The hand: spring to the knob, mNm per degree (0.5 N m/rad); correction by ear, 1/s, and its delay, steps.
STIFFNESS, CORRECTION, DELAY = 1000 * 0.5 * math.pi / 180, 2.0, 15


def k_of(h, condition):
    return 27 / (4 * h**3) if condition == "coupled" else study_log.K_REFERENCE


def reeds(equal_travel):
    """{(H, condition): landmarks of the notes}, from the program: thresholds, closures and torque in degrees and mNm."""
    found = {}
    for h in OPENINGS:
        for condition in study_log.CONDITIONS:
            line = f"haptic --all --torque {TORQUE_MNM:g} --ceiling 450 --H {h} --k {k_of(h, condition):.6f} --csv -"
            words = line.split() + (["--equal-travel"] if equal_travel else [])
            told = subprocess.run([program(), *words], capture_output=True, text=True, check=False)
            assert told.returncode == 0, told.stderr
            rows = csv.DictReader(line for line in io.StringIO(told.stdout) if not line.startswith("#"))
            by_note = {int(row["written_midi"]): {name: float(row[name]) for name in row} for row in rows}
            found[h, condition] = {
                name: np.array([by_note[written][name] for written in WRITTEN])
                for name in ("a_on_deg", "a_close_deg", "scale_mnm", "gamma_sounding", "h", "k")
            }
    return found


def torque_mnm(angle, on, close, peak_mnm):
    """Torque against the hand: the flow law with its mark. Flow is H sqrt(p) - p^1.5 / k, whose peak lies at a third of closure."""
    x = np.clip(angle / close, 0.0, 1.0)
    law = peak_mnm * 1.5 * math.sqrt(3) * np.sqrt(x) * (1 - x)
    rest = np.clip(1 - ((angle - on) / MARK_DEG) ** 2, 0.0, None)
    return law + MARK_MNM * rest**2


def gamma_of(angle, on, close, gamma_on):
    """The map from angle to gamma: rest, threshold, closure, and on at the same slope."""
    beyond = gamma_on + (1 - gamma_on) * (angle - on) / (close - on)
    return np.where(angle < on, gamma_on * np.clip(angle, 0, None) / on, beyond)


class Players:
    """What the players of one study are like, one number for each."""

    def __init__(self, random, count):
        self.speed_deg_s = 350 * np.exp(0.2 * random.standard_normal(count))
        self.reaction_s = 0.15 + 0.02 * random.standard_normal(count)
        self.reach = 1.4 + 0.1 * random.standard_normal(count)
        self.tremor_deg = 0.3 * np.exp(0.25 * random.standard_normal(count))
        self.overshoot_deg = np.clip(6 + 2 * random.standard_normal(count), 0, None)


def study(reeds_, seed, count, trembles=None):
    """The trials of a study with `count` players, as `by_trial` gives them. `trembles` multiplies each player's tremor on the
    free side."""
    random = np.random.default_rng(seed)
    players = Players(random, count)
    stays = []
    for who in range(count):
        order = random.permutation(16)
        for trial, place in enumerate(order):
            h, a = OPENINGS[place % 4], study_log.CONDITIONS[(place // 4) % 2]
            b = study_log.CONDITIONS[a == "coupled"]
            # Half of the players go back to A in the end.
            for side, condition in [("A", a), ("B", b), ("A", a)][: 2 + int(random.integers(2))]:
                stays.append((who, trial + 1, side, condition, h))
    angle, torque, gamma, gamma_on = simulate(reeds_, random, players, stays, trembles)
    t_s = STEP_S * np.arange(angle.shape[1])
    written = np.repeat(np.array(WRITTEN, dtype=float), round(NOTE_S / STEP_S))
    # The first note begins a little after the side was chosen.
    written[:5] = np.nan
    unknown = np.full(len(t_s), np.nan)
    trials, offset_s = {}, 0.0
    for n, (who, trial, side, condition, h) in enumerate(stays):
        length = int(len(t_s) * np.clip(1 - 0.1 * abs(random.standard_normal()), 0.5, 1))
        rows = slice(0, length)
        piece = Piece(
            who, trial, side, condition, offset_s + t_s[rows], angle[n, rows], -torque[n, rows], written[rows],
            gamma[n, rows], np.where(np.isfinite(written), gamma_on[n], np.nan)[rows],
            np.full(length, 1.0 + (condition == "free")), unknown[rows], unknown[rows], unknown[rows], h,
            k_of(h, condition), True, True, 0,
        )
        offset_s += length * STEP_S
        trials.setdefault((who, trial), []).append(piece)
    return trials


def simulate(reeds_, random, players, stays, trembles):
    """Angles, torques, gammas and thresholds of all stays, one row each."""
    who = np.array([stay[0] for stay in stays])
    steps, per_note = round(VISIT_S / STEP_S), round(NOTE_S / STEP_S)

    def of_notes(name):
        return np.repeat(np.array([reeds_[stay[4], stay[3]][name] for stay in stays]), per_note, axis=1)

    on, close, scale, gamma_on, h, k = map(
        of_notes, ("a_on_deg", "a_close_deg", "scale_mnm", "gamma_sounding", "h", "k")
    )
    peak = scale * np.sqrt(4 * h**3 * k / 27)
    wanted = aims(random, players, who, on, per_note)
    wobble = tremor(random, players, stays, who, steps, trembles)
    angle, correction = np.zeros_like(on), np.zeros(len(stays))
    here = wanted[:, 0]
    for n in range(steps):
        if n >= DELAY:
            correction += CORRECTION * STEP_S * (wanted[:, n - DELAY] - angle[:, n - DELAY])
        aim = wanted[:, n] + correction + wobble[:, n]
        for _ in range(3):
            # The spring is stiffer than the torque is steep, so this comes to rest.
            here = aim - torque_mnm(here, on[:, n], close[:, n], peak[:, n]) / STIFFNESS
        angle[:, n] = here
    return angle, torque_mnm(angle, on, close, peak), gamma_of(angle, on, close, gamma_on), gamma_on


def aims(random, players, who, on, per_note):
    """Where the hands want to be: from half the threshold up to each note, a little beyond, held, and down before the next."""
    wanted = np.empty_like(on)
    t = STEP_S * np.arange(per_note)
    for note in range(on.shape[1] // per_note):
        rows = slice(note * per_note, (note + 1) * per_note)
        count, threshold = len(who), on[:, note * per_note]

        def varied(mean, share):
            return mean * np.exp(share * random.standard_normal(count))

        low = 0.5 * threshold
        high = varied(players.reach[who], 0.06) * threshold
        # Now and then a note is not blown hard enough.
        high = np.where(random.random(count) < 0.03, 0.85 * threshold, high)
        begins = players.reaction_s[who] + 0.025 * random.standard_normal(count)
        speed = varied(players.speed_deg_s[who], 0.15)
        turned = speed[:, None] * np.clip(t - begins[:, None], 0, None)
        way = (high - low)[:, None]
        beyond = np.clip(varied(players.overshoot_deg[who], 0.4), 0, 20)[:, None]
        since = np.clip((turned - way) / speed[:, None], 0, None)
        up = low[:, None] + np.minimum(turned, way) + np.where(turned >= way, beyond * np.exp(-since / 0.05), 0)
        down = high[:, None] - 900 * np.clip(t - HELD_UNTIL_S, 0, None)
        wanted[:, rows] = np.maximum(np.where(t < HELD_UNTIL_S, up, down), low[:, None])
    return wanted


def tremor(random, players, stays, who, steps, trembles):
    """Tremor of 8 to 12 Hz, and a slow drift, degrees."""
    count, t = len(stays), STEP_S * np.arange(steps)
    # A trial has its own on both sides.
    trials = {key: np.exp(0.15 * random.standard_normal()) for key in sorted({stay[:2] for stay in stays})}
    size = players.tremor_deg[who] * np.array([trials[stay[:2]] for stay in stays])
    size *= np.exp(0.1 * random.standard_normal(count))
    if trembles is not None:
        size = np.where([stay[3] == "free" for stay in stays], size * np.asarray(trembles)[who], size)
    wobble = np.zeros((count, steps))
    for _ in range(6):
        hz, phase = random.uniform(8, 12, (count, 1)), random.uniform(0, 2 * math.pi, (count, 1))
        wobble += math.sqrt(2 / 6) * np.sin(2 * math.pi * hz * t + phase)
    hz, phase = random.uniform(0.3, 1.0, (count, 1)), random.uniform(0, 2 * math.pi, (count, 1))
    return size[:, None] * (wobble + np.sin(2 * math.pi * hz * t + phase))
