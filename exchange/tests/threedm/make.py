"""Writes the archives of this folder with McNeel's toolkit: pip install rhino3dm==8.35.0; python make.py.

Tables that the reader does not look at are taken out again, so that the files stay small. Identities are drawn
anew by the toolkit in each run.
"""

import struct

import rhino3dm as rhino

COMMENT, PROPERTIES, SETTINGS = 0x00000001, 0x10000014, 0x10000015
LAYERS, OBJECTS, BLOCKS, END = 0x10000011, 0x10000013, 0x10000021, 0x00007FFF
KEPT_RECORDS = {0xA0000026, 0x20008024, 0x20008031, 0xFFFFFFFF}


def point(*xyz):
    return rhino.Point3d(*xyz)


def model(version):
    file = rhino.File3dm()
    inches = version in (4, 8)
    file.Settings.ModelUnitSystem = rhino.UnitSystem.Inches if inches else rhino.UnitSystem.Millimeters
    file.Settings.ModelAbsoluteTolerance = 0.001
    body, hidden = rhino.Layer(), rhino.Layer()
    body.Name, body.Color = "body", (10, 20, 30, 255)
    hidden.Name, hidden.Visible = "hidden", False
    body, hidden = file.Layers.Add(body), file.Layers.Add(hidden)

    def called(name, layer=body, **more):
        attributes = rhino.ObjectAttributes()
        attributes.Name, attributes.LayerIndex = name, layer
        for key, value in more.items():
            setattr(attributes, key, value)
        return attributes

    objects = file.Objects
    box = rhino.BoundingBox(point(0, 0, 0), point(10, 20, 30))
    objects.AddBrep(rhino.Brep.CreateFromBoundingBox(box), called("box"))
    cylinder = rhino.Cylinder(rhino.Circle(point(50, 0, 0), 5), 12)
    objects.AddBrep(rhino.Brep.CreateFromCylinder(cylinder, True, True), called("cylinder"))
    own = {"ColorSource": rhino.ObjectColorSource.ColorFromObject, "ObjectColor": (200, 100, 50, 255)}
    sphere = rhino.Brep.CreateFromSphere(rhino.Sphere(point(0, 60, 0), 7))
    objects.AddBrep(sphere, called("sphere", **own))

    profile = rhino.PolyCurve()
    profile.Append(rhino.LineCurve(point(104, 0, 0), point(108, 0, 5)))
    profile.Append(rhino.ArcCurve.CreateFromArc(rhino.Arc(point(108, 0, 5), point(107, 0, 9), point(104.5, 0, 11))))
    vase = rhino.RevSurface.Create(profile, rhino.Line(point(98, 0, 0), point(98, 0, 1)), 0.3, 5.0)
    objects.AddBrep(rhino.Brep.CreateFromRevSurface(vase, False, False), called("vase"))
    ball = rhino.NurbsSurface.CreateFromSphere(rhino.Sphere(point(0, 100, 0), 3))
    objects.AddSurface(ball, called("ball"))

    outline = rhino.Polyline(5)
    for x, y in ((0, 0), (20, 0), (20, 10), (0, 10), (0, 0)):
        outline.Add(x, y, 0)
    plate = rhino.Extrusion.Create(rhino.PolylineCurve(outline), 6, True)
    plate.AddInnerProfile(rhino.ArcCurve.CreateFromCircle(rhino.Circle(point(10, 5, 0), 2)))
    objects.AddExtrusion(plate, called("plate"))

    lines = [rhino.LineCurve(point(0, y, 0), point(3, y, 0)) for y in (0, 5)]
    flat = rhino.NurbsSurface.CreateRuledSurface(*lines)
    objects.AddSurface(flat, called("unseen", layer=hidden))
    objects.AddSurface(flat, called("hidden one", Visible=False))
    mesh = rhino.Mesh()
    for xyz in ((0, 0, 0), (1, 0, 0), (0, 1, 0)):
        mesh.Vertices.Add(*xyz)
    mesh.Faces.AddFace(0, 1, 2)
    objects.AddMesh(mesh, called("mesh"))
    objects.AddCurve(lines[0], called("line"))

    index = file.InstanceDefinitions.Add("bolt", "", "", "", point(0, 0, 0), (flat,), (called("bolt part"),))
    bolt = file.InstanceDefinitions[index].Id
    across = rhino.Plane(point(220, 0, 0), rhino.Vector3d(1, 0, 0))
    for put in (rhino.Transform.Translation(200, 0, 0), rhino.Transform.Mirror(across)):
        objects.AddInstanceObject(rhino.InstanceReference(bolt, put), called("placed"))
    return file


def chunks(data, wide):
    at = 0
    while at < len(data):
        code, value = struct.unpack_from("<Iq" if wide == 8 else "<II", data, at)
        size = 0 if code >> 31 else value
        start, at = at, at + 4 + wide + size
        yield code, data[at - size : at], data[start:at]


def smaller(data):
    wide = 8 if int(data[24:32]) >= 50 else 4

    def chunk(code, content):
        return struct.pack("<I", code) + len(content).to_bytes(wide, "little") + content

    out = data[:32]
    for code, content, whole in chunks(data[32:], wide):
        if code in (COMMENT, LAYERS, OBJECTS, BLOCKS):
            out += whole
        elif code in (PROPERTIES, SETTINGS):
            out += chunk(code, b"".join(w for c, _, w in chunks(content, wide) if c in KEPT_RECORDS))
        elif code == END:
            out += chunk(code, (len(out) + 4 + 2 * wide).to_bytes(wide, "little"))
    return out


for version in (2, 4, 5, 8):
    name = f"v{version}.3dm"
    model(version).Write(name, version)
    with open(name, "rb") as file:
        data = smaller(file.read())
    with open(name, "wb") as file:
        file.write(data)
    print(name, len(data))
