"""Overlap volumes and distances that JAX can differentiate.

`from ist.jax import overlap, separation`: the library's own gradients, in float64 on the host's cores.
"""

import types
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

import ist
from ist._scene import Gaps, Scene, Volumes, numbers

__all__ = ["overlap", "separation"]


def overlap(solids: "ist.Solids | Sequence[ist.Asset | ist.Shape]", poses: jax.Array, *, pairs=None,
            scales: "jax.Array | None" = None, **settings) -> jax.Array:
    """Overlap volumes of pairs of placed solids [u³], differentiable by their poses and scales.

    solids: k Assets and Fields, or an ist.Solids of them on the CPU, where queries run.
    poses: (k, 7), or (w, k, 7) for w scenes: qw, qx, qy, qz, tx [u], ty, tz. Quaternions may have any
        length but 0: q/|q| is used, and the gradient is that of V(q/|q|).
    pairs: (n, 2) numbers of solids, one of each an Asset; None: all pairs of Assets, and each
        Shape with each Asset.
    scales: (k,) or (w, k) > 0; None: 1. Their gradient is a difference of two queries: accurate to
        2e-4, at three times the cost.
    settings: measure, spheres_only, pair_budget, threads, … of ist.penetration.

    Returns an array (n,) or (w, n) of the dtype of `poses`. Pairs with an invalid pose or scale,
    or with a solid that lacks what the measure needs, are NaN, and so are their gradients.
    Works under jit, grad and vmap, by a callback on the host. Differentiable once, in reverse.
    """
    return _differentiable(Volumes, solids, poses, pairs, scales, settings)


def separation(solids: "ist.Solids | Sequence[ist.Asset | ist.Shape]", poses: jax.Array, *, pairs=None,
               scales: "jax.Array | None" = None, **settings) -> jax.Array:
    """Distances of pairs of placed solids [u], differentiable by their poses and scales.

    Arguments, shapes, NaN and transformations are those of overlap(); settings: inner_spheres,
    max_visits and threads of ist.separation. Solids that overlap have the distance 0 and no gradient.
    Elsewhere the gradient is that of the nearest points; where several pairs of points are nearest,
    that of one of them.
    """
    return _differentiable(Gaps, solids, poses, pairs, scales, settings)


def _differentiable(kind, solids, poses, pairs, scales, settings):
    scene = Scene(solids, numbers(pairs))
    poses = jnp.asarray(poses)
    if not jnp.issubdtype(poses.dtype, jnp.floating):
        poses = poses.astype(float)
    if scales is not None:
        scales = jnp.asarray(scales)

    def values(poses, scales):
        return _call(_ask(kind, scene, settings, False), [()], scene, poses, scales)[0]

    def forward(poses, scales):
        rows = [(), (7,), (7,)] + ([(), ()] if scales is not None else [])
        found = _call(_ask(kind, scene, settings, True), rows, scene, poses, scales)
        return found[0], (found[1:3], found[3:], poses, scales)

    def backward(kept, slope):
        by_pose, by_scale, poses, scales = kept
        total = jnp.zeros_like(poses)
        for solid, gradient in zip(scene.pairs, by_pose):
            total = total.at[..., solid, :].add(_times(slope[..., None], gradient))
        if scales is None:
            return total, None
        sizes = jnp.zeros_like(scales)
        for solid, gradient in zip(scene.pairs, by_scale):
            sizes = sizes.at[..., solid].add(_times(slope, gradient).astype(scales.dtype))
        return total, sizes

    answer = jax.custom_vjp(values)
    answer.defvjp(forward, backward)
    return answer(poses, scales)


def _times(slope, gradient):
    return jnp.where(slope == 0, 0, slope * gradient)  # of what nobody asks, NaN is nothing


def _call(ask, rows, scene, poses, scales):
    shape = (*poses.shape[:-2], scene.pairs.shape[1])
    wanted = [jax.ShapeDtypeStruct(shape + row, poses.dtype) for row in rows]
    return jax.pure_callback(ask, wanted, poses, scales, vmap_method="broadcast_all")


def _columns(query, names, a, b, poses, **arguments):
    found = query(a, b, poses, **arguments)
    return {name: getattr(found, name) for name in names}


_ARRAY = types.SimpleNamespace(ask=_columns, cross=np.cross, join=np.concatenate, spread=np.broadcast_to)


def _ask(kind, scene, settings, with_gradients):
    """The callback: of poses (…, k, 7) and scales (…, k) or None."""

    def ask(poses, scales):
        dtype, lead = poses.dtype, poses.shape[:-2]
        rows = np.asarray(poses, np.float64).reshape(-1, *poses.shape[-2:])
        sizes = None if scales is None else np.asarray(scales, np.float64).reshape(rows.shape[:2])
        length = np.linalg.norm(rows[..., :4], axis=-1, keepdims=True)
        with np.errstate(all="ignore"):
            placed = np.concatenate((rows[..., :4] / length, rows[..., 4:]), axis=-1)
            found = kind(scene, placed, sizes, _ARRAY, settings, wants_pose=with_gradients,
                         wants_scale=with_gradients and sizes is not None)
            answers = [found.value]
            if with_gradients:
                for solid, gradient in zip(scene.pairs, found.pose_gradients()):
                    gradient[..., :4] /= length[:, solid]
                    answers.append(gradient)
                if sizes is not None:
                    answers += found.scale_gradients()
        return [np.where(found.valid if a.ndim == 2 else found.valid[..., None], a, np.nan)
                .reshape(lead + a.shape[1:]).astype(dtype) for a in answers]

    return ask
