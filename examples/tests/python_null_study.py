"""Studies of simulated players: equal hands find nothing, a planted effect is found. Run by python_examples.py."""

import functools
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import simulated_study  # noqa: E402
import study_questions  # noqa: E402
from study_measures import by_trial, summarise  # noqa: E402

SEEDS = 100
# Of the acceptance: players of the null study, and in how many of 100 studies it must find nothing, and the effect.
NULL_PLAYERS, NOTHING_IN, EFFECT_IN = 8, 95, 80
ALPHA = 0.05


@functools.cache
def reeds(equal_travel):
    return simulated_study.reeds(equal_travel)


def answers(seed, players, opening="all", equal_travel=True, trembles=None):
    """The rows of a study about the player, over participants."""
    trials = simulated_study.study(reeds(equal_travel), seed, players, trembles)
    pieces = [piece for pieces in trials.values() for piece in pieces]
    pairs = study_questions.pairs_of(summarise(by_trial(pieces), 2.0))
    rows = study_questions.compare_group("participants", pairs, opening)
    return {row["metric"]: row for row in rows if row["about"] == "player"}


def equal_hands_find_nothing():
    clean, small, asked = 0, 0, 0
    for seed in range(SEEDS):
        rows = answers(seed, NULL_PLAYERS)
        assert len(rows) == study_questions.FAMILY, sorted(rows)
        clean += all(row["p_holm"] > ALPHA for row in rows.values())
        # Eight players are too few for Holm over seven questions, so look at p itself as well.
        small += sum(row["p"] <= ALPHA for row in rows.values())
        asked += len(rows)
    print(f"  {NULL_PLAYERS} equal hands: nothing in {clean} of {SEEDS} studies; p <= {ALPHA} in {small} of {asked} questions")
    assert clean >= NOTHING_IN, clean
    assert small <= 1.5 * ALPHA * asked, (small, asked)


def equal_hands_find_nothing_below_and_above_the_reference():
    """Where the condition always changes the torque in the same direction."""
    for opening in ("below", "above"):
        rows = [answers(seed, study_questions.ENOUGH_PARTICIPANTS, opening) for seed in range(SEEDS // 4)]
        found = sum(any(row["p_holm"] <= ALPHA for row in study.values()) for study in rows)
        small = {name: sum(study[name]["p"] <= ALPHA for study in rows) for name in rows[0]}
        print(f"  {opening}, {study_questions.ENOUGH_PARTICIPANTS} equal hands: something in {found} of {len(rows)}; {small}")
        # With 25 studies and a true rate of 5 %, more than 4 come by chance in 0.7 % of cases.
        assert found <= 4 and max(small.values()) <= 6, (opening, found, small)


def without_equal_travel_the_reed_is_measured():
    """The same hands on knobs whose travel follows the reed: the test above can fail."""
    rows = [answers(seed, NULL_PLAYERS, "below", equal_travel=False) for seed in range(4)]
    least = [min(row["p"] for row in study.values()) for study in rows]
    print(f"  without equal travel: least p {least}")
    assert all(p <= 2 / 2**NULL_PLAYERS + 1e-9 for p in least), least


def a_planted_effect_of_one_standard_deviation_is_found():
    players, metric, own_spread = study_questions.ENOUGH_PARTICIPANTS, "angle_rms_deg", 0.05
    # How far a hand that trembles a fifth more moves the measure, and how much the differences of equal hands scatter.
    many = 40
    equal, more = (answers(1_000, many, trembles=np.full(many, size))[metric] for size in (1.0, 1.2))
    slope = (equal["difference"] - more["difference"]) / 0.2
    spread = np.hypot(equal["sd"] / slope, own_spread)
    found, others, dz = 0, 0, []
    for seed in range(SEEDS):
        # People differ in how much more they tremble; the mean is one standard deviation of all differences.
        trembles = 1 + spread + own_spread * np.random.default_rng(seed + 5_000).standard_normal(players)
        rows = answers(seed + 2_000, players, trembles=trembles)
        found += rows[metric]["p_holm"] <= ALPHA
        others += any(row["p_holm"] <= ALPHA for name, row in rows.items() if name != metric)
        dz.append(-rows[metric]["dz"])
    print(
        f"  {players} players, an effect of {np.mean(dz):.2f} standard deviations (tremor {100 * spread:.0f} % larger): "
        f"found in {found} of {SEEDS} studies, something else in {others}"
    )
    assert 0.9 < np.mean(dz) < 1.2, np.mean(dz)
    assert found >= EFFECT_IN and others <= SEEDS - NOTHING_IN, (found, others)


TESTS = [
    equal_hands_find_nothing,
    equal_hands_find_nothing_below_and_above_the_reference,
    without_equal_travel_the_reed_is_measured,
    a_planted_effect_of_one_standard_deviation_is_found,
]
