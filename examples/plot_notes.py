#!/usr/bin/env python3
"""Plots the threshold and the pitch of every note of an instrument.

    chalumeau threshold --all --zeta 0.3 --csv threshold.csv
    chalumeau tune --gamma 0.5 --csv mf.csv
    chalumeau tune --gamma 0.8 --csv ff.csv
    python plot_notes.py threshold.csv mf.csv ff.csv --out notes.png

Thresholds are relative to the closing pressure of the reed; a bore without losses would have 1/3 everywhere. Pitch is
relative to equal temperament; a note that lost its register is a cross at the bottom. Needs numpy and matplotlib. Exit code 0:
done; 2: a file cannot be used, and the message says why.
"""

import argparse
import sys

import kit
import numpy as np

STYLES = ((kit.BLUE, "o"), (kit.RED, "s"), (kit.GREEN, "^"))


def draw(args):
    written, gamma_on = kit.table(args.threshold, "written_midi", "gamma_on")
    figure, (upper, lower) = kit.plt.subplots(2, 1, figsize=(12, 7), sharex=True, layout="constrained")
    upper.axhline(1 / 3, color=kit.GREY, lw=1, ls=":")
    upper.text(written[0], 1 / 3, "1/3: no losses", va="bottom", fontsize=9, color="0.35")
    upper.plot(written, gamma_on, "o-", color=kit.BLUE, ms=4, lw=1)
    upper.set_ylabel("threshold gamma\n(mouth over closing pressure)")
    fallen = []
    for index, path in enumerate(args.tunings):
        notes, cents, held = kit.table(path, "written_midi", "cents", "register_ok")
        colour, marker = STYLES[index % len(STYLES)]
        good = (held == 1) & np.isfinite(cents)
        lower.plot(notes[good], cents[good], marker, color=colour, ms=4, ls="-", lw=0.6, label=path)
        fallen += [(note, index, colour) for note in notes[~good]]
    lower.axhline(0, color=kit.GREY, lw=0.8)
    low, high = lower.get_ylim()
    # Show at least +-1 cent, so that notes in tune look in tune.
    low, high = min(low, -1.0), max(high, 1.0)
    # Leave room at the bottom for notes that lost their register and for the legend.
    lower.set_ylim(low - 0.25 * (high - low), high)
    for note, index, colour in fallen:
        # One line for each table, so that the crosses do not overlap.
        lower.plot(note, 0.04 + 0.05 * index, "x", color=colour, ms=6, transform=lower.get_xaxis_transform())
    if fallen:
        lower.plot([], [], "x", color="black", label="register did not hold")
    lower.set(xlabel="written note", ylabel="cents from equal temperament")
    lower.set_xticks(written, [kit.name(note) for note in written], rotation=90, fontsize=9)
    lower.legend(frameon=False, loc="lower left", ncols=4)
    for axis in (upper, lower):
        axis.grid(alpha=0.3)
    figure.suptitle("Threshold and tuning of every fingering")
    kit.save(figure, args.out)


def main():
    words = {"description": __doc__, "formatter_class": argparse.RawDescriptionHelpFormatter}
    parser = argparse.ArgumentParser(**words)
    parser.add_argument("threshold", help="table of chalumeau threshold --all")
    parser.add_argument("tunings", nargs="+", help="tables of chalumeau tune")
    parser.add_argument("--out", default="notes.png", metavar="FILE", help="picture to write [default: notes.png]")
    return kit.run("plot_notes", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
