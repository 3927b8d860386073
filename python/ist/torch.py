"""Overlap volumes and distances that PyTorch can differentiate.

`from ist.torch import overlap, separation`: the library's own gradients, in float64, on the CPU or a GPU.
"""

import functools
import types
from collections.abc import Sequence

import numpy as np
import torch

import ist
from ist._scene import VECTORS, Gaps, Scene, Volumes, numbers

__all__ = ["overlap", "separation"]


def overlap(solids: "ist.Solids | Sequence[ist.Asset | ist.Shape]", poses: torch.Tensor, *, pairs=None,
            scales: "torch.Tensor | None" = None, **settings) -> torch.Tensor:
    """Overlap volumes of pairs of placed solids [u³], differentiable by their poses and scales.

    solids: k Assets and Fields, or an ist.Solids of them where the poses are.
    poses: (k, 7), or (w, k, 7) for w scenes: qw, qx, qy, qz, tx [u], ty, tz. Any real dtype;
        whole numbers become torch.get_default_dtype().
        Quaternions may have any length but 0: q/|q| is used, and the gradient is that of V(q/|q|), so
        that a step along it changes the rotation and hardly the length.
        On a GPU the volumes and gradients are computed there, and the host does not wait.
    pairs: (n, 2) numbers of solids, one of each an Asset; None: all pairs of Assets, and each
        Shape with each Asset.
    scales: (k,) or (w, k) > 0, where the poses are; None: 1. Their gradient is a difference of two
        queries, 0.05 % of the scale to either side: accurate to 2e-4, at three times the cost.
    settings: measure, spheres_only, pair_budget, threads, … of ist.penetration. If a limit stops a query, the
        gradient lacks the estimated part. With measure="exact" volumes and gradients are the true
        ones. A GPU takes measure and pair_budget. By spheres it gives the CPU's answers for
        spheres_only=True, of two Assets also by default.

    Returns a tensor (n,) or (w, n) of the dtype and the device of `poses`. Pairs with an invalid pose
    or scale, or with a solid that lacks what the measure needs, are NaN, and so are their gradients;
    other pairs are not affected. Differentiable once.
    Sphere sums have a noise of 5e-9 of the volume: torch.autograd.gradcheck needs eps=1e-4,
    atol=5e-3, rtol=2e-3; with measure="exact" eps=1e-5, atol=1e-6, rtol=1e-5.

    The last eight lists of solids and pairs stay on the GPU; later changes of a Shape's arrays have no
    effect there. An ist.Solids is uploaded once.
    """
    return _differentiable(Volumes, solids, poses, pairs, scales, settings)


def separation(solids: "ist.Solids | Sequence[ist.Asset | ist.Shape]", poses: torch.Tensor, *, pairs=None,
               scales: "torch.Tensor | None" = None, **settings) -> torch.Tensor:
    """Distances of pairs of placed solids [u], differentiable by their poses and scales.

    Arguments, shapes and NaN are those of overlap(); settings: inner_spheres, max_visits and threads of
    ist.separation. Solids that overlap have the distance 0 and no gradient. Elsewhere the gradient is
    that of the nearest points; where several pairs of points are nearest, that of one of them.
    A GPU takes max_visits and pairs of two Assets; others are NaN.
    """
    return _differentiable(Gaps, solids, poses, pairs, scales, settings)


def _differentiable(kind, solids, poses, pairs, scales, settings):
    poses = _real(torch.as_tensor(poses), "poses")
    if scales is not None:
        scales = _real(torch.as_tensor(scales), "scales")
    device = poses.device
    if device.type not in ("cpu", "cuda"):
        raise TypeError(f"poses: on {device}; wanted a tensor on the CPU or a CUDA device")
    if scales is not None and scales.device != device:
        raise TypeError(f"scales: on {scales.device}; wanted a tensor on {device}, as poses are")
    solids = solids if isinstance(solids, ist.Solids) else tuple(solids)
    pairs = numbers(pairs)
    make = _scene if device.type == "cuda" else _scene.__wrapped__
    scene = make(solids, None if pairs is None else pairs.tobytes(), str(device))
    return _Answers.apply(poses, scales, scene, settings, kind)


@functools.lru_cache(maxsize=8)
def _scene(solids, pairs, device):
    pairs = None if pairs is None else np.frombuffer(pairs, np.int64).reshape(-1, 2)
    scene = Scene(solids, pairs, device)
    scene.pairs, scene.places = (torch.from_numpy(x).to(device) for x in (scene.pairs, scene.places))
    return scene


def _real(tensor, name):
    """Whole numbers would cut the volumes to whole ones: they become what torch divides them to."""
    if tensor.is_complex() or tensor.dtype == torch.bool:
        raise TypeError(f"{name}: dtype {tensor.dtype}; wanted real numbers")
    return tensor if tensor.is_floating_point() else tensor.to(torch.get_default_dtype())


class _Answers(torch.autograd.Function):
    @staticmethod
    def forward(ctx, poses, scales, scene, settings, kind):
        given = poses.detach().to(torch.float64)
        length = given[..., :4].norm(dim=-1, keepdim=True)
        placed = torch.cat((given[..., :4] / length, given[..., 4:]), dim=-1)
        sizes = None if scales is None else scales.detach().to(torch.float64)
        wants_pose, wants_scale = ctx.needs_input_grad[:2]
        ctx.answer = kind(scene, placed, sizes, _ARRAY, settings, wants_pose=wants_pose,
                          wants_scale=wants_scale)
        ctx.pairs, ctx.length = scene.pairs, length
        ctx.save_for_backward(poses, scales)
        ctx.like = [(x.shape, x.dtype) if x is not None else None for x in (poses, scales)]
        return torch.where(ctx.answer.valid, ctx.answer.value, torch.nan).to(poses.dtype)

    @staticmethod
    def backward(ctx, slope):
        with torch.no_grad():
            found = _gradients(ctx, slope.to(torch.float64))
        if torch.is_grad_enabled():  # someone may differentiate them
            found = [x if x is None else _Once.apply(x, slope, *ctx.saved_tensors) for x in found]
        return *found, None, None, None


def _gradients(ctx, slope):
    """By poses and by scales, where they are wanted."""
    answer = ctx.answer
    slope = torch.where(answer.valid | (slope == 0), slope, torch.nan)
    by_pose = by_scale = None
    if ctx.needs_input_grad[0]:
        shape, dtype = ctx.like[0]
        total = slope.new_zeros(shape)
        for solid, gradient in zip(ctx.pairs, answer.pose_gradients()):
            total.index_add_(-2, solid, _times(slope[..., None], gradient))
        total[..., :4] = _times(total[..., :4], 1 / ctx.length)
        by_pose = total.to(dtype)
    if ctx.needs_input_grad[1]:
        shape, dtype = ctx.like[1]
        total = slope.new_zeros(shape)
        for solid, gradient in zip(ctx.pairs, answer.scale_gradients()):
            total.index_add_(-1, solid, _times(slope, gradient))
        by_scale = total.to(dtype)
    return by_pose, by_scale


def _times(slope, gradient):
    return torch.where(slope == 0, 0.0, slope * gradient)  # NaN in an unused output does no harm


class _Once(torch.autograd.Function):
    """A gradient that raises when it is differentiated in turn."""

    @staticmethod
    def forward(ctx, gradient, *of):
        return gradient.clone()

    @staticmethod
    def backward(ctx, slope):
        raise RuntimeError("ist.torch: answers are differentiable once; detach() their gradients to take "
                           "them as constants")


def _ask(query, names, a, b, poses, **arguments):
    """Columns by name, where the poses are."""
    if poses.device.type == "cuda":
        return _ask_gpu(query, names, a, b, poses, **arguments)
    found = query(a, b, poses, **arguments)
    return {name: torch.from_numpy(np.asarray(getattr(found, name), np.float64)) for name in names}


def _ask_gpu(query, names, a, b, poses, **arguments):
    """In PyTorch's memory, and the host does not wait."""
    rows = len(poses)
    out = {name: torch.empty(rows, dtype=torch.int32, device=poses.device) if name == "status"
           else poses.new_empty((rows, 3) if name in VECTORS else rows) for name in names}
    query(a, b, poses, out=out, stream=torch.cuda.current_stream(poses.device).cuda_stream, **arguments)
    return out


_ARRAY = types.SimpleNamespace(ask=_ask, cross=torch.linalg.cross, join=torch.cat,
                               spread=lambda x, shape: torch.broadcast_to(x, shape).contiguous())
