#!/usr/bin/env bash
# A URDF mirrors the mesh of a left hand for a right one by scale="1 -1 1". Pinocchio 4.1.0 scales its vertices and leaves its faces
# as they are, so that Coal has the solid inside out: volume and moments of inertia are negative. trimesh 5.2.0, through yourdfpy
# 0.0.60, turns the faces of the same file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 coal==3.0.3 yourdfpy==0.0.60 trimesh==5.2.0 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" - <<'END'
import numpy as np
import pinocchio
import trimesh
import yourdfpy

trimesh.creation.cone(1, 2).export("cone.stl")
volumes = {}
for scale in ("1 1 1", "1 -1 1"):
    with open("robot.urdf", "w") as file:
        file.write(f'<robot name="r"><link name="hand"><collision><geometry><mesh filename="cone.stl" scale="{scale}"/>'
                   "</geometry></collision></link></robot>")
    model = pinocchio.buildModelFromUrdf("robot.urdf")
    shapes = pinocchio.buildGeomFromUrdf(model, "robot.urdf", pinocchio.GeometryType.COLLISION, package_dirs=".")
    coal_mesh = shapes.geometryObjects[0].geometry
    robot = yourdfpy.URDF.load("robot.urdf", load_collision_meshes=True, build_collision_scene_graph=True)
    other = robot.collision_scene.dump()[0]
    inertia = np.diag(coal_mesh.computeMomentofInertia())
    volumes[scale] = coal_mesh.computeVolume(), other.volume
    print(f"scale {scale}: Pinocchio {volumes[scale][0]:.4f}, moments {np.round(inertia, 3)}; yourdfpy {volumes[scale][1]:.4f}")
    assert (inertia < 0).all() == (scale == "1 -1 1")
assert abs(volumes["1 1 1"][0] - volumes["1 1 1"][1]) < 1e-6
assert abs(volumes["1 -1 1"][0] + volumes["1 1 1"][0]) < 1e-6
assert abs(volumes["1 -1 1"][1] - volumes["1 1 1"][1]) < 1e-6
END
