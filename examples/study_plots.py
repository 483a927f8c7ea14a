"""Draws the plots of analyse_study.py: single trials, torque against angle, and the paired comparison."""

import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from study_log import CONDITIONS
from study_questions import QUESTIONS

# Okabe and Ito's colours, distinct for all common kinds of colour vision; shapes and dashes distinguish them in grey.
STYLE = {"coupled": {"color": "#0072B2", "marker": "o"}, "free": {"color": "#D55E00", "marker": "s"}}


def plot_timeline(path, title, pieces):
    """Angle, gamma and torque of one trial; grey bands are side B. The time between two logs is left out."""
    figure, axes = plt.subplots(3, 1, figsize=(10, 7), sharex=True, layout="constrained")
    offset, last_log, last_end, spans = 0.0, None, 0.0, []
    for piece in pieces:
        if piece.log != last_log:
            offset, last_log = last_end - piece.t_s[0], piece.log
        t, style = piece.t_s + offset, STYLE[piece.condition]
        last_end = t[-1]
        if spans and spans[-1][0] == piece.side:
            spans[-1][3] = t[-1]
        else:
            spans.append([piece.side, piece.condition, t[0], t[-1]])
        axes[0].plot(t, piece.angle_deg, color=style["color"], lw=1.2)
        axes[1].plot(t, piece.gamma, color=style["color"], lw=1.2)
        axes[1].plot(t, piece.gamma_on, color="black", lw=0.9, ls=":")
        axes[2].plot(t, piece.torque_mnm, color=style["color"], lw=1.2)
    for axis in axes:
        for side, _, begin, end in spans:
            if side == "B":
                axis.axvspan(begin, end, color="0.88", lw=0, zorder=0)
        axis.grid(alpha=0.3)
    whole = max(last_end - spans[0][2], 1e-9)
    for side, condition, begin, end in spans:
        # A label only where there is room for it.
        if (end - begin) / whole > 0.08:
            where = axes[0].get_xaxis_transform()
            axes[0].text(
                0.5 * (begin + end), 1.02, f"{side} {condition}", transform=where, ha="center", fontsize=9,
                color=STYLE[condition]["color"],
            )
    axes[0].set_ylabel("angle, degrees")
    axes[1].set_ylabel("gamma (mouth over\nclosing pressure)")
    axes[2].set_ylabel("commanded torque, mNm")
    axes[2].set_xlabel("time, s")
    handles = [plt.Line2D([], [], color=STYLE[c]["color"], label=c) for c in CONDITIONS]
    handles += [plt.Line2D([], [], color="black", ls=":", lw=0.9, label="gamma at which the note begins")]
    handles += [plt.Rectangle((0, 0), 1, 1, color="0.88", label="side B")]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(title)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def plot_phase(path, participant, trials):
    """Torque against angle, one panel for each opening."""
    fields = {}
    for piece in (piece for pieces in trials.values() for piece in pieces if piece.participant == participant):
        fields.setdefault(round(piece.h, 3) if math.isfinite(piece.h) else None, []).append(piece)
    columns = min(2, len(fields))
    lines = -(-len(fields) // columns)
    figure, axes = plt.subplots(
        lines, columns, figsize=(5 * columns, 0.8 + 3.6 * lines), sharex=True, sharey=True, squeeze=False,
        layout="constrained",
    )
    for axis in axes.flat[len(fields) :]:
        axis.set_visible(False)
    for axis, (h, pieces) in zip(axes.flat, sorted(fields.items(), key=lambda field: field[0] or 0.0)):
        rows = sum(len(piece.t_s) for piece in pieces)
        for piece in pieces:
            style = STYLE[piece.condition]
            axis.plot(piece.angle_deg, piece.torque_mnm, color=style["color"], lw=0.6, alpha=0.35)
            # Markers, because the lines overlap too much for dashes; about 300 in a panel.
            some = slice(None, None, max(1, rows // 300))
            axis.plot(
                piece.angle_deg[some], piece.torque_mnm[some], ls="", marker=style["marker"], ms=4, mec=style["color"],
                mfc=style["color"] if piece.condition == "coupled" else "none", mew=0.9, alpha=0.8,
            )
        axis.axhline(0, color="0.6", lw=0.8, zorder=0)
        axis.set_title("H not logged" if h is None else f"H = {h:g}", fontsize=10)
        axis.grid(alpha=0.3)
        axis.set_xlabel("angle, degrees")
        axis.set_ylabel("torque of the motor, mNm")
    handles = [
        plt.Line2D([], [], **STYLE[c], lw=0.6, mfc=STYLE[c]["color"] if c == "coupled" else "none", label=c)
        for c in CONDITIONS
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    says = "on one note the area inside a loop is work lost; changes of note draw loops, too"
    figure.suptitle(f"Participant {participant}: torque against angle\n({says})")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def plot_paired(path, pairs):
    """The two sides of each trial, joined by a line; one panel for each metric, one place for each opening. Bars are means."""
    openings = sorted({h for trials in pairs.values() for h, _ in trials if math.isfinite(h)})
    place = {h: n for n, h in enumerate(openings)}
    names = ["preference", *QUESTIONS]
    figure, axes = plt.subplots(2, 4, figsize=(15, 7.5), layout="constrained")
    axes.flat[-1].set_visible(False)
    for axis, name in zip(axes.flat, names):
        values = {}
        for trials in pairs.values():
            for h, metrics in trials:
                if np.isfinite(metrics[name]).all():
                    values.setdefault(place.get(h, len(openings)), []).append(metrics[name])
        axis.set_xticks(range(len(openings) + any(n == len(openings) for n in values)))
        axis.set_xticklabels([f"{h:g}" for h in openings] + ["?"] * (len(axis.get_xticks()) - len(openings)))
        axis.set_xlim(-0.5, len(axis.get_xticks()) - 0.5)
        axis.set_xlabel("opening H")
        axis.grid(axis="y", alpha=0.3)
        for n, both in values.items():
            both = np.array(both)
            if name == "preference":
                share = both[:, 0].mean()
                axis.bar(n, share, 0.6, color=STYLE["coupled"]["color"])
                axis.bar(n, 1 - share, 0.6, bottom=share, color=STYLE["free"]["color"], hatch="//", edgecolor="white")
                axis.text(n, 1.02, f"n={len(both)}", ha="center", fontsize=8)
                continue
            x = np.array([n - 0.18, n + 0.18])
            axis.plot(x, both.T, color="0.6", lw=0.8, zorder=1)
            for which, condition in enumerate(CONDITIONS):
                style = STYLE[condition]
                axis.scatter(
                    np.full(len(both), x[which]), both[:, which], s=24, color=style["color"], marker=style["marker"],
                    alpha=0.75, zorder=2, linewidths=0,
                )
                mean = both[:, which].mean()
                axis.plot([x[which] - 0.12, x[which] + 0.12], [mean, mean], color="black", lw=2, zorder=3)
        if name == "preference":
            axis.set_ylim(0, 1.12)
            axis.axhline(0.5, color="black", lw=0.9, ls=":")
            axis.set_ylabel("share of trials that ended there")
        else:
            axis.set_ylabel(QUESTIONS[name][1])
    handles = [plt.Line2D([], [], ls="", **STYLE[c], label=c) for c in CONDITIONS]
    handles += [plt.Line2D([], [], color="black", lw=2, label="mean")]
    handles += [plt.Line2D([], [], color="0.6", label="one trial")]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    trials = sum(map(len, pairs.values()))
    persons = f"{len(pairs)} participant{'s' * (len(pairs) > 1)}"
    says = "lines and means are over trials; the tests count participants"
    figure.suptitle(f"Coupled and free k, {trials} trials of {persons}\n({says})")
    figure.savefig(path, dpi=110)
    plt.close(figure)
