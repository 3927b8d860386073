#!/usr/bin/env bash
# A closed mesh that lies 1e6 from the origin, as surveyed ones do, with exact coordinates: its moment of inertia in trimesh 5.2.0 is
# some thousand times too large (at 1e5 it is 38 % too small), and its volume in Open3D 0.20.0 ten times (at 1e5 17 % too small),
# without a warning. trimesh's volume and those of VTK (PyVista 0.49.1) and Manifold 3.5.4 are right to nine digits.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 open3d==0.20.0 pyvista==0.49.1 manifold3d==3.5.4 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'END'
import manifold3d
import numpy as np
import open3d
import pyvista
import trimesh

ball = trimesh.creation.icosphere(3)
places = np.round(ball.vertices * 2**20) / 2**20  # so that moving them is exact
truth = trimesh.Trimesh(places, ball.faces, process=False)
for far in (1e3, 1e5, 1e6):
    moved = places + far * np.array([1.0, 2.0, -1.0])
    assert (moved - far * np.array([1.0, 2.0, -1.0]) == places).all()
    mesh = trimesh.Trimesh(moved, ball.faces, process=False)
    by_open3d = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(moved), open3d.utility.Vector3iVector(ball.faces))
    by_manifold = manifold3d.Manifold(manifold3d.Mesh64(moved, ball.faces.astype(np.uint64)))
    ratios = {
        "trimesh's volume": mesh.volume / truth.volume,
        "VTK's": pyvista.PolyData.from_regular_faces(moved, ball.faces).volume / truth.volume,
        "Manifold's": by_manifold.volume() / truth.volume,
        "Open3D's": by_open3d.get_volume() / truth.volume,
        "trimesh's inertia": mesh.moment_inertia[0, 0] / truth.moment_inertia[0, 0],
    }
    print(f"at {far:g}, over the truth:", ", ".join(f"{name} {ratio:.9g}" for name, ratio in ratios.items()))
    *right, volume, inertia = ratios.values()
    assert all(abs(ratio - 1) < 1e-9 for ratio in right)
    if far == 1e3:
        assert abs(volume - 1) < 1e-6 and abs(inertia - 1) < 1e-3
    elif far == 1e5:
        assert abs(volume - 1) > 0.1 and abs(inertia - 1) > 0.1
    else:
        assert abs(volume - 1) > 2 and abs(inertia - 1) > 100
END
