#!/usr/bin/env python3
"""CPU time and peak memory of reading the two largest models: claymill's readers against Open CASCADE's.

    python3 benches/readers.py [CORPUS]

Makes a virtual environment under target/ with cadquery-ocp 7.9.3.1.1 from PyPI (once), builds the example `read` of
claymill-exchange, and runs each reader in a process of its own, best of three. Exits with 1 when claymill takes more
than a fifth of Open CASCADE's CPU time or more memory.
"""

import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = ROOT / "target" / "bench-venv"
OCP = "cadquery-ocp==7.9.3.1.1"
MODELS = ["sports_car_25200.igs", "sports_car_6300_sewn.stp"]
RUNS = 3
BAR = 0.2

OCC = """
import sys
from OCP.IFSelect import IFSelect_RetDone
from OCP.TopExp import TopExp
from OCP.TopAbs import TopAbs_FACE
from OCP.TopTools import TopTools_IndexedMapOfShape
if sys.argv[1].endswith(".stp"):
    from OCP.STEPControl import STEPControl_Reader as Reader
else:
    from OCP.IGESControl import IGESControl_Reader as Reader
reader = Reader()
assert reader.ReadFile(sys.argv[1]) == IFSelect_RetDone
reader.TransferRoots()
faces = TopTools_IndexedMapOfShape()
TopExp.MapShapes_s(reader.OneShape(), TopAbs_FACE, faces)
print(faces.Extent(), "faces")
"""


def measured(command):
    """CPU seconds (user and system, all threads) and peak resident MiB of a command, least of the runs."""
    best = None
    for _ in range(RUNS):
        with open(os.devnull, "w") as nothing:
            process = subprocess.Popen(command, stdout=nothing)
            _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            sys.exit(f"{' '.join(map(str, command))}: exit status {status}")
        run = (usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)
        best = run if best is None else tuple(map(min, best, run))
    return best


def main():
    corpus = Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("CLAYMILL_CORPUS", ROOT / "../shared/corpus"))
    if not corpus.is_dir():
        sys.exit(f"no corpus at {corpus}")
    python = ENVIRONMENT / "bin" / "python"
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", OCP], check=True)
    build = ["cargo", "build", "--release", "--quiet", "-p", "claymill-exchange", "--example", "read"]
    subprocess.run(build, cwd=ROOT, check=True)
    reader = ROOT / "target" / "release" / "examples" / "read"
    start, _ = measured([python, "-c", "import OCP.STEPControl, OCP.IGESControl, OCP.TopExp, OCP.TopTools"])
    print(f"{'model':28} {'OCC s':>8} {'claymill s':>11} {'ratio':>7} {'OCC MiB':>9} {'claymill MiB':>13}")
    passed = True
    for model in MODELS:
        path = corpus / model
        occ_s, occ_mib = measured([python, "-c", OCC, path])
        # Starting Python and loading its libraries is not reading.
        occ_s -= start
        own_s, own_mib = measured([reader, path])
        print(f"{model:28} {occ_s:8.2f} {own_s:11.2f} {own_s / occ_s:7.3f} {occ_mib:9.0f} {own_mib:13.0f}")
        passed &= own_s <= BAR * occ_s and own_mib < occ_mib
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
