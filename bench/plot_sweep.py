#!/usr/bin/python3
"""Turns what packet_micro measured into pictures, and prints tables in Markdown that show them.

    plot_sweep.py RESULTS.json FOLDER
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display
import matplotlib.pyplot as plt

MODES = ["single", "packet8", "packet16", "tile", "stream", "auto"]
ISAS = ["scalar", "sse42", "avx2", "avx512"]
SWEEPS = [
    ("angle", "angle to the group's axis, degrees"),
    ("origin", "distance to the group's origin, % of the diagonal"),
    ("order", "order of a camera's pixels in memory"),
    ("bounce", "bounces"),
]
COLORS = dict(zip(MODES + ISAS, ["C0", "C1", "C2", "C3", "C4", "black", "C7", "C0", "C1", "C2"]))


def read(path):
    """Results by the parts of their names; those that this CPU cannot run are left out."""
    runs = json.loads(Path(path).read_text())["benchmarks"]
    return {tuple(r["name"].split("/")): r for r in runs if not r.get("error_occurred")}


def print_table(titles, rows):
    for cells in [titles, ["---"] * len(titles), *rows]:
        print("| " + " | ".join(cells) + " |")
    print()


def three_digits(value):
    return f"{value:.{0 if value >= 99.5 else 1 if value >= 9.95 else 2}f}"


def save(figure, folder, name):
    figure.tight_layout()
    figure.savefig(folder / name, dpi=80)
    print(f"![{name}](images/{name})\n")


def rate(run):
    """In millions a second."""
    return next(run[key] for key in ("rays/s", "tests/s", "boxes/s") if key in run) / 1e6


def plot_steps(results, folder):
    """Box, triangle and overlap tests, by how many at once and instruction set."""
    steps = defaultdict(dict)
    for name, run in results.items():
        if name[0] in ("box", "triangle", "overlap"):
            steps["/".join(name[:-1])][name[-1]] = rate(run)
    print("Million tests a second, of RAYS x ITEMS (overlap: of triangles with so many boxes)\n")
    print_table(["test", *ISAS], [[step, *(three_digits(by[isa]) if isa in by else "" for isa in ISAS)]
                                  for step, by in steps.items()])
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), width_ratios=[6, 5, 4])
    for axis, test in zip(axes, ("box", "triangle", "overlap")):
        names = [step for step in steps if step.startswith(test)]
        for i, isa in enumerate(ISAS):
            places = [k + (i - 1.5) * 0.2 for k in range(len(names))]
            axis.bar(places, [steps[n].get(isa, 0) for n in names], 0.2, label=isa, color=COLORS[isa])
        axis.set_xticks(range(len(names)), [n.split("/", 1)[1].replace("mixed", "\nmixed") for n in names])
        axis.set_title(f"{test} tests, million/s")
    axes[0].legend()
    save(figure, folder, "sweep-steps.png")


def plot_walks(results, folder):
    """Every walk on every structure."""
    walks = [name for name in results if name[0] == "walk"]
    structures = list(dict.fromkeys(name[1] for name in walks))
    kinds = list(dict.fromkeys(name[2] for name in walks))
    figure, axes = plt.subplots(1, len(kinds), figsize=(11, 4.2))
    print("Mrays/s of every walk on every structure\n")
    table = [[s] for s in structures]
    for axis, kind in zip(axes, kinds):
        values = [[rate(results["walk", s, kind, m]) for m in MODES] for s in structures]
        axis.imshow(values, aspect="auto", cmap="Blues", vmin=0, vmax=1.4 * max(map(max, values)))
        for y, row in enumerate(values):
            table[y] += map(three_digits, row)
            for x, value in enumerate(row):
                axis.text(x, y, three_digits(value), ha="center", va="center")
        axis.set_xticks(range(len(MODES)), MODES)
        axis.set_yticks(range(len(structures)), structures)
        axis.set_title(f"{kind} rays, Mrays/s")
    print_table(["structure", *(f"{k} {m}" for k in kinds for m in MODES)], table)
    save(figure, folder, "sweep-walks.png")


def plot_sweeps(results, folder):
    """Speed, use of lanes and work, from coherent rays to others."""
    rows = [("Mrays/s", rate), ("share of lanes used", lambda run: run["lanes_used"]),
            ("nodes a ray", lambda run: run["nodes/ray"]),
            ("triangles a ray", lambda run: run["triangles/ray"])]
    figure, axes = plt.subplots(len(rows), len(SWEEPS), figsize=(15, 12), sharex="col")
    for column, (sweep, title) in enumerate(SWEEPS):
        values = list(dict.fromkeys(name[1] for name in results if name[0] == sweep))
        print(f"Mrays/s, and the share of lanes used, by {title}\n")
        print_table([sweep, *MODES], [
            [v, *(f"{three_digits(rate(r))} ({r['lanes_used']:.2f})"
                  for r in (results[sweep, v, m] for m in MODES))] for v in values])
        for axis, (name, measure) in zip(axes[:, column], rows):
            for mode in MODES:
                axis.plot(values, [measure(results[sweep, v, mode]) for v in values], marker=".",
                          label=mode, color=COLORS[mode], linestyle=":" if mode == "auto" else "-")
            axis.set_ylabel(name if column == 0 else "")
            if measure is rate:
                axis.set_yscale("log")
                axis.set_ylim(1, 200)
                axis.yaxis.set_major_formatter("{x:.0f}")
            else:
                axis.set_ylim(bottom=0)
            axis.grid(alpha=0.3)
        axis.set_xlabel(title)
    axes[0, 0].legend()
    save(figure, folder, "sweep-coherence.png")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    results = read(sys.argv[1])
    plot_steps(results, folder)
    plot_walks(results, folder)
    plot_sweeps(results, folder)


main()
