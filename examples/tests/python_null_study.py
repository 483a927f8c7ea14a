"""Studies of simulated players: equal hands find nothing, a planted effect is found: python python_null_study.py [word..]

All studies, or those whose name contains one of the words. python_examples.py runs them, too.
"""

import concurrent.futures
import contextlib
import functools
import io
import itertools
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import python_kit  # noqa: E402
import simulate_study  # noqa: E402
import study_log  # noqa: E402
import study_questions  # noqa: E402
from study_measures import by_trial, summarise  # noqa: E402

# Where this is set, all studies are played, and not a sixth.
ALL = "CHALUMEAU_ALL_CASES" in os.environ
SEEDS = 100 if ALL else 16
# Of the acceptance: players of the null study, in which share of studies it must find nothing, and in how many of 100 studies the effect.
NULL_PLAYERS, EFFECT_IN = 8, 80
# Of 16 studies with a true rate of 0.8, the effect is found in fewer than 9 by chance in less than 1 % of cases.
FOUND_IN = EFFECT_IN if ALL else 9
ALPHA = 0.05


def reeds(equal_travel):
    return simulate_study.reeds(python_kit.program(), equal_travel)


def answers(reeds_, players, seed, trembles=None):
    """What a study says about the player, over participants: rows by opening and metric."""
    trials = simulate_study.study(reeds_, seed, players, trembles)
    pieces = [piece for pieces in trials.values() for piece in pieces]
    pairs = study_questions.pairs_of(summarise(by_trial(pieces), 2.0))
    groups = {name: study_questions.compare_group("participants", pairs, name) for name in ("all", "below", "above")}
    return {
        name: {row["metric"]: row for row in rows if row["about"] == "player"} for name, rows in groups.items()
    }


def studies(players, seeds, equal_travel=True, trembles=itertools.repeat(None)):
    """The answers of many studies, on all cores."""
    study = functools.partial(answers, reeds(equal_travel), players)
    with concurrent.futures.ProcessPoolExecutor() as pool:
        return list(pool.map(study, seeds, trembles, chunksize=2))


def is_anything_found(rows):
    return any(row["p_holm"] <= ALPHA for row in rows.values())


def equal_hands_find_nothing():
    found = [study["all"] for study in studies(NULL_PLAYERS, range(SEEDS))]
    assert all(len(rows) == study_questions.FAMILY for rows in found)
    clean = sum(not is_anything_found(rows) for rows in found)
    # Eight players are too few for Holm over seven questions (the least p, 2/256, seven times, is more than ALPHA): p itself tells.
    p = np.array([[row["p"] for row in rows.values()] for rows in found])
    print(f"  {NULL_PLAYERS} equal hands: nothing in {clean} of {SEEDS} studies; p <= {ALPHA} in {(p <= ALPHA).sum()} of {p.size}")
    assert clean == SEEDS, clean
    assert (p <= ALPHA).mean() <= 1.5 * ALPHA, (p <= ALPHA).mean()


def enough_equal_hands_find_nothing_either():
    """Also below and above the reference, where the condition always changes the torque in the same direction."""
    players, seeds = study_questions.ENOUGH_PARTICIPANTS, range(500, 550 if ALL else 508)
    found = studies(players, seeds)
    for opening in ("all", "below", "above"):
        rows = [study[opening] for study in found]
        count = sum(map(is_anything_found, rows))
        small = {name: sum(study[name]["p"] <= ALPHA for study in rows) for name in rows[0]}
        print(f"  {players} equal hands, {opening}: something in {count} of {len(rows)} studies; p <= {ALPHA} in {small}")
        # Of 50 studies with a true rate of 5 %, more than 6 have something by chance in 1 % of cases; of 8, more than 2 in 0.6 %. The seven
        # p of each are looked at together.
        most, most_of_one = (6, 8) if ALL else (2, 3)
        assert count <= most and max(small.values()) <= most_of_one, (opening, count, small)


def without_equal_travel_the_reed_is_measured():
    """The same hands on knobs whose travel follows the reed: the tests above can fail."""
    found = studies(NULL_PLAYERS, range(4), equal_travel=False)
    least = [min(row["p"] for row in study["below"].values()) for study in found]
    print(f"  without equal travel: least p {least}")
    assert all(p <= 2 / 2**NULL_PLAYERS + 1e-9 for p in least), least


def a_planted_effect_of_one_standard_deviation_is_found():
    players, metric, own_spread = study_questions.ENOUGH_PARTICIPANTS, "angle_rms_deg", 0.05
    # How far a hand that trembles a tenth more moves the measure, and how much the differences of such hands scatter: each
    # from 160 hands, so that the scatter is known within 6 %.
    many, step, pilot_seeds = 40, 0.1, range(1_000, 1_004)
    sizes = [np.full(many, size) for size in (1.0, 1.0 + step) for _ in pilot_seeds]
    pilots = [study["all"][metric] for study in studies(many, [*pilot_seeds, *pilot_seeds], trembles=sizes)]
    equal, more = pilots[: len(pilot_seeds)], pilots[len(pilot_seeds) :]
    slope = np.mean([a["difference"] - b["difference"] for a, b in zip(equal, more)]) / step
    scatter = np.sqrt(np.mean([row["sd"] ** 2 for row in more]))
    spread = float(np.hypot(scatter / slope, own_spread))

    # People differ in how much more they tremble; the mean is one standard deviation of all differences.
    def planted(seed):
        return 1 + spread + own_spread * np.random.default_rng(seed + 5_000).standard_normal(players)

    seeds = range(2_000, 2_000 + SEEDS)
    rows = [study["all"] for study in studies(players, seeds, trembles=map(planted, seeds))]
    found = sum(study[metric]["p_holm"] <= ALPHA for study in rows)
    others = sum(is_anything_found({name: study[name] for name in study if name != metric}) for study in rows)
    dz = -np.mean([study[metric]["dz"] for study in rows])
    print(
        f"  {players} players, an effect of {dz:.2f} standard deviations (tremor {100 * spread:.0f} % larger): found in {found} "
        f"of {SEEDS} studies, something else in {others}"
    )
    assert 0.9 < dz < 1.2, dz
    assert found >= FOUND_IN, found


def logs_of_simulated_players_are_those_players():
    """What simulate_study.py writes is read as what was simulated, in the order of the command line, and can be analysed."""
    folder, players, seed = pathlib.Path(tempfile.mkdtemp()), 2, 7
    logs, results = folder / "logs", folder / "results"

    def simulate(*words):
        """In this process, where the tables of feel are known: exit code, standard output and errors."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = simulate_study.main([str(word) for word in words])
            except SystemExit as stop:
                code = stop.code
        return code, out.getvalue(), err.getvalue()

    os.environ[simulate_study.PROGRAM] = python_kit.program()
    words = ("--out", logs, "--players", players, "--seed", seed, "--tremble", "1.5")
    code, out, err = simulate(*words)
    assert code == 0, err
    files = sorted(logs.iterdir())
    assert [str(path) for path in files] == out.split()
    orders = [simulate_study.order(python_kit.program(), who, seed) for who in range(1, players + 1)]
    simulated = simulate_study.study(reeds(True), seed, players, np.full(players, 1.5), orders)
    for who, path in enumerate(files):
        read = study_log.read_log(path, 0, study_log.Onset())
        made = [piece for (of, _), own in simulated.items() if of == who for piece in own]
        assert len(read) == len(made)
        for was, now in zip(made, read):
            assert (now.participant, now.trial, now.side, now.condition) == (who + 1, was.trial, was.side, was.condition)
            assert abs(now.h - was.h) < 1e-9 and abs(now.k - was.k) < 1e-5 and now.has_threshold and now.is_visit
            for name, near in (("angle_deg", 0.051), ("torque_mnm", 0.0051), ("gamma", 6e-6), ("gamma_on", 6e-6), ("written", 0)):
                a, b = getattr(was, name), getattr(now, name)
                assert np.allclose(a, b, rtol=0, atol=near, equal_nan=True), (path, name)
        sides = [(piece.h, piece.condition) for piece in made if piece.side == "A"]
        assert sorted(set(sides)) == sorted(set(orders[who])) and made[0].trial == 1
    line = [sys.executable, python_kit.EXAMPLES / "analyse_study.py", *files, "--out", results, "--no-timelines"]
    told = subprocess.run(line, capture_output=True, text=True, check=False)
    assert told.returncode == 0 and "WARNING" not in told.stdout, told.stdout + told.stderr
    assert f"{players * simulate_study.TRIALS} trials of {players} participants" in told.stdout, told.stdout
    # Nothing is replaced, and what cannot be is said.
    code, _, err = simulate(*words)
    assert code == 2 and "is there already" in err, err
    code, _, err = simulate("--out", logs, "--players", 0)
    assert code == 2 and "--players must be 1 to 100, got 0" in err, err


TESTS = [
    logs_of_simulated_players_are_those_players,
    equal_hands_find_nothing,
    enough_equal_hands_find_nothing_either,
    without_equal_travel_the_reed_is_measured,
    a_planted_effect_of_one_standard_deviation_is_found,
]


# Processes that a study starts import this file.
if __name__ == "__main__":
    for test in TESTS:
        if len(sys.argv) < 2 or any(word in test.__name__ for word in sys.argv[1:]):
            print(test.__name__, flush=True)
            test()
