#!/usr/bin/env bash
# A threaded screw of bd_warehouse 0.4.0 (build123d 0.13.0) is 20 solids that overlap, a nut 8. Their volume, and that of their
# meshes, counts what they share as often as it is covered: 5 % too much for an M6 screw of 20 mm and for its nut, beside the union
# that manifold3d 3.5.4 makes of the same meshes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bd_warehouse==0.4.0 build123d==0.13.0 manifold3d==3.5.4
"$folder/venv/bin/python" - <<'END'
import manifold3d
import numpy as np
from bd_warehouse.fastener import HexHeadScrew, HexNut


def volumes(solids):
    """[mm³] of the union of the meshes of all solids, and their sum."""
    parts = []
    for one in solids:
        points, triangles = one.tessellate(0.01, 0.1)
        points = np.round([tuple(point) for point in points], 7)
        corners, index = np.unique(points, axis=0, return_inverse=True)
        faces = index.reshape(-1)[np.array(triangles)]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        part = manifold3d.Manifold(manifold3d.Mesh64(corners, faces.astype(np.uint64)))
        assert part.status() == manifold3d.Error.NoError, part.status()
        parts.append(part)
    return manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add).volume(), sum(part.volume() for part in parts)


for name, part in (("screw", HexHeadScrew("M6-1", 20, simple=False)), ("nut", HexNut("M6-1", simple=False))):
    solids = part.solids()
    once, summed = volumes(solids)
    print(f"{name}: {len(solids)} solids, volume {part.volume:.2f} mm3, of their meshes {summed:.2f}, of the union {once:.2f}")
    assert len(solids) == (20 if name == "screw" else 8)
    assert abs(part.volume / summed - 1) < 1e-3 and 1.03 < summed / once < 1.07
END
