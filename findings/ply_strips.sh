#!/usr/bin/env bash
# Scans of the Stanford repository hold their triangles as strips: an element tristrips whose list of indices is cut by -1. Of a cube
# of twelve triangles stored so, assimp (by assimp-py 1.1.0) keeps one, without an error; trimesh 5.2.0 makes a point cloud of it,
# VTK (by PyVista 0.49.1) eight vertices, Open3D 0.20.0 a mesh without triangles, with a warning. MeshLab (pymeshlab 2025.7) and
# libigl 2.6.3 read all twelve.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 assimp-py==1.1.0 pymeshlab==2025.7.post1 \
  pyvista==0.49.1 open3d==0.20.0 libigl==2.6.3
cd "$folder"
"$folder/venv/bin/python" - <<'END'
import assimp_py
import igl
import open3d
import pymeshlab
import pyvista
import trimesh

corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
sides = [(0, 1, 2, 3), (4, 6, 5, 7), (0, 4, 1, 5), (2, 3, 6, 7), (0, 2, 4, 6), (1, 5, 3, 7)]  # a strip of two triangles each
strips = [index for side in sides for index in (*side, -1)][:-1]
with open("cube.ply", "w") as file:
    file.write("ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
               "element tristrips 1\nproperty list int int vertex_indices\nend_header\n")
    file.writelines("%d %d %d\n" % corner for corner in corners)
    file.write(f"{len(strips)} {' '.join(map(str, strips))}\n")

meshes = pymeshlab.MeshSet()
meshes.load_new_mesh("cube.ply")
read = {
    "MeshLab": meshes.current_mesh().face_number(),
    "libigl": len(igl.read_triangle_mesh("cube.ply")[1]),
    "assimp": sum(len(mesh.indices) // 3 for mesh in assimp_py.import_file("cube.ply", 0).meshes),
    "trimesh": len(getattr(trimesh.load("cube.ply"), "faces", ())),
    "VTK": len(pyvista.read("cube.ply").regular_faces) + pyvista.read("cube.ply").n_strips,
    "Open3D": len(open3d.io.read_triangle_mesh("cube.ply").triangles),
}
print("of twelve triangles:", read)
assert read == {"MeshLab": 12, "libigl": 12, "assimp": 1, "trimesh": 0, "VTK": 0, "Open3D": 0}
END
