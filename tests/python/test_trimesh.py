"""ist.trimesh.CollisionManager: what it tells, beside queries of pairs and solids whose answers are known."""
import itertools

import numpy as np
import pytest

import ist
from ist.trimesh import CollisionManager


class Box:
    """A mesh as trimesh has it, of side 2 · half."""

    def __init__(self, half=0.5, top=True):
        corners = np.array(list(itertools.product((-half, half), repeat=3)))
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4)] + [(1, 5, 7, 3)] * top
        self.vertices = corners
        self.faces = np.array([f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])


def at(x, y=0, z=0):
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def test_what_collides():
    m = CollisionManager()
    m.add_object("a", Box())
    m.add_object("b", Box(), at(5))
    assert m.in_collision_internal() is False and m.in_collision_single(Box()) is True
    hit, names, data = m.in_collision_single(Box(), at(5.75), return_names=True, return_data=True)
    assert hit is True and names == {"b"} and len(data) == 1 and data[0].names == {"b", "__external"}
    assert data[0].depth == pytest.approx(0.25) and data[0].volume == pytest.approx(0.25)
    assert data[0].normal == pytest.approx([1, 0, 0], abs=1e-8) and not data[0].touching
    assert data[0].point == pytest.approx([5.375, 0, 0], abs=1e-6)
    assert m.in_collision_single(Box(), at(2), return_names=True) == (False, set())
    m.add_object("c", Box(), at(5, 1))  # flush
    hit, names, data = m.in_collision_internal(return_names=True, return_data=True)
    assert hit is True and names == {("b", "c")}
    assert data[0].touching and data[0].depth == 0 and np.abs(data[0].normal) == pytest.approx([0, 1, 0])
    m.set_transform("c", at(5, 1.001))
    assert m.in_collision_internal() is False
    m.add_object("c", Box(0.1), at(0.1))  # within: a solid has no hollow
    assert m.in_collision_internal(return_names=True) == (True, {("a", "c")})
    m.remove_object("c")
    assert m.in_collision_internal() is False
    n = CollisionManager()
    n.add_object("a", Box(), at(-5))
    assert m.in_collision_other(n) is False
    n.add_object("d", Box(), at(5))
    assert m.in_collision_other(n, return_names=True) == (True, {("b", "d")})


def test_a_manager_beside_an_empty_one_and_itself():
    m, empty = CollisionManager(), CollisionManager()
    for name, x in (("a", 0), ("b", 0.75), ("c", 5)):
        m.add_object(name, Box(), at(x))
    for one, other in ((m, empty), (empty, m), (empty, empty)):
        assert one.in_collision_other(other, return_names=True, return_data=True) == (False, set(), [])
        assert one.in_collision_other(other) is False
        assert one.min_distance_other(other, return_names=True) == (np.inf, None)
    assert empty.in_collision_internal(return_names=True) == (False, set())
    every = {(x, y) for x in "ab" for y in "ab"} | {("c", "c")}  # as FCL tells it
    assert m.in_collision_other(m, return_names=True) == (True, every)
    assert m.min_distance_other(m) == pytest.approx(-1) and m.min_distance_internal("c") == 3.25
    alone = CollisionManager()
    alone.add_object("a", Box())
    assert alone.in_collision_other(alone) is True and alone.min_distance_internal("a") == np.inf


def test_a_bar_through_a_plate():
    bar, plate = Box(), Box()
    bar.vertices, plate.vertices = bar.vertices * (1, 2, 10), plate.vertices * (8, 9, 2)
    m = CollisionManager()
    m.add_object("bar", bar)
    m.add_object("plate", plate, at(0.3, 0.7, 1.1))
    contact, = m.in_collision_internal(return_data=True)[1]
    assert contact.volume == pytest.approx(4) and contact.normal.tolist() == [0, 0, 0]  # no way leads out
    assert m.min_distance_internal() == pytest.approx(-np.cbrt(4))


def test_how_far():
    m = CollisionManager()
    assert m.min_distance_single(Box()) == np.inf and m.min_distance_internal() == np.inf
    m.add_object("a", Box(), at(5))
    assert m.min_distance_single(Box(), return_name=True) == (4, "a")
    assert m.min_distance_single(Box(), at(5.75)) == pytest.approx(-0.25)
    assert m.min_distance_single(Box(), at(6)) == 0
    m.add_object("b", Box(), at(-5))
    assert m.min_distance_internal(return_names=True) == (9, ("a", "b"))
    m.add_object("c", Box(), at(2))
    assert m.min_distance_internal(return_names=True) == (2, ("a", "c"))
    assert m.min_distance_internal("b", return_names=True) == (6, ("b", "c"))
    n = CollisionManager()
    n.add_object("d", Box(), at(0, 0, 3))
    far, names, data = m.min_distance_other(n, return_names=True, return_data=True)
    assert names == ("c", "d") and data.distance == far
    assert np.linalg.norm(data.point("c") - data.point("d")) == pytest.approx(far)


def test_many_are_asked_as_pairs():
    rng = np.random.default_rng(3)
    m, boxes = CollisionManager(), []
    for i in range(60):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        transform = at(*rng.uniform(0, 5, 3))
        transform[:3, :3] = turn * np.sign(np.linalg.det(turn)) if i % 2 else np.eye(3)
        transform[:3, 3] = transform[:3, 3] if i % 2 else np.round(transform[:3, 3])
        boxes.append(transform)
        m.add_object(i, Box(), transform)
    asset = m.add_object(0, Box(), boxes[0])
    poses = ist.poses(np.array(boxes))
    told = m.in_collision_internal(return_names=True)[1]
    for i in range(60):
        for j in range(i):
            found = ist.penetration(asset, asset, poses[i], poses_a=poses[j], measure="exact")
            assert (tuple(sorted((i, j))) in told) == (found.volume > 0 or found.touching), (i, j)
    moved = at(9, 9, 9)
    gaps = [ist.separation(asset, asset, ist.poses(moved), poses_a=pose).distance for pose in poses]
    assert m.min_distance_single(Box(), moved, return_name=True) == (min(gaps), int(np.argmin(gaps)))


def test_where_solids_touch():
    m = CollisionManager()
    m.add_object("a", Box(), at(5, 6, 7))
    for aside, point in (((1, 0.5, 0), (5.5, 6.25, 7)),  # in a face: its middle
                         ((1, -1, 0.5), (5.5, 5.5, None)),  # along an edge
                         ((-1, 1, 1), (4.5, 6.5, 7.5))):
        there = at(5 + aside[0], 6 + aside[1], 7 + aside[2])
        contact, = m.in_collision_single(Box(), there, return_data=True)[1]
        assert contact.touching and contact.depth == 0
        far, data = m.min_distance_single(Box(), there, return_data=True)
        assert far == data.distance == 0
        for told in (contact.point, data.point("a"), data.point("__external")):
            assert all(x == pytest.approx(y, abs=1e-8) for x, y in zip(told, point) if y is not None)
            assert np.abs(told - (5, 6, 7)).max() <= 0.5 + 1e-8


def test_a_collision_that_ends_is_not_told_again():
    m = CollisionManager()
    for name, x in (("a", 0), ("b", 0.5), ("c", 5), ("d", 6)):
        m.add_object(name, Box(), at(x))
    assert m.in_collision_internal() is True
    m.set_transform("b", at(2))
    assert m.in_collision_internal() is True and m.in_collision_internal(return_names=True)[1] == {("c", "d")}
    m.remove_object("d")
    assert m.in_collision_internal() is False
    m.add_object("e", Box(), at(2.5))
    assert m.in_collision_internal() is True
    m.add_object("e", Box(), at(9))
    assert m.in_collision_internal() is False


def test_the_deepest_of_all_overlaps():
    rng = np.random.default_rng(5)
    for _ in range(20):
        m, n = CollisionManager(), 25
        halves, poses = rng.uniform(0.2, 0.8, n), rng.normal(size=(n, 7))
        poses[:, 4:] *= rng.uniform(0.5, 2)
        for i, (half, pose) in enumerate(zip(halves, poses)):
            transform = at(*pose[4:])
            w, x, y, z = pose[:4] / np.linalg.norm(pose[:4])
            transform[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                                 [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                                 [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
            m.add_object(i, Box(half), transform)
        first, second = np.triu_indices(n, 1)
        assets = ist.Solids([m.add_object("other", Box(half)) for half in halves])
        m.remove_object("other")
        found = ist.penetration(assets[first], assets[second], poses[second], poses_a=poses[first], measure="exact")
        area = np.linalg.norm(found.force, axis=1)
        depth = np.minimum(found.volume / np.maximum(area, 1e-300), np.cbrt(found.volume))
        far, names = m.min_distance_internal(return_names=True)
        assert far == pytest.approx(-depth.max(), rel=1e-6)
        assert names == (first[depth.argmax()], second[depth.argmax()])


def test_the_deepest_of_what_is_flush():
    rng = np.random.default_rng(7)
    found = {"deep": 0, "touching": 0, "apart": 0}
    for _ in range(60):
        spread = rng.choice((4, 9))
        m, spots = CollisionManager(), rng.integers(-spread, spread + 1, (8, 3)) / 2
        halves = rng.choice((0.25, 0.5, 1), 8)
        assets = [m.add_object(i, Box(half), at(*spot)) for i, (half, spot) in enumerate(zip(halves, spots))]
        told = {}
        for i, j in itertools.combinations(range(8), 2):
            def ask(aside):
                pose = np.array([1, 0, 0, 0, *(spots[j] + 2 * halves[i] * aside * np.array((0.36, 0.48, 0.8)))])
                return ist.penetration(assets[i], assets[j], pose, poses_a=[1, 0, 0, 0, *spots[i]], measure="exact")

            if ask(0).volume > 0:
                under, over = ask(-1e-9), ask(1e-9)
                volume = (under.volume + over.volume) / 2
                area = np.linalg.norm(under.force + over.force) / 2
                told[i, j] = -min(volume / max(area, 1e-300), np.cbrt(volume))
            else:
                told[i, j] = np.linalg.norm(np.maximum(np.abs(spots[i] - spots[j]) - halves[i] - halves[j], 0))
        least = min(told.values())
        far, names, data = m.min_distance_internal(return_names=True, return_data=True)
        assert far == data.distance == pytest.approx(least, rel=1e-12)
        assert told[names] == pytest.approx(least, rel=1e-12)
        found["deep" if least < 0 else "touching" if least == 0 else "apart"] += 1
    assert min(found.values()) > 0


def test_few_of_many_are_looked_at(monkeypatch):
    real, rooms = ist.Scene, []
    monkeypatch.setattr(ist, "Scene", lambda **settings: rooms.append(settings["max_pairs"]) or real(**settings))
    m = CollisionManager()
    for i in range(1500):  # room for 16 pairs each does not hold what meets at the origin
        m.add_object(i, Box(), at(0) if i < 400 else at(3 * (i % 20), 3 * (i // 20 % 20), 3 * (i // 400 + 1)))
    assert len(m.in_collision_internal(return_names=True)[1]) == 400 * 399 // 2
    assert len(rooms) == 2 and sum(rooms) < 1500**2 / 4
    assert m.in_collision_single(Box(), at(3.9, 3, 9), return_names=True)[1] == {821}
    assert m.min_distance_single(Box(), at(-1000), return_name=True)[0] == 999
    for i in range(400):
        m.remove_object(i)
    assert m.min_distance_internal() == 2
    m.set_transform(500, at(0, 0, -1e6))
    assert m.min_distance_internal(500) == pytest.approx(1e6 + 5)
    n = CollisionManager()
    n.add_object("far", Box(), at(0, 0, -1e6 - 3))
    assert m.min_distance_other(n, return_names=True) == (2, (500, "far"))


def test_the_one_of_many_that_another_manager_meets():
    m, n = CollisionManager(), CollisionManager()
    m.add_object("a", Box())
    for i in range(600):
        n.add_object(i, Box(), at(3 * i + 3))
    assert m.in_collision_other(n) is n.in_collision_other(m) is False
    for i in (0, 63, 64, 575, 576, 599):
        n.set_transform(i, at(0.5))
        assert m.in_collision_other(n) is n.in_collision_other(m) is True
        assert m.in_collision_other(n, return_names=True) == (True, {("a", i)})
        n.set_transform(i, at(0, 3))
        assert m.in_collision_other(n) is False and m.min_distance_other(n, return_names=True) == (2, ("a", i))
        n.remove_object(i)


def test_what_a_scene_refuses_is_raised(monkeypatch):
    class Broken:
        def __init__(self, **settings):
            pass

        def __getattr__(self, name):
            return lambda *arguments, **settings: 0

        def _step_pairs(self, *arguments):
            raise ist.Error("no step")

    monkeypatch.setattr(ist, "Scene", Broken)
    m = CollisionManager()
    m.add_object("a", Box(), at(0))
    with pytest.raises(ist.Error, match="no step"):
        m.in_collision_internal()


def test_scenes_scale_and_mirror():
    trimesh = pytest.importorskip("trimesh")
    from ist.trimesh import scene_to_collision

    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box(), node_name="large", transform=np.diag([2, 2, 2, 1.]))
    scene.add_geometry(trimesh.creation.box(), node_name="mirrored", transform=at(1.4) @ np.diag([-1, 1, 1, 1.]))
    scene.add_geometry(trimesh.PointCloud(np.eye(3)), node_name="points")
    manager, assets = scene_to_collision(scene)
    assert set(assets) == {"large", "mirrored"}
    assert manager.min_distance_internal() == pytest.approx(-0.1)
    assert manager.in_collision_internal(return_data=True)[1][0].volume == pytest.approx(0.1)


def test_mistakes_are_told():
    m = CollisionManager()
    with pytest.raises(ist.OpenMeshError, match="lid: .*not closed"):
        m.add_object("lid", Box(top=False))
    CollisionManager(repair=True).add_object("lid", Box(top=False))
    for call in (lambda: m.remove_object("x"), lambda: m.set_transform("x", at(1)),
                 lambda: m.min_distance_internal("x")):
        with pytest.raises(ValueError, match="x not in collision manager!"):
            call()
    with pytest.raises(ValueError, match="transform must be"):
        m.add_object("a", Box(), np.eye(3))
    with pytest.raises(ValueError, match="transform of a: must be finite"):
        m.add_object("a", Box(), np.full((4, 4), np.nan))
    with pytest.raises(ValueError, match="transform of a: it is no rigid motion: .*; scale or mirror the mesh"):
        m.add_object("a", Box(), np.diag([2, 2, 2, 1]))
    m.add_object("a", Box(), at(3))
    for wrong in (np.diag([1, 1, -1, 1]), np.full((4, 4), np.inf), at(np.nan), np.eye(4)[:3]):
        with pytest.raises(ValueError, match="transform"):
            m.set_transform("a", wrong)
    assert m.min_distance_single(Box()) == 2  # where it was
    for call in (lambda: m.in_collision_single(Box(), at(1e38)), lambda: m.min_distance_single(Box(), at(1e38)),
                 lambda: m.set_transform("a", at(1e38)) or m.in_collision_internal()):
        with pytest.raises(ValueError, match="reaches beyond 1e37 u"):  # no scene holds it
            call()


def test_the_face_of_a_contact():
    pytest.importorskip("trimesh")
    import trimesh

    m = CollisionManager()
    m.add_object("a", trimesh.creation.box((1, 1, 1)))
    data = m.min_distance_single(trimesh.creation.box((0.2, 0.2, 0.2)), at(3), return_data=True)[1]
    m.set_transform("a", at(6))  # what was told is of before
    m.add_object("a", trimesh.creation.box((4, 4, 4)), at(6))
    assert trimesh.creation.box((1, 1, 1)).face_normals[data.index("a")] == pytest.approx([1, 0, 0])
