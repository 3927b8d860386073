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
_FIRST = 16  # distances that are asked first: the best of them bounds the others


class _Data:
    """What both kinds of data have: names, and the face of a mesh that is nearest to a point."""

    def __init__(self, names, objects):
        self.names = set(names)
        self._objects = dict(zip(names, objects))

    def _face(self, name, point):
        return self._objects[name].face(point)


class ContactData(_Data):
    """A contact of two objects.

    normal: (3,) unit, from the first object to the second; zero where they touch in a point or edge.
    point: (3,) [u] world. depth: [u] ≥ 0. volume: [u³] of the overlap there. touching: whether they
    touch, and do not overlap.
    """

    def __init__(self, names, objects, normal, point, depth, volume):
        super().__init__(names, objects)
        self.normal, self.point = normal, point
        self.depth, self.volume = float(depth), float(volume)

    @property
    def touching(self):
        return self.volume == 0

    def index(self, name):
        """The face of that object's mesh which is nearest to the point."""
        return self._face(name, self.point)


class DistanceData(_Data):
    """The distance of two objects [u]: negative where they overlap, by the depth of the deepest contact."""

    def __init__(self, names, objects, distance, points):
        super().__init__(names, objects)
        self.distance = float(distance)
        self._points = dict(zip(names, points))

    def point(self, name):
        """(3,) [u] on that object, world."""
        return self._points[name]

    def index(self, name):
        """The face of that object's mesh which is nearest to its point."""
        return self._face(name, self._points[name])


class _Object:
    """A mesh at a pose."""

    def __init__(self, name, mesh, asset, transform):
        self.name, self.mesh, self.asset = name, mesh, asset
        self.box = np.array([asset.bounds().lower, asset.bounds().upper])
        self.size = (self.box[1] - self.box[0]).max()
        self.set_transform(transform)

    def set_transform(self, transform):
        transform = np.eye(4) if transform is None else np.array(transform, dtype=np.float64)
        if transform.shape != (4, 4):
            raise ValueError("transform must be (4,4)!")
        if not np.isfinite(transform).all():
            raise ValueError(f"transform of {self.name}: must be finite")
        if not _is_rigid(*transform.tolist()):
            try:
                ist.poses(transform)
            except ValueError as error:
                why = str(error).partition(": ")[2].replace("matrix 0", "it", 1)
                raise ValueError(f"transform of {self.name}: {why}; scale or mirror the mesh") from None
        self.transform = transform

    def face(self, point):
        import trimesh

        inverse = np.linalg.inv(self.transform)
        local = inverse[:3, :3] @ np.asarray(point) + inverse[:3, 3]
        triangles = np.asarray(self.mesh.triangles)
        near = trimesh.triangles.closest_point(triangles, np.broadcast_to(local, (len(triangles), 3)))
        return int(((near - local)**2).sum(axis=1).argmin())


def _is_rigid(x, y, z, last):
    """As ist.poses has it, of a matrix's rows."""
    columns = list(zip(x[:3], y[:3], z[:3]))
    off = max(abs(sum(map(operator.mul, u, v)) - (u is v)) for u in columns for v in columns)
    (a, b, c), (d, e, f), (g, h, i) = columns
    return off < 1e-6 and a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0 and last == [0, 0, 0, 1]


class _Bodies:
    """Objects as queries take them, a row each."""

    def __init__(self, objects):
        self.objects = list(objects)
        self.solids = ist.Solids([one.asset for one in self.objects])
        self.sizes = np.array([one.size for one in self.objects])
        self.poses, self.low, self.high = (np.empty((len(self.objects), width)) for width in (7, 3, 3))
        self.move(np.arange(len(self.objects)))

    def move(self, rows):
        """To where the objects are now."""
        if len(rows) == 0:
            return
        at = np.array([self.objects[row].transform for row in rows])
        box = np.array([self.objects[row].box for row in rows])
        self.poses[rows] = ist.poses(at)
        middle = np.einsum("nij,nj->ni", at[:, :3, :3], box.mean(axis=1)) + at[:, :3, 3]
        half = np.einsum("nij,nj->ni", np.abs(at[:, :3, :3]), (box[:, 1] - box[:, 0]) / 2)
        # (more than what placing a solid rounds)
        half += 1e-12 * (np.abs(middle).max(axis=1) + half.max(axis=1))[:, None]
        self.low[rows], self.high[rows] = middle - half, middle + half


class CollisionManager:
    """Objects by name, and what of them collides. Meshes of equal content are prepared once.

    repair: close open meshes, as ist.close_mesh does, instead of raising.
    """

    def __init__(self, *, repair=False):
        self._repair = repair
        self._objs = {}
        self._assets = {}
        self._scene, self._room, self._pairs = None, 0, 16  # made where it is needed, for so many
        self._moved = set()  # numbers of objects that the scene has elsewhere
        self._bodies = self._row = None  # rows of all objects, and those of the scene's numbers
        self._found = None  # the pairs of a margin, until something moves
        self._size = np.inf  # of the smallest object

    def add_object(self, name, mesh, transform=None):
        """Adds or replaces an object: anything with `vertices` and `faces`. transform: (4, 4), rigid.

        Returns its ist.Asset.
        """
        added = self._object(name, mesh, transform)
        if name in self._objs:
            self.remove_object(name)
        self._objs[name] = added
        self._bodies = self._row = self._found = None
        self._size = min(self._size, added.size)
        if self._scene is not None and len(self._objs) <= self._room:
            added.number = self._scene.add(added.asset, ist.poses(added.transform))
        else:
            self._scene = None
        return added.asset

    def remove_object(self, name):
        gone = self._of(name)
        if self._scene is not None:
            self._scene.remove(gone.number)
            self._moved.discard(gone.number)
        self._bodies = self._row = self._found = None
        del self._objs[name]

    def set_transform(self, name, transform):
        moved = self._of(name)
        moved.set_transform(transform)
        self._found = None
        if self._scene is not None:
            self._moved.add(moved.number)

    def in_collision_single(self, mesh, transform=None, return_names=False, return_data=False):
        """Whether a mesh collides with any object; the set of their names; a list of ContactData."""
        pairs = self._near(_Bodies([self._object("__external", mesh, transform)]))
        found, names, data = _collide(pairs, return_names, return_data)
        return _told(found, {a for a, _ in names}, data, return_names, return_data)

    def in_collision_internal(self, return_names=False, return_data=False):
        """Whether any two objects collide; the set of their names, sorted in each pair."""
        found, names, data = _collide(self._within(), return_names, return_data)
        return _told(found, {tuple(sorted(pair)) for pair in names}, data, return_names, return_data)

    def in_collision_other(self, other_manager, return_names=False, return_data=False):
        """Whether an object collides with one of another manager; names are (own, other's)."""
        pairs = self._near(_Bodies(other_manager._objs.values()))
        found, names, data = _collide(pairs, return_names, return_data)
        return _told(found, set(names), data, return_names, return_data)

    def min_distance_single(self, mesh, transform=None, return_name=False, return_data=False):
        """The least distance of a mesh from any object [u], negative inside; inf without objects."""
        single = _Bodies([self._object("__external", mesh, transform)])
        distance, names, data = _nearest(lambda margin: self._near(single, margin), len(self._objs),
                                         single.sizes[0], return_data)
        return _told(distance, names and names[0], data, return_name, return_data)

    def min_distance_internal(self, name=None, return_names=False, return_data=False):
        """The least distance of two objects, or of object `name` from the others."""
        count = len(self._objs)
        if name is None:
            distance, names, data = _nearest(self._within, count * (count - 1) // 2, self._size, return_data)
        else:
            one = _Bodies([self._of(name)])
            distance, names, data = _nearest(lambda margin: self._near(one, margin), count - 1, one.sizes[0],
                                             return_data)
        return _told(distance, names and tuple(sorted(names)), data, return_names, return_data)

    def min_distance_other(self, other_manager, return_names=False, return_data=False):
        """The least distance of an object from one of another manager; names are (own, other's)."""
        others = _Bodies(other_manager._objs.values())
        distance, names, data = _nearest(lambda margin: self._near(others, margin),
                                         len(self._objs) * len(others.objects), self._size, return_data)
        return _told(distance, names, data, return_names, return_data)

    def _placed(self):
        """The scene of all objects, where they were at its last step."""
        if self._bodies is None:
            self._bodies = _Bodies(self._objs.values())
        if self._scene is None:
            self._room = 2 * len(self._objs) + 2
            self._scene = ist.Scene(max_bodies=self._room, max_pairs=self._pairs * self._room, threads=1)
            self._moved, self._row = set(), None
            for one, pose in zip(self._bodies.objects, self._bodies.poses):
                one.number = self._scene.add(one.asset, pose)
        if self._row is None:
            numbers = [one.number for one in self._bodies.objects]
            self._row = np.empty(max(numbers, default=0) + 1, int)
            self._row[numbers] = np.arange(len(numbers))
        return self._scene

    def _within(self, margin=0):
        """The pairs whose boxes are no further apart than the margin."""
        while self._found is None or self._found[0] != margin:
            self._placed().set_rule(answer="boxes", measure="exact", margin=margin)
            numbers = np.array(list(self._moved), int)
            rows = self._row[numbers]
            self._bodies.move(rows)
            self._moved = set()
            try:
                found = self._scene.step(self._bodies.poses[rows], numbers=numbers)
                self._found = margin, _Pairs(self._bodies, self._bodies, *self._row[found.pairs].T)
            except ist.Error:  # more pairs than there is room for, or, with room for all, something else
                self._scene = None
                if self._pairs >= self._room:
                    raise
                self._pairs *= 8
        return self._found[1]

    def _near(self, others, margin=0):
        """As _within(), of objects of this manager and others."""
        if self._moved:
            self._within()
        scene = self._placed()
        near = [self._row[scene.in_box(low - margin, high + margin)]
                for low, high in zip(others.low, others.high)]
        first = np.concatenate([np.zeros(0, int), *near])
        second = np.repeat(np.arange(len(near)), [len(rows) for rows in near])
        own = [self._bodies.objects[i] is others.objects[k] for i, k in zip(first.tolist(), second.tolist())]
        return _Pairs(self._bodies, others, first[~np.array(own, bool)], second[~np.array(own, bool)])

    def _of(self, name):
        if name not in self._objs:
            raise ValueError(f"{name} not in collision manager!")
        return self._objs[name]

    def _object(self, name, mesh, transform):
        content = hashlib.blake2b()
        for array in (mesh.vertices, mesh.faces):
            content.update(np.ascontiguousarray(array).tobytes())
        key = content.digest()
        asset = self._assets.get(key)
        if asset is None:
            closed = ist.close_mesh(ist.from_trimesh(mesh), name=str(name), repair=self._repair)
            asset = self._assets[key] = ist.bake_mesh_only(closed)
        return _Object(name, mesh, asset, transform)


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
            # The mesh takes what no pose has: scales and mirror images.
            mesh = mesh.copy()
            mesh.apply_transform(transform)
            transform = None
        assets[node] = manager.add_object(node, mesh, transform)
    return manager, assets


class _Pairs:
    """Pairs of objects: their rows among those of either side."""

    def __init__(self, of_a, of_b, first, second):
        self.of_a, self.of_b, self.first, self.second = of_a, of_b, first, second

    def gaps(self):
        """[u] (n,): how far boxes are apart."""
        a, b = self.of_a, self.of_b
        apart = np.maximum(a.low[self.first] - b.high[self.second], b.low[self.second] - a.high[self.first])
        return np.linalg.norm(np.maximum(apart, 0), axis=1)

    def ask(self, query, chosen, aside=0, **settings):
        """The query of some of them, in one call. aside: of B, in sizes of A."""
        first, second = self.first[chosen], self.second[chosen]
        poses = self.of_b.poses[second]
        if aside != 0:
            poses[:, 4:] += aside * self.of_a.sizes[first, None] * _WAY
        return query(self.of_a.solids[first], self.of_b.solids[second], poses,
                     poses_a=self.of_a.poses[first], **settings)

    def overlaps(self, chosen):
        """Volumes, forces on B and centroids.

        Where faces are flush beside an overlap its slope jumps, and the mean of both sides is that of
        neither face.
        """
        sides = [self.ask(ist.penetration, chosen, aside, measure="exact") for aside in (-_ASIDE, _ASIDE)]
        _refuse_unanswered(self, chosen, sides[0].status)
        return ((getattr(sides[0], what) + getattr(sides[1], what)) / 2
                for what in ("volume", "force", "centroid"))

    def parts(self, i):
        """The connected parts of the overlap of a pair, largest first."""
        a, b = self.objects(i)
        pose_a, pose_b = self.of_a.poses[self.first[i]], self.of_b.poses[self.second[i]]
        move = _ASIDE * a.size * np.concatenate([np.zeros(4), _WAY])
        sides = []
        for pose in (pose_b - move, pose_b + move):
            found = ist.overlap_outline(a.asset, b.asset, pose, poses_a=pose_a, max_patches=32).contact
            sides.append((found, np.argsort(-found.volume[:found.count])))
        if sides[0][0].count != sides[1][0].count:
            sides = sides[:1]
        out = []
        for k in range(sides[0][0].count):
            force, volume, point = (sum(getattr(found, what)[order[k]] for found, order in sides) / len(sides)
                                    for what in ("force", "volume", "point"))
            area = np.linalg.norm(force)
            out.append(ContactData(self.names(i), (a, b), force / max(area, 1e-300), point,
                                   min(volume / max(area, 1e-300), np.cbrt(volume)), volume))
        return out

    def objects(self, i):
        return self.of_a.objects[self.first[i]], self.of_b.objects[self.second[i]]

    def names(self, i):
        return tuple(one.name for one in self.objects(i))


def _collide(pairs, with_names, with_data):
    """(whether any collide, their names, their ContactData); the first to collide, where that is all"""
    with_names = with_names or with_data
    hits, touches = [], []
    begin, count = 0, len(pairs.first) if with_names else 1
    while begin < len(pairs.first) and (with_names or not hits):
        chosen = np.arange(begin, min(begin + count, len(pairs.first)))
        answers = pairs.ask(ist.penetration, chosen, measure="exact")
        _refuse_unanswered(pairs, chosen, answers.status)
        for k in np.flatnonzero((answers.volume > 0) | answers.touching):
            hits.append(chosen[k])
            touches.append(None if answers.volume[k] > 0 else answers.contact_normal[k])
        begin, count = begin + count, 4 * count
    data = []
    for i, normal in zip(hits, touches) if with_data else ():
        if normal is None:
            data += pairs.parts(i)
        else:
            point = pairs.ask(ist.separation, [i]).point_a[0]
            data.append(ContactData(pairs.names(i), pairs.objects(i), normal, point, 0, 0))
    return bool(len(hits)), [pairs.names(i) for i in hits], data


def _nearest(near_by, count, margin, with_data):
    """(least distance, names, DistanceData); negative where solids overlap, by volume over area.

    near_by(margin): pairs whose boxes are no further apart, of `count` in all. margin: tried first.
    """
    pairs = near_by(0)
    near = np.arange(len(pairs.first))
    best, nearest = np.inf, None
    if len(near) > 0:
        answers = pairs.ask(ist.penetration, near, measure="exact")
        _refuse_unanswered(pairs, near, answers.status)
        near = near[answers.volume > 0]
    if len(near) > 0:
        volume, force, point = pairs.overlaps(near)
        area = np.linalg.norm(force, axis=1)
        # (where forces cancel, as of a solid inside another, the size of the overlap)
        depth = np.minimum(volume / np.maximum(area, 1e-300), np.cbrt(volume))
        k = int(depth.argmax())
        half = 0.5 * depth[k] * force[k] / max(area[k], 1e-300)
        best, nearest = -depth[k], (pairs, near[k], (point[k] + half, point[k] - half))
    looked = -1.0  # pairs whose boxes are no further apart are known
    while count > 0 and looked < best and best > 0 and looked < 1e37:
        looked = best if best < np.inf else margin
        pairs, margin = near_by(looked), 4 * margin
        gap = pairs.gaps()
        order, begin, size = np.argsort(gap, kind="stable"), 0, _FIRST
        while begin < len(order) and gap[order[begin]] < best:
            chosen = order[begin:begin + size]
            chosen = chosen[gap[chosen] < best]
            limit = {"max_distance": best} if best < np.inf else {}
            found = pairs.ask(ist.separation, chosen, **limit)
            _refuse_unanswered(pairs, chosen, found.status)
            k = int(found.distance.argmin())
            if found.distance[k] < best:
                best, nearest = found.distance[k], (pairs, chosen[k], (found.point_a[k], found.point_b[k]))
            begin, size = begin + size, 4 * size
        if len(gap) == count:
            break
    if nearest is None:
        return float("inf"), None, None
    pairs, i, points = nearest
    data = DistanceData(pairs.names(i), pairs.objects(i), best, points) if with_data else None
    return float(best), pairs.names(i), data


def _refuse_unanswered(pairs, chosen, status):
    for k in np.flatnonzero(status != int(ist.QueryStatus.ok))[:1]:
        name = ist.QueryStatus(int(status[k])).name
        raise ist.Error(f"{' and '.join(map(str, pairs.names(chosen[k])))}: {name}")


def _told(found, names, data, with_names, with_data):
    out = [found] + [names] * bool(with_names) + [data] * bool(with_data)
    return out[0] if len(out) == 1 else tuple(out)
