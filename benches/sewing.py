#!/usr/bin/env python3
"""CPU time and peak memory of sewing a model and classing every joint: claymill against Open CASCADE.

    python3 benches/sewing.py [CORPUS [MODEL …]]

Open CASCADE sews (BRepBuilderAPI_Sewing, tolerance as claymill finds it for these models) and asks
LocalAnalysis_SurfaceContinuity at the middle of every shared edge; claymill measures gap, angle and curvature along
the whole of every joint and grows the regions. Reading the file is timed apart and left out on both sides. Shares the
virtual environment of readers.py (cadquery-ocp from PyPI); the calls from Python, a few for each edge, count as
Open CASCADE's. One run each. Exits with 1 when claymill takes more than a third of Open CASCADE's CPU time on the
largest model, or more memory on any.
"""

import json
import sys

import cost
import occ

MODELS = ["sports_car_1399.igs", "sports_car_6300.igs", "sports_car_25200.igs"]
LARGEST = "sports_car_25200.igs"
BAR = 1 / 3

OCC = """
import json, resource, sys, time
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.GeomAbs import GeomAbs_G2
from OCP.IGESControl import IGESControl_Reader
from OCP.LocalAnalysis import LocalAnalysis_SurfaceContinuity
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape
from OCP.TopoDS import TopoDS

reader = IGESControl_Reader()
reader.ReadFile(sys.argv[1])
reader.TransferRoots()
shape = reader.OneShape()

start = time.process_time()
sewing = BRepBuilderAPI_Sewing(0.02)
sewing.Add(shape)
sewing.Perform()
sewn = sewing.SewedShape()
sew_s = time.process_time() - start

start = time.process_time()
faces = TopTools_IndexedDataMapOfShapeListOfShape()
TopExp.MapShapesAndAncestors_s(sewn, TopAbs_EDGE, TopAbs_FACE, faces)
classes = {"C0": 0, "G1": 0, "G2": 0, "failed": 0}
for i in range(1, faces.Extent() + 1):
    both = list(faces.FindFromIndex(i))
    if len(both) != 2:
        continue
    edge = TopoDS.Edge_s(faces.FindKey(i))
    first, second = (TopoDS.Face_s(face) for face in both)
    c1 = BRep_Tool.CurveOnSurface_s(edge, first, 0.0, 0.0)
    c2 = BRep_Tool.CurveOnSurface_s(edge, second, 0.0, 0.0)
    middle = 0.5 * sum(BRep_Tool.Range_s(edge))
    found = LocalAnalysis_SurfaceContinuity(
        c1, c2, middle, BRep_Tool.Surface_s(first), BRep_Tool.Surface_s(second), GeomAbs_G2,
        0.001, 0.02, 0.001, 0.001, 0.00873, 0.1)
    if not found.IsDone():
        classes["failed"] += 1
    elif found.IsG2():
        classes["G2"] += 1
    elif found.IsG1():
        classes["G1"] += 1
    else:
        classes["C0"] += 1
judge_s = time.process_time() - start
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"sew": sew_s, "judge": judge_s, "mib": peak, "joints": sum(classes.values()), "classes": classes}))
"""


def main():
    corpus, python = occ.corpus(sys.argv[1:]), occ.python()
    read, count = occ.example("claymill-exchange", "read"), occ.example("claymill-surface-merge", "count")
    print(f"{'model':24} {'OCC sew s':>10} {'judge s':>8} {'joints':>7} {'MiB':>6} "
          f"{'claymill s':>11} {'joints':>7} {'MiB':>6} {'ratio':>7}")
    passed = True
    for model in sys.argv[2:] or MODELS:
        path = corpus / model
        theirs = json.loads(cost.measured([python, "-c", OCC, path])[2].splitlines()[-1])
        reading, _, _ = cost.measured([read, path])
        whole, own_mib, output = cost.measured([count, path])
        own, joints = whole - reading, int(output.split()[0])
        ratio = own / (theirs["sew"] + theirs["judge"])
        print(f"{model:24} {theirs['sew']:10.2f} {theirs['judge']:8.2f} {theirs['joints']:7} {theirs['mib']:6.0f} "
              f"{own:11.2f} {joints:7} {own_mib:6.0f} {ratio:7.3f}", flush=True)
        print(f"{'':24} Open CASCADE at mid-points: {theirs['classes']}; claymill: {output.decode().strip()}", flush=True)
        passed &= (model != LARGEST or ratio <= BAR) and own_mib < theirs["mib"]
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
