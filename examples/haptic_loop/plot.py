#!/usr/bin/env python3
"""Plots what haptic_loop --trace wrote: plot.py TRACE.csv PICTURE.png (needs matplotlib)."""

import csv
import sys


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    with open(sys.argv[1], newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    column = lambda key: [row[key] for row in rows]
    time = column("t")
    figure, axes = pyplot.subplots(3, 1, sharex=True, figsize=(9, 8))
    for part, keys, title in (
        (axes[0], ("fx", "fy", "fz"), "force on the hand"),
        (axes[1], ("tx", "ty", "tz"), "torque on the hand"),
        (axes[2], ("from_hand", "stored"), "energy"),
    ):
        for key in keys:
            part.plot(time, column(key), label=key, linewidth=0.8)
        part.set_ylabel(title)
        part.legend(loc="upper right")
    axes[2].set_xlabel("s")
    figure.tight_layout()
    figure.savefig(sys.argv[2], dpi=120)


if __name__ == "__main__":
    main()
