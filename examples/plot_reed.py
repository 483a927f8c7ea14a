#!/usr/bin/env python3
"""Plots the flow law of the reed in physical units, with the orbit of a played note.

    chalumeau reed --law --csv law.csv
    chalumeau render --written G4 --gamma 0.5 --seconds 1 --no-noise --out g4.wav --probe g4.csv
    python plot_reed.py law.csv g4.csv --out reed.png

The law is the flow through a reed at rest at each pressure. The orbit of the note differs from it, because the moving
reed has inertia and its lay is curved. Needs numpy and matplotlib. Exit code 0: done; 2: a file cannot be used, and the
message says why.
"""

import argparse
import math
import sys

import kit
import numpy as np

# The reference reed of the notebook, to which zeta refers: p = 1 shuts it.
H_REFERENCE = math.sqrt(27) / 2
# Length shown, s, up to the end of the note: several periods of the lowest note.
SHOWN_S = 0.05


def draw(args):
    p, u = kit.table(args.law, "p", "u")
    t, gamma, flow, mouthpiece = kit.table(args.probe, "t_s", "gamma", "flow_m3s", "p_mouthpiece_pa")
    closing_pa = kit.remark(args.probe, "closing pressure", "Pa")
    scale_m3s = kit.remark(args.probe, "zeta", ",") * kit.remark(args.probe, "reference pressure", "Pa")
    scale_m3s /= kit.remark(args.probe, "Zc", "Pa s/m3")
    end_s = t[-1] if args.until is None else args.until
    shown = (t > end_s - SHOWN_S) & (t <= end_s)
    if shown.sum() < 16:
        raise kit.BadInput(f"{args.probe}: {shown.sum()} rows before {end_s:g} s; it has {t[0]:g} to {t[-1]:g} s")

    # Both curves use the same closing pressure, so that the axes of the law are those of the note.
    p_delta_kpa = 1e-3 * (gamma[shown] * closing_pa - mouthpiece[shown])
    reference_kpa = 1e-3 * kit.remark(args.probe, "reference pressure", "Pa")
    law_kpa, law_l_s = reference_kpa * p, 1e3 * scale_m3s * u / H_REFERENCE
    seen = law_kpa >= min(-0.1 * reference_kpa, p_delta_kpa.min() - 0.2)

    figure, (left, right) = kit.plt.subplots(
        1, 2, figsize=(12, 5), layout="constrained", gridspec_kw={"width_ratios": [3, 2]}
    )
    left.axhline(0, color=kit.GREY, lw=0.8)
    left.axvline(0, color=kit.GREY, lw=0.8)
    left.plot(law_kpa[seen], law_l_s[seen], color=kit.BLUE, lw=2, label="law, reed at rest at each pressure")
    left.plot(p_delta_kpa, 1e3 * flow[shown], color=kit.RED, lw=1, label="orbit of the note")
    # An arrow shows the direction, from the largest flow on.
    at = int(np.argmax(flow[shown][: -len(p_delta_kpa) // 8]))
    there = [(p_delta_kpa[n], 1e3 * flow[shown][n]) for n in (at, at + max(2, len(p_delta_kpa) // 400))]
    left.annotate("", there[1], there[0], arrowprops={"arrowstyle": "-|>", "color": kit.RED, "mutation_scale": 18})
    top = np.nanargmax(law_l_s)
    left.annotate(
        f"most flow\n{law_kpa[top]:.2f} kPa", (law_kpa[top], law_l_s[top]), (0, -95), textcoords="offset points",
        ha="center", arrowprops={"arrowstyle": "-", "color": kit.GREY},
    )
    left.annotate(
        f"shut\n{1e-3 * closing_pa:.2f} kPa", (1e-3 * closing_pa, 0), (0, 26), textcoords="offset points", ha="center",
        arrowprops={"arrowstyle": "-", "color": kit.GREY},
    )
    left.set_ylim(top=1.2 * max(np.nanmax(law_l_s), 1e3 * flow[shown].max()))
    left.set(xlabel="pressure difference, mouth less mouthpiece, kPa", ylabel="flow into the bore, l/s")
    left.legend(loc="upper left", frameon=False)
    left.grid(alpha=0.3)
    t_ms = 1e3 * (t[shown] - t[shown][0])
    right.plot(t_ms, 1e-3 * mouthpiece[shown], color=kit.RED, lw=1.2)
    right.set(xlabel="time, ms", ylabel="pressure in the mouthpiece, kPa", xlim=(0, min(20, t_ms[-1])))
    right.grid(alpha=0.3)
    figure.suptitle(f"A reed and a note, gamma {gamma[shown].mean():.2f}")
    kit.save(figure, args.out)


def main():
    words = {"description": __doc__, "formatter_class": argparse.RawDescriptionHelpFormatter}
    parser = argparse.ArgumentParser(**words)
    parser.add_argument("law", help="table of chalumeau reed --law")
    parser.add_argument("probe", help="table of chalumeau render --probe")
    parser.add_argument("--until", type=float, metavar="S", help="show the 50 ms before this time [default: the end]")
    parser.add_argument("--out", default="reed.png", metavar="FILE", help="picture to write [default: reed.png]")
    return kit.run("plot_reed", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
