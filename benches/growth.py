#!/usr/bin/env python3
"""Time and peak memory of reading files of n and of 10 n patches: both must grow linearly.

    python3 benches/growth.py [PATCHES]

Generates the built-in vehicle as IGES and STEP with PATCHES (5000) and ten times as many, reads each in a process of
its own (the example `read` of claymill-exchange), best of three, and prints CPU time and memory for each patch. Exits
with 1 when a patch of the large file costs more than 1.3 times one of the small.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cost

ROOT = Path(__file__).resolve().parent.parent
BAR = 1.3


def main():
    patches = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    build = ["cargo", "build", "--release", "--quiet"]
    subprocess.run([*build, "-p", "claymill-cli"], cwd=ROOT, check=True)
    subprocess.run([*build, "-p", "claymill-exchange", "--example", "read"], cwd=ROOT, check=True)
    release = ROOT / "target" / "release"
    reader = release / "examples" / "read"
    print(f"{'file':12} {'patches':>8} {'MiB':>7} {'CPU s':>7} {'µs/patch':>9} {'peak MiB':>9} {'KiB/patch':>10}")
    passed = True
    with tempfile.TemporaryDirectory() as folder:
        for kind in ["igs", "stp"]:
            costs = []
            for asked in [patches, 10 * patches]:
                path = Path(folder) / f"n{asked}.{kind}"
                make = [release / "claymill", "--json", "--quiet", "sample", "roadster", "--patches", str(asked), "-o", path]
                totals = subprocess.run(make, check=True, capture_output=True, text=True).stdout
                faces = json.loads(totals)["faces"]
                seconds, mib = cost.least([reader, path])
                size = path.stat().st_size / 2**20
                per_patch = (1e6 * seconds / faces, 1024 * mib / faces)
                costs.append(per_patch)
                print(f"{path.name:12} {faces:8} {size:7.1f} {seconds:7.2f} {per_patch[0]:9.2f} {mib:9.1f} {per_patch[1]:10.2f}")
            growth = [large / small for small, large in zip(*costs)]
            print(f"{kind}: a patch of the large file costs {growth[0]:.2f} times the time and {growth[1]:.2f} times the memory")
            passed &= max(growth) <= BAR
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
