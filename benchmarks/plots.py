"""One plot a benchmark: the function named for the program draws its report into a PNG file."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def save(figure, path):
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def query_peers(report, path):
    rows = report["tables"]["Time a query"]
    pairs = list(dict.fromkeys(row["pair"] for row in rows))
    classes = list(dict.fromkeys(row["class"] for row in rows))
    queries = list(dict.fromkeys(row["query"] for row in rows))
    figure, axes = plt.subplots(len(pairs), 1, figsize=(9, 3 * len(pairs)), squeeze=False)
    width = 0.8 / len(queries)
    for axis, pair in zip(axes[:, 0], pairs):
        for i, query in enumerate(queries):
            at = [c + (i - len(queries) / 2 + 0.5) * width for c in range(len(classes))]
            by_class = [next(row for row in rows if (row["pair"], row["class"], row["query"]) ==
                             (pair, c, query)) for c in classes]
            median = [row["median us"] for row in by_class]
            tail = [row["p99 us"] - row["median us"] for row in by_class]
            axis.bar(at, median, width, label=query,
                     yerr=[[0] * len(tail), tail], error_kw={"elinewidth": 0.8, "capsize": 2})
        axis.set(yscale="log", title=pair, ylabel="µs: median, whisker p99",
                 xticks=range(len(classes)), xticklabels=classes)
        axis.grid(True, axis="y", alpha=0.3)
    axes[0, 0].legend(fontsize=7, ncol=3, loc="lower center", bbox_to_anchor=(0.5, 1.12))
    save(figure, path)


def small_large(report, path):
    """Error of the volume over the ratio of sizes: a panel a pair, a colour a depth."""
    rows = [row for row in report["tables"]["Small against large"]
            if row["pair"].startswith("small_")]
    pairs = list(dict.fromkeys(row["pair"] for row in rows))
    figure, axes = plt.subplots(1, len(pairs), figsize=(4.5 * len(pairs), 4), squeeze=False,
                                sharey=True)
    for axis, pair in zip(axes[0], pairs):
        for depth in sorted({row["depth"] for row in rows}):
            mine = sorted((row for row in rows if (row["pair"], row["depth"]) == (pair, depth)),
                          key=lambda row: row["ratio"])
            ratios = [row["ratio"] for row in mine]
            line, = axis.loglog(ratios, [row["default volume median %"] for row in mine], "o-",
                                label=f"depth {depth:g}, by default")
            axis.loglog(ratios, [row["lenses volume median %"] for row in mine], "s--",
                        color=line.get_color(), label=f"depth {depth:g}, lenses")
        axis.set(title=pair, xlabel="size of B over A's")
        axis.grid(True, which="major", alpha=0.3)
    axes[0, 0].set_ylabel("error of the volume, median, %")
    axes[0, -1].legend(fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
    save(figure, path)


def mated(report, path):
    """Time over the distance from the mate: a panel a mate, a curve a library. The first place of
    the axis is the mate itself."""
    rows = report["tables"]["Time over distance"]
    mates = list(dict.fromkeys(row["mate"] for row in rows))
    figure, axes = plt.subplots(1, len(mates), figsize=(4.5 * len(mates), 4), squeeze=False,
                                sharey=True)
    for axis, mate in zip(axes[0], mates):
        mine = [row for row in rows if row["mate"] == mate]
        at = range(len(mine))
        axis.semilogy(at, [row["Manifold us"] for row in mine], "s--", color="tab:gray",
                      label="Manifold's boolean")
        axis.semilogy(at, [row["us"] for row in mine], "o-", color="tab:blue", label="ist, exact")
        axis.set(title=mate, xlabel="distance from the mate", xticks=list(at)[::3],
                 xticklabels=[f"{row['distance']:g}" for row in mine][::3])
        axis.grid(True, which="major", alpha=0.3)
    axes[0, 0].set_ylabel("µs")
    axes[0, -1].legend(fontsize=8)
    save(figure, path)


def grids(report, path):
    """The paper's Figure 9: a column a mesh, a curve a grid; coverage above, spheres below."""
    rows = report["tables"]["Rounds"]
    meshes = list(dict.fromkeys(row["mesh"] for row in rows))
    modes = list(dict.fromkeys(row["grid"] for row in rows))
    figure, axes = plt.subplots(2, len(meshes), figsize=(4 * len(meshes), 7), squeeze=False,
                                sharex="col")
    for column, mesh in enumerate(meshes):
        for mode in modes:
            mine = [row for row in rows if (row["mesh"], row["grid"]) == (mesh, mode)]
            style = "k.-" if mode == "banded" else ".-"
            times = [row["ms"] for row in mine]
            axes[0, column].semilogx(times, [100 * row["coverage"] for row in mine], style,
                                     label=mode)
            axes[1, column].loglog(times, [row["spheres"] for row in mine], style, label=mode)
        axes[0, column].set(title=mesh)
        axes[1, column].set(xlabel="ms")
        for axis in axes[:, column]:
            axis.grid(True, which="both", alpha=0.3)
    axes[0, 0].set_ylabel("coverage, %")
    axes[1, 0].set_ylabel("spheres")
    axes[0, 0].legend(fontsize=8)
    save(figure, path)


def trade(report, path):
    """Error of the volume against time: a row a pair, a panel a class of overlap, a curve a way to
    ask. Points on the front are ringed; libraries that answer no volume are vertical lines."""
    rows = report["tables"]["Trade"]
    pairs = list(dict.fromkeys(row["pair"] for row in rows))[:2]
    classes = list(dict.fromkeys(row["class"] for row in rows))
    curves = list(dict.fromkeys(row["curve"] for row in rows))
    colours = plt.get_cmap("tab20").colors
    figure, axes = plt.subplots(len(pairs), len(classes), squeeze=False,
                                figsize=(4 * len(classes), 4.2 * len(pairs)))
    for axis_row, pair in zip(axes, pairs):
        for axis, c in zip(axis_row, classes):
            for i, curve in enumerate(curves):
                mine = [row for row in rows
                        if (row["pair"], row["class"], row["curve"]) == (pair, c, curve)]
                if not mine:
                    continue
                colour = colours[i % len(colours)]
                if "error median %" not in mine[0]:
                    axis.axvline(mine[0]["median us"], color=colour, linestyle=":", label=curve)
                    continue
                style = {"matched": "o-", "inner": "v--", "SDF voxel sum": "s-", "exact": "*",
                         "Manifold boolean": "P"}.get(curve, ".-")
                # Errors below 1e-5 %, those of exact volumes, are at the lower edge.
                points = [(row["median us"], max(row["error median %"], 1e-5)) for row in mine]
                axis.loglog(*zip(*points), style, color=colour, label=curve,
                            markersize=11 if style in "*P" else 5)
                if curve == "matched":
                    for row, point in zip(mine, points):
                        axis.annotate(f" {int(row['setting']):,}", point, fontsize=6)
                front = [p for row, p in zip(mine, points) if row["on the front"]]
                if front:
                    axis.loglog(*zip(*front), "o", markersize=10, markerfacecolor="none",
                                markeredgecolor="black", markeredgewidth=0.8)
            axis.set(title=f"{pair}: {c}")
            axis.grid(True, which="major", alpha=0.3)
        axis_row[0].set_ylabel("error of the volume, median, %")
    for axis in axes[-1]:
        axis.set_xlabel("µs, median")
    handles = {label: handle for axis in axes.flat
               for handle, label in zip(*axis.get_legend_handles_labels())}
    figure.legend(handles.values(), handles.keys(), ncol=4, fontsize=8, loc="upper center",
                  bbox_to_anchor=(0.5, 0.0))
    figure.tight_layout()
    figure.savefig(path, dpi=100, bbox_inches="tight")
    plt.close(figure)
