"""trimesh's CollisionManager by exact overlaps and distances: `from ist.trimesh import CollisionManager`.

Methods, arguments and what they return are those of trimesh.collision.CollisionManager (trimesh 5.2),
which asks FCL. What differs: a mesh is a solid here, convex or not, so that one within another
collides; a mesh that is not closed raises ist.OpenMeshError unless `repair`; the depth of a contact
is its volume over its area (at most the volume's cube root), and each contact tells its volume and
whether it only touches.
"""

import hashlib
import operator

import numpy as np

import ist

__all__ = ["CollisionManager", "ContactData", "DistanceData", "scene_to_collision"]

_ASIDE, _WAY = 1e-9, np.array([0.36, 0.48, 0.8])  # of an object's size, and where to
_FIRST = 16  # distances that are queried first: the best of them bounds the others
_SOME = 64  # objects that are asked first: one of them may collide already


class _Data:
    """What both kinds of data have: names, and the face of a mesh that is nearest to a point."""

    def __init__(self, pairs, i):
        self._objects = pairs.objects(i)
        self._poses = pairs.poses_a[i], pairs.poses_b[i]

    @property
    def names(self):
        return {one.name for one in self._objects}

    def _of(self, name, values):
        return dict(zip([one.name for one in self._objects], values))[name]

    def _face(self, name, point):
        one, pose = self._of(name, zip(self._objects, self._poses))
        return one.face(pose, point)


class ContactData(_Data):
    """A contact of two objects.

    normal: (3,) unit, from the first object to the second; zero where they touch in a point or edge, or
    where no way leads out, as of a bar through a plate.
    point: (3,) [u] world; NaN where they touch in points or edges alone and none of them is found.
    depth: [u] ≥ 0. volume: [u³] of the overlap there. touching: whether they touch, and do not overlap.
    """

    def __init__(self, pairs, i, normal, point, depth, volume):
        super().__init__(pairs, i)
        self.normal, self.point, self.depth, self.volume = normal, point, depth, volume

    @property
    def touching(self):
        return self.volume == 0

    def index(self, name):
        """The face of that object's mesh which is nearest to the point."""
        return self._face(name, self.point)


class DistanceData(_Data):
    """The distance of two objects [u]: negative where they overlap, by the depth of the deepest contact."""

    def __init__(self, pairs, i, distance, points):
        super().__init__(pairs, i)
        self.distance, self._points = distance, points

    def point(self, name):
        """(3,) [u] on that object, world."""
        return self._of(name, self._points)

    def index(self, name):
        """The face of that object's mesh which is nearest to its point."""
        return self._face(name, self.point(name))


class _Object:
    """A mesh and its asset."""

    def __init__(self, name, mesh, asset, size):
        self.name, self.mesh, self.asset, self.size = name, mesh, asset, size

    def face(self, pose, point):
        import trimesh

        local = np.asarray(point) - pose[4:]
        w, v = pose[0], -pose[1:4]  # turns back
        turned = 2 * np.cross(v, local)
        local = local + w * turned + np.cross(v, turned)
        triangles = np.asarray(self.mesh.triangles)
        near = trimesh.triangles.closest_point(triangles, np.broadcast_to(local, (len(triangles), 3)))
        return int(((near - local)**2).sum(axis=1).argmin())


def _put(pose, name, transform):
    """Writes a transform as a row of ist.poses."""
    try:
        ist._core._put_pose(pose, transform)
    except ValueError as error:
        raise ValueError(f"transform of {name}: {error}") from None


class _Bodies:
    """Objects as queries take them, a row each. A row that is free keeps what it had."""

    def __init__(self):
        self.objects, self.free = [], []
        self.poses = np.empty((16, 7))
        self._solids = None

    def put(self, one, pose):
        """The row that they get."""
        if self.free:
            row = self.free.pop()
            self.objects[row] = one
        else:
            row = len(self.objects)
            self.objects.append(one)
            if row == len(self.poses):
                self.poses = np.concatenate([self.poses, self.poses])
        self.poses[row] = pose
        self._solids = None
        return row

    def solids(self, rows):
        if self._solids is None:
            self._solids = ist.Solids([one.asset for one in self.objects])
        return self._solids[rows]


class CollisionManager:
    """Objects by name, and what of them collides. Meshes of equal content are prepared once.

    repair: close open meshes, as ist.close_mesh does, instead of raising.
    """

    def __init__(self, *, repair=False):
        self._repair = repair
        self._objs = {}  # rows of bodies
        self._bodies = _Bodies()
        self._assets = {}  # and sizes, by content
        self._scene, self._room, self._pairs = None, 0, 16  # made where it is needed, for so many
        self._margin = 0  # of the scene
        self._moved = set()  # rows that the scene has elsewhere
        self._found = None  # the pairs of a margin, until something moves
        self._hit = None  # rows of two objects that collided

    def add_object(self, name, mesh, transform=None):
        """Adds or replaces an object: anything with `vertices` and `faces`. transform: (4, 4), rigid.

        Returns its ist.Asset.
        """
        added, pose = self._object(name, mesh, transform)
        if name in self._objs:
            self.remove_object(name)
        row = self._objs[name] = self._bodies.put(added, pose)
        self._found = self._hit = None
        if self._scene is not None and len(self._objs) <= self._room:
            self._scene.add(added.asset, pose, number=row)
        else:
            self._scene = None
        return added.asset

    def remove_object(self, name):
        row = self._row(name)
        if self._scene is not None:
            self._scene.remove(row)
            self._moved.discard(row)
        self._found = self._hit = None
        self._bodies.free.append(row)
        del self._objs[name]

    def set_transform(self, name, transform):
        row = self._row(name)
        _put(self._bodies.poses[row], name, transform)
        self._found = None
        self._moved.add(row)

    def in_collision_single(self, mesh, transform=None, return_names=False, return_data=False):
        """Whether a mesh collides with any object; the set of their names; a list of ContactData."""
        pairs = self._near(*self._single(mesh, transform))
        found, names, data = _collide(pairs, return_names, return_data)
        return _told(found, {a for a, _ in names}, data, return_names, return_data)

    def in_collision_internal(self, return_names=False, return_data=False):
        """Whether any two objects collide; the set of their names, sorted in each pair."""
        if not (return_names or return_data):
            return self._meet()
        found, names, data = _collide(self._within(), return_names, return_data)
        return _told(found, {tuple(sorted(pair)) for pair in names}, data, return_names, return_data)

    def in_collision_other(self, other_manager, return_names=False, return_data=False):
        """Whether an object collides with one of another manager; names are (own, other's)."""
        others, rows = other_manager._bodies, list(other_manager._objs.values())
        if not (return_names or return_data):
            ends = [0, *range(_SOME, len(rows), 8 * _SOME), len(rows)]
            return any(len(_hits(self._near(others, rows[i:j]), True)[0]) > 0 for i, j in zip(ends, ends[1:]))
        found, names, data = _collide(self._near(others, rows), return_names, return_data)
        return _told(found, set(names), data, return_names, return_data)

    def min_distance_single(self, mesh, transform=None, return_name=False, return_data=False):
        """The least distance of a mesh from any object [u], negative inside; inf without objects."""
        single, rows = self._single(mesh, transform)
        distance, names, data = _nearest(lambda margin: self._near(single, rows, margin), len(self._objs),
                                         single.objects[0].size, return_data)
        return _told(distance, names and names[0], data, return_name, return_data)

    def min_distance_internal(self, name=None, return_names=False, return_data=False):
        """The least distance of two objects, or of object `name` from the others."""
        count = len(self._objs)
        if name is None:
            distance, names, data = _nearest(self._within, count * (count - 1) // 2, self._size(), return_data)
        else:
            row = self._row(name)
            distance, names, data = _nearest(lambda margin: self._near(self._bodies, [row], margin, itself=False),
                                             count - 1, self._bodies.objects[row].size, return_data)
        return _told(distance, names and tuple(sorted(names)), data, return_names, return_data)

    def min_distance_other(self, other_manager, return_names=False, return_data=False):
        """The least distance of an object from one of another manager; names are (own, other's)."""
        others, rows = other_manager._bodies, list(other_manager._objs.values())
        distance, names, data = _nearest(lambda margin: self._near(others, rows, margin),
                                         len(self._objs) * len(rows), self._size(), return_data)
        return _told(distance, names, data, return_names, return_data)

    def _meet(self):
        """Whether any two objects collide. Those that did are asked first."""
        if self._hit is not None and len(_hits(_Pairs(self._bodies, self._bodies, *self._hit), True)[0]) > 0:
            return True
        pairs = self._within()
        hits = _hits(pairs, True)[0]
        self._hit = (pairs.first[hits], pairs.second[hits]) if len(hits) > 0 else None
        return len(hits) > 0

    def _size(self):
        """Of the smallest object."""
        return min((self._bodies.objects[row].size for row in self._objs.values()), default=np.inf)

    def _within(self, margin=0):
        """The pairs whose boxes are no further apart than the margin."""
        while self._found is None or self._found[0] != margin:
            scene = self._placed(margin)
            rows = np.fromiter(self._moved, int, len(self._moved))
            try:
                found = scene._step_pairs(self._bodies.poses[rows], rows)
            except ist.Error:  # more pairs than there is room for, or, with room for all, something else
                self._scene = None
                if self._pairs >= self._room:
                    raise
                self._pairs *= 8
                continue
            self._moved = set()
            self._found = margin, _Pairs(self._bodies, self._bodies, *found)
        return self._found[1]

    def _placed(self, margin):
        """The scene of all objects, where they were at its last step."""
        if self._scene is None:
            self._room = 2 * len(self._objs) + 2
            self._scene = ist.Scene(max_bodies=self._room, max_pairs=self._pairs * self._room, threads=1)
            self._moved, self._margin = set(), None
            for row in self._objs.values():
                self._scene.add(self._bodies.objects[row].asset, self._bodies.poses[row], number=row)
        if self._margin != margin:
            self._scene.set_rule(answer="boxes", measure="exact", margin=margin)
            self._margin = margin
        return self._scene

    def _near(self, others, rows, margin=0, itself=True):
        """As _within(), of objects of this manager and of others in these rows. itself: an object is near itself."""
        if self._moved:
            self._within()
        rows = np.array(rows, int)
        first, second = self._placed(0)._near(others.solids(rows), others.poses[rows], margin)
        if not itself:
            first, second = first[first != second], second[first != second]
        return _Pairs(self._bodies, others, first, second)

    def _row(self, name):
        if name not in self._objs:
            raise ValueError(f"{name} not in collision manager!")
        return self._objs[name]

    def _object(self, name, mesh, transform):
        """And its pose."""
        content = hashlib.sha256()
        for array in (mesh.vertices, mesh.faces):
            content.update(np.ascontiguousarray(array).tobytes())
        key = content.digest()
        if key not in self._assets:
            closed = ist.close_mesh(ist.from_trimesh(mesh), name=str(name), repair=self._repair)
            asset = ist.bake_mesh_only(closed)
            box = asset.bounds()
            self._assets[key] = asset, float((box.upper - box.lower).max())
        pose = np.array([1., 0, 0, 0, 0, 0, 0])
        if transform is not None:
            _put(pose, name, transform)
        return _Object(name, mesh, *self._assets[key]), pose

    def _single(self, mesh, transform):
        """A body that is in no manager, and its row."""
        bodies = _Bodies()
        bodies.put(*self._object("__external", mesh, transform))
        return bodies, [0]


def scene_to_collision(scene, *, repair=False):
    """A CollisionManager of a trimesh.Scene's meshes, as they stand there, and {node: ist.Asset}."""
    manager = CollisionManager(repair=repair)
    assets = {}
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if not hasattr(mesh, "faces"):  # a path or points
            continue
        if np.abs(transform[:3, :3].T @ transform[:3, :3] - np.eye(3)).max() > 1e-9 or np.linalg.det(transform) < 0:
            # The mesh takes the part of the transform that is not a pose: scales and mirror images.
            mesh = mesh.copy()
            mesh.apply_transform(transform)
            transform = None
        assets[node] = manager.add_object(node, mesh, transform)
    return manager, assets


class _Pairs:
    """Pairs of objects: their rows among those of either side, and their poses."""

    def __init__(self, of_a, of_b, first, second):
        self.of_a, self.of_b, self.first, self.second = of_a, of_b, first, second
        self.poses_a, self.poses_b = of_a.poses[first], of_b.poses[second]

    def __len__(self):
        return len(self.first)

    def ask(self, query, chosen=slice(None), aside=0, **settings):
        """The query of some of them, in one call. aside: of B, in sizes of A."""
        first = self.first[chosen]
        poses = self.poses_b[chosen]
        if aside:
            poses = poses.copy()
            poses[:, 4:] += (aside * np.array([self.of_a.objects[row].size for row in first]))[:, None] * _WAY
        return query(self.of_a.solids(first), self.of_b.solids(self.second[chosen]), poses,
                     poses_a=self.poses_a[chosen], **settings)

    def penetration(self, chosen):
        answers = self.ask(ist.penetration, chosen, measure="exact")
        _refuse_unanswered(self, chosen, answers.status)
        return answers

    def touched(self, chosen, answers, rows):
        """(k, 3): the middle of the faces that lie on each other, or else where solids touch."""
        points = np.where(answers.contact_area[rows, None] > 0, answers.centroid[rows], np.nan)
        for aside in (_ASIDE, -_ASIDE):
            left = np.flatnonzero(np.isnan(points[:, 0]))
            if len(left) > 0:
                apart = self.ask(ist.separation, chosen[rows[left]], aside)
                points[left] = np.where(apart.distance[:, None] > 0, (apart.point_a + apart.point_b) / 2, np.nan)
        return points

    def objects(self, i):
        return self.of_a.objects[self.first[i]], self.of_b.objects[self.second[i]]

    def names(self, i):
        return tuple(one.name for one in self.objects(i))


def _hits(pairs, only_first, tells_touching=False):
    """(those that collide, or the first of them; whether each only touches, where that is asked)"""
    if len(pairs) == 0:
        return np.zeros(0, int), np.zeros(0, bool)
    hits, touching, stopped, status = pairs.ask(ist._core._collisions, only_first=only_first,
                                                tells_touching=tells_touching)
    if stopped >= 0:
        _refuse_unanswered(pairs, [stopped], np.array([status]))
    return hits, touching


def _collide(pairs, with_names, with_data):
    """(whether any collide, their names, their ContactData)"""
    hits, touching = _hits(pairs, not (with_names or with_data), with_data)
    names = [pairs.names(i) for i in hits.tolist()]
    if not with_data:
        return len(hits) > 0, names, []
    data = _touches(pairs, hits[touching])
    for i in hits[~touching].tolist():
        data += _parts(pairs, i)
    return len(hits) > 0, names, [contact for _, contact in sorted(data, key=operator.itemgetter(0))]


def _touches(pairs, chosen):
    """[(i, ContactData)] of pairs that touch."""
    if len(chosen) == 0:
        return []
    answers = pairs.penetration(chosen)
    points = pairs.touched(chosen, answers, np.arange(len(chosen)))
    return [(i, ContactData(pairs, i, normal, point, 0.0, 0.0))
            for i, normal, point in zip(chosen.tolist(), answers.contact_normal, points)]


def _parts(pairs, i):
    """[(i, ContactData)] of the connected parts of the overlap of a pair, the largest first."""
    a, b = pairs.objects(i)
    sides = []
    for aside in (-_ASIDE, _ASIDE):
        pose = pairs.poses_b[i].copy()
        pose[4:] += aside * a.size * _WAY
        found = ist.overlap_outline(a.asset, b.asset, pose, poses_a=pairs.poses_a[i], max_patches=32).contact
        sides.append((int(found.count), found.force, found.volume, found.point))
    count = sides[0][0]
    if sides[1][0] != count:
        sides = sides[:1]
    orders = [np.argsort(-side[2][:count]) for side in sides]
    force, volume, point = (sum(side[k][order] for side, order in zip(sides, orders)) / len(sides)
                            for k in (1, 2, 3))
    normal, area = _directions(force, volume), np.linalg.norm(force, axis=1)
    return [(i, ContactData(pairs, i, normal[k], point[k], ist._core._depth(volume[k], area[k]), float(volume[k])))
            for k in range(count)]


def _directions(force, volume):
    """Unit; zero where forces cancel but for rounding, as of a bar through a plate."""
    area = np.linalg.norm(force, axis=1)[:, None]
    return np.where(area > 1e-9 * np.cbrt(volume**2)[:, None], force / np.maximum(area, 1e-300), 0)


def _nearest(near_by, count, margin, with_data):
    """(least distance, names, DistanceData); negative where solids overlap, by volume over area.

    near_by(margin): pairs whose boxes are no further apart, of `count` in all. margin: tried first.
    """
    best, nearest = np.inf, None
    looked, pairs = -1.0, near_by(0)
    if len(pairs) > 0:
        best, nearest = _deepest(pairs)
    while count > 0 and looked < best and best > 0 and looked < 1e37:
        looked = best if best < np.inf else margin
        pairs, margin = near_by(looked), 4 * margin
        if len(pairs) > 0:
            best, nearest = _least(pairs, best, nearest)
        if len(pairs) == count:
            break
    if nearest is None:
        return float("inf"), None, None
    pairs, i, points = nearest
    data = DistanceData(pairs, i, float(best), points) if with_data else None
    return float(best), pairs.names(i), data


def _deepest(pairs):
    """(minus the depth of the deepest overlap, (pairs, its number, points on both)); 0 where solids
    only touch, inf where they do not."""
    distance, i, volume, (force, point), status = pairs.ask(ist._core._deepest, way=_ASIDE * _WAY)
    if i < 0:
        return distance, None
    _refuse_unanswered(pairs, [i], np.array([status]))
    if distance == 0:
        one = np.array([i])
        point, = pairs.touched(one, pairs.penetration(one), one * 0)
        return 0.0, (pairs, i, (point, point))
    half = -0.5 * distance * _directions(force[None], np.array([volume]))[0]
    return distance, (pairs, i, (point + half, point - half))


def _least(pairs, best, nearest):
    """As _deepest(), of solids that do not overlap, where one is nearer than `best`."""
    gap = np.maximum(pairs.ask(ist._core._nearness), 0)
    order, begin, size = np.argsort(gap, kind="stable"), 0, _FIRST
    while begin < len(order) and gap[order[begin]] < best:
        chosen = order[begin:begin + size]
        chosen = chosen[gap[chosen] < best]
        found = pairs.ask(ist.separation, chosen, **({"max_distance": best} if best < np.inf else {}))
        _refuse_unanswered(pairs, chosen, found.status)
        k = int(found.distance.argmin())
        if found.distance[k] < best:
            best, nearest = found.distance[k], (pairs, int(chosen[k]), (found.point_a[k], found.point_b[k]))
        begin, size = begin + size, 4 * size
    return best, nearest


def _refuse_unanswered(pairs, chosen, status):
    for k in np.flatnonzero(status != int(ist.QueryStatus.ok))[:1]:
        name = ist.QueryStatus(int(status[k])).name
        raise ist.Error(f"{' and '.join(map(str, pairs.names(chosen[k])))}: {name}")


def _told(found, names, data, with_names, with_data):
    out = [found] + [names] * bool(with_names) + [data] * bool(with_data)
    return out[0] if len(out) == 1 else tuple(out)
