#!/usr/bin/env python3
"""Writes logs of a study with simulated players, to try the analysis before the first session.

    python simulate_study.py --out logs
    python analyse_study.py logs/*.csv --out results

Nobody played these logs: a program moved simulated hands. Each player has a log of sixteen trials in the order that
`chalumeau study` gives, with the columns of a take (docs/study.md). Nothing was heard, so level, pitch and onset are empty. Needs
numpy, and `chalumeau` for the feel and the order.

Both reeds of a trial get the same hand: movements in degrees, against the torque that the program says each reed has. The
hand is a spring that the torque pushes back, it listens and corrects (as the program's own simulated hand,
crates/knob/src/simulator/hand.rs), and it varies from note to note, trial to trial and person to person. How much it varies
is judgement: reaction times and speeds of aimed movements vary by 15 to 20 %, physiological tremor is a few tenths of a
degree. Time is in steps of 10 ms. The hands are the same on both reeds unless --tremble says otherwise.

Exit code 0: done; 2: something cannot be used, and the message says why.
"""

import argparse
import csv
import functools
import io
import math
import os
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import study_log
from study_log import BadInput, Piece

# Names the command line, where it is not on the search path.
PROGRAM = "CHALUMEAU_PROGRAM"
TRIALS = 16
# Columns of a log.
COLUMNS = (
    "t_us", "angle_deg", "velocity_deg_s", "torque_mnm", "written_midi", "gamma", "feel_id", "h", "k", "participant", "trial",
    "side", "condition", "gamma_sounding", "level_db", "f0_hz", "heard_us", "armed",
)

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


def tell(program, words):
    """The rows of a table that the command line prints. Raises BadInput."""
    try:
        told = subprocess.run([program, *words], capture_output=True, text=True, check=False)
    except OSError as reason:
        raise BadInput(f"{program}: cannot be started: {reason.strerror}; {PROGRAM} names the command line") from reason
    if told.returncode != 0:
        raise BadInput(f"`{program} {' '.join(words)}` failed: {told.stderr.strip()}")
    return list(csv.DictReader(line for line in io.StringIO(told.stdout) if not line.startswith("#")))


@functools.cache
def reeds(program, equal_travel=True):
    """{(H, condition): landmarks of the notes}, from the program: thresholds, closures and torque in degrees and mNm."""
    found = {}
    for h in OPENINGS:
        for condition in study_log.CONDITIONS:
            line = f"haptic --all --torque {TORQUE_MNM:g} --ceiling 450 --H {h} --k {k_of(h, condition):.6f} --csv -"
            words = line.split() + (["--equal-travel"] if equal_travel else [])
            rows = tell(program, words)
            by_note = {int(row["written_midi"]): row for row in rows}
            found[h, condition] = {
                name: np.array([float(by_note[written][name]) for written in WRITTEN])
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


def order(program, participant, seed):
    """[(H, condition of side A)], from the program: the trials of a participant."""
    rows = tell(program, f"study --participant {participant} --seed {seed} --csv -".split())
    return [(float(row["h"]), row["a"]) for row in rows]


def study(reeds_, seed, count, trembles=None, orders=None):
    """The trials of a study with `count` players, as `by_trial` gives them. `trembles` multiplies each player's tremor on the
    free side; `orders` has the trials of each player, otherwise they come in any order."""
    random = np.random.default_rng(seed)
    players = Players(random, count)
    stays = []
    for who in range(count):
        places = random.permutation(TRIALS)
        any_order = [(OPENINGS[place % 4], study_log.CONDITIONS[(place // 4) % 2]) for place in places]
        for trial, (h, a) in enumerate(any_order if orders is None else orders[who]):
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
            k_of(h, condition), True, True, True, 0,
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


def write_log(path, remark, pieces):
    """A log of one participant, as the plugin writes it. A stay begins half a second after the one before it."""

    def cell(value, digits):
        return "" if math.isnan(value) else f"{value:.{digits}f}"

    with open(path, "x", encoding="utf-8", newline="") as file:
        file.write(f"# {remark}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        begins_s = 0.0
        for piece in pieces:
            times_s = begins_s + piece.t_s - piece.t_s[0]
            begins_s = times_s[-1] + 0.5
            velocity = np.gradient(piece.angle_deg, STEP_S)
            for row, t_s in enumerate(times_s):
                note, sounding = piece.written[row], piece.gamma_on[row]
                writer.writerow((
                    round(1e6 * t_s), cell(piece.angle_deg[row], 1), cell(velocity[row], 1), cell(piece.torque_mnm[row], 2),
                    cell(note, 0), cell(piece.gamma[row], 5), cell(piece.feel_id[row], 0), f"{piece.h:g}", f"{piece.k:.5f}",
                    piece.participant, piece.trial, piece.side, piece.condition, cell(sounding, 5), "", "", "", 1,
                ))


def write_study(program, folder, players, seed, tremble):
    """The logs of a study, one for each player. Raises BadInput."""
    people = range(1, players + 1)
    orders = [order(program, participant, seed) for participant in people]
    trials = study(reeds(program), seed, players, np.full(players, tremble), orders)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        raise BadInput(f"--out {folder}: cannot be made: {reason.strerror}") from reason
    for who, participant in enumerate(people):
        pieces = [piece for (of, _), own in trials.items() if of == who for piece in own]
        for piece in pieces:
            piece.participant = participant
        path = folder / f"simulated-{participant:03}.csv"
        words = f"simulated player {participant}, seed {seed}, tremor on the free side x {tremble:g}: nobody played this"
        try:
            write_log(path, words, pieces)
        except FileExistsError:
            raise BadInput(f"{path}: is there already; name another folder, or remove it") from None
        except OSError as reason:
            raise BadInput(f"{path}: cannot be written: {reason.strerror}") from reason
        print(path)


def main(argv=None):
    words, _, rest = __doc__.partition("\n")
    parser = argparse.ArgumentParser(
        description=words, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for the logs; created if missing")
    parser.add_argument("--players", type=int, default=12, metavar="N", help="simulated players, 1 to 100 [default: 12]")
    parser.add_argument("--seed", type=int, default=3, metavar="N", help="the study's seed, 1 to 9999 [default: 3]")
    parser.add_argument(
        "--tremble", type=float, default=1.0, metavar="FACTOR",
        help="tremor on the free side over that on the coupled side, 0 to 10: 1 is a study in which there is nothing to find "
        "[default: 1]",
    )
    args = parser.parse_args(argv)
    for name, value, low, high in (
        ("players", args.players, 1, 100), ("seed", args.seed, 1, 9999), ("tremble", args.tremble, 0, 10),
    ):
        if not low <= value <= high:
            parser.error(f"--{name} must be {low} to {high}, got {value:g}")
    program = os.environ.get(PROGRAM) or shutil.which("chalumeau")
    if not program:
        parser.error(f"`chalumeau` is not on the search path; {PROGRAM} may name it")
    try:
        write_study(program, pathlib.Path(args.out), args.players, args.seed, args.tremble)
    except BadInput as reason:
        print(f"simulate_study: {reason}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
