#!/usr/bin/env python3
"""CPU time and peak memory of reading the two largest models: claymill's readers against Open CASCADE's.

    python3 benches/readers.py [CORPUS]

Makes a virtual environment under target/ with cadquery-ocp 7.9.3.1.1 from PyPI (once), builds the example `read` of
claymill-exchange, and runs each reader in a process of its own, best of three. Exits with 1 when claymill takes more
than a fifth of Open CASCADE's CPU time or more memory.
"""

import sys

import cost
import occ

MODELS = ["sports_car_25200.igs", "sports_car_6300_sewn.stp"]
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


def main():
    corpus, python = occ.corpus(sys.argv[1:]), occ.python()
    reader = occ.example("claymill-exchange", "read")
    start, _ = cost.least([python, "-c", "import OCP.STEPControl, OCP.IGESControl, OCP.TopExp, OCP.TopTools"])
    print(f"{'model':28} {'OCC s':>8} {'claymill s':>11} {'ratio':>7} {'OCC MiB':>9} {'claymill MiB':>13}")
    passed = True
    for model in MODELS:
        path = corpus / model
        occ_s, occ_mib = cost.least([python, "-c", OCC, path])
        # Starting Python and loading its libraries is not reading.
        occ_s -= start
        own_s, own_mib = cost.least([reader, path])
        print(f"{model:28} {occ_s:8.2f} {own_s:11.2f} {own_s / occ_s:7.3f} {occ_mib:9.0f} {own_mib:13.0f}")
        passed &= own_s <= BAR * occ_s and own_mib < occ_mib
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
