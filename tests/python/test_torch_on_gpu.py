"""ist.torch on a card."""
import functools
import time

import numpy as np
import pytest

import ist

pytestmark = pytest.mark.skipif(not ist.gpu.available(), reason=f"{ist.gpu.why_not()}")

if ist.gpu.available():
    torch = pytest.importorskip("torch", reason="no PyTorch")
    import ist.torch
    overlap = functools.partial(ist.torch.overlap, spheres_only=True)

CYCLES = 1_000_000_000  # a good part of a second


@pytest.fixture(scope="module")
def solids(gear, knot, cube):
    return [gear, knot, cube]


def gradients(solids, poses, scales, device, query=None, **settings):
    poses = poses.to(device).requires_grad_()
    scales = scales.to(device).requires_grad_() if scales is not None else None
    volumes = (query or overlap)(solids, poses, scales=scales, **settings)
    weights = torch.linspace(-1, 2, volumes.numel(), dtype=torch.float64).reshape(volumes.shape)
    (volumes * weights.to(device)).sum().backward()
    return [x.detach().cpu() for x in (volumes, poses.grad)] + (
        [scales.grad.cpu()] if scales is not None else [])


def test_overlaps_are_those_of_the_cpu(solids, random_poses):
    poses = torch.from_numpy(random_poses(400, 1.2).reshape(100, 4, 7))
    poses[..., :4] *= 3
    solids = [solids[0], solids[1], solids[0], solids[2]]
    scales = torch.linspace(0.7, 1.3, 400, dtype=torch.float64).reshape(100, 4)
    for p, s in ((poses, None), (poses, scales), (poses[0], scales[0])):
        ours = gradients(solids, p.clone(), s, "cuda")
        theirs = gradients(solids, p.clone(), s, "cpu")
        assert theirs[0].abs().max() > 0.1
        for k, (one, other) in enumerate(zip(ours, theirs)):
            bound = (1e-5, 1e-5, 2e-3)[k]  # scales' are differences
            assert (one - other).abs().max() <= bound * other.abs().max(), k
    assert overlap(solids, poses.float().cuda()).dtype == torch.float32


def test_fields_stand_first(solids, random_poses):
    poses = torch.from_numpy(random_poses(500, 0.8).reshape(100, 5, 7))
    solids = [solids[0], ist.HalfSpaceShape(), solids[1], ist.BoxShape([0.5, 0.7, 0.6]), solids[2]]
    scales = torch.linspace(0.7, 1.3, 500, dtype=torch.float64).reshape(100, 5)
    for s in (None, scales):
        ours = gradients(solids, poses.clone(), s, "cuda")
        theirs = gradients(solids, poses.clone(), s, "cpu")
        for k, (one, other) in enumerate(zip(ours, theirs)):
            assert (one - other).abs().max() <= (1e-5, 1e-5, 2e-3)[k] * other.abs().max(), k


def test_overlaps_gradients_are_differences(solids, random_poses):
    poses = torch.from_numpy(random_poses(12, 1.0).reshape(4, 3, 7)).cuda()
    _, found = gradients(solids, poses.clone(), None, "cuda")
    weights = torch.linspace(-1, 2, 12, dtype=torch.float64).reshape(4, 3).cuda()
    h = 1e-3
    expected = torch.zeros_like(poses)
    for index in np.ndindex(3, 7):
        step = torch.zeros_like(poses)
        step[(slice(None), *index)] = h
        expected[(slice(None), *index)] = (
            (overlap(solids, poses + step) - overlap(solids, poses - step)) * weights).sum(-1) / (2 * h)
    assert expected.abs().max() > 0.1
    assert (found.cuda() - expected).norm() < 5e-3 * expected.norm()


@pytest.mark.parametrize("held", [False, True])
def test_distances_are_those_of_the_cpu(solids, random_poses, held):
    distance = ist.torch.separation
    poses = torch.from_numpy(random_poses(300, 6.0).reshape(100, 3, 7))
    scales = torch.linspace(0.7, 1.3, 300, dtype=torch.float64).reshape(100, 3)
    there = ist.Solids(solids, device="cuda") if held else solids
    for s in (None, scales):
        ours = gradients(there, poses.clone(), s, "cuda", distance)
        theirs = gradients(solids, poses.clone(), s, "cpu", distance)
        assert (theirs[0] > 0).double().mean() > 0.8
        for one, other in zip(ours, theirs):
            assert (one - other).abs().max() < 1e-9 * other.abs().max()


def test_overlap_never_waits(solids, random_poses):
    poses = torch.from_numpy(random_poses(300, 1.0).reshape(100, 3, 7)).cuda().requires_grad_()
    overlap(solids, poses).sum().backward()
    torch.cuda.synchronize()
    torch.cuda.set_sync_debug_mode("error")
    try:
        torch.cuda._sleep(CYCLES)
        start = time.perf_counter()
        overlap(solids, poses).sum().backward()
        took = time.perf_counter() - start
        assert not torch.cuda.current_stream().query()
        assert took < 0.1
    finally:
        torch.cuda.set_sync_debug_mode("default")
    torch.cuda.synchronize()


def test_an_invalid_pose_is_nan_where_it_is(solids, random_poses):
    poses = torch.from_numpy(random_poses(18, 1.0).reshape(6, 3, 7)).cuda()
    poses[1, 2, 5] = torch.nan
    poses[4, 0, :4] = 0
    poses.requires_grad_()
    volumes = overlap(solids, poses)
    assert torch.isnan(volumes).nonzero().tolist() == [[1, 1], [1, 2], [4, 0], [4, 1]]
    volumes.sum().backward()
    assert torch.isfinite(poses.grad[[0, 2, 3, 5]]).all() and torch.isnan(poses.grad[1]).all()


def test_descent_parts_two_solids(gear, knot):
    pose = torch.tensor([0.5, 0.1, 0.0, 0.2, 4.5, 0.5, 1.0], dtype=torch.float64, device="cuda",
                        requires_grad=True)
    still = torch.tensor([1.0, 0, 0, 0, 0, 0, 0], dtype=torch.float64, device="cuda")
    adam = torch.optim.Adam([pose], lr=0.1)
    for step in range(200):
        adam.zero_grad()
        volume = overlap([gear, knot], torch.stack((still, pose)))[0]
        assert step > 0 or volume.item() > 0.1
        if volume.item() == 0:
            return
        volume.backward()
        adam.step()
    pytest.fail(f"{volume.item()} is left")
