#!/usr/bin/env python3
"""Volumes of unions by Manifold, for corpus_soak: unions.csv.

usage: unions.py FOLDER > unions.csv, with what `corpus_soak --write FOLDER` wrote there.
Needs manifold3d==3.5.4, scipy and numpy. Meshes that Manifold does not take are left out.
"""
import pathlib
import sys

import manifold3d
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def read(path):
    vertices, triangles = [], []
    for line in path.open():
        kind, *rest = line.split()
        (vertices if kind == "v" else triangles).append([float(x) for x in rest])
    return np.array(vertices), np.array(triangles, dtype=np.int64) - 1


def shells(triangles):
    """Triangles that hang together by edges, group by group."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    _, name = np.unique(edges, axis=0, return_inverse=True)
    name = name.ravel()
    order = np.argsort(name, kind="stable")
    same = name[order][1:] == name[order][:-1]
    a, b = owner[order][1:][same], owner[order][:-1][same]
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(triangles),) * 2)
    count, label = connected_components(graph, directed=False)
    return [triangles[label == i] for i in range(count)]


def signed_volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def solid(vertices, triangles):
    used, corner = np.unique(triangles, return_inverse=True)
    mesh = manifold3d.Mesh64(np.ascontiguousarray(vertices[used]),
                             corner.reshape(-1, 3).astype(np.uint64))
    made = manifold3d.Manifold(mesh)
    return made if made.status() == manifold3d.Error.NoError else None


print("file,volume,tolerance")
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.obj")):
    vertices, triangles = read(path)
    parts = shells(triangles)
    # Cavities belong to a part: what has any is one solid for Manifold.
    if any(signed_volume(vertices, part) <= 0 for part in parts):
        parts = [triangles]
    solids = [solid(vertices, part) for part in parts]
    if any(s is None for s in solids):
        continue
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    tolerance = 2 * union.get_tolerance() * union.surface_area()
    print(f"{path.name[:-4].replace('+', '/')},{union.volume():.17g},{tolerance:.3g}")
