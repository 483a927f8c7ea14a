#!/usr/bin/env python3
"""Plots the input impedance of a fingering: magnitude with its modes, and phase, of one or several models.

    chalumeau impedance --written F4 --csv f4.csv
    chalumeau impedance --written F4 --peaks 8 --csv f4_peaks.csv
    chalumeau impedance --written F4 --model tmm --csv f4_tmm.csv
    python plot_impedance.py f4.csv f4_tmm.csv --peaks f4_peaks.csv --out f4.png

Each mode is labelled with its frequency and its distance in cents from the nearest whole multiple of the sounding note.
Modes near odd multiples support the tone. Needs numpy and matplotlib. Exit code 0: done; 2: a file cannot be used, and the
message says why.
"""

import argparse
import re
import sys

import kit
import numpy as np

STYLES = (
    {"color": kit.BLUE, "lw": 2.2}, {"color": kit.RED, "lw": 1.2, "ls": (0, (4, 2))},
    {"color": kit.GREEN, "lw": 1.2, "ls": (0, (1, 1.5))},
)


def refuse_magnitude(path):
    """Refuses a table of magnitude and phase, which many impedance heads give, and says how to convert it. Raises BadInput."""
    try:
        with open(path, encoding="utf-8-sig") as file:
            lines = (line.strip() for line in file)
            head = next((line for line in lines if line and not line.startswith("#")), "")
    except (OSError, UnicodeDecodeError):
        return  # The reader of tables says what is wrong.
    if "re_z_over_zc" not in head and re.search("phase|mag|abs|arg", head, re.IGNORECASE):
        raise kit.BadInput(
            f"{path}: has magnitude and phase ({head}); make columns f_hz,re_z_over_zc,im_z_over_zc of it: "
            "re = |Z|/Zc cos(phase), im = |Z|/Zc sin(phase), with Zc = rho c / S of the nominal bore"
        )


def draw(args):
    figure, (upper, lower) = kit.plt.subplots(
        2, 1, figsize=(11, 7), sharex=True, layout="constrained", gridspec_kw={"height_ratios": [3, 2]}
    )
    top = -np.inf
    for index, path in enumerate(args.curves):
        refuse_magnitude(path)
        f_hz, real, imaginary = kit.table(path, "f_hz", "re_z_over_zc", "im_z_over_zc")
        z, style = real + 1j * imaginary, STYLES[index % len(STYLES)]
        size_db = 20 * np.log10(np.abs(z))
        top = max(top, size_db.max())
        upper.plot(f_hz, size_db, label=path, **style)
        lower.plot(f_hz, np.degrees(np.angle(z)), **style)
    if args.peaks:
        written, f_hz, size = kit.table(args.peaks, "written_midi", "f_hz", "mag_over_zc")
        transposition = args.transposition
        if transposition is None:
            transposition = kit.remark(args.peaks, "transposition", "semitones")
        if len(set(written)) != 1:
            raise kit.BadInput(f"{args.peaks}: has {len(set(written))} notes; one was expected, as --written F4 gives")
        played_hz = 440 * 2 ** ((written[0] - transposition - 69) / 12)
        # The label of a mode nearer than this to the previous one moves up a step; Hz and points.
        near_hz, step_pt, last_hz, lift_pt = 250, 26, -np.inf, 6
        for mode_hz, height in zip(f_hz, size):
            harmonic = max(1, round(mode_hz / played_hz))
            cents = 1200 * np.log2(mode_hz / (harmonic * played_hz))
            at_db = 20 * np.log10(height)
            upper.plot(mode_hz, at_db, "o", color="black", ms=4)
            lift_pt = lift_pt + step_pt if mode_hz - last_hz < near_hz else 6
            last_hz = mode_hz
            upper.annotate(
                f"{mode_hz:.0f} Hz\n{cents:+.0f} ct of {harmonic}f", (mode_hz, at_db), (0, lift_pt), ha="center",
                fontsize=8, textcoords="offset points", arrowprops={"arrowstyle": "-", "color": kit.GREY, "lw": 0.6},
            )
        upper.set_title(f"Written {kit.name(written[0])}, sounding f = {played_hz:.1f} Hz; modes, and cents from the nearest multiple")
    upper.set_ylim(top=top + 12)
    upper.set_ylabel("|Z| / Zc, dB")
    upper.legend(frameon=False, loc="upper right")
    lower.axhline(0, color=kit.GREY, lw=0.8)
    lower.set(xlabel="frequency, Hz", ylabel="phase, degrees", ylim=(-95, 95), yticks=(-90, -45, 0, 45, 90))
    for axis in (upper, lower):
        axis.grid(alpha=0.3)
    kit.save(figure, args.out)


def main():
    words = {"description": __doc__, "formatter_class": argparse.RawDescriptionHelpFormatter}
    parser = argparse.ArgumentParser(**words)
    parser.add_argument("curves", nargs="+", help="tables of chalumeau impedance --written")
    parser.add_argument("--peaks", metavar="FILE", help="table of the same note, made with --peaks N: marks its modes")
    parser.add_argument(
        "--transposition", type=int, metavar="N",
        help="semitones the instrument sounds below what is written [default: as the remarks of the table of peaks say]",
    )
    parser.add_argument("--out", default="impedance.png", metavar="FILE", help="picture to write [default: impedance.png]")
    return kit.run("plot_impedance", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
