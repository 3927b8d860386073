"""Overlap volumes and distances that PyTorch can differentiate.

`from ist.torch import overlap, separation`: the library's own gradients, in float64, on the CPU;
volumes on a GPU too.
"""

import functools
from collections.abc import Sequence

import numpy as np
import torch

import ist
from ist._scene import Gaps, Volumes, all_pairs, by_pose

__all__ = ["overlap", "separation"]


def overlap(solids: Sequence["ist.Asset | ist.Field"], poses: torch.Tensor, *, pairs=None,
            scales: "torch.Tensor | None" = None, **settings) -> torch.Tensor:
    """Overlap volumes of pairs of placed solids [u³], differentiable by their poses and scales.

    solids: k Assets and Fields.
    poses: (k, 7), or (w, k, 7) for w scenes: qw, qx, qy, qz, tx [u], ty, tz. Any real dtype;
        whole numbers become torch.get_default_dtype().
        Quaternions may have any length but 0: q/|q| is used, and the gradient is that of V(q/|q|), so
        that a step along it changes the rotation and hardly the length.
        On a GPU the volumes and gradients are computed there (ist.gpu), and the host does not wait.
    pairs: (n, 2) numbers of solids, one of each an Asset; None: all pairs of Assets, and each
        Field with each Asset.
    scales: (k,) or (w, k) > 0, where the poses are; None: 1. Their gradient is the difference of two
        queries, 0.05 % of the scale to either side, exact to some 1e-4, and takes three times as
        long.
    settings: measure, field, pair_budget, threads, … of ist.penetration. If a limit stops a query, the
        gradient lacks the estimated part. With measure="exact" volumes and gradients are the true
        ones. On a GPU only measure ("matched", "inner") and pair_budget apply, and volumes of two
        Assets are by lenses, as with field="never" on the CPU.

    Returns a tensor (n,) or (w, n) of the dtype and the device of `poses`. Pairs with an invalid pose
    or scale, or with a solid that lacks what the measure needs, are NaN, and so are their gradients;
    other pairs are not affected. Differentiable once.
    Sums of spheres have a noise of 5e-9 of the volume: torch.autograd.gradcheck needs eps=1e-4,
    atol=5e-3, rtol=2e-3, and by measure="exact" eps=1e-5, atol=1e-6, rtol=1e-5.

    The last eight lists of solids and pairs stay on the GPU; later changes of a Field's arrays have no
    effect there.
    """
    return _differentiable(Volumes, solids, poses, pairs, scales, settings)


def separation(solids: Sequence["ist.Asset | ist.Field"], poses: torch.Tensor, *, pairs=None,
               scales: "torch.Tensor | None" = None, **settings) -> torch.Tensor:
    """Distances of pairs of placed solids [u], differentiable by their poses and scales; on the CPU.

    Arguments, shapes and NaN are those of overlap(); settings: inner_spheres, max_visits and threads of
    ist.separation. Solids that overlap have the distance 0 and no gradient. Elsewhere the gradient is
    that of the nearest points; where several pairs of points are nearest, that of one of them.

    Raises TypeError for poses on a GPU: ist.gpu.separation has nearest points and normals there.
    """
    return _differentiable(Gaps, solids, poses, pairs, scales, settings)


def _differentiable(kind, solids, poses, pairs, scales, settings):
    if pairs is None:
        pairs = all_pairs(solids)
    poses = _real(torch.as_tensor(poses), "poses")
    if scales is not None:
        scales = _real(torch.as_tensor(scales), "scales")
    return _Answers.apply(poses, scales, solids, np.asarray(pairs, np.int64).reshape(-1, 2),
                          settings, kind)


def _real(tensor, name):
    """Whole numbers would cut the volumes to whole ones: they become what torch divides them to."""
    if tensor.is_complex() or tensor.dtype == torch.bool:
        raise TypeError(f"{name}: dtype {tensor.dtype}; wanted real numbers")
    return tensor if tensor.is_floating_point() else tensor.to(torch.get_default_dtype())


class _Answers(torch.autograd.Function):
    @staticmethod
    def forward(ctx, poses, scales, solids, pairs, settings, kind):
        given = _doubles(poses, "poses", poses.device)
        length = given[..., :4].norm(dim=-1, keepdim=True)
        placed = torch.cat((given[..., :4] / length, given[..., 4:]), dim=-1)
        sizes = None if scales is None else _doubles(scales, "scales", poses.device)
        ask = _ask_gpu if poses.device.type == "cuda" else _ask_cpu
        ctx.answer = ask(solids, placed, pairs, sizes, ctx.needs_input_grad[:2], settings, kind)
        ctx.length = length
        ctx.like = [(x.shape, x.dtype) if x is not None else None for x in (poses, scales)]
        return torch.where(ctx.answer.valid, ctx.answer.value, torch.nan).to(poses.dtype)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, slope):
        answer = ctx.answer
        slope = torch.where(answer.valid, slope.to(torch.float64), torch.nan)
        by_pose = by_scale = None
        if ctx.needs_input_grad[0]:
            shape, dtype = ctx.like[0]
            total = slope.new_zeros(shape)
            for solid, gradient in zip(answer.pairs, answer.pose_gradients()):
                total.index_add_(-2, solid, slope[..., None] * gradient)
            total[..., :4] /= ctx.length
            by_pose = total.to(dtype)
        if ctx.needs_input_grad[1]:
            shape, dtype = ctx.like[1]
            total = slope.new_zeros(shape)
            for solid, gradient in zip(answer.pairs, answer.scale_gradients()):
                total.index_add_(-1, solid, slope * gradient)
            by_scale = total.to(dtype)
        return by_pose, by_scale, None, None, None, None


def _doubles(tensor, name, device):
    if device.type not in ("cpu", "cuda"):
        raise TypeError(f"{name}: on {device}; wanted a tensor on the CPU or a CUDA device")
    if tensor.device != device:
        raise TypeError(f"{name}: on {tensor.device}; wanted a tensor on {device}, as poses are")
    return tensor.detach().to(torch.float64)


class _Answer:
    """Of pairs, shape (n,) or (w, n): a value, whether it is `valid`, and both solids' gradients."""

    def __init__(self, pairs, value, valid, pose_gradients, scale_gradients):
        self.pairs = pairs  # two (n,) numbers of solids
        self.value, self.valid = value, valid
        # Of A and of B; functions, as not everybody wants them.
        self.pose_gradients, self.scale_gradients = pose_gradients, scale_gradients


def _ask_cpu(solids, placed, pairs, scales, needs_gradient, settings, kind):
    found = kind(solids, placed.numpy(), pairs, None if scales is None else scales.numpy(),
                 scales is not None and needs_gradient[1], settings)
    return _Answer(
        torch.from_numpy(pairs.T.copy()), torch.from_numpy(found.value),
        torch.from_numpy(found.status != ist.QueryStatus.invalid_input),
        lambda: [torch.from_numpy(array) for array in found.pose_gradients()],
        lambda: [torch.from_numpy(array) for array in found.scale_gradients()])


class _Scene:
    """Solids and pairs of them on a device."""

    def __init__(self, solids, pairs, device):
        for k, solid in enumerate(solids):
            if not isinstance(solid, (ist.Asset, ist.Field)):
                raise TypeError(f"solids[{k}]: a {type(solid).__name__}; wanted an Asset or a Field")
        is_field = np.array([isinstance(solid, ist.Field) for solid in solids], bool)
        for i, (first, second) in enumerate(pairs.tolist()):
            if not (0 <= first < len(solids) and 0 <= second < len(solids)):
                raise ValueError(f"pairs[{i}]: ({first}, {second}): solids are numbered 0 to "
                                 f"{len(solids) - 1}")
            if first == second:
                raise ValueError(f"pairs[{i}]: ({first}, {second}): a solid cannot be paired with itself")
            if is_field[first] and is_field[second]:
                raise ValueError(f"pairs[{i}]: ({first}, {second}): two Fields; one of them must be "
                                 "an Asset")
        place = {solid: k for k, solid in enumerate(dict.fromkeys(solids))}  # each once
        self.solids = ist.gpu.Solids(list(place), device=device.index)
        self.pairs = torch.from_numpy(pairs.T.copy()).to(device)  # two (n,) numbers of solids
        places = np.array([place[solid] for solid in solids], np.int32)
        self.places = torch.from_numpy(places[pairs.T]).to(device)  # among what the device holds


@functools.lru_cache(maxsize=8)
def _scene(solids, pairs, device):
    return _Scene(solids, np.frombuffer(pairs, np.int64).reshape(-1, 2), device)


def _ask_gpu(solids, placed, pairs, scales, needs_gradient, settings, kind):
    if kind is Gaps:
        raise TypeError("poses: on a GPU; separation() takes them on the CPU, ist.gpu.separation on a GPU")
    settings = dict(settings)
    asked = {name: settings.pop(name) for name in ("measure", "pair_budget") if name in settings}
    if settings.pop("field", "never") != "never":
        raise ValueError("field: on a GPU volumes of two Assets are by lenses: 'never'")
    for name in settings:
        raise TypeError(f"{name}: there is no such setting on a GPU")
    k = len(solids)
    if placed.ndim not in (2, 3) or tuple(placed.shape[-2:]) != (k, 7):
        raise ValueError(f"poses: shape {tuple(placed.shape)}; wanted ({k}, 7) or (w, {k}, 7)")
    if scales is not None and scales.shape != placed.shape[:-1]:
        raise ValueError(f"scales: shape {tuple(scales.shape)}; wanted {tuple(placed.shape[:-1])}")
    scene = _scene(tuple(solids), pairs.tobytes(), placed.device)
    wants_pose, wants_scale = needs_gradient[0], scales is not None and needs_gradient[1]
    shape = (*placed.shape[:-2], scene.pairs.shape[1])
    place_a, place_b = (place.expand(shape).reshape(-1).contiguous() for place in scene.places)
    pose_a, pose_b = (placed[..., solid, :].reshape(-1, 7) for solid in scene.pairs)
    scale_a = scale_b = None
    if scales is not None:
        scale_a, scale_b = (scales[..., solid].reshape(-1) for solid in scene.pairs)
    rows = len(place_a)

    def ask(scale_b, *wanted):
        out = {name: placed.new_empty((rows, 3) if name.endswith("gradient") else rows)
               for name in wanted}
        out["status"] = torch.empty(rows, dtype=torch.int32, device=placed.device)
        ist.gpu.penetration(scene.solids, place_a, place_b, pose_a, pose_b, scale_a, scale_b,
                            out=out, **asked,
                            stream=torch.cuda.current_stream(placed.device).cuda_stream)
        return out

    gradients = ["translation_gradient", "rotation_gradient"] if wants_pose or wants_scale else []
    found = ask(scale_b, "volume", *gradients)
    away = pose_b[:, 4:] - pose_a[:, 4:]

    def pose_gradients():
        push, turn = (found[name] for name in gradients)
        # What turns and moves B is undone by the same about A's origin.
        turn_a = -(turn + torch.linalg.cross(away, push))
        return [by_pose(pose, *by, torch.linalg.cross, torch.cat).reshape(*shape, 7)
                for pose, by in ((pose_a, (-push, turn_a)), (pose_b, (push, turn)))]

    by_scale = None
    if wants_scale:
        # As on the CPU (python/src/penetration.cpp).
        step = scale_b / 2048
        more, less = (ask(scale_b + by, "volume")["volume"] for by in (step, -step))
        by_b = (more - less) / (2 * step)
        by_a = (3 * found["volume"] - scale_b * by_b
                - (away * found["translation_gradient"]).sum(-1)) / scale_a
        by_scale = [torch.where(found["volume"] > 0, by, 0.0).reshape(shape) for by in (by_a, by_b)]
    return _Answer(scene.pairs, found["volume"].reshape(shape),
                   (found["status"] != ist.QueryStatus.invalid_input).reshape(shape),
                   pose_gradients, lambda: by_scale)
