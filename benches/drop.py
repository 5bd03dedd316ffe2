#!/usr/bin/env python3
"""A ball of 10 mm dropped over a whole car body, rows 2 mm and places 1 mm apart: claymill on the NURBS against
opencamlib on triangles. Rate on one core, accuracy and memory side by side.

    python3 benches/drop.py [CORPUS [MODEL [DEFLECTION_MM]]]

opencamlib (2023.1.11 from PyPI, in the virtual environment of readers.py) drops on a mesh by Open CASCADE with a chord
error of 0.01 mm, on one thread, on every two-hundredth of the same rows. Rates where contacts are certified and elsewhere
are of a second pass, once that is known. CPU seconds of dropping alone; meshing and making the
search trees are told apart. Where the two differ by more than 1 µm, the ball at claymill's height is held against the
surfaces themselves by claymill-nurbs' closest points, which share nothing with the drop but the evaluation. Exits with 1
below a million locations a second, below 500 times opencamlib's rate, or where claymill gouges by more than 1 µm.
"""

import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import cost
import occ

MODEL = "sports_car_body_2720.igs"
PACKAGE = "opencamlib==2023.1.11"
RATE, RATIO, GOUGE_MM = 1e6, 500.0, 1e-3
RADIUS_MM, ROWS_MM, STEP_MM, EVERY = 10.0, 2.0, 1.0, 200

OCL = """
import json, math, resource, struct, sys, time
import opencamlib as ocl
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.IGESControl import IGESControl_Reader
from OCP.StlAPI import StlAPI_Writer

model, places, heights, deflection, radius, stl = sys.argv[1:4] + [float(x) for x in sys.argv[4:6]] + sys.argv[6:7]
reader = IGESControl_Reader()
reader.ReadFile(model)
reader.TransferRoots()
shape = reader.OneShape()
start = time.process_time()
BRepMesh_IncrementalMesh(shape, deflection, False, 0.5, False)
mesh_s = time.process_time() - start
writer = StlAPI_Writer()
writer.ASCIIMode = False
writer.Write(shape, stl)
surface = ocl.STLSurf()
ocl.STLReader(stl, surface)
data = open(places, "rb").read()
cutter = ocl.BallCutter(2 * radius, 200)
dropper = ocl.BatchDropCutter()
start = time.process_time()
dropper.setSTL(surface)
dropper.setCutter(cutter)
dropper.setThreads(1)
tree_s = time.process_time() - start
for x, y in struct.iter_unpack("<dd", data):
    dropper.appendPoint(ocl.CLPoint(x, y, -1e6))
start = time.process_time()
dropper.run()
drop_s = time.process_time() - start
with open(heights, "wb") as out:
    for p in dropper.getCLPoints():
        out.write(struct.pack("<d", p.z + radius))
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"triangles": surface.size(), "mesh_s": mesh_s, "tree_s": tree_s, "drop_s": drop_s, "mib": peak}))
"""


def pairs(output):
    """What an example prints, a key and a value a line."""
    return {k: float(v) for k, v in (line.split() for line in output.decode().splitlines())}


def main():
    arguments = sys.argv[1:]
    model = occ.corpus(arguments) / (arguments[1] if len(arguments) > 1 else MODEL)
    deflection = arguments[2] if len(arguments) > 2 else "0.01"
    python = occ.python()
    subprocess.run([python, "-m", "pip", "install", "--quiet", PACKAGE], check=True)
    drop = occ.example("claymill-contact", "drop")
    with tempfile.TemporaryDirectory() as folder:
        ours, places, heights, mesh, check = (Path(folder) / n for n in ["ours", "places", "heights", "m.stl", "check"])
        command = [drop, model, str(RADIUS_MM), str(ROWS_MM), str(STEP_MM)]
        _, mib, output = cost.measured([*command, "-o", ours])
        own = pairs(output)
        found = list(struct.iter_unpack("<ddd", ours.read_bytes()))
        rows = sorted({y for _, y, _ in found})[::EVERY]
        chosen = [at for at in found if at[1] in set(rows) and at[2] == at[2]]
        places.write_bytes(b"".join(struct.pack("<dd", x, y) for x, y, _ in chosen))
        output = cost.measured([python, "-c", OCL, model, places, heights, deflection, str(RADIUS_MM), mesh])[2]
        other = json.loads(output.splitlines()[-1])
        theirs = [z for (z,) in struct.iter_unpack("<d", heights.read_bytes())]
        # The ball at both heights against the surfaces: gouge (positive) or clearance in mm.
        apart = [(x, y, a, b) for (x, y, a), b in zip(chosen, theirs) if abs(a - b) > GOUGE_MM]
        check.write_bytes(b"".join(struct.pack("<dddddd", x, y, a, x, y, b) for x, y, a, b in apart))
        gouges = [float(g) for g in subprocess.run([drop, model, str(RADIUS_MM), "--gouge", check], check=True,
                                                   stdout=subprocess.PIPE).stdout.split()]
    ratio = own["per_s"] * other["drop_s"] / len(chosen)
    print(f"{'':24}{'claymill':>14}{'opencamlib':>14}")
    print(f"{'locations':24}{own['locations']:14.0f}{len(chosen):14}")
    print(f"{'a second and core':24}{own['per_s']:14.0f}{len(chosen) / other['drop_s']:14.0f}")
    print(f"{'certified share':24}{own['certified'] / own['locations']:14.2f}")
    print(f"{'where certified':24}{own['simple_per_s']:14.0f}")
    print(f"{'elsewhere':24}{own['complex_per_s']:14.0f}")
    print(f"{'gouge at most, µm':24}{max(gouges[::2], default=0) * 1e3:14.2f}{max(gouges[1::2], default=0) * 1e3:14.2f}")
    print(f"{'too high at most, µm':24}{-min(gouges[::2], default=0) * 1e3:14.2f}"
          f"{-min(gouges[1::2], default=0) * 1e3:14.2f}")
    print(f"{'memory, MiB':24}{mib:14.0f}{other['mib']:14.0f}")
    print(f"{'making ready, s':24}{own['covered_s']:14.1f}{other['mesh_s'] + other['tree_s']:14.1f}")
    print(f"{len(apart)} of {len(chosen)} heights differ by more than 1 µm; opencamlib on {other['triangles']} triangles; "
          f"ratio {ratio:.0f}")
    failed = own["per_s"] < RATE or ratio < RATIO or max(gouges[::2], default=0) > GOUGE_MM
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
