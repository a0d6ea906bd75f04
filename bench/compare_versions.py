#!/usr/bin/python3
"""Compares two versions of the program: the same rays by both in turn, whose hits must be equal.

    compare_versions.py OLD/packet NEW/packet SCENE.glb RAYS.npy [SCENE.glb RAYS.npy ...]
        [--query any] [--mode auto] [--quality high] [--threads 1] [--width 0] [--rounds 7]

Prints Mrays/s of both, medians, and the ratio: the median of those of runs that follow each other,
so that a machine that changes its speed does so for both.
"""

import argparse
import filecmp
import json
import subprocess
import sys
import tempfile
from math import prod
from pathlib import Path
from statistics import median


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("scenes_and_rays", type=Path, nargs="+", metavar="SCENE RAYS")
    parser.add_argument("--query", default="closest")
    parser.add_argument("--mode", default="auto")
    parser.add_argument("--quality", default="high")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--width", type=int, default=0)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    if len(options.scenes_and_rays) % 2 != 0:
        parser.error("each scene needs its rays")
    return options


def trace(program, scene, rays, hits, options):
    """Mrays/s, the median of a few runs."""
    done = subprocess.run(
        [program, "trace", scene, rays, "-o", hits, "--flatten", "--json", "--repeat", "7",
         "--query", options.query, "--mode", options.mode, "--quality", options.quality,
         "--threads", str(options.threads), "--width", str(options.width)],
        capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{program}: {done.stderr.strip()}")
    return json.loads(done.stdout)["trace"]["mrays_per_s"]


def compare(scene, rays, options, folder):
    """The ratio of the speeds, after a line that shows it."""
    programs = {"old": options.old, "new": options.new}
    speeds = {name: [] for name in programs}
    for _ in range(options.rounds):
        for name, program in programs.items():
            speeds[name].append(trace(program, scene, rays, folder / name, options))
        if not filecmp.cmp(folder / "old", folder / "new", shallow=False):
            sys.exit(f"{scene}, {rays}: the hits differ")
    ratio = median(new / old for old, new in zip(speeds["old"], speeds["new"]))
    print(f"| {scene.stem} | {rays.stem} | {median(speeds['old']):.2f} | "
          f"{median(speeds['new']):.2f} | {ratio:.3f} |", flush=True)
    return ratio


def main():
    options = parse_options()
    print("| scene | rays | old | new | new / old |\n| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        pairs = zip(options.scenes_and_rays[::2], options.scenes_and_rays[1::2])
        ratios = [compare(scene, rays, options, Path(folder)) for scene, rays in pairs]
    print(f"\nMean {prod(ratios) ** (1 / len(ratios)):.3f}")


if __name__ == "__main__":
    main()
