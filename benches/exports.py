#!/usr/bin/env python3
"""Whether solids come back from the files that Open CASCADE (and so FreeCAD, CadQuery and others) writes.

    python3 benches/exports.py [PAIRS]

Makes the virtual environment of readers.py, then whole and cut primitives, NURBS made of them, fillets, and PAIRS
(40) of primitives joined, cut and intersected at places drawn by a fixed seed. Each is written as STEP (AP203, AP214,
AP242) and as IGES (faces, faces in inches, B-rep); `claymill inspect` must find the area of Open CASCADE's own mesh in
every one of them, to within what the mesh's chords take. Exits with 1 when any is missed; names each.
"""

import json
import subprocess
import sys
import tempfile

import occ

# The mesh is off by its chords, by this share and on the smallest solids by some more; claymill's areas are exact.
CHORDS = 2e-3
CHORDS_MM2 = 1.0

SOLIDS = r'''
import math, random, sys
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert, BRepBuilderAPI_Transform
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepPrimAPI import (BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakeSphere, BRepPrimAPI_MakeTorus)
from OCP.BRep import BRep_Tool
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.TopTools import TopTools_IndexedMapOfShape
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

def parts(shape, kind):
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(i + 1) for i in range(found.Extent())]

def area(shape):
    BRepMesh_IncrementalMesh(shape, 0.02, False, 0.1, True)
    total = 0.0
    for face in parts(shape, TopAbs_FACE):
        mesh = BRep_Tool.Triangulation_s(TopoDS.Face_s(face), TopLoc_Location())
        if mesh is None:
            return None
        for i in range(mesh.NbTriangles()):
            a, b, c = (mesh.Node(k) for k in mesh.Triangle(i + 1).Get())
            total += 0.5 * gp_Vec(a, b).Crossed(gp_Vec(a, c)).Magnitude()
    return total

def filleted(shape, radius):
    fillet = BRepFilletAPI_MakeFillet(shape)
    for edge in parts(shape, TopAbs_EDGE):
        fillet.Add(radius, TopoDS.Edge_s(edge))
    return fillet.Shape()

def nurbs(shape):
    return BRepBuilderAPI_NurbsConvert(shape, True).Shape()

def moved(shape, x, y, z, axis=(0, 0, 1), deg=0.0):
    turn, shift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(*axis)), math.radians(deg))
    shift.SetTranslation(gp_Vec(x, y, z))
    return BRepBuilderAPI_Transform(shape, shift.Multiplied(turn), True).Shape()

aslant = gp_Ax2(gp_Pnt(10, 20, 30), gp_Dir(1, 2, 3), gp_Dir(2, -1, 0))
cylinder = lambda r, h: BRepPrimAPI_MakeCylinder(r, h).Shape()
sphere = lambda r: BRepPrimAPI_MakeSphere(r).Shape()
torus = lambda a, b: BRepPrimAPI_MakeTorus(a, b).Shape()
cone = lambda a, b, h: BRepPrimAPI_MakeCone(a, b, h).Shape()
box = lambda a, b, c: BRepPrimAPI_MakeBox(a, b, c).Shape()
fuse = lambda a, b: BRepAlgoAPI_Fuse(a, b).Shape()
cut = lambda a, b: BRepAlgoAPI_Cut(a, b).Shape()
common = lambda a, b: BRepAlgoAPI_Common(a, b).Shape()

makers = {
    "sphere": lambda: sphere(50),
    "hemisphere": lambda: BRepPrimAPI_MakeSphere(aslant, 50, 0, math.pi / 2).Shape(),
    "sphere_zone": lambda: BRepPrimAPI_MakeSphere(aslant, 50, -0.5, 0.7, 2.1).Shape(),
    "torus": lambda: BRepPrimAPI_MakeTorus(aslant, 60, 20).Shape(),
    "torus_part": lambda: BRepPrimAPI_MakeTorus(aslant, 60, 20, 0.3, 2.5, 4.0).Shape(),
    "cone_to_apex": lambda: BRepPrimAPI_MakeCone(aslant, 40, 0, 70).Shape(),
    "cone_part": lambda: BRepPrimAPI_MakeCone(aslant, 40, 10, 70, 4.5).Shape(),
    "cylinder_part": lambda: BRepPrimAPI_MakeCylinder(aslant, 40, 70, 5.5).Shape(),
    "sphere_halved": lambda: cut(sphere(50), moved(box(100, 100, 100), 10, -50, -50)),
    "sphere_drilled": lambda: cut(sphere(50), moved(cylinder(15, 200), 0, 0, -100)),
    "sphere_drilled_aside": lambda: cut(sphere(50), moved(cylinder(15, 200), 20, 0, -100)),
    "torus_cut": lambda: cut(torus(60, 20), moved(box(50, 200, 100), 30, -100, -50)),
    "torus_drilled": lambda: cut(torus(60, 20), moved(cylinder(8, 300), 60, 0, -100)),
    "torus_and_post": lambda: fuse(torus(60, 20), moved(cylinder(30, 60), 60, 0, -30)),
    "cone_drilled": lambda: cut(cone(40, 0, 70), moved(cylinder(10, 200), 0, 100, 30, (1, 0, 0), 90)),
    "cone_quartered": lambda: cut(cone(40, 0, 70), box(100, 100, 100)),
    "cross": lambda: fuse(moved(cylinder(20, 100), 0, 0, -50), moved(cylinder(12, 100), 0, 30, -25, (1, 0, 0), 60)),
    "stepped_filleted": lambda: filleted(fuse(cylinder(30, 50), moved(cylinder(15, 60), 0, 0, 40)), 4),
    "tee_filleted": lambda: filleted(fuse(moved(cylinder(20, 120), 0, 0, -60),
        moved(cylinder(12, 120), 0, 0, 0, (1, 0, 0), 90)), 3),
    "box_filleted": lambda: filleted(box(120, 100, 60), 12),
}
for name in ("sphere", "torus", "cone_to_apex", "sphere_drilled", "torus_and_post", "cross"):
    makers["nurbs_" + name] = lambda name=name: nurbs(makers[name]())

def pair(seed):
    r = random.Random(seed)
    def primitive():
        a, b, c = (r.uniform(15, 50) for _ in range(3))
        shape = r.choice([lambda: sphere(a), lambda: cylinder(a, 2 * b), lambda: cone(a, 0.3 * b, 1.5 * c),
            lambda: torus(a + 25, 0.4 * b + 4), lambda: box(2 * a, 2 * b, 2 * c)])()
        axis = [r.gauss(0, 1) for _ in range(3)]
        return moved(shape, *(r.uniform(-30, 30) for _ in range(3)), axis, r.uniform(0, 360))
    return r.choice([fuse, cut, common])(primitive(), primitive())

for seed in range(int(sys.argv[2])):
    makers["pair_%d" % seed] = lambda seed=seed: pair(seed)

for name, make in makers.items():
    try:
        shape = make()
        if not parts(shape, TopAbs_FACE) or not BRepCheck_Analyzer(shape).IsValid():
            continue
        mm2 = area(shape)
    except Exception:
        continue
    if mm2 is None:
        continue
    files = []
    for schema in ("AP203", "AP214IS", "AP242DIS"):
        Interface_Static.SetCVal_s("write.step.schema", schema)
        files.append("%s/%s_%s.stp" % (sys.argv[1], name, schema))
        writer = STEPControl_Writer()
        writer.Transfer(shape, STEPControl_AsIs)
        writer.Write(files[-1])
    for kind, unit, brep in (("faces", "MM", 0), ("faces_in", "IN", 0), ("brep", "MM", 1)):
        files.append("%s/%s_%s.igs" % (sys.argv[1], name, kind))
        writer = IGESControl_Writer(unit, brep)
        writer.AddShape(shape)
        writer.ComputeModel()
        writer.Write(files[-1])
    print("solid", name, repr(mm2), *files)
'''


def main():
    pairs = sys.argv[1] if len(sys.argv) > 1 else "40"
    build = ["cargo", "build", "--release", "--quiet", "-p", "claymill-cli", "--no-default-features"]
    subprocess.run(build, cwd=occ.ROOT, check=True)
    claymill = occ.ROOT / "target" / "release" / "claymill"
    solids = files = missed = 0
    with tempfile.TemporaryDirectory() as folder:
        made = subprocess.run([occ.python(), "-c", SOLIDS, folder, pairs], capture_output=True, text=True, check=True)
        for line in made.stdout.splitlines():
            if not line.startswith("solid "):
                continue
            _, name, mm2, *written = line.split()
            solids += 1
            for path in written:
                files += 1
                read = subprocess.run([claymill, "inspect", path, "--json"], capture_output=True, text=True)
                found = json.loads(read.stdout)["area_mm2"] if read.returncode == 0 else None
                if found is None or not abs(found - float(mm2)) <= CHORDS * float(mm2) + CHORDS_MM2:
                    missed += 1
                    why = read.stderr.strip().splitlines()
                    print(f"{path.rsplit('/', 1)[1]:40} {float(mm2):12.2f} mm², read {found}", *why[:1])
    print(f"{files - missed} of {files} files of {solids} solids came back whole")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
