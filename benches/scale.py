#!/usr/bin/env python3
"""What ten thousand models a night would take: measured for one vehicle and a variant of it, and multiplied out.

    python3 benches/scale.py [target/release/claymill]

Prints the two tables that docs/scale.md speaks of. Only Python's own library is needed.
"""

import os
import sys
import tempfile
from pathlib import Path

import cost

JOB = ["--tool", "ball:10", "--scallop", "0.5", "--quiet"]
MODELS, VARIANTS, HOURS = 10_000, 20, 10.0


def size_mb(folder):
    return sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / 1e6


def main():
    program = str(Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/claymill").resolve())
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        os.chdir(folder)
        # Pictures are no part of the question.
        os.environ["WGPU_ADAPTER_NAME"] = "none"
        cost.measured([program, "sample", "roadster", "-o", "first.igs", "--quiet"])
        cost.measured([program, "sample", "roadster", "--edit=2", "-o", "variant.igs", "--quiet"])
        rows = []
        before_mb = 0.0
        for name, model in (("first", "first"), ("again", "first"), ("variant", "variant")):
            seconds, peak_mib, _ = cost.measured([program, "plan", f"{model}.igs", *JOB, "--store", "store", "-o", name])
            now_mb = size_mb(folder / "store")
            rows.append((name, seconds, now_mb - before_mb, size_mb(folder / name), peak_mib))
            before_mb = now_mb
        print("| plan | CPU time | added to the store | job folder | memory |\n|---|---|---|---|---|")
        names = {"first": "first of a vehicle", "again": "the same again", "variant": "one with a wing moved by 2 mm"}
        for name, seconds, store_mb, job_mb, peak_mib in rows:
            print(f"| {names[name]} | {seconds:.0f} s | {store_mb:.1f} MB | {job_mb:.1f} MB | {peak_mib / 1024:.1f} GiB |")
        first, _, variant = rows
        vehicles = MODELS // VARIANTS
        others = MODELS - vehicles
        cpu_h = (vehicles * first[1] + others * variant[1]) / 3600
        alone_h = MODELS * first[1] / 3600
        print(f"\n| {MODELS} models a night: {vehicles} vehicles with {VARIANTS} variants each | with a store | without |\n|---|---|---|")
        print(f"| CPU time | {cpu_h:.0f} h | {alone_h:.0f} h |")
        print(f"| cores for {HOURS:.0f} hours | {cpu_h / HOURS:.0f} | {alone_h / HOURS:.0f} |")
        memory = first[4] / 1024
        print(f"| memory, two cores a plan | {cpu_h / HOURS / 2 * memory:.0f} GiB | {alone_h / HOURS / 2 * memory:.0f} GiB |")
        print(f"| store | {(vehicles * first[2] + others * variant[2]) / 1e3:.0f} GB | none |")
        print(f"| job folders | {(vehicles * first[3] + others * variant[3]) / 1e3:.0f} GB | {MODELS * first[3] / 1e3:.0f} GB |")


if __name__ == "__main__":
    main()
