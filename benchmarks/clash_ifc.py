#!/usr/bin/env python3
"""Walls and slabs that are flush, or overlap or part by 1 µm to 1 mm: `ist clash` beside IfcOpenShell's clash.

usage: clash_ifc.py --ist PROGRAM --out FILE.json     (pip install ifcopenshell==0.9.0.post1)
"""
import argparse
import datetime
import json
import pathlib
import subprocess
import tempfile

import ifcopenshell
import ifcopenshell.api.context
import ifcopenshell.api.geometry
import ifcopenshell.api.root
import ifcopenshell.api.unit
import ifcopenshell.geom
import numpy as np

# Names, sizes [m] and corners of two boxes, and the axis along which the second is moved into the first.
PAIRS = {
    "wall on slab": (((5, 4, 0.2), (0, 0, -0.2)), ((3, 0.2, 2.5), (1, 1.5, 0)), 2),
    "wall on the slab's edge": (((5, 4, 0.2), (0, 0, -0.2)), ((3, 0.2, 2.5), (1, 0, 0)), 2),
    "wall end to end": (((3, 0.2, 2.5), (-3, 0, 0)), ((3, 0.2, 2.5), (0, 0, 0)), 0),
    "wall against wall": (((3, 0.2, 2.5), (0, -0.2, 0)), ((0.2, 3, 2), (1, 0, 0.25)), 1),
}
DEPTHS = (1e-3, 1e-4, 1e-5, 1e-6, 0, -1e-6, -1e-5, -1e-4, -1e-3)


def placed(pair, depth):
    """[(size, corner)] of both, and the volume that they share."""
    first, (size, corner), axis = PAIRS[pair]
    corner = [x - depth * (k == axis) for k, x in enumerate(corner)]
    boxes = [first, (size, corner)]
    low = np.max([c for _, c in boxes], axis=0)
    high = np.min([np.add(c, s) for s, c in boxes], axis=0)
    return boxes, float(np.prod(np.maximum(high - low, 0))) if depth > 0 else 0.0


def ifc_clashes(boxes):
    """Intersections and collisions that IfcOpenShell finds."""
    model = ifcopenshell.file(schema="IFC4")
    ifcopenshell.api.root.create_entity(model, ifc_class="IfcProject", name="p")
    ifcopenshell.api.unit.assign_unit(model, length={"is_metric": True, "raw": "METERS"})
    context = ifcopenshell.api.context.add_context(model, context_type="Model")
    body = ifcopenshell.api.context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context)
    elements = []
    for (length, thickness, height), corner in boxes:
        element = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingElementProxy")
        shape = ifcopenshell.api.geometry.add_wall_representation(
            model, context=body, length=length, height=height, thickness=thickness)
        ifcopenshell.api.geometry.assign_representation(model, product=element, representation=shape)
        place = np.eye(4)
        place[:3, 3] = corner
        ifcopenshell.api.geometry.edit_object_placement(model, product=element, matrix=place)
        elements.append([element])
    tree = ifcopenshell.geom.tree(backend="opencascade.trianglebvh")
    shapes = ifcopenshell.geom.iterator(ifcopenshell.geom.settings(), model, 1)
    assert shapes.initialize()
    while True:
        tree.add_element(shapes.get())
        if not shapes.next():
            break
    return (len(tree.clash_intersection_many(*elements, tolerance=1e-6, check_all=True)),
            len(tree.clash_collision_many(*elements, allow_touching=False)),
            len(tree.clash_collision_many(*elements, allow_touching=True)))


def ist_clash(program, boxes):
    """(kind, volume, contact area) by `ist clash`; kind "–": not listed."""
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    with tempfile.TemporaryDirectory() as folder:
        toml = ""
        for name, (size, corner) in zip("ab", boxes):
            corners = [np.add(corner, np.multiply(size, x)) for x in
                       ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]
            (pathlib.Path(folder) / f"{name}.obj").write_text(
                "".join(f"v {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in corners)
                + "".join("f " + " ".join(str(k + 1) for k in face) + "\n" for face in faces))
            toml += f'[[part]]\nname = "{name}"\nmesh = "{name}.obj"\n'
        path = pathlib.Path(folder) / "boxes.toml"
        path.write_text(toml)
        done = subprocess.run([program, "clash", path, "--json"], capture_output=True, text=True)
        assert done.returncode in (0, 3), done.stderr
        pairs = json.loads(done.stdout)["pairs"]
    return (pairs[0]["kind"], pairs[0]["volume"], pairs[0]["contact_area"]) if pairs else ("–", 0.0, 0.0)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--ist", required=True)
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    rows, wrong, theirs = [], 0, 0
    for pair in PAIRS:
        for depth in DEPTHS:
            boxes, volume = placed(pair, depth)
            intersections, strict, touching = ifc_clashes(boxes)
            kind, found, area = ist_clash(arguments.ist, boxes)
            truth = "overlapping" if depth > 0 else "touching" if depth == 0 else "–"
            wrong += kind != truth or abs(found - volume) > 1e-12
            theirs += (intersections > 0) != (depth > 0)
            rows.append({"boxes": pair, "overlap m": depth, "truth": truth, "ist": kind, "ist volume m³": found,
                         "true volume m³": volume, "ist contact m²": area, "IfcOpenShell intersections": intersections,
                         "collisions": strict, "collisions, touching allowed": touching})
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
    commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True).stdout.strip()
    report = {
        "benchmark": "clash_ifc", "page": "Flush walls and slabs",
        "made_by": "benchmarks/clash_ifc.py", "commit": commit,
        "date": datetime.date.today().isoformat(), "cpu": cpu, "cores": 1, "compiler": "–", "quick": False,
        "tables": {"Boxes": rows},
        "targets": [{"what": "ist: rows with another kind or volume than the truth", "value": wrong, "limit": "≤ 0",
                     "met": wrong == 0}],
        "remarks": [
            "Two boxes each, moved into each other (overlap > 0) or apart. By "
            f"IfcOpenShell {ifcopenshell.version} from PyPI: clash_intersection_many (tolerance 1 µm) and "
            "clash_collision_many, without and with touching. ist reads the same coordinates in doubles.",
            f"IfcOpenShell's intersections are other than the truth in {theirs} of {len(rows)} rows."]}
    pathlib.Path(arguments.out).write_text(json.dumps(report, indent=1) + "\n")
    for row in rows:
        print(row)


main()
