#!/usr/bin/env bash
# A COLLADA file says how long its unit is. A robot's mesh in millimetres is a thousand times too large in Pinocchio 4.1.0 (and so in
# Coal 3.0.3) and in yourdfpy 0.0.60 with trimesh 5.2.0, which both read coordinates as they stand; PyBullet 3.2.7 converts them to
# metres, as RViz does. The same URDF is so two robots. Transforms of the file's nodes all three apply.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pin==4.1.0 coal==3.0.3 yourdfpy==0.0.60 trimesh==5.2.0 \
  pycollada==0.9.3 pybullet==3.2.7 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" - <<'END' 2>&1 | grep -v "^pybullet build time"
import numpy as np
import pinocchio
import pybullet
import trimesh
import yourdfpy

box = trimesh.creation.box((100, 200, 300))
with open("robot.urdf", "w") as file:
    file.write('<robot name="r"><link name="hand"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
               '</inertial><collision><geometry><mesh filename="box.dae"/></geometry></collision></link></robot>')
for unit in (1, 0.001):
    with open("box.dae", "w") as file:
        numbers, count = " ".join(map(str, box.vertices.ravel())), len(box.vertices)
        file.write(f'''<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{unit}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{3 * count}">{numbers}</float_array><technique_common>
<accessor source="#a" count="{count}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(box.faces)}"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{" ".join(map(str, box.faces.ravel()))}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><scale>2 1 1</scale><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>''')
    model = pinocchio.buildModelFromUrdf("robot.urdf")
    shapes = pinocchio.buildGeomFromUrdf(model, "robot.urdf", pinocchio.GeometryType.COLLISION, package_dirs=".")
    shape = shapes.geometryObjects[0].geometry
    shape.computeLocalAABB()
    by_pinocchio = shape.aabb_local.max_ - shape.aabb_local.min_
    robot = yourdfpy.URDF.load("robot.urdf", load_collision_meshes=True, build_collision_scene_graph=True)
    by_yourdfpy = robot.collision_scene.extents
    world = pybullet.connect(pybullet.DIRECT)
    low, high = pybullet.getAABB(pybullet.loadURDF("robot.urdf"))
    by_bullet = np.subtract(high, low) - 0.004  # a margin of its boxes
    pybullet.disconnect(world)
    print(f"unit {unit} m: Pinocchio {np.round(by_pinocchio, 3)}, yourdfpy {np.round(by_yourdfpy, 3)}, PyBullet {np.round(by_bullet, 3)}")
    assert np.allclose(by_pinocchio, [200, 200, 300]) and np.allclose(by_yourdfpy, [200, 200, 300])
    assert np.allclose(by_bullet, np.array([200, 200, 300]) * unit, atol=1e-3)
END
