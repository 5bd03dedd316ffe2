#!/usr/bin/env python3
"""201 rows over one panel: claymill's dropped ball against Open CASCADE cutting its exact offset surface by planes.

    python3 benches/panel.py

The panel, one bicubic face of 600 by 400 mm with a bulge and a waist, is made and written by Open CASCADE. Its sections by planes
2 mm apart of the surface offset by 10 mm are curves; claymill drops the ball of 10 mm every half millimetre along the same rows and says at
each place what proves it. CPU seconds of cutting and of dropping alone; Open CASCADE's closest points judge how far from 10 mm the
balls of both are from the panel. Exits with 1 where claymill is slower or off by more than Open CASCADE and a nanometre.
"""

import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import cost
import occ

RADIUS_MM, ROWS, STEP_MM, JUDGED = 10.0, 201, 0.5, 2000

OCC = """
import json, math, random, struct, sys, time
from OCP.Geom import Geom_OffsetSurface, Geom_Plane
from OCP.GeomAPI import GeomAPI_IntSS, GeomAPI_PointsToBSplineSurface, GeomAPI_ProjectPointOnSurf
from OCP.GeomAbs import GeomAbs_C2
from OCP.GeomLProp import GeomLProp_SLProps
from OCP.IGESControl import IGESControl_Reader, IGESControl_Writer
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.Interface import Interface_Static
from OCP.TColgp import TColgp_Array2OfPnt
from OCP.TopoDS import TopoDS
from OCP.TopExp import TopExp_Explorer
from OCP.TopAbs import TopAbs_FACE
from OCP.gp import gp_Dir, gp_Pnt

task, model, radius, rows, file, judged = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4]), sys.argv[5], int(sys.argv[6])
if task == "make":
    net = TColgp_Array2OfPnt(1, 13, 1, 9)
    for i in range(13):
        for j in range(9):
            x, y = -300 + 50 * i, -200 + 50 * j
            net.SetValue(i + 1, j + 1, gp_Pnt(x, y, 40 * math.cos(x / 140) * math.cos(y / 160) + 8 * math.sin(x / 60 + y / 90)))
    surface = GeomAPI_PointsToBSplineSurface(net, 3, 3, GeomAbs_C2, 1e-3).Surface()
    face = BRepBuilderAPI_MakeFace(surface, 1e-6).Face()
    Interface_Static.SetIVal_s("write.iges.brep.mode", 0)
    writer = IGESControl_Writer("MM", 0)
    writer.AddShape(face)
    writer.Write(model)
    sys.exit()
reader = IGESControl_Reader()
reader.ReadFile(model)
reader.TransferRoots()
faces = TopExp_Explorer(reader.OneShape(), TopAbs_FACE)
surface = BRep_Tool.Surface_s(TopoDS.Face_s(faces.Current()))
random.seed(1)
def off(points):
    found = []
    for p in points:
        foot = GeomAPI_ProjectPointOnSurf(p, surface)
        if foot.NbPoints():
            found.append(abs(foot.LowerDistance() - radius))
    return max(found), len(found)
if task == "cut":
    u0, u1, v0, v1 = surface.Bounds()
    upward = GeomLProp_SLProps(surface, 0.5 * (u0 + u1), 0.5 * (v0 + v1), 1, 1e-9).Normal().Z() > 0
    start = time.process_time()
    curves = []
    for k in range(rows):
        plane = Geom_Plane(gp_Pnt(0, -200 + 400 * k / (rows - 1), 0), gp_Dir(0, 1, 0))
        cut = GeomAPI_IntSS(Geom_OffsetSurface(surface, radius if upward else -radius), plane, 1e-6)
        curves += [cut.Line(n) for n in range(1, cut.NbLines() + 1)]
    seconds = time.process_time() - start
    share = lambda c: c.Value(c.FirstParameter() + (c.LastParameter() - c.FirstParameter()) * random.random())
    worst, looked = off([share(random.choice(curves)) for _ in range(judged)])
    print(json.dumps({"curves": len(curves), "cpu_s": seconds, "off_mm": worst, "judged": looked}))
else:
    centres = [c for c in struct.iter_unpack("<ddd", open(file, "rb").read()) if c[2] == c[2]]
    # Balls that roll over the rim are not on the offset surface.
    inner = [c for c in centres if abs(c[0]) < 280 and abs(c[1]) < 180]
    worst, looked = off([gp_Pnt(*c) for c in random.sample(inner, judged)])
    print(json.dumps({"off_mm": worst, "judged": looked}))
"""


def main():
    python = occ.python()
    drop = occ.example("claymill-contact", "drop")
    with tempfile.TemporaryDirectory() as folder:
        model, centres = Path(folder) / "panel.igs", Path(folder) / "centres"

        def ask(task):
            command = [python, "-c", OCC, task, model, str(RADIUS_MM), str(ROWS), centres, str(JUDGED)]
            return subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout.decode().strip()

        ask("make")
        cut = json.loads(ask("cut").splitlines()[-1])
        output = cost.measured([drop, model, str(RADIUS_MM), str(400 / (ROWS - 1)), str(STEP_MM), "-o", centres])[2]
        own = {k: float(v) for k, v in (line.split() for line in output.decode().splitlines())}
        judged = json.loads(ask("judge").splitlines()[-1])
    print(f"{'':28}{'claymill':>14}{'Open CASCADE':>14}")
    print(f"{'rows or curves':28}{ROWS:14}{cut['curves']:14}")
    print(f"{'CPU s':28}{own['dropped_cpu_s']:14.3f}{cut['cpu_s']:14.3f}")
    print(f"{'making ready, s':28}{own['covered_s']:14.3f}")
    print(f"{'off at most, nm':28}{judged['off_mm'] * 1e6:14.4f}{cut['off_mm'] * 1e6:14.4f}")
    print(f"{own['locations']:.0f} locations; {judged['judged']} and {cut['judged']} of both judged")
    slower = own["dropped_cpu_s"] + own["covered_s"] > cut["cpu_s"]
    sys.exit(1 if slower or judged["off_mm"] > cut["off_mm"] + 1e-6 else 0)


if __name__ == "__main__":
    main()
