"""What ist.torch and ist.jax share: pairs of placed scenes as rows of queries, and their gradients."""

import numpy as np

import ist

VECTORS = ("force", "torque", "point_a", "point_b", "normal")  # columns of three numbers


def numbers(pairs):
    """(n, 2) int64, or None: all pairs."""
    if pairs is None:
        return None
    pairs = np.asarray(pairs)
    if pairs.size and (pairs.dtype.kind not in "iu" or pairs.ndim != 2 or pairs.shape[1] != 2):
        raise TypeError(f"pairs: {pairs.dtype} {pairs.shape}; wanted whole numbers (n, 2)")
    return pairs.astype(np.int64).reshape(-1, 2)


class Scene:
    """Solids, and pairs of them: of `pairs` by number, of `places` by index of `solids`; (2, n)."""

    def __init__(self, solids, pairs, device="cpu"):
        if isinstance(solids, ist.Solids):
            if solids.device != device:
                raise TypeError(f"solids: on {solids.device}; wanted them on {device}, as poses are")
            self.solids, places = solids, np.arange(len(solids))
        else:
            place = {solid: k for k, solid in enumerate(dict.fromkeys(solids))}  # each once
            self.solids = ist.Solids(list(place), device=device)
            places = np.array([place[solid] for solid in solids], int)
        self.count = len(places)
        is_shape = np.isin(places, self.solids.shapes)
        self.pairs = self._all_pairs(is_shape) if pairs is None else self._checked(pairs, is_shape)
        self.places = places.astype(np.int32)[self.pairs]

    def _all_pairs(self, is_shape):
        """(2, n): each Asset with each later one, and each Shape with each Asset."""
        assets, fields = np.flatnonzero(~is_shape), np.flatnonzero(is_shape)
        first, second = np.triu_indices(len(assets), 1)
        return np.stack([np.append(np.repeat(fields, len(assets)), assets[first]),
                         np.append(np.tile(assets, len(fields)), assets[second])])

    def _checked(self, pairs, is_shape):
        for i, (first, second) in enumerate(pairs.tolist()):
            if not (0 <= first < self.count and 0 <= second < self.count):
                why = f"solids are numbered 0 to {self.count - 1}"
            elif first == second:
                why = "a solid cannot be paired with itself"
            elif is_shape[first] and is_shape[second]:
                why = "two shapes; one of them must be an Asset"
            else:
                continue
            raise ValueError(f"pairs[{i}]: ({first}, {second}): {why}")
        return pairs.T.copy()


class Answers:
    """Values of a Scene's pairs, (n,) or (w, n), with their gradients by poses and scales.

    poses: (k, 7) or (w, k, 7), of unit quaternions. scales: (k,) or (w, k), or None. array: what the
    poses' framework calls `cross`, `join` and `spread`, and ask(query, names, …) → columns by name.
    """

    def __init__(self, scene, poses, scales, array, settings):
        k = scene.count
        if poses.ndim not in (2, 3) or tuple(poses.shape[-2:]) != (k, 7):
            raise ValueError(f"poses: shape {tuple(poses.shape)}; wanted ({k}, 7) or (w, {k}, 7)")
        if scales is not None and tuple(scales.shape) != tuple(poses.shape[:-1]):
            raise ValueError(f"scales: shape {tuple(scales.shape)}; wanted {tuple(poses.shape[:-1])}")
        self.shape = (*poses.shape[:-2], scene.pairs.shape[1])
        self.array, self.settings = array, settings
        self.solids = [scene.solids[array.spread(place, self.shape).reshape(-1)] for place in scene.places]
        self.poses = [poses[..., solid, :].reshape(-1, 7) for solid in scene.pairs]
        self.scales = [None if scales is None else scales[..., solid].reshape(-1)
                       for solid in scene.pairs]

    def ask(self, query, names, scale_b):
        columns = self.array.ask(query, [*names, "status"], *self.solids, self.poses[1],
                                 poses_a=self.poses[0], scales=scale_b, scales_a=self.scales[0],
                                 **self.settings)
        self.valid = (columns.pop("status") != int(ist.QueryStatus.invalid_input)).reshape(self.shape)
        return columns

    def by_pose(self, side, push, turn):
        """(…, 7): the slope by a side's pose, from those by its translation and its turning."""
        pose = self.poses[side]
        w, v = pose[:, :1], pose[:, 1:4]
        # A rotation vector δ moves the unit quaternion by ½ (0, δ) q.
        slope = self.array.join((-2 * (turn * v).sum(-1)[:, None],
                                 2 * (w * turn + self.array.cross(turn, v)), push), -1)
        return slope.reshape(*self.shape, 7)


class Volumes(Answers):
    """Overlap volumes."""

    def __init__(self, *arguments, wants_pose, wants_scale):
        super().__init__(*arguments)
        names = ["force", "torque"] if wants_pose or wants_scale else []
        self.found = self.ask(ist.penetration, ["volume", *names], self.scales[1])
        self.value = self.found["volume"].reshape(self.shape)
        if wants_scale:
            # Repeats python/src/penetration.cpp, since memory on a GPU belongs to the caller's
            # framework.
            step = self.scales[1] / 2048
            more, less = (self.ask(ist.penetration, ["volume"], self.scales[1] + by)["volume"]
                          for by in (step, -step))
            self.by_scale_b = (more - less) / (2 * step)

    def pose_gradients(self):
        """Of A's and of B's."""
        push, turn = -self.found["force"], -self.found["torque"]
        # A motion of B is equivalent to the inverse motion about A's origin.
        turn_a = -(turn + self.array.cross(self._away(), push))
        return self.by_pose(0, -push, turn_a), self.by_pose(1, push, turn)

    def scale_gradients(self):
        volume, by_b = self.found["volume"], self.by_scale_b
        by_a = (3 * volume - self.scales[1] * by_b
                + (self._away() * self.found["force"]).sum(-1)) / self.scales[0]
        return [(by * (volume > 0)).reshape(self.shape) for by in (by_a, by_b)]

    def _away(self):
        return self.poses[1][:, 4:] - self.poses[0][:, 4:]


class Gaps(Answers):
    """Distances. The nearest points stay the nearest in a small motion."""

    def __init__(self, *arguments, wants_pose, wants_scale):
        super().__init__(*arguments)
        names = ["point_a", "point_b", "normal"] if wants_pose or wants_scale else []
        self.found = self.ask(ist.separation, ["distance", *names], self.scales[1])
        self.value = self.found["distance"].reshape(self.shape)

    def _sides(self):
        for side, (sign, point) in enumerate(((-1, "point_a"), (1, "point_b"))):
            yield sign * self.found["normal"], self.found[point] - self.poses[side][:, 4:]

    def pose_gradients(self):
        return [self.by_pose(side, push, self.array.cross(arm, push))
                for side, (push, arm) in enumerate(self._sides())]

    def scale_gradients(self):
        return [((push * arm).sum(-1) / scale).reshape(self.shape)
                for scale, (push, arm) in zip(self.scales, self._sides())]
