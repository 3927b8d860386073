"""Overlap volumes that PyTorch can differentiate.

`from ist.torch import overlap`: the library's own gradients, in float64, on the CPU.
"""

from collections.abc import Sequence

import numpy as np
import torch

import ist

__all__ = ["overlap"]


def overlap(solids: Sequence["ist.Asset | ist.Field"], poses: torch.Tensor, *, pairs=None,
            scales: "torch.Tensor | None" = None, **settings) -> torch.Tensor:
    """Overlap volumes of pairs of placed solids [u³], differentiable by their poses and scales.

    solids: k Assets and Fields.
    poses: (k, 7), or (w, k, 7) for w scenes: qw, qx, qy, qz, tx [u], ty, tz. Any real dtype.
        Quaternions may have any length but 0: what is meant is q/|q|, and the gradient is that of
        V(q/|q|), so that a step along it changes a rotation and hardly the length.
    pairs: (n, 2) numbers of solids, the second of each an Asset; None: all pairs of Assets, and each
        Field with each Asset.
    scales: (k,) or (w, k) > 0; None: 1. Their gradient is the difference of two queries, 0.05 %
        of the scale to either side, exact to some 1e-4, and takes three times as long.
    settings: measure, field, pair_budget, min_radius, threads, … of ist.penetration. Limits that
        stop a query leave its gradient without the part that was guessed.

    Returns a tensor (n,) or (w, n) of the dtype of `poses`. Pairs of an invalid pose or scale are
    NaN, and so are their gradients; they spoil no others. Differentiable once.
    """
    if pairs is None:
        pairs = all_pairs(solids)
    if scales is not None:
        scales = torch.as_tensor(scales)
    return _Overlap.apply(poses, scales, solids, np.asarray(pairs, np.int64).reshape(-1, 2),
                          settings)


def all_pairs(solids):
    """(n, 2): each Asset with each later one, and each Field with each Asset."""
    assets = [k for k, solid in enumerate(solids) if isinstance(solid, ist.Asset)]
    fields = [k for k, solid in enumerate(solids) if not isinstance(solid, ist.Asset)]
    return ([(f, a) for f in fields for a in assets] +
            [(a, b) for i, a in enumerate(assets) for b in assets[i + 1:]])


def _on_the_cpu(tensor, name):
    if tensor.device.type != "cpu":
        raise TypeError(f"{name}: on {tensor.device}; wanted a tensor on the CPU")
    return tensor.detach().to(torch.float64)


class _Overlap(torch.autograd.Function):
    @staticmethod
    def forward(ctx, poses, scales, solids, pairs, settings):
        given = _on_the_cpu(poses, "poses")
        length = given[..., :4].norm(dim=-1, keepdim=True)
        placed = torch.cat((given[..., :4] / length, given[..., 4:]), dim=-1)
        answer = ist.penetration_of_pairs(
            solids, placed.numpy(), pairs,
            scales=None if scales is None else _on_the_cpu(scales, "scales").numpy(),
            scale_gradients=scales is not None and ctx.needs_input_grad[1], **settings)
        valid = torch.from_numpy(answer.status != ist.QueryStatus.invalid_input)
        ctx.answer, ctx.pairs, ctx.length, ctx.valid = answer, pairs, length, valid
        ctx.like = [(x.shape, x.dtype) if x is not None else None for x in (poses, scales)]
        return torch.where(valid, torch.from_numpy(answer.volume), torch.nan).to(poses.dtype)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, slope):
        poses_like, scales_like = ctx.like
        answer, (first, second) = ctx.answer, torch.from_numpy(ctx.pairs.T.copy())
        slope = torch.where(ctx.valid, slope.to(torch.float64), torch.nan)
        by_pose = by_scale = None
        if ctx.needs_input_grad[0]:
            total = torch.zeros(poses_like[0], dtype=torch.float64)
            for solid, gradient in (first, answer.pose_gradient_a), (second, answer.pose_gradient):
                total.index_add_(-2, solid, slope[..., None] * torch.from_numpy(gradient))
            total[..., :4] /= ctx.length
            by_pose = total.to(poses_like[1])
        if ctx.needs_input_grad[1]:
            total = torch.zeros(scales_like[0], dtype=torch.float64)
            for solid, gradient in (first, answer.scale_gradient_a), (second, answer.scale_gradient):
                total.index_add_(-1, solid, slope * torch.from_numpy(gradient))
            by_scale = total.to(scales_like[1])
        return by_pose, by_scale, None, None, None
