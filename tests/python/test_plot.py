"""plot(): a page of one file that holds what is drawn."""
import base64
import json
import re

import numpy as np
import pytest

import ist

TURNED = np.array([0.0, 0, 0, 2, 8, 0, 0])  # half a turn about z; a quaternion of length 2


def scene_of(page):
    scene = json.loads(re.search('id="scene">({.*?})</script>', str(page))[1])
    rows = {"vertices": 3, "triangles": 3, "spheres": 4}

    def numbers(text, width, dtype=np.float32):
        return np.frombuffer(base64.b64decode(text), dtype).reshape(-1, width)

    solids = [{key: numbers(solid[key], width, np.uint32 if key == "triangles" else np.float32)
               for key, width in rows.items()} for solid in scene["solids"]]
    return solids, numbers(scene["outline"], 6), scene["lines"]


def test_what_is_drawn_is_where_it_is(cube, knot_mesh):
    page = ist.plot([cube, knot_mesh], [[1, 0, 0, 0, 0, 0, 0], TURNED], scales=[1, 3])
    (box, knot), outline, lines = scene_of(page)
    assert len(box["spheres"]) == cube.sphere_count and len(knot["spheres"]) == 0
    assert np.array_equal(knot["triangles"], knot_mesh.triangles)
    assert len(outline) == 0 and lines == []
    placed = 3 * knot_mesh.vertices * [-1, -1, 1] + [8, 0, 0]
    drawn = np.concatenate([box["vertices"], knot["vertices"]])
    world = np.concatenate([cube.mesh()[0], placed])
    # The page has a middle and a unit of its own.
    unit = np.linalg.norm(world[0] - world[-1]) / np.linalg.norm(drawn[0] - drawn[-1])
    assert world - world[0] == pytest.approx(unit * (drawn - drawn[0]), abs=1e-5 * unit)
    spheres = cube.spheres()
    assert spheres[:, 3] == pytest.approx(unit * box["spheres"][:, 3], rel=1e-5)
    assert spheres[:, :3] - world[0] == pytest.approx(unit * (box["spheres"][:, :3] - drawn[0]),
                                                      abs=1e-5 * unit)
    assert np.linalg.norm(drawn, axis=1).max() <= 1 + 1e-6


def test_overlaps_have_their_outline_and_volume(cube):
    apart, half, far = np.eye(4), np.eye(4), np.eye(4)
    half[:3, 3], far[:3, 3] = [0.5, 0.25, 0.25], [0, 0, 9]
    solids, outline, lines = scene_of(ist.plot([cube, cube, cube], [apart, half, far]))
    assert lines == ["overlap of 0 and 1: 0.28125 u³, exact"]
    found = ist.overlap_outline(cube, cube, half).segments
    assert len(outline) == len(found) > 0
    assert "iframe" in ist.plot(cube)._repr_html_()
    bare = ist.bake(ist.sample_mesh("cube"), max_spheres=300, keep_mesh=False)
    solids, outline, lines = scene_of(ist.plot([cube, bare], [apart, half]))
    assert len(outline) == 0 and lines[0].endswith(", by spheres")
    assert len(solids[1]["vertices"]) == 0 and len(solids[1]["spheres"]) == bare.sphere_count
    surface = ist.bake_mesh_only(ist.sample_mesh("cube"))
    solids, outline, lines = scene_of(ist.plot([cube, surface], [apart, half]))
    assert lines == ["overlap of 0 and 1: 0.28125 u³, exact"] and len(solids[1]["vertices"]) > 0
    solids, outline, lines = scene_of(ist.plot([bare, surface], [apart, half]))
    assert len(outline) == 0 and "is a mesh alone, without spheres" in lines[0]


def test_the_page_needs_no_other_file(cube, tmp_path):
    path = tmp_path / "cube.html"
    page = ist.plot(cube, path=path)
    assert path.read_text(encoding="utf-8") == str(page)
    assert not re.search(r"https?://|src=|href=|@import", str(page))


@pytest.mark.parametrize("poses, scales, error, text", [
    (np.zeros((3, 7)), None, ValueError, r"poses: shape \(3, 7\); wanted \(2, 7\)"),
    (np.zeros((2, 7)), None, ValueError, "row 0 is no pose"),
    (None, [1, 2, 3], ValueError, r"scales: shape \(3,\)"),
    (None, [1, 0], ValueError, "row 1 is no pose, or its scale"),
])
def test_wrong_places_are_named(cube, poses, scales, error, text):
    with pytest.raises(error, match=text):
        ist.plot([cube, cube], poses, scales=scales)


def test_what_cannot_be_drawn_is_named(cube):
    with pytest.raises(TypeError, match=r"solids\[1\]: a BallShape; wanted an Asset"):
        ist.plot([cube, ist.BallShape(1)])
    with pytest.raises(ValueError, match="nothing to draw"):
        ist.plot([])
