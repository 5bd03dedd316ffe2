#!/usr/bin/env python3
"""Every joint of a model judged twice: by claymill and from Open CASCADE's surfaces, edges and pcurves.

    python3 benches/joints.py [CORPUS [MODEL …]]

Open CASCADE reads the file and sews it (BRepBuilderAPI_Sewing). On every edge with two faces its own Geom_Surface::D2
is asked on both sides at places along the edge; from that follow the angle between the normals and the difference of
the normal curvatures across the edge, by the rule of docs/merging.md: C0 above 0.5°, G1 where the curvatures differ by
more than 10 % of the larger one and more than the file's rounding, else G2. Joints are matched by their ends and length;
an edge that claymill cuts into several joints is matched with all of them.
The classes must agree on every joint whose angle and curvature difference are not within 5 % of a limit on either side;
those that are within, and joints that only one of the two has, are counted and listed with --list.

The midpoint test of LocalAnalysis_SurfaceContinuity is printed beside it: what a judgement in the middle alone says.

Shares the virtual environment of readers.py (cadquery-ocp from PyPI, with numpy). Exits with 1 when a class differs.
"""

import json
import math
import subprocess
import sys
from collections import Counter, defaultdict

import occ

MODELS = ["sports_car_1399.igs", "sports_car_6300.igs", "sports_car_25200.igs"]
ANGLE_DEG = 0.5
NEAR = 0.05
APART_MM = 0.05
LONGEST_CHAIN = 6

OCC = r"""
import json, sys
import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.GeomAbs import GeomAbs_G2
from OCP.IGESControl import IGESControl_Reader
from OCP.LocalAnalysis import LocalAnalysis_SurfaceContinuity
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp
from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape
from OCP.TopoDS import TopoDS
from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec, gp_Vec2d

reader = IGESControl_Reader()
reader.ReadFile(sys.argv[1])
reader.TransferRoots()
sewing = BRepBuilderAPI_Sewing(0.02)
sewing.Add(reader.OneShape())
sewing.Perform()
faces = TopTools_IndexedDataMapOfShapeListOfShape()
TopExp.MapShapesAndAncestors_s(sewing.SewedShape(), TopAbs_EDGE, TopAbs_FACE, faces)

nodes = {n: 0.5 * (np.polynomial.legendre.leggauss(n)[0] + 1.0) for n in (9, 45)}
p, su, sv, suu, svv, suv = gp_Pnt(), gp_Vec(), gp_Vec(), gp_Vec(), gp_Vec(), gp_Vec()
p2, d2 = gp_Pnt2d(), gp_Vec2d()
xyz = lambda v: (v.X(), v.Y(), v.Z())

def jets(surface, pcurve, ts):
    rows = []
    for t in ts:
        pcurve.D1(t, p2, d2)
        surface.D2(p2.X(), p2.Y(), p, su, sv, suu, svv, suv)
        rows.append((xyz(p), xyz(su), xyz(sv), xyz(suu), xyz(suv), xyz(svv), (d2.X(), d2.Y(), 0.0)))
    return np.array(rows)

def normal_curvature(j, n, w):
    s = j[:, 1:3]
    e, f, g = (np.einsum("ij,ij->i", s[:, a], s[:, b]) for a, b in ((0, 0), (0, 1), (1, 1)))
    a, b = (np.einsum("ij,ij->i", s[:, k], w) for k in (0, 1))
    det = e * g - f * f
    x, y = (g * a - f * b) / det, (e * b - f * a) / det
    l, m, k = (np.einsum("ij,ij->i", j[:, c], n) for c in (3, 4, 5))
    return l * x * x + 2 * m * x * y + k * y * y

def spans(edge, surfaces):
    return 45 if any(s.DynamicType().Name() != "Geom_BSplineSurface" or s.NbUKnots() > 2 or s.NbVKnots() > 2
                     for s in surfaces) else 9

for i in range(1, faces.Extent() + 1):
    both = list(faces.FindFromIndex(i))
    edge = TopoDS.Edge_s(faces.FindKey(i))
    if BRep_Tool.Degenerated_s(edge):
        continue
    pair = [TopoDS.Face_s(face) for face in both]
    seam = len(pair) > 0 and all(face.IsSame(pair[0]) for face in pair) and BRep_Tool.IsClosed_s(edge, pair[0])
    if seam:
        pair = [pair[0], pair[0]]
    if len(pair) != 2 or pair[0].IsSame(pair[1]) and not seam:
        continue
    surfaces = [BRep_Tool.Surface_s(face) for face in pair]
    # A seam has two pcurves on one face: the reversed edge has the other one.
    sides = [edge, TopoDS.Edge_s(edge.Reversed()) if seam else edge]
    curves = [BRep_Tool.CurveOnSurface_s(side, face, 0.0, 0.0) for side, face in zip(sides, pair)]
    if any(c is None for c in curves):
        continue
    t0, t1 = BRep_Tool.Range_s(edge)
    ts = t0 + (t1 - t0) * np.concatenate(([0.0], nodes[spans(edge, surfaces)], [1.0]))
    a, b = (jets(s, c, ts) for s, c in zip(surfaces, curves))
    length = float(np.linalg.norm(np.diff(a[:, 0], axis=0), axis=1).sum())
    ends = [a[0, 0].tolist(), a[-1, 0].tolist()]
    a, b = a[1:-1], b[1:-1]
    na, nb = (np.cross(j[:, 1], j[:, 2]) for j in (a, b))
    la, lb = (np.linalg.norm(n, axis=1) for n in (na, nb))
    # Poles have no normal here.
    sound = (la > 1e-9 * (a[:, 1] ** 2 + a[:, 2] ** 2).sum(1)) & (lb > 1e-9 * (b[:, 1] ** 2 + b[:, 2] ** 2).sum(1))
    if not sound.any():
        continue
    a, b, na, nb = a[sound], b[sound], (na.T / la).T[sound], (nb.T / lb).T[sound]
    nb *= np.where((na * nb).sum(1) < 0.0, -1.0, 1.0)[:, None]
    angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(na, nb), axis=1), (na * nb).sum(1)))
    along = a[:, 1] * a[:, 6, :1] + a[:, 2] * a[:, 6, 1:2]
    along = (along.T / np.linalg.norm(along, axis=1)).T
    ka = normal_curvature(a, na, np.cross(along, na))
    kb = normal_curvature(b, nb, np.cross(along, nb))
    found = LocalAnalysis_SurfaceContinuity(curves[0], curves[1], 0.5 * (t0 + t1), surfaces[0], surfaces[1],
                                            GeomAbs_G2, 0.001, 0.02, 0.001, 0.001, 0.00873, 0.1)
    middle = "failed" if not found.IsDone() else "G2" if found.IsG2() else "G1" if found.IsG1() else "C0"
    print(json.dumps([ends, length, float(angle.max()), np.abs(ka - kb).tolist(),
                      np.maximum(abs(ka), abs(kb)).tolist(), middle]))
"""


def cell(point):
    return tuple(math.floor(x / (4 * APART_MM)) for x in point)


def neighbours(key):
    return ((key[0] + i, key[1] + j, key[2] + k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1))


def judged(angle, jump):
    return "C0" if angle > ANGLE_DEG else "G1" if jump > 1.0 else "G2"


def is_near(angle, jump):
    angle /= ANGLE_DEG
    # The curvature decides only where the normals agree.
    return abs(angle - 1.0) < NEAR or (angle < 1.0 and abs(jump - 1.0) < NEAR)


def chain(ends, length, own):
    """Joints not yet matched that lead from one end to the other and are as long together: claymill cuts edges at
    corners, closed edges in three, and both sides where a third face begins, Open CASCADE does not."""
    def lead(at, left, used):
        if used and math.dist(at, ends[1]) < APART_MM and abs(left) < 0.02 * length + APART_MM:
            return used
        if len(used) == LONGEST_CHAIN or left < -0.02 * length - APART_MM:
            return None
        for joint in own:
            if joint[-1] or joint in used:
                continue
            for i in (0, 1):
                if math.dist(at, joint[0][i]) < APART_MM:
                    found = lead(joint[0][1 - i], left - joint[1], used + [joint])
                    if found:
                        return found
        return None

    return lead(ends[0], length, [])


def compare(python, joints, path, listing):
    own = defaultdict(list)
    count = 0
    for line in subprocess.run([joints, path], check=True, capture_output=True, text=True).stdout.splitlines():
        x = line.split()
        ends = [tuple(map(float, x[0:3])), tuple(map(float, x[3:6]))]
        middle = [0.5 * (p + q) for p, q in zip(*ends)]
        own[cell(middle)].append([ends, float(x[6]), x[7], float(x[8]), float(x[9]), float(x[11]), False])
        count += 1
    tally, middles, differing, near, unmatched = Counter(), Counter(), [], 0, []
    stream = subprocess.Popen([python, "-c", OCC, path], stdout=subprocess.PIPE, text=True)

    def judge(mine, angle, jumps, larger, ends):
        nonlocal near
        own_angle, own_jump, floor = (max(joint[k] for joint in mine) for k in (3, 4, 5))
        own_class = min(joint[2] for joint in mine)
        for joint in mine:
            joint[-1] = True
        jump = max(d / max(0.1 * k, floor) for d, k in zip(jumps, larger))
        other = judged(angle, jump)
        tally[own_class, other] += 1
        if is_near(angle, jump) or is_near(own_angle, own_jump):
            near += 1
            if listing:
                print(f"near a limit: {own_class} {own_angle:.4f}° {own_jump:.3f}, Open CASCADE {other} {angle:.4f}° {jump:.3f} at {ends[0]}")
        elif own_class != other:
            differing.append((own_class, other, own_angle, angle, own_jump, jump, ends))

    for line in stream.stdout:
        if not line.startswith("["):
            continue
        ends, length, angle, jumps, larger, middle = json.loads(line)
        middles[middle] += 1
        best = None
        for key in neighbours(cell([0.5 * (p + q) for p, q in zip(*ends)])):
            for joint in own.get(key, []):
                ways = [max(math.dist(ends[0], joint[0][i]), math.dist(ends[1], joint[0][1 - i])) for i in (0, 1)]
                off = abs(length - joint[1])
                if min(ways) < APART_MM and off < 0.02 * length + APART_MM and not joint[-1] and (best is None or off < best[0]):
                    best = (off, joint)
        if best is None:
            unmatched.append((ends, length, angle, jumps, larger))
        else:
            judge([best[1]], angle, jumps, larger, ends)
    left = [joint for some in own.values() for joint in some if not joint[-1]]
    one_for_one, in_parts, only_occ = count - len(left), 0, 0
    for ends, length, angle, jumps, larger in unmatched:
        parts = chain(ends, length, left)
        if parts:
            in_parts += len(parts)
            judge(parts, angle, jumps, larger, ends)
        else:
            only_occ += 1
            if listing:
                print(f"only in Open CASCADE: {length:.3f} mm from {ends[0]} to {ends[1]}")
    if listing:
        for joint in left:
            if not joint[-1]:
                print(f"only in claymill: {joint[1]:.3f} mm {joint[2]} {joint[3]:.4f}° from {joint[0][0]} to {joint[0][1]}")
    stream.wait()
    agree = sum(n for (a, b), n in tally.items() if a == b)
    whole = len(unmatched) - only_occ
    print(f"{path.name}: {count} joints, {one_for_one} of them edges of Open CASCADE, {in_parts} parts of {whole} such edges,")
    print(f"  {count - one_for_one - in_parts} only here, {only_occ} only there")
    print(f"  classes agree on {agree}, {near} are within 5 % of a limit, {len(differing)} others differ")
    print(f"  claymill / Open CASCADE along the joint: {dict(sorted(tally.items()))}")
    print(f"  Open CASCADE in the middle only: {dict(sorted(middles.items()))}", flush=True)
    for own_class, other, own_angle, angle, own_jump, jump, ends in differing[:20]:
        print(f"  {own_class} {own_angle:.4f}° {own_jump:.3f}, Open CASCADE {other} {angle:.4f}° {jump:.3f}, from {ends[0]} to {ends[1]}")
    return not differing


def main():
    arguments = [a for a in sys.argv[1:] if a != "--list"]
    corpus, python = occ.corpus(arguments), occ.python()
    joints = occ.example("claymill-surface-merge", "joints")
    same = [compare(python, joints, corpus / model, "--list" in sys.argv) for model in arguments[1:] or MODELS]
    sys.exit(0 if all(same) else 1)


if __name__ == "__main__":
    main()
