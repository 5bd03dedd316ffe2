"""Whether two builds of claymill plan the same bytes.

    python3 benches/same_bytes.py BEFORE AFTER [CORPUS] [--only NAME] [--strategies planar,scallop,auto]

BEFORE and AFTER are built commands. Each plans a fixed set of jobs, and `toolpaths.jsonl`, `regions.json` and
`verify.json` of both are compared by hash. Hashes are kept in target/same-bytes/ by the command's own hash, so that a
second comparison with the same BEFORE plans only with AFTER. Exit code 1 where anything differs.

A change of structure alone must pass this. A change of behaviour must not be mixed with one.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import occ

FILES = ["toolpaths.jsonl", "regions.json", "verify.json"]
# Name, model (the roadster is generated), options.
JOBS = [
    ("roadster", None, ["--tool", "ball:6", "--up", "+z", "--length=-x"]),
    ("sports car", "sports_car_1399.igs", ["--tool", "ball:10"]),
    ("nose", "race_car_nose_141.stp", ["--tool", "ball:6"]),
    ("helmet", "helmet_928.igs", ["--tool", "ball:6"]),
    ("bottle", "perfume_bottle.3dm", ["--tool", "ball:3"]),
]


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def hashes(command, model, options, strategy):
    """The hash of each file of a job; the exit code takes the place of files that were not written."""
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "job"
        plan = [command, "plan", model, "-o", job, "--scallop", "0.1", "--strategy", strategy, *options]
        # Without a Vulkan driver there are no pictures, which take as long as a small plan.
        environment = os.environ | {"VK_DRIVER_FILES": "/nonexistent"}
        ran = subprocess.run([str(p) for p in plan], capture_output=True, text=True, env=environment)
        return {f: digest(job / f) if (job / f).exists() else f"exit code {ran.returncode}" for f in FILES}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("corpus", nargs="?")
    parser.add_argument("--only")
    parser.add_argument("--strategies", default="planar,scallop,auto")
    arguments = parser.parse_args()
    folder = occ.corpus([arguments.corpus] if arguments.corpus else [])
    kept = occ.ROOT / "target" / "same-bytes"
    kept.mkdir(parents=True, exist_ok=True)
    roadster = kept / "roadster.igs"
    differ = 0
    for name, file, options in JOBS:
        if arguments.only not in (None, name):
            continue
        model = folder / file if file else roadster
        if file is None and not model.exists():
            sample = [arguments.before, "sample", "roadster", "--scale", "0.4", "-o", roadster]
            subprocess.run([str(p) for p in sample], check=True, capture_output=True)
        for strategy in arguments.strategies.split(","):
            found = []
            began = time.monotonic()
            for command in (arguments.before.resolve(), arguments.after.resolve()):
                told = kept / f"{digest(command)[:16]}.json"
                known = json.loads(told.read_text()) if told.exists() else {}
                key = f"{name} {strategy} {digest(model)[:16]} {' '.join(options)}"
                if key not in known:
                    known[key] = hashes(command, model, options, strategy)
                    told.write_text(json.dumps(known, indent=1))
                found.append(known[key])
            changed = [f for f in FILES if found[0][f] != found[1][f] or len(found[0][f]) != 64]
            differ += bool(changed)
            says = "same" if not changed else "DIFFERS: " + ", ".join(changed)
            print(f"{name:12} {strategy:8} {time.monotonic() - began:6.1f} s  {says}", flush=True)
    sys.exit(1 if differ else 0)


if __name__ == "__main__":
    main()
