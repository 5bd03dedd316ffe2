"""Solids with features, planned and verified: what comes of each model and strategy.

    python3 benches/solids.py [CORPUS] [--command CLAYMILL] [--strategies planar,scallop,auto] [--only TEXT]
    python3 benches/solids.py [CORPUS] --material aluminium [--folders mfcad] [--every 12]

Every file in CORPUS/solids and CORPUS/nist is planned with a ball of about a sixtieth of its longest side and a scallop
height of a sixtieth of the radius, or with a whole job for a material; --every 12 takes one file of twelve. A row tells the
verdict, the findings that are errors, and the time. Exit code 1 where a plan fails without a finding that names the reason.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import occ

BALLS_MM = [0.05, 0.1, 0.2, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12.5, 16, 20]
LONGEST_S = 900
# Passes are exact to this scallop height.
FINEST_MM = 0.001


def size_mm(command, model):
    told = subprocess.run([command, "inspect", model, "--json", "--quiet"], capture_output=True, text=True)
    if told.returncode != 0:
        return None
    box = json.loads(told.stdout)["box_mm"]
    return max(box[k + 3] - box[k] for k in range(3))


def finishing(radius, strategy):
    return ["--tool", f"ball:{radius}", "--scallop", f"{max(radius / 60, FINEST_MM):.4g}", "--strategy", strategy]


def row(command, model, options, environment):
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "job"
        plan = [command, "plan", model, "-o", job, *options, "--no-store", "--quiet"]
        began = time.monotonic()
        try:
            ran = subprocess.run([str(p) for p in plan], capture_output=True, text=True, env=environment, timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            return "no end", [f"more than {LONGEST_S} s"], LONGEST_S
        seconds = time.monotonic() - began
        verdict = job / "verify.json"
        if not verdict.exists():
            return "not planned", [(ran.stderr.strip().splitlines() or ["no message"])[0]], seconds
        found = json.loads(verdict.read_text())["verdict"]
        errors = [f"{f['code']}: {f['message']}" for f in found["findings"] if f["severity"] == "error"]
        return "PASSED" if found["passed"] else "not passed", errors, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", nargs="?")
    parser.add_argument("--command", type=Path, default=occ.ROOT / "target" / "dist" / "claymill")
    parser.add_argument("--strategies", default="planar,scallop,auto")
    parser.add_argument("--only", default="")
    parser.add_argument("--folders", default="solids,nist")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--material")
    arguments = parser.parse_args()
    folder = occ.corpus([arguments.corpus] if arguments.corpus else [])
    command = arguments.command.resolve()
    # Without a Vulkan driver there are no pictures, which take as long as a small plan.
    environment = os.environ | {"VK_DRIVER_FILES": "/nonexistent"}
    models = sorted(f for part in arguments.folders.split(",") for f in (folder / part).iterdir() if f.suffix != ".json")
    models = models[:: arguments.every]
    passed = total = unnamed = 0
    for model in models:
        if arguments.only not in model.name:
            continue
        size = size_mm(command, model)
        if size is None:
            print(f"{model.name}: cannot be read", flush=True)
            unnamed += 1
            continue
        radius = min(BALLS_MM, key=lambda r: abs(r - size / 60))
        if arguments.material:
            jobs = {f"{arguments.material} job": ["--material", arguments.material]}
        else:
            jobs = {f"{s:8} ball {radius:<5g}": finishing(radius, s) for s in arguments.strategies.split(",")}
        for job, options in jobs.items():
            verdict, errors, seconds = row(command, model, options, environment)
            total += 1
            passed += verdict == "PASSED"
            unnamed += verdict != "PASSED" and not errors
            why = "; ".join(errors)
            print(f"{model.name:34} {job} {verdict:11} {seconds:6.1f} s  {why}", flush=True)
    print(f"{passed} of {total} passed")
    sys.exit(1 if unnamed else 0)


if __name__ == "__main__":
    main()
