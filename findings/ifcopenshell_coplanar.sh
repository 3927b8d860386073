#!/usr/bin/env bash
# Two boxes of an IFC may overlap while sides of both lie in one plane, as walls and slabs of one grid do. IfcOpenShell
# 0.9.0 then finds no clash, neither as an intersection nor as a collision: not of a box half inside the other, and not of
# a copy in place. Shifted off the grid it finds the same boxes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check ifcopenshell==0.9.0.post1 numpy==2.2.6
cd "$folder"
venv/bin/python - <<'END'
import ifcopenshell
import ifcopenshell.api.context
import ifcopenshell.api.geometry
import ifcopenshell.api.root
import ifcopenshell.api.unit
import ifcopenshell.geom
import numpy as np


def clashes(at):
    """Of two boxes of 1 m, one at the origin: (intersections, collisions)."""
    model = ifcopenshell.file(schema="IFC4")
    ifcopenshell.api.root.create_entity(model, ifc_class="IfcProject", name="p")
    ifcopenshell.api.unit.assign_unit(model, length={"is_metric": True, "raw": "METERS"})
    context = ifcopenshell.api.context.add_context(model, context_type="Model")
    body = ifcopenshell.api.context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=context)
    boxes = []
    for corner in ((0, 0, 0), at):
        box = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingElementProxy")
        shape = ifcopenshell.api.geometry.add_wall_representation(
            model, context=body, length=1, height=1, thickness=1)
        ifcopenshell.api.geometry.assign_representation(model, product=box, representation=shape)
        place = np.eye(4)
        place[:3, 3] = corner
        ifcopenshell.api.geometry.edit_object_placement(model, product=box, matrix=place)
        boxes.append([box])
    tree = ifcopenshell.geom.tree(backend="opencascade.trianglebvh")
    shapes = ifcopenshell.geom.iterator(ifcopenshell.geom.settings(), model, 1)
    assert shapes.initialize()
    while True:
        tree.add_element(shapes.get())
        if not shapes.next():
            break
    return (len(tree.clash_intersection_many(*boxes, tolerance=1e-6, check_all=True)),
            len(tree.clash_collision_many(*boxes, allow_touching=True)))


found = {at: clashes(at) for at in ((0.5, 0.3, 0.2), (0.5, 0, 0), (0, 0, 0))}
for at, (intersections, collisions) in found.items():
    print(f"second box at {at}: {intersections} intersections, {collisions} collisions")
assert list(found.values()) == [(1, 1), (0, 0), (0, 0)], found
END
