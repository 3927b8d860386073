"""Solids as a page that needs no server and no other file."""

import base64
import html
import json
import pathlib

import numpy as np

import ist


class Plot:
    """What plot() returns. Notebooks show it; `save(path)` writes it, str() is the page."""

    def __init__(self, page):
        self._page = page

    def __str__(self):
        return self._page

    def save(self, path):
        """Writes a page of one file, .html."""
        pathlib.Path(path).write_text(self._page, encoding="utf-8")

    def _repr_html_(self):
        return (f'<iframe srcdoc="{html.escape(self._page)}" width="100%" height="480" '
                'style="border: 0"></iframe>')


def plot(solids, poses=None, *, scales=None, path=None):
    """Draws solids, their spheres and the outline of their overlaps, in a page for any browser.

    solids: an Asset, a Mesh or a ClosedMesh, or a list of them.
    poses: (7,) or (k, 7) or (4, 4) or (k, 4, 4), one for each solid; None: all at the origin.
    scales: (k,) or a number; None: 1.
    path: where to write the page; None: nowhere. The Plot returned has save(), too.

    Between two assets that keep their meshes, the exact overlap's outline is drawn and its volume is
    stated; between others, the volume by spheres. Drag turns, shift and drag moves, the wheel zooms.

    Returns a Plot. Raises TypeError for other solids, ValueError for poses or scales that do not
    fit.
    """
    solids = list(solids) if isinstance(solids, (list, tuple)) else [solids]
    if not solids:
        raise ValueError("solids: nothing to draw")
    for k, solid in enumerate(solids):
        if not isinstance(solid, (ist.Asset, ist.Mesh, ist.ClosedMesh)):
            raise TypeError(f"solids[{k}]: a {type(solid).__name__}; wanted an Asset, a Mesh or a "
                            "ClosedMesh")
    if isinstance(poses, (ist.Asset, ist.Mesh, ist.ClosedMesh)):
        raise TypeError(f"poses: a {type(poses).__name__}; several solids are a list: plot([a, b])")
    poses, scales = _placed(len(solids), poses, scales)
    parts = [_part(solid, pose, scale) for solid, pose, scale in zip(solids, poses, scales)]
    outline, lines = _overlaps(solids, poses, scales)
    points = np.concatenate([part[key][:, :3] for part in parts for key in ("vertices", "spheres")])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = np.linalg.norm(points - middle, axis=1).max() or 1.0
    for part in parts:
        part["spheres"][:, :3] -= middle
        part.update(vertices=_text((part["vertices"] - middle) / radius, np.float32),
                    triangles=_text(part["triangles"], np.uint32),
                    spheres=_text(part["spheres"] / radius, np.float32))
    scene = {"solids": parts, "lines": lines, "outline": _text((outline - middle) / radius, np.float32)}
    page = pathlib.Path(__file__).with_name("viewer.html").read_text(encoding="utf-8")
    made = Plot(page.replace('id="scene">{}', 'id="scene">' + json.dumps(scene).replace("<", r"\u003c"), 1))
    if path is not None:
        made.save(path)
    return made


def _placed(count, poses, scales):
    """(count, 7) with unit quaternions, and (count,)."""
    rows = np.zeros((count, 7)) if poses is None else np.asarray(poses, np.float64)
    if poses is None:
        rows[:, 0] = 1
    if rows.shape[-2:] == (4, 4):
        rows = ist.poses(rows)
    rows = np.atleast_2d(rows)
    factors = np.ones(count) if scales is None else np.asarray(scales, np.float64)
    factors = np.full(count, factors) if factors.ndim == 0 else factors
    if rows.shape != (count, 7):
        raise ValueError(f"poses: shape {rows.shape}; wanted ({count}, 7), a row for each solid")
    if factors.shape != (count,):
        raise ValueError(f"scales: shape {factors.shape}; wanted ({count},)")
    lengths = np.linalg.norm(rows[:, :4], axis=1)
    bad = ~(np.isfinite(rows).all(axis=1) & (lengths > 0) & np.isfinite(factors) & (factors > 0))
    if bad.any():
        raise ValueError(f"poses, scales: row {np.flatnonzero(bad)[0]} is no pose, or its scale is not > 0")
    return np.concatenate((rows[:, :4] / lengths[:, None], rows[:, 4:]), axis=1), factors


def _rotation(q):
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def _part(solid, pose, scale):
    """What a solid has, in the world."""
    spheres = np.zeros((0, 4))
    vertices, triangles = np.zeros((0, 3)), np.zeros((0, 3))
    if not isinstance(solid, ist.Asset):
        vertices, triangles = solid.vertices, solid.triangles
    else:
        if solid.sphere_count:
            spheres = solid.spheres()
        if solid.mesh_triangles:
            vertices, triangles = solid.mesh()
    turn = scale * _rotation(pose[:4]).T
    return {"vertices": vertices @ turn + pose[4:], "triangles": triangles,
            "spheres": np.column_stack((spheres[:, :3] @ turn + pose[4:], scale * spheres[:, 3])),
            "text": ", ".join(f"{len(rows):,} {what}" for rows, what in
                              ((triangles, "triangles"), (spheres, "spheres")) if len(rows))}


def _overlaps(solids, poses, scales):
    """(n, 2, 3) segments of all outlines in the world, and a line of text for each overlap."""
    segments, lines = [np.zeros((0, 2, 3))], []
    assets = np.flatnonzero([isinstance(solid, ist.Asset) for solid in solids])
    held = ist.Solids([solids[k] for k in assets])
    first, second = np.triu_indices(len(assets), 1)
    a, b = assets[first], assets[second]
    touching = ist.overlap(held[first], held[second], poses[b], poses_a=poses[a], scales=scales[b],
                           scales_a=scales[a]) != ist.YesNo.no
    for i, k in zip(a[touching], b[touching]):
        placed = {"poses_a": poses[i], "scales_a": scales[i], "scales": scales[k]}
        exact = solids[i].mesh_triangles and solids[k].mesh_triangles
        try:
            if exact:
                found = ist.overlap_outline(solids[i], solids[k], poses[k], **placed)
                segments.append(found.segments)
                contact = found.contact.penetration
            else:
                contact = ist.penetration(solids[i], solids[k], poses[k], **placed)
        except ist.Error as error:  # one lacks the data; both are drawn
            lines.append(f"overlap of {i} and {k}: {error}")
            continue
        if contact.volume > 0:
            lines.append(f"overlap of {i} and {k}: {contact.volume:.6g} u³, "
                         + ("exact" if exact else "by spheres"))
    return np.concatenate(segments), lines


def _text(array, dtype):
    return base64.b64encode(np.ascontiguousarray(array, dtype).tobytes()).decode()
