"""What ist.torch and ist.jax share."""

import numpy as np

import ist


def all_pairs(solids):
    """(n, 2): each Asset with each later one, and each Field with each Asset."""
    assets = [k for k, solid in enumerate(solids) if isinstance(solid, ist.Asset)]
    fields = [k for k, solid in enumerate(solids) if not isinstance(solid, ist.Asset)]
    return ([(f, a) for f in fields for a in assets] +
            [(a, b) for i, a in enumerate(assets) for b in assets[i + 1:]])


def by_pose(pose, push, turn, cross, join):
    """(…, 7): the slope by a pose of unit quaternion, from those by its translation and its turning."""
    w, v = pose[..., :1], pose[..., 1:4]
    # A rotation vector δ moves the unit quaternion by ½ (0, δ) q.
    return join((-2 * (turn * v).sum(-1)[..., None], 2 * (w * turn + cross(turn, v)), push), -1)


class Volumes:
    """Overlap volumes of pairs in placed scenes, poses (…, k, 7), with their gradients."""

    def __init__(self, solids, poses, pairs, scales, wants_scales, settings):
        found = ist.penetration_of_pairs(solids, poses, pairs, scales=scales,
                                         scale_gradients=wants_scales, **settings)
        self.value, self.status = found.volume, found.status
        # Of A and of B; read where they are wanted.
        self.pose_gradients = lambda: (found.pose_gradient_a, found.pose_gradient)
        self.scale_gradients = lambda: (found.scale_gradient_a, found.scale_gradient)


class Gaps:
    """Distances, likewise. The nearest points stay the nearest in a small motion."""

    def __init__(self, solids, poses, pairs, scales, wants_scales, settings):
        found = ist.separation_of_pairs(solids, poses, pairs, scales=scales, **settings)
        self.value, self.status = found.distance, found.status
        sides = [(solid, sign * found.normal, point - poses[..., solid, 4:])
                 for solid, sign, point in zip(np.asarray(pairs).T, (-1, 1), (found.point_a, found.point_b))]
        self.pose_gradients = lambda: [
            by_pose(poses[..., solid, :], push, np.cross(arm, push), np.cross, np.concatenate)
            for solid, push, arm in sides]
        self.scale_gradients = lambda: [(push * arm).sum(-1) / scales[..., solid] for solid, push, arm in sides]
