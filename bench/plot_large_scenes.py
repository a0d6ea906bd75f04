#!/usr/bin/python3
"""Turns what packet_large measured into a picture, and prints tables in Markdown that show it.

    plot_large_scenes.py RESULTS.csv FOLDER
"""

import csv
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display
import matplotlib.pyplot as plt

MODES = ["single", "stream", "treelet", "Embree"]
COLORS = dict(zip(MODES, ["C0", "C4", "C3", "C7"]))


def cache_bytes():
    """Of the last level, where this is drawn; 0 if unknown."""
    known = subprocess.run(["getconf", "LEVEL3_CACHE_SIZE"], capture_output=True, text=True,
                           check=False)
    return int(known.stdout.strip() or 0) if known.returncode == 0 else 0


def read(path):
    """Speeds by scene, rays and threads, then by mode, as lists of (bytes, triangles, Mrays/s)."""
    results = defaultdict(lambda: defaultdict(list))
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            results[row["scene"], row["rays"], int(row["threads"])][row["mode"]].append(
                (int(row["bytes"]), int(row["triangles"]), float(row["mrays_per_s"])))
    return results


def crossover(lines):
    """The bytes from which on treelets are faster than single rays and streams, or None."""
    sizes = sorted(zip(lines["treelet"], lines["single"], lines["stream"]))
    first = None
    for treelet, single, stream in sizes:
        wins = treelet[2] > max(single[2], stream[2])
        first = (first or treelet[0]) if wins else None
    return first


def print_tables(results):
    print("| scene | rays | threads | triangles | MB |", " | ".join([*MODES, "auto"]),
          "| treelet / best other |")
    print("| --- " * (7 + len(MODES)) + "|")
    for (scene, rays, threads), lines in results.items():
        for i, (size, triangles, _) in enumerate(lines["single"]):
            speeds = {mode: lines[mode][i][2] for mode in [*MODES, "auto"]}
            best = max(speed for mode, speed in speeds.items() if mode not in ("treelet", "auto"))
            print(f"| {scene} | {rays} | {threads} | {triangles} | {size / 1e6:.0f} |",
                  " | ".join(f"{s:.2f}" for s in speeds.values()),
                  f"| {speeds['treelet'] / best:.2f} |")
    print()
    for (scene, rays, threads), lines in results.items():
        size = crossover(lines)
        where = f"from {size / 1e6:.0f} MB on" if size else "never"
        print(f"- {scene}, {rays}, {threads} thread(s): ahead of single and stream {where}")


def plot(results, folder):
    cache = cache_bytes()
    columns = list(dict.fromkeys((rays, threads) for _, rays, threads in results))
    scenes = list(dict.fromkeys(scene for scene, _, _ in results))
    figure, axes = plt.subplots(len(scenes), len(columns), squeeze=False, sharex=True,
                                figsize=(3.6 * len(columns), 2.8 * len(scenes)))
    for (scene, rays, threads), lines in results.items():
        axis = axes[scenes.index(scene)][columns.index((rays, threads))]
        for mode in MODES:
            axis.plot([point[0] / 1e6 for point in lines[mode]], [point[2] for point in lines[mode]],
                      marker=".", label=mode, color=COLORS[mode])
        if cache > 0:
            axis.axvline(cache / 1e6, color="black", linestyle=":", linewidth=1)
        axis.set_xscale("log")
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
        axis.set_title(f"{scene}, {rays}, {threads} thread{'s' * (threads > 1)}", fontsize=10)
    for axis in axes[:, 0]:
        axis.set_ylabel("Mrays/s")
    for axis in axes[-1]:
        axis.set_xlabel("MB of the scene's tree")
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "large-scenes.png", dpi=80)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    results = read(sys.argv[1])
    print_tables(results)
    plot(results, folder)


main()
