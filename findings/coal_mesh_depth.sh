#!/usr/bin/env bash
# The depth of a contact of two meshes in Coal 3.0.3 is one of two triangles. Meshes of two cubes of side 2 that stand 5e-7 apart, one 0.1
# aside, collide, though Coal's own distance is 5e-7: seven contacts, each 1.8 or 1.9 deep, with normals along their faces.
# While the cubes overlap by 1e-9 to 0.1 the deepest contact stays at 1.9. As primitives the same cubes have one contact of
# the true depth.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check coal==3.0.3 numpy==2.2.6
"$folder/venv/bin/python" - <<'END'
import itertools

import coal
import numpy as np


def cube():
    corners = coal.StdVec_Vec3s()
    for corner in itertools.product((-1.0, 1.0), repeat=3):
        corners.append(np.array(corner))
    triangle = getattr(coal, "Triangle32", None) or coal.Triangle
    faces = (getattr(coal, "StdVec_Triangle32", None) or coal.StdVec_Triangle)()
    for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
        faces.append(triangle(a, b, c))
        faces.append(triangle(a, c, d))
    model = coal.BVHModelOBBRSS()
    model.beginModel(12, 8)
    model.addSubModel(corners, faces)
    model.endModel()
    return model


def contacts(a, b, place):
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.num_max_contacts = 100
    coal.collide(a, coal.Transform3s(), b, place, request, result)
    return [result.getContact(i) for i in range(result.numContacts())]


mesh, box = cube(), coal.Box(2, 2, 2)
for gap in (1e-5, 5e-7, 1e-9, -1e-9, -1e-3, -0.1):
    place = coal.Transform3s(np.eye(3), np.array([2 + gap, 0.1, 0.2]))
    distance = coal.distance(mesh, coal.Transform3s(), mesh, place, coal.DistanceRequest(), coal.DistanceResult())
    found = contacts(mesh, mesh, place)
    depths = [-one.penetration_depth for one in found]
    primitive = [-one.penetration_depth for one in contacts(box, box, place)]
    print(f"gap {gap}: distance {distance:.2g}, {len(found)} contacts, depths {np.round(depths, 9)}; primitives {primitive}")
    if gap == 1e-5:
        assert not found and not primitive
        continue
    deepest = found[int(np.argmax(depths))]
    assert max(depths) > 1.8 and abs(deepest.normal[0]) < 1e-6, (depths, deepest.normal)
    assert len(primitive) == 1 and abs(primitive[0] - max(-gap, 0)) < 1e-6
    if gap > 0:
        assert distance > 0 and min(depths) > 1.7
END
