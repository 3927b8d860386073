"""Overlap volumes and distances that JAX can differentiate.

`from ist.jax import overlap, separation`: the library's own gradients, in float64, on the CPU or a GPU.
"""

import types
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

import ist
from ist._scene import VECTORS, Gaps, Scene, Volumes, numbers

__all__ = ["overlap", "separation"]


def overlap(solids: "ist.Solids | Sequence[ist.Asset | ist.Shape]", poses: jax.Array, *, pairs=None,
            scales: "jax.Array | None" = None, **settings) -> jax.Array:
    """Overlap volumes of pairs of placed solids [u³], differentiable by their poses and scales.

    solids: k Assets and Fields, whose queries run on the host's cores; or an ist.Solids of them, where
        queries run. For one on a GPU the poses are there, volumes and gradients are computed there in
        XLA's own order and nothing goes to the host: JAX 0.6.1 or later, with jax_enable_x64 on.
    poses: (k, 7), or (w, k, 7) for w scenes: qw, qx, qy, qz, tx [u], ty, tz. Quaternions may have any
        length but 0: q/|q| is used, and the gradient is that of V(q/|q|).
    pairs: (n, 2) numbers of solids, one of each an Asset; None: all pairs of Assets, and each
        Shape with each Asset.
    scales: (k,) or (w, k) > 0; None: 1. Their gradient is a difference of two queries: accurate to
        2e-4, at three times the cost.
    settings: measure, spheres_only, pair_budget, threads, … of ist.penetration. A GPU takes measure
        and pair_budget.

    Returns an array (n,) or (w, n) of the dtype of `poses`. Pairs with an invalid pose or scale,
    or with a solid that lacks what the measure needs, are NaN, and so are their gradients.
    Works under jit, grad and vmap, by a callback. Differentiable once, in reverse.
    """
    return _differentiable(Volumes, solids, poses, pairs, scales, settings)


def separation(solids: "ist.Solids | Sequence[ist.Asset | ist.Shape]", poses: jax.Array, *, pairs=None,
               scales: "jax.Array | None" = None, **settings) -> jax.Array:
    """Distances of pairs of placed solids [u], differentiable by their poses and scales.

    Arguments, shapes, NaN and transformations are those of overlap(); settings: inner_spheres,
    max_visits and threads of ist.separation. Solids that overlap have the distance 0 and no gradient.
    Elsewhere the gradient is that of the nearest points; where several pairs of points are nearest,
    that of one of them. A GPU takes max_visits and pairs of two Assets; others are NaN.
    """
    return _differentiable(Gaps, solids, poses, pairs, scales, settings)


def _differentiable(kind, solids, poses, pairs, scales, settings):
    device = solids.device if isinstance(solids, ist.Solids) else "cpu"
    scene = Scene(solids, numbers(pairs), device)
    poses = jnp.asarray(poses)
    if not jnp.issubdtype(poses.dtype, jnp.floating):
        poses = poses.astype(float)
    if scales is not None:
        scales = jnp.asarray(scales)
    if device == "cpu":
        ask = _on_host(kind, scene, settings)
    elif jax.config.jax_enable_x64:
        ask = _on_device(kind, scene, settings)
    else:
        raise TypeError(f"poses: {poses.dtype}; wanted float64 for solids on {device}: "
                        'jax.config.update("jax_enable_x64", True)')

    def values(poses, scales):
        return ask(poses, scales, False)[0]

    def forward(poses, scales):
        found = ask(poses, scales, True)
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
    return jnp.where(slope == 0, 0, slope * gradient)  # NaN in an unused output does no harm


def _answers(xp, array, kind, scene, settings, poses, scales, with_gradients):
    """Values, and with gradients those by poses and by scales: of poses (…, k, 7), scales (…, k) or None."""
    lead = poses.shape[:-2]
    rows = xp.asarray(poses, xp.float64).reshape(-1, *poses.shape[-2:])
    sizes = None if scales is None else xp.asarray(scales, xp.float64).reshape(rows.shape[:2])
    length = xp.linalg.norm(rows[..., :4], axis=-1, keepdims=True)
    with np.errstate(all="ignore"):
        placed = xp.concatenate((rows[..., :4] / length, rows[..., 4:]), axis=-1)
        found = kind(scene, placed, sizes, array, settings, wants_pose=with_gradients,
                     wants_scale=with_gradients and sizes is not None)
        answers = [found.value]
        if with_gradients:
            answers += [xp.concatenate((gradient[..., :4] / length[:, solid], gradient[..., 4:]), axis=-1)
                        for solid, gradient in zip(scene.pairs, found.pose_gradients())]
            if sizes is not None:
                answers += found.scale_gradients()
    return [xp.where(found.valid if a.ndim == 2 else found.valid[..., None], a, xp.nan)
            .reshape(lead + a.shape[1:]).astype(poses.dtype) for a in answers]


def _columns(query, names, a, b, poses, **arguments):
    found = query(a, b, poses, **arguments)
    return {name: getattr(found, name) for name in names}


_HOST = types.SimpleNamespace(ask=_columns, cross=np.cross, join=np.concatenate, spread=np.broadcast_to)


def _on_host(kind, scene, settings):
    def ask(poses, scales, with_gradients):
        rows = [()]
        if with_gradients:
            rows += [(7,), (7,)] + ([(), ()] if scales is not None else [])
        shape = (*poses.shape[:-2], scene.pairs.shape[1])
        wanted = [jax.ShapeDtypeStruct(shape + row, poses.dtype) for row in rows]
        return jax.pure_callback(
            lambda poses, scales: _answers(np, _HOST, kind, scene, settings, np.asarray(poses),
                                           scales, with_gradients),
            wanted, poses, scales, vmap_method="broadcast_all")

    return ask


class _Rows:
    """A buffer of XLA's without the axes that vmap put before its rows."""

    def __init__(self, buffer, inner):
        self.__cuda_array_interface__ = dict(buffer.__cuda_array_interface__, shape=(
            int(np.prod(buffer.shape[:buffer.ndim - len(inner)])), *inner))
        self.buffer = buffer


class _Later:
    """Stands for Solids: which of them each row asks is known when a batch is launched."""

    def __getitem__(self, numbers):
        return numbers


def _on_device(kind, scene, settings):
    from jax.experimental.buffer_callback import buffer_callback  # from JAX 0.6.1 on

    solids = scene.solids
    scene.solids = _Later()

    def batch(query, names, a, b, poses, *, poses_a, scales, scales_a, **settings):
        given = dict(a=a, b=b, poses=poses, poses_a=poses_a, scales=scales, scales_a=scales_a)
        given = {name: array for name, array in given.items() if array is not None}
        wanted = {name: jax.ShapeDtypeStruct((len(poses), 3) if name in VECTORS else (len(poses),),
                                             jnp.int32 if name == "status" else jnp.float64)
                  for name in names}

        def launch(context, out, given):
            out, given = ({name: _Rows(buffer, like[name].shape[1:]) for name, buffer in some.items()}
                          for some, like in ((out, wanted), (given, inner)))
            query(solids[given.pop("a")], solids[given.pop("b")], out=out, stream=context.stream,
                  **given, **settings)

        inner = {name: jax.ShapeDtypeStruct(array.shape, array.dtype) for name, array in given.items()}
        return buffer_callback(launch, wanted, vmap_method="broadcast_all")(given)

    array = types.SimpleNamespace(ask=batch, cross=jnp.cross, join=jnp.concatenate, spread=jnp.broadcast_to)

    def ask(poses, scales, with_gradients):
        return _answers(jnp, array, kind, scene, settings, poses, scales, with_gradients)

    return ask
