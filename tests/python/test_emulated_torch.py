"""ist.torch as on a GPU, over a device that is host memory: tensors of the CPU stand for its own.

On a card: test_torch_on_gpu.py.
"""
import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="no python3-torch: ./dev setup --torch")

import ist  # noqa: E402
import ist.torch  # noqa: E402
from test_emulated_gpu import OnDevice  # noqa: E402


class Stream:
    cuda_stream = 5


def lent(tensor):
    if tensor is None:
        return None
    array = OnDevice(tensor.detach().numpy(), kept=True)
    assert tensor.numel() == 0 or array.array.ctypes.data == tensor.data_ptr()  # not a copy of it
    return array


@pytest.fixture
def overlap(monkeypatch):
    """ist.torch.overlap that takes tensors of the CPU for a GPU's."""
    batch, there = ist.gpu.penetration, ist.gpu.Solids

    def penetration(solids, *arguments, out, **settings):
        found = batch(solids, *map(lent, arguments), **settings,
                      out={name: lent(tensor) for name, tensor in out.items()})
        # PyTorch would go on behind the batch; here somebody is to wait for it.
        batch(solids, 0, 0, None, OnDevice(np.zeros((1, 7)))).status.numpy()
        return found

    def asked(*arguments, **settings):
        with monkeypatch.context() as patch:
            patch.setattr(ist.gpu, "penetration", penetration)
            patch.setattr(ist.gpu, "Solids", lambda solids, device: there(solids))
            patch.setattr(torch.cuda, "current_stream", lambda device: Stream())
            patch.setattr(ist.torch, "_ask_cpu", ist.torch._ask_gpu)
            return ist.torch.overlap(*arguments, **settings)

    ist.torch._scene.cache_clear()
    yield asked
    ist.torch._scene.cache_clear()


def gradients(overlap, solids, poses, scales, **settings):
    poses = poses.clone().requires_grad_()
    scales = scales.clone().requires_grad_() if scales is not None else None
    volumes = overlap(solids, poses, scales=scales, **settings)
    weights = torch.linspace(-1, 2, volumes.numel(), dtype=torch.float64).reshape(volumes.shape)
    (volumes * weights).sum().backward()
    return [volumes.detach(), poses.grad] + ([scales.grad] if scales is not None else [])


@pytest.fixture
def solids(gear, knot, cube):
    return [gear, ist.HalfSpaceField(), knot, ist.BoxField([0.5, 0.7, 0.6]), cube, gear]


@pytest.mark.parametrize("pairs", [None, [(3, 0), (0, 2), (1, 4), (5, 0), (1, 2), (4, 2)], [(1, 0)], [(0, 1), (2, 0), (2, 3)],
                                   [(4, 0)], [(0, 5)], []])
@pytest.mark.parametrize("scaled", [False, True])
def test_overlaps_are_those_of_the_cpu(overlap, solids, random_poses, pairs, scaled):
    poses = torch.from_numpy(random_poses(24, 0.8).reshape(4, 6, 7))
    poses[1, 2, 5] = torch.nan
    scales = torch.linspace(0.7, 1.3, 24, dtype=torch.float64).reshape(4, 6) if scaled else None
    for p, s in ((poses, scales), (poses[0], scales[0] if scaled else None)):
        theirs = gradients(ist.torch.overlap, solids, p, s, pairs=pairs, field="never")
        ours = gradients(overlap, solids, p, s, pairs=pairs)
        assert pairs == [] or p.ndim == 2 or theirs[0].nan_to_num().abs().max() > 0.01
        for k, (one, other) in enumerate(zip(ours, theirs)):
            assert one.shape == other.shape and (one.isnan() == other.isnan()).all()
            bound = (1e-5, 2e-5, 2e-3)[k]  # scales' are differences
            if other.numel():
                error = (one - other).nan_to_num().abs().max()
                assert error <= bound * other.nan_to_num().abs().max(), k


def test_wrong_scenes_are_named(overlap, solids, random_poses):
    poses = torch.from_numpy(random_poses(6, 0.8))
    for wrong, error, text in [
            (dict(pairs=[(1, 3)]), ValueError, r"pairs\[0\]: \(1, 3\): two Fields; one of them must"),
            (dict(pairs=[(0, 6)]), ValueError, r"pairs\[0\]: \(0, 6\): solids are numbered 0 to 5"),
            (dict(pairs=[(2, 2)]), ValueError, "a solid cannot be paired with itself"),
            (dict(field="always"), ValueError, "field: on a GPU"),
            (dict(max_visits=1), TypeError, "max_visits: there is no such setting on a GPU"),
            (dict(poses=poses[:5]), ValueError, r"poses: shape \(5, 7\); wanted \(6, 7\)"),
            (dict(scales=torch.ones(3)), ValueError, r"scales: shape \(3,\); wanted \(6,\)"),
            (dict(solids=[*solids[:5], 3]), TypeError, r"solids\[5\]: a int; wanted an Asset or a")]:
        with pytest.raises(error, match=text):
            overlap(**{**dict(solids=solids, poses=poses, pairs=[(0, 2)]), **wrong})


def test_a_budget_is_passed_on(overlap, solids, random_poses):
    poses = torch.from_numpy(random_poses(6, 0.8))
    assert not torch.equal(overlap(solids, poses, pair_budget=60), overlap(solids, poses))
