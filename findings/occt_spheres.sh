#!/usr/bin/env bash
# The intersection of two unit spheres in Open CASCADE 8.0 (cadquery-ocp-novtk 8.0.1.1.0) depends on the direction between them. Moved
# by 0.001 along y it is empty, and by 0.1 along y 0.06 % too small; along z both are right. build123d 0.13.0 tidies the right result
# for spheres 1 apart along x into an invalid solid of the whole sphere's volume, 4.19 for 1.31, without an error.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check build123d==0.13.0 cadquery-ocp-novtk==8.0.1.1.0
cd "$folder"
"$folder/venv/bin/python" - <<'END'
from math import pi

from build123d import Solid, Vector
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common


def truth(distance):
    return 4 * pi / 3 * (1 - 0.75 * distance + distance**3 / 16)


def of_occt(*at):
    return Solid(BRepAlgoAPI_Common(Solid.make_sphere(1).wrapped, Solid.make_sphere(1).translate(Vector(at)).wrapped).Shape()).volume


def of_build123d(*at):
    (common,) = Solid.make_sphere(1).intersect(Solid.make_sphere(1).translate(Vector(at)))
    return common.volume, common.is_valid


for distance in (0.001, 0.1):
    along_y, along_z = of_occt(0, distance, 0), of_occt(0, 0, distance)
    print(f"Open CASCADE, {distance} apart, true {truth(distance):.5f}: along y {along_y:.5f}, along z {along_z:.5f}")
    assert abs(along_z / truth(distance) - 1) < 1e-6
    assert along_y == 0 if distance == 0.001 else 5e-4 < 1 - along_y / truth(distance) < 8e-4

along_x, along_z = of_build123d(1, 0, 0), of_build123d(0, 0, 1)
print(f"build123d, 1 apart, true {truth(1):.5f}: along x {along_x[0]:.5f} (valid: {along_x[1]}), along z {along_z[0]:.5f} (valid: {along_z[1]});"
      f" Open CASCADE along x {of_occt(1, 0, 0):.5f}")
assert abs(along_x[0] / (4 * pi / 3) - 1) < 1e-6 and not along_x[1]
assert abs(along_z[0] / truth(1) - 1) < 1e-6 and along_z[1] and abs(of_occt(1, 0, 0) / truth(1) - 1) < 1e-6
END
