#!/usr/bin/env python3
"""Where dropped balls rest, judged by Open CASCADE's closest points: on models of the corpus, with two balls each.

    python3 benches/contact.py [CORPUS [PLACES]]

claymill drops a ball over the whole model; PLACES (60) of its locations, spread evenly over all of them, are given to Open
CASCADE, which has read the same file by itself and finds the distance from the centre to the nearest of its faces. A ball at rest is as
far away as its radius. Exits with 1 where any is off by more than a micrometre.
"""

import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import occ

OFF_MM = 1e-3
# Model, balls, rows and steps, mm.
MODELS = [
    ("sports_car_body_2720.igs", [3, 10], 40, 11),
    ("sports_car_1399.igs", [6, 12.7], 40, 11),
    ("helmet_928.igs", [2, 6], 5, 3),
    ("race_car_nose_141.stp", [3, 10], 25, 7),
    ("ship_hull_55.iges", [3, 10], 60, 31),
    ("bracket_inch.iges", [1, 3], 2, 1),
    ("prismatic_ctc01.stp", [3, 10], 15, 7),
    ("prismatic_ctc03_inch.stp", [3, 10], 15, 7),
    ("prismatic_ctc05_inch.stp", [3, 10], 15, 7),
]

OCC = """
import json, struct, sys
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.IGESControl import IGESControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.gp import gp_Pnt

model, centres, radius = sys.argv[1], sys.argv[2], float(sys.argv[3])
reader = STEPControl_Reader() if model.endswith("stp") else IGESControl_Reader()
reader.ReadFile(model)
reader.TransferRoots()
shape = reader.OneShape()
off = []
for x, y, z in struct.iter_unpack("<ddd", open(centres, "rb").read()):
    found = BRepExtrema_DistShapeShape(BRepBuilderAPI_MakeVertex(gp_Pnt(x, y, z)).Vertex(), shape)
    off.append(found.Value() - radius)
print(json.dumps(off))
"""


def main():
    arguments = sys.argv[1:]
    corpus = occ.corpus(arguments)
    places = int(arguments[1]) if len(arguments) > 1 else 60
    python = occ.python()
    drop = occ.example("claymill-contact", "drop")
    worst = 0.0
    print(f"{'model':28}{'ball, mm':>10}{'locations':>11}{'judged':>8}{'deepest, µm':>13}{'highest, µm':>13}")
    for name, balls, rows, step in MODELS:
        for radius in balls:
            with tempfile.TemporaryDirectory() as folder:
                found, chosen = Path(folder) / "found", Path(folder) / "chosen"
                subprocess.run([drop, corpus / name, str(radius), str(rows), str(step), "-o", found], check=True,
                               stdout=subprocess.DEVNULL)
                centres = [c for c in struct.iter_unpack("<ddd", found.read_bytes()) if c[2] == c[2]]
                few = centres[:: max(1, len(centres) // places)]
                chosen.write_bytes(b"".join(struct.pack("<ddd", *c) for c in few))
                judge = subprocess.run([python, "-c", OCC, corpus / name, chosen, str(radius)], check=True,
                                       stdout=subprocess.PIPE)
            off = json.loads(judge.stdout.decode().splitlines()[-1])
            worst = max([worst, *map(abs, off)])
            print(f"{name:28}{radius:10g}{len(centres):11}{len(off):8}{-min(off) * 1e3:13.3f}{max(off) * 1e3:13.3f}", flush=True)
    sys.exit(1 if worst > OFF_MM else 0)


if __name__ == "__main__":
    main()
