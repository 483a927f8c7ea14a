"""examples/analyse_study.py on logs made here, with figures known beforehand. Run by python_examples.py."""

import itertools
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import matplotlib.image
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
ANALYSE = ROOT / "examples/analyse_study.py"
sys.path.insert(0, str(ANALYSE.parent))
import study_log  # noqa: E402
import study_questions  # noqa: E402

SCRATCH = pathlib.Path(tempfile.mkdtemp())
HEADER = (
    "t_us,angle_deg,velocity_deg_s,torque_mnm,written_midi,gamma,feel_id,h,k,participant,trial,side,condition,"
    "gamma_sounding,level_db,f0_hz,heard_us,armed"
)

RATE_HZ = 200
# What the hand of the made-up logs does on either condition: slope of gamma after a note, 1/s; wobble of gamma, peak
# (it grows by a twentieth of this with every trial); torque while turning up, mNm (half of it while turning down).
HANDS = {"coupled": (1.0, 0.01, 40.0), "free": (0.5, 0.02, 60.0)}
CONDITIONS = ("coupled", "free")
# Windows of 0.5 s in the stays of a trial of `eight_trials`, by hand; the last trial has one stay of 6 s on each side.
WINDOWS = ({"coupled": 2 * 6 + 4, "free": 2 * 5}, {"coupled": 10, "free": 9})
HOLD = 0.5
NOTE_AFTER_S = 0.2
# What is heard of it: the onset so long after gamma's, level and pitch with a wobble, peak, in dB and cents.
HEARD_AFTER_S, LEVEL_DB, PITCH_CENTS = 0.03, 3.0, 5.0


def visit(t_s, seconds, participant, trial, side, condition, h, hands):
    """Rows of one stay on a side: a note after 0.2 s, blown up to 0.5 and held; the knob turns to 90 degrees."""
    slope, wobble, torque = hands[condition]
    wobble *= 1 + trial / 20
    feel_id = 1 + CONDITIONS.index(condition)
    k = 27 / (4 * h**3) if condition == "coupled" else 0.3849
    rows = []
    for n in range(round(seconds * RATE_HZ)):
        t = n / RATE_HZ
        gamma = min(HOLD, max(0.0, slope * (t - NOTE_AFTER_S)))
        if gamma == HOLD:
            gamma += wobble * math.sin(2 * math.pi * 10 * t)
        note = 60 if t >= NOTE_AFTER_S else ""
        heard_s = NOTE_AFTER_S + 1 / 3 / slope + HEARD_AFTER_S
        heard = round(1e6 * (t_s + heard_s)) if t >= heard_s else ""
        sway = math.sin(2 * math.pi * 10 * t)
        sound = f"{-20 + LEVEL_DB * sway:.3f},{220 * 2 ** (PITCH_CENTS * sway / 1200):.4f}"
        phase = (t + 0.25 / RATE_HZ) % 1.0
        angle = 180 * min(phase, 1 - phase)
        size = -torque if phase < 0.5 else -torque / 2
        rows.append(
            f"{round(1e6 * (t_s + t))},{angle:.3f},0.0,{size:.1f},{note},{gamma:.6f},{feel_id},{h:.5f},{k:.5f},"
            f"{participant},{trial},{side},{condition},,{sound},{heard},1"
        )
    return rows


def log(name, participant, trials, hands=HANDS, before=()):
    """Trials: (number, H, condition of A, visits as side and seconds)."""
    rows, t_s = [HEADER, *before], 5.0
    for trial, h, a, visits in trials:
        other = "free" if a == "coupled" else "coupled"
        for side, seconds in visits:
            rows += visit(t_s, seconds, participant, trial, side, a if side == "A" else other, h, hands)
            t_s += seconds
    path = SCRATCH / name
    path.write_text("# made by a test\n" + "\n".join(rows) + "\n")
    return path


def analyse(*args):
    return subprocess.run([sys.executable, ANALYSE, *map(str, args)], capture_output=True, text=True, check=False)


def table(path):
    rows = [line.split(",") for line in path.read_text().splitlines()]
    return [dict(zip(rows[0], row)) for row in rows[1:]]


def near(found, wanted, share, what):
    assert abs(float(found) - wanted) <= share * abs(wanted), f"{what}: {found}, not {wanted} within {share:.0%}"


def eight_trials():
    """Each opening with either order; every trial ends on the coupled side but the last, on B."""
    plan = []
    for n, (h, a) in enumerate(itertools.product((2.0, 2.3, 2.9, 3.3), ("coupled", "free"))):
        ends = ("A", 3) if a == "coupled" else ("B", 3)
        plan.append((n + 1, h, a, [("A", 4), ("B", 4), ("A", 4), ("B", 4), ends]))
    plan[-1] = (8, 3.3, "coupled", [("A", 6), ("B", 6)])
    return plan


def figures_are_those_the_log_was_made_with():
    out = SCRATCH / "known"
    told = analyse(log("known.csv", 7, eight_trials()), "--out", out)
    assert told.returncode == 0, told.stderr
    summary = table(out / "summary.csv")
    assert len(summary) == 16
    for row in summary:
        slope, wobble, torque = HANDS[row["condition"]]
        wobble *= 1 + int(row["trial"]) / 20
        what = f"trial {row['trial']} {row['condition']}"
        near(row["gamma_rms"], wobble / math.sqrt(2), 0.03, what)
        near(row["onset_s"], 1 / 3 / slope, 0.01, what)
        peak = HOLD + wobble if slope == 1.0 else 1 / 3 + 0.2 * slope
        near(row["gamma_overshoot"], peak - 1 / 3, 0.06, what)
        near(row["heard_s"], 1 / 3 / slope + HEARD_AFTER_S, 0.01, what)
        near(row["level_rms_db"], LEVEL_DB / math.sqrt(2), 0.03, what)
        near(row["pitch_rms_cents"], PITCH_CENTS / math.sqrt(2), 0.03, what)
        near(float(row["pressure_rms_pa"]), 6000 * float(row["h"]) * float(row["k"]) * float(row["gamma_rms"]), 1e-3, what)
        # Held and settled: a stay of 4 s has 6 or 5 whole windows, one of 3 s 4.
        near(row["held_windows"], WINDOWS[row["trial"] == "8"][row["condition"]], 0, what)
        near(row["torque_mean_mnm"], 0.75 * torque, 0.02, what)
        near(row["torque_peak_mnm"], torque, 0, what)
        # Up against all of it, back down with half of it given back: pi/2 rad each way, once a second.
        near(row["power_mw"], torque / 2 * math.pi / 2, 0.03, what)
        near(float(row["work_mj"]), float(row["power_mw"]) * float(row["time_s"]), 1e-4, what)
    first = next(row for row in summary if row["trial"] == "1" and row["side"] == "A")
    near(first["time_s"], 11, 0.01, "time")
    assert (first["visits"], first["onsets"], first["switches"]) == ("3", "3", "4"), first
    assert (first["last_side"], first["last_condition"], first["silent_notes"]) == ("A", "coupled", "0"), first
    last = next(row for row in summary if row["trial"] == "8")
    assert (last["switches"], last["last_condition"]) == ("1", "free"), last


def comparison_pairs_the_sides_of_a_trial():
    out = SCRATCH / "known"
    rows = {(r["scope"], r["opening_h"], r["metric"]): r for r in table(out / "comparison.csv")}
    preference = rows["participant 7", "all", "preference"]
    near(preference["coupled"], 7 / 8, 1e-4, "preference")
    # Of 256 patterns, 9 have seven heads or more and 9 seven tails or more.
    near(preference["p"], 2 * 9 / 256, 1e-4, "p of 7 in 8")
    unsteady = rows["participant 7", "all", "gamma_rms"]
    # 0.01 / sqrt(2) times 1.05, 1.1 .. 1.4: the mean is 1.225 and the spread 0.05 sqrt(6) of that.
    near(unsteady["difference"], -0.01 / math.sqrt(2) * 1.225, 0.03, "difference")
    near(unsteady["dz"], -1.225 / 0.05 / math.sqrt(6), 0.05, "effect size")
    assert (unsteady["n"], unsteady["about"], unsteady["p"]) == ("8", "reed and hand", ""), unsteady
    onset = rows["participant 7", "all", "onset_s"]
    near(onset["p"], 2 / 256, 1e-4, "p of 8 in 8")
    near(onset["p_holm"], study_questions.FAMILY * 2 / 256, 1e-4, "for all questions asked")
    assert (onset["n"], onset["about"], onset["test"]) == ("8", "player", "exact"), onset
    assert rows["participant 7", "3.3", "torque_mean_mnm"]["n"] == "2"
    assert {h for _, h, _ in rows} == {"all", "below", "above", "2", "2.3", "2.9", "3.3"}
    assert [rows["participant 7", side, "onset_s"]["n"] for side in ("below", "above")] == ["4", "4"]
    asked = [row for row in rows.values() if row["about"] == "player"]
    assert all(float(row["p_holm"]) >= float(row["p"]) for row in asked)
    assert {row["metric"] for row in asked} <= {"preference", *study_questions.QUESTIONS}


def plots_are_drawn():
    out = SCRATCH / "known"
    names = {path.name for path in out.glob("*.png")}
    wanted = {"paired.png", "phase_p0007.png"} | {f"timeline_p0007_t{n:02}.png" for n in range(1, 9)}
    assert names == wanted, names ^ wanted
    for name in names:
        picture = matplotlib.image.imread(out / name)[..., :3]
        assert picture.shape[0] > 400 and picture.shape[1] > 500, picture.shape
        # Both conditions are on every picture, in the two colours that all kinds of colour vision tell apart.
        for colour in ((0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00)):
            close = np.abs(255 * picture - colour).max(axis=-1) < 40
            assert close.sum() > 100, f"{name}: {close.sum()} pixels of {colour}"


def persons_are_compared_and_not_their_trials():
    logs = []
    for who in range(1, 7):
        # Five persons begin sooner on coupled, one on free.
        hands = HANDS if who < 6 else {"coupled": HANDS["free"], "free": HANDS["coupled"]}
        logs.append(log(f"p{who}.csv", who, eight_trials()[:4], hands))
    out = SCRATCH / "persons"
    told = analyse(*logs, "--out", out, "--no-timelines")
    assert told.returncode == 0, told.stderr
    rows = [r for r in table(out / "comparison.csv") if r["scope"] == "participants" and r["opening_h"] == "all"]
    onset = next(r for r in rows if r["metric"] == "onset_s")
    assert onset["n"] == "6", onset
    near(onset["p"], 2 * 7 / 64, 1e-4, "p of 5 in 6 with equal differences")
    assert not list(out.glob("timeline*")) and "n counts participants" in told.stdout
    assert "9 are the fewest, and 20 are advised" in told.stdout, told.stdout


def the_hand_is_measured_in_degrees_and_seconds():
    """Three notes on each side: from 60 degrees at known speeds to 150, 8 degrees beyond and back, with a wobble."""
    rows, t_s = [HEADER], 0.0
    for side in "AB":
        condition = CONDITIONS["AB".index(side)]
        for written, speed in ((60, 150.0), (62, 200.0), (64, 250.0)):
            for n in range(2 * RATE_HZ):
                t = n / RATE_HZ
                turned = speed * max(0.0, t - 0.3)
                angle = 60 + min(turned, 90.0)
                if turned >= 90.0:
                    angle += 8 * math.exp(-(t - 0.3 - 90.0 / speed) / 0.05) + 0.4 * math.sin(2 * math.pi * 10 * t)
                # The reeds differ in what an angle blows and in where the note begins, at 129.6 degrees on both.
                gamma_on = (0.36, 0.4)["AB".index(side)]
                gamma = gamma_on * angle / 129.6
                note = written if t >= 0.1 else ""
                rows.append(
                    f"{round(1e6 * (t_s + t))},{angle:.4f},0,-40,{note},{gamma:.6f},1,2.0,0.4,1,1,{side},{condition},"
                    f"{gamma_on},,,,"
                )
            t_s += 2.0
    path = SCRATCH / "hand.csv"
    path.write_text("\n".join(rows))
    told = analyse(path, "--out", SCRATCH / "hand", "--no-timelines")
    assert told.returncode == 0 and "1/3" not in told.stdout, told.stdout + told.stderr
    onsets = [0.2 + 69.6 / speed for speed in (150.0, 200.0, 250.0)]
    for row in table(SCRATCH / "hand/summary.csv"):
        near(row["onset_s"], onsets[1], 0.01, "onset")
        near(row["onset_spread_s"], float(np.std(onsets, ddof=1)), 0.02, "spread of onsets")
        near(row["overshoot_deg"], 8.0, 0.06, "overshoot")
        near(row["angle_rms_deg"], 0.4 / math.sqrt(2), 0.05, "unsteadiness")
        assert (row["onsets"], row["silent_share"], row["heard_s"]) == ("3", "0", ""), row


def a_gap_and_a_glance_count_for_nothing():
    lines = log("whole.csv", 3, [(1, 2.0, "free", [("A", 4), ("B", 4)]), (2, 2.0, "free", [("A", 4), ("B", 0.5)])])
    lines = lines.read_text().splitlines()
    at = 2 + 2 * RATE_HZ
    # A second is missing in trial 1, and rows outside the study stand in front.
    kept = [line for n, line in enumerate(lines) if not at <= n < at + RATE_HZ]
    kept[2:2] = ["4900000,0.00,0.0,0,,0.00000,1,2.59808,0.38490,,,,,,,,,"] * 3
    path = SCRATCH / "gap.csv"
    path.write_text("\n".join(kept))
    out = SCRATCH / "gap"
    told = analyse(path, "--out", out, "--no-timelines")
    assert told.returncode == 0, told.stderr
    first = table(out / "summary.csv")[0]
    near(first["time_s"], 3, 0.01, "time without the gap")
    assert (first["visits"], first["onsets"], first["compared"]) == ("1", "1", "yes"), first
    assert [row["compared"] for row in table(out / "summary.csv")] == ["yes", "yes", "no", "no"]
    assert "3/2" in told.stdout, told.stdout


def time_without_torque_counts_for_nothing():
    """The knob lets go for two of the five seconds of B in trial 1, and is never armed on B in trial 2."""
    plan = [(1, 2.0, "free", [("A", 5), ("B", 5)]), (2, 3.3, "free", [("A", 5), ("B", 5)])]
    lines = log("armed.csv", 4, plan).read_text().splitlines()
    torque = HEADER.split(",").index("torque_mnm")
    rows = [n for n, line in enumerate(lines) if ",4,1," in line and ",B," in line]
    free = set(rows[RATE_HZ : 3 * RATE_HZ]) | {n for n, line in enumerate(lines) if ",4,2," in line and ",B," in line}
    for n, line in enumerate(lines[1:], 1):
        cells = line.split(",")
        cells[torque] = "0" if n in free else cells[torque]
        cells[-1] = "0" if n in free else cells[-1]
        lines[n] = ",".join(cells)
    path, out = SCRATCH / "unarmed.csv", SCRATCH / "unarmed"
    path.write_text("\n".join(lines))
    told = analyse(path, "--out", out, "--no-timelines")
    assert told.returncode == 0, told.stderr
    assert "the knob was not armed for part of 2 of 2 trials (participant/trial): 4/1, 4/2\n" in told.stdout, told.stdout
    assert "no torque at all on a side, knob not armed? (participant/trial): 4/2\n" in told.stdout, told.stdout
    first, second = table(out / "summary.csv")[1], table(out / "summary.csv")[3]
    near(first["time_s"], 3, 0.02, "time with torque")
    near(first["unarmed_s"], 2, 0.02, "time without")
    assert (first["visits"], first["compared"], second["compared"]) == ("1", "yes", "no"), (first, second)
    whole = SCRATCH / "whole_armed"
    assert analyse(SCRATCH / "armed.csv", "--out", whole, "--no-timelines").returncode == 0
    near(first["torque_mean_mnm"], float(table(whole / "summary.csv")[1]["torque_mean_mnm"]), 0.3, "mean of what was felt")


def a_feel_that_does_not_follow_is_told():
    plan = [(1, 2.0, "free", [("A", 4), ("B", 4)]), (2, 3.3, "free", [("A", 4), ("B", 4), ("A", 4)])]
    lines = log("follows.csv", 9, plan).read_text().splitlines()
    stuck = SCRATCH / "stuck.csv"
    # In trial 2 the knob keeps the feel of the side before, and on side A the motor is off.
    feel, torque = HEADER.split(",").index("feel_id"), HEADER.split(",").index("torque_mnm")
    for n, line in enumerate(lines):
        cells = line.split(",")
        if ",9,2," in line:
            cells[feel] = "2"
            cells[torque] = "0" if ",A," in line else cells[torque]
        lines[n] = ",".join(cells)
    stuck.write_text("\n".join(lines))
    out = SCRATCH / "stuck"
    told = analyse(stuck, "--out", out, "--no-timelines")
    assert told.returncode == 0, told.stderr
    assert "did not follow the switch in 1 of 2 trials (participant/trial): 9/2\n" in told.stdout, told.stdout
    assert "no torque at all on a side, knob not armed? (participant/trial): 9/2\n" in told.stdout, told.stdout
    assert [row["feel_followed"] for row in table(out / "summary.csv")] == ["yes", "yes", "no", "no"]
    assert "WARNING" not in analyse(SCRATCH / "follows.csv", "--out", out, "--no-timelines").stdout


def notes_that_never_speak_are_counted():
    rows = [HEADER]
    for n in range(8 * RATE_HZ):
        t, side = n / RATE_HZ, "AB"[n >= 4 * RATE_HZ]
        # Half a second of each note; every second one stays below 1/3.
        part = int(2 * t)
        note = 60 + part % 3 if t % 0.5 > 0.1 else ""
        gamma = (0.2 if part % 2 else 0.45) * (t % 0.5 > 0.2)
        condition = "coupled" if side == "A" else "free"
        rows.append(f"{round(1e6 * t)},0,0,0,{note},{gamma},1,2.0,0.4,1,1,{side},{condition},,,,,")
    path = SCRATCH / "silent.csv"
    path.write_text("\n".join(rows))
    told = analyse(path, "--out", SCRATCH / "silent", "--no-timelines")
    assert told.returncode == 0, told.stderr
    # The last note of each side is cut off by the switch or the end: it might have spoken yet.
    for row in table(SCRATCH / "silent/summary.csv"):
        assert (row["onsets"], row["silent_notes"]) == ("4", "3"), row
        near(row["silent_share"], 3 / 7, 1e-4, "share")


def thresholds_follow_the_reed():
    path = SCRATCH / "haptic.csv"
    head = "written_midi,gamma_on,gamma_off,p_req_pa,a_on_deg,a_off_deg,a_close_deg,scale_mnm,h,k\n# zeta 0.3\n"
    path.write_text(
        head
        + "60,0.364955,1.2483,2189.73,112.2803,420.4819,336.8408,18.7134,2.598076,0.3849002\n"
        + "97,nan,nan,nan,112.2803,420.4819,336.8408,18.7134,2.598076,0.3849002\n"
    )
    onset = study_log.Onset(path)
    # What `chalumeau haptic --written 60 --H H --k k` itself says.
    for h, k, wanted in ((3.3, 0.3849, 0.361248), (2.0, 0.3849, 0.369603), (2.0, 0.84375, 0.388727)):
        near(onset.gamma(np.array([60.0]), np.array([h]), np.array([k]))[0], wanted, 0.002, f"H {h} k {k}")
    unknown = onset.gamma(np.array([np.nan, 97.0, 60.0]), np.full(3, np.nan), np.full(3, np.nan))
    assert np.isnan(unknown[:2]).all() and abs(unknown[2] - 0.364955) < 1e-5, unknown
    out = SCRATCH / "thresholds"
    plan = [(1, study_log.H_REFERENCE, "coupled", [("A", 4), ("B", 4)])]
    told = analyse(log("thresholds.csv", 1, plan), "--thresholds", path, "--out", out, "--no-timelines")
    assert told.returncode == 0, told.stderr
    near(table(out / "summary.csv")[0]["onset_s"], 0.364955, 0.005, "time to the note's own onset")


def permutation_test_is_right():
    random_ = np.random.default_rng(5)
    sign_flip_p, exact_pairs = study_questions.sign_flip_p, study_questions.EXACT_PAIRS
    for n in (1, 2, 5, 9, 14):
        d = random_.normal(0.5, 1, n)
        patterns = [sum(s * x for s, x in zip(signs, d)) for signs in itertools.product((-1, 1), repeat=n)]
        wanted = np.mean([abs(total) >= abs(sum(d)) - 1e-12 for total in patterns])
        assert abs(sign_flip_p(d)[0] - wanted) < 1e-12, n
    assert sign_flip_p([1.0, -1.0])[0] == 1.0 and sign_flip_p([0.0, 0.0, 0.0])[0] == 1.0
    d = random_.normal(0.2, 1, exact_pairs)
    exact, _ = sign_flip_p(d)
    drawn, method = sign_flip_p(np.append(d, 0.0))
    assert 0.02 < exact < 0.98, exact
    assert "draws" in method and abs(exact - drawn) < 0.01, (exact, drawn)
    # Where nothing is to be found it is found in at most one of twenty.
    found = [sign_flip_p(random_.normal(0, 1, 9))[0] <= 0.05 for _ in range(2000)]
    assert 0.03 < np.mean(found) < 0.065, np.mean(found)
    assert np.allclose(study_questions.holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])
    assert np.allclose(study_questions.holm([0.01, 0.04, 0.03], 5), [0.05, 0.12, 0.12])
    # With the fewest participants, and no fewer, something can be found.
    for n in (study_questions.LEAST_PARTICIPANTS - 1, study_questions.LEAST_PARTICIPANTS):
        p, _ = sign_flip_p(np.linspace(1, 2, n))
        found = study_questions.holm([p], study_questions.FAMILY)[0] <= 0.05
        assert found == (n >= study_questions.LEAST_PARTICIPANTS), (n, p)


def bad_files_are_named_with_the_place():
    good = log("good.csv", 1, [(1, 2.0, "coupled", [("A", 3), ("B", 3)])])
    lines = good.read_text().splitlines()

    def changed(name, row, column, text):
        new = list(lines)
        cells = new[row].split(",")
        cells[HEADER.split(",").index(column)] = text
        new[row] = ",".join(cells)
        path = SCRATCH / name
        path.write_text("\n".join(new))
        return path

    def written(name, text):
        path = SCRATCH / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    other_seed = log("seed2.csv", 1, [(1, 2.0, "free", [("A", 3), ("B", 3)])])
    for files, said in (
        ([SCRATCH / "absent.csv"], "cannot be read"),
        ([SCRATCH], "cannot be read"),
        ([written("empty.csv", "")], "is empty"),
        ([written("header.csv", HEADER)], "no rows"),
        ([written("columns.csv", "t_us,angle_deg\n0,1\n")], "no column torque_mnm"),
        ([written("short.csv", f"{HEADER}\n0,1,2\n")], "line 2 has 3 cells"),
        ([written("binary.csv", b"\x89PNG\r\n\x1a\n\xff\xfe\x00")], "not UTF-8"),
        ([changed("cell.csv", 9, "gamma", "loud")], "line 10: gamma is `loud`"),
        ([changed("nan.csv", 9, "torque_mnm", "nan")], "line 10: torque_mnm is `nan`"),
        ([changed("back.csv", 9, "t_us", "0")], "line 10: t_us goes back"),
        ([changed("side.csv", 9, "side", "C")], "line 10: side is `C`"),
        ([changed("condition.csv", 9, "condition", "")], "line 10: condition is ``"),
        ([changed("trial.csv", 9, "trial", "")], "line 10: trial is empty"),
        ([written("off.csv", f"{HEADER}\n0,1,0,0,60,0.5,1,2,0.4,,,,,,,,,\n")], "no row belongs to a study"),
        ([changed("heard.csv", 9, "f0_hz", "high")], "line 10: f0_hz is `high`"),
        ([good, good], "given twice"),
        ([good, other_seed], "two orders"),
        ([good, "--thresholds", written("t.csv", "written_midi,gamma_on,h,k\n60,0.1,2,1\n")], "1/3..1"),
        ([good, "--thresholds", written("u.csv", "written_midi,gamma_on,h,k\n60,nan,2,1\n")], "no gamma_on"),
    ):
        told = analyse(*files, "--out", SCRATCH / "bad", "--no-timelines")
        assert told.returncode == 2 and said in told.stderr and "Traceback" not in told.stderr, (said, told.stderr)
        assert not (SCRATCH / "bad").exists(), "nothing is written for a log that cannot be used"
    told = analyse(good, "--out", good)
    assert told.returncode == 2 and "cannot be made" in told.stderr, told.stderr


def columns_are_those_the_plugin_writes():
    source = (ROOT / "crates/knob/src/touch/take_csv.rs").read_text()
    header = re.search(r'HEADER: &str = "(.*?)";', source, re.DOTALL).group(1)
    header = re.sub(r"\\\s+", "", header)
    read = study_log.NUMBERS + study_log.WORDS + study_log.OPTIONAL
    assert header == HEADER and set(read) <= set(header.split(",")), header


def older_logs_are_read():
    """A log from before the columns of the sound gives the same, without what was heard."""
    new = log("new.csv", 4, eight_trials()[:2])
    lines = [line if line.startswith("#") else ",".join(line.split(",")[:13]) for line in new.read_text().splitlines()]
    old = SCRATCH / "old.csv"
    old.write_text("\n".join(lines))
    for path in (new, old):
        told = analyse(path, "--out", SCRATCH / path.stem, "--no-timelines")
        assert told.returncode == 0, told.stderr
    for a, b in zip(table(SCRATCH / "new/summary.csv"), table(SCRATCH / "old/summary.csv")):
        assert b["heard_s"] == b["level_rms_db"] == "" != a["heard_s"], b
        assert all(a[name] == b[name] for name in a if name not in ("heard_s", "level_rms_db", "pitch_rms_cents"))


TESTS = [
    figures_are_those_the_log_was_made_with,
    comparison_pairs_the_sides_of_a_trial,
    plots_are_drawn,
    persons_are_compared_and_not_their_trials,
    the_hand_is_measured_in_degrees_and_seconds,
    a_gap_and_a_glance_count_for_nothing,
    time_without_torque_counts_for_nothing,
    a_feel_that_does_not_follow_is_told,
    notes_that_never_speak_are_counted,
    thresholds_follow_the_reed,
    permutation_test_is_right,
    bad_files_are_named_with_the_place,
    columns_are_those_the_plugin_writes,
    older_logs_are_read,
]
