"""ist.torch: volumes that autograd can differentiate."""
import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="no python3-torch: ./dev setup --torch")

import ist  # noqa: E402
from ist.torch import overlap, separation  # noqa: E402


@pytest.fixture
def scenes(random_poses):
    """(6, 3, 7) float64, quaternions of any length."""
    poses = random_poses(18, 1.2).reshape(6, 3, 7)
    poses[..., :4] *= np.random.default_rng(5).uniform(0.2, 5, (6, 3, 1))
    return torch.tensor(poses, requires_grad=True)


def differences(function, x, h):
    """The gradient of a sum over scenes, by central differences; scenes do not see each other."""
    gradient = torch.zeros_like(x)
    with torch.no_grad():
        for index in np.ndindex(*x.shape[1:]):
            step = torch.zeros_like(x)
            step[(slice(None), *index)] = h
            gradient[(slice(None), *index)] = (function(x + step) - function(x - step)) / (2 * h)
    return gradient


def test_volumes_are_the_librarys(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    volumes = overlap(solids, scenes)
    unit = scenes.detach().numpy().copy()
    unit[..., :4] /= np.linalg.norm(unit[..., :4], axis=-1, keepdims=True)
    expected = np.stack([ist.penetration(solids[a], solids[b], unit[:, b], poses_a=unit[:, a]).volume
                         for a, b in ((0, 1), (0, 2), (1, 2))], axis=-1)
    assert volumes.shape == (6, 3) and volumes.dtype == torch.float64
    assert volumes.detach().numpy() == pytest.approx(expected, rel=1e-9)
    assert overlap(solids, scenes[2]).tolist() == volumes[2].tolist()
    assert overlap(solids, scenes.float()).dtype == torch.float32


def test_pose_gradients_are_differences(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    weights = torch.tensor([1.0, -0.3, 2.0], dtype=torch.float64)

    def energy(poses):
        return (overlap(solids, poses) * weights).sum(-1)

    energy(scenes).sum().backward()
    expected = differences(energy, scenes.detach(), 1e-4)
    assert expected.abs().max() > 1
    for scene in range(6):
        error = (scenes.grad[scene] - expected[scene]).norm() / expected[scene].norm()
        assert error < 2e-3
    # A step along the gradient keeps each quaternion's length.
    along = (scenes.grad[..., :4] * scenes.detach()[..., :4]).sum(-1).abs()
    assert along.max() < 1e-9


def test_whole_numbers_are_converted(cube):
    whole = torch.tensor([[1, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0]])
    found = overlap([cube, cube], whole)
    assert found.dtype == torch.get_default_dtype()
    assert found.item() == pytest.approx(overlap([cube, cube], whole.double()).item(), rel=1e-6)
    assert overlap([cube, cube], whole.double(), scales=torch.tensor([1, 1])).item() == pytest.approx(
        found.item(), rel=1e-6)
    with pytest.raises(TypeError, match="poses: dtype torch.complex64; wanted real numbers"):
        overlap([cube, cube], whole.to(torch.complex64))


def test_autograds_own_check(gear, knot):
    pose = torch.tensor([[1.0, 0, 0, 0, 0, 0, 0], [0.9, 0.3, -0.2, 0.4, 0.6, 0.2, 0.1]],
                        dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda p: overlap([gear, knot], p), pose, eps=1e-4, atol=5e-3,
                                    rtol=2e-3)


def test_exact_passes_autograds_own_check_tightly(gear, knot):
    pose = torch.tensor([[1.0, 0, 0, 0, 0, 0, 0], [0.9, 0.3, -0.2, 0.4, 0.6, 0.2, 0.1]],
                        dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda p: overlap([gear, knot], p, measure="exact"), pose,
                                    eps=1e-5, atol=1e-6, rtol=1e-5)


def test_exact_of_a_field_is_nan(cube):
    poses = torch.tensor([[1.0, 0, 0, 0, 0, 0, 0]] * 2, dtype=torch.float64, requires_grad=True)
    volume = overlap([ist.HalfSpaceShape(), cube], poses, measure="exact")
    assert torch.isnan(volume).all()
    volume.sum().backward()
    assert torch.isnan(poses.grad).any()


def test_scale_gradients_are_differences(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    scales = torch.full((6, 3), 0.9, dtype=torch.float64, requires_grad=True)
    poses = scenes.detach()
    overlap(solids, poses, scales=scales).sum().backward()
    expected = differences(lambda s: overlap(solids, poses, scales=s).sum(-1), scales.detach(), 1e-3)
    assert (scales.grad - expected).norm() < 3e-3 * expected.norm()


def test_fields_stand_first(cube):
    floor = ist.HalfSpaceShape()
    poses = torch.tensor([[1.0, 0, 0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0, 0, 0]], dtype=torch.float64,
                         requires_grad=True)
    volume = overlap([floor, cube], poses)
    assert volume.shape == (1,)
    volume.sum().backward()
    assert poses.grad[1, 6] < 0 < poses.grad[0, 6]  # up is out of the floor
    assert poses.grad[1, 6] == pytest.approx(-poses.grad[0, 6])


def test_an_invalid_pose_is_nan_where_it_is(gear, knot, cube, scenes):
    spoiled = scenes.detach().clone()
    spoiled[1, 2, 5] = torch.nan
    spoiled[4, 0, :4] = 0
    spoiled.requires_grad_()
    volumes = overlap([gear, knot, cube], spoiled)
    assert torch.isnan(volumes).nonzero().tolist() == [[1, 1], [1, 2], [4, 0], [4, 1]]
    volumes.sum().backward()
    fine = [0, 2, 3, 5]
    assert torch.isfinite(spoiled.grad[fine]).all() and torch.isnan(spoiled.grad[1]).all()
    # Answers that nobody differentiates leave the others alone.
    for ask, among in ((overlap, scenes), (separation, apart(scenes)[0].detach())):
        bad, good = among.detach().clone(), among.detach().clone()
        bad[4, 0, :4] = 0
        for poses in (bad.requires_grad_(), good.requires_grad_()):
            torch.nansum(ask([gear, knot, cube], poses)[:, 2]).backward()
        assert torch.equal(bad.grad, good.grad) and bad.grad[4, 0].eq(0).all()


def test_gradients_of_gradients_are_refused(cube):
    poses = torch.tensor([[1.0, 0, 0, 0, 0, 0, 0], [0.9, 0.1, 0.3, 0.2, 0.9, 0.3, 0.2]],
                         dtype=torch.float64, requires_grad=True)
    volume = overlap([cube, cube], poses).sum()
    gradient, = torch.autograd.grad(volume, poses, create_graph=True)
    with pytest.raises(RuntimeError, match="differentiable once"):
        (volume + gradient.square().sum()).backward()
    plain, = torch.autograd.grad(overlap([cube, cube], poses).sum(), poses)
    assert not plain.requires_grad and torch.equal(plain, gradient)


def test_wrong_tensors_are_named(gear, knot):
    with pytest.raises(ValueError, match=r"poses: shape \(3, 7\); wanted \(2, 7\)"):
        overlap([gear, knot], torch.ones(3, 7))
    with pytest.raises(TypeError, match="poses: on meta; wanted a tensor on the CPU or a CUDA device"):
        overlap([gear, knot], torch.ones(2, 7, device="meta"))
    with pytest.raises(TypeError, match="scales: on meta; wanted a tensor on cpu, as poses are"):
        overlap([gear, knot], torch.ones(2, 7), scales=torch.ones(2, device="meta"))


def test_descent_parts_two_solids(gear, knot):
    pose = torch.tensor([0.5, 0.1, 0.0, 0.2, 4.5, 0.5, 1.0], dtype=torch.float64, requires_grad=True)
    still = torch.tensor([1.0, 0, 0, 0, 0, 0, 0], dtype=torch.float64)
    adam = torch.optim.Adam([pose], lr=0.1)
    first = None
    for _ in range(200):
        adam.zero_grad()
        volume = overlap([gear, knot], torch.stack((still, pose)))[0]
        first = volume.item() if first is None else first
        if volume == 0:
            assert first > 0.1
            return
        volume.backward()
        adam.step()
    pytest.fail(f"{volume.item()} is left")


def apart(scenes):
    """Scenes whose solids are mostly clear of each other, and their sizes."""
    poses = scenes.detach().clone()
    poses[..., 4:] *= 3
    sizes = 0.3 + 0.4 * torch.rand(6, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(3))
    return poses.requires_grad_(), sizes.requires_grad_()


def test_distances_are_the_librarys(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    poses, sizes = apart(scenes)
    unit = poses.detach().numpy().copy()
    unit[..., :4] /= np.linalg.norm(unit[..., :4], axis=-1, keepdims=True)
    found = separation(solids, poses, scales=sizes)
    size = sizes.detach().numpy()
    expected = np.stack([ist.separation(solids[a], solids[b], unit[:, b], poses_a=unit[:, a],
                                        scales=size[:, b], scales_a=size[:, a]).distance
                         for a, b in ((0, 1), (0, 2), (1, 2))], axis=-1)
    assert found.detach().numpy() == pytest.approx(expected, rel=1e-9)
    assert separation(solids, poses[2], scales=sizes[2]).tolist() == found[2].tolist()
    inner = separation(solids, poses, scales=sizes, inner_spheres=True)
    assert (inner >= found).all() and (inner > found).any()


def test_gradients_of_distances_are_differences(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    poses, sizes = apart(scenes)
    weights = torch.tensor([1.0, -0.3, 2.0], dtype=torch.float64)

    def energy(poses, sizes):
        return (separation(solids, poses, scales=sizes) * weights).sum(-1)

    assert (separation(solids, poses, scales=sizes) > 0).double().mean() > 0.9
    energy(poses, sizes).sum().backward()
    for found, expected in (
            (poses.grad, differences(lambda x: energy(x, sizes), poses.detach(), 1e-6)),
            (sizes.grad, differences(lambda x: energy(poses, x), sizes.detach(), 1e-6))):
        for scene in range(6):  # the nearest points move continuously along smooth surfaces only
            assert (found[scene] - expected[scene]).norm() < 1e-3 * expected[scene].norm()


def test_distances_of_what_overlaps_or_is_no_number(cube):
    poses = torch.zeros(3, 7, dtype=torch.float64)
    poses[:, 0] = 1
    poses[2, 4] = torch.nan
    poses.requires_grad_()
    found = separation([cube, cube, cube], poses)
    assert found[0] == 0 and found[1:].isnan().all()
    assert torch.autograd.grad(separation([cube, cube], poses[:2]).sum(), poses)[0].abs().max() == 0
    floor = ist.HalfSpaceShape([0, 0, 1])
    high = torch.tensor([[1.0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 2]], requires_grad=True)
    gap = separation([floor, cube], high)
    assert gap.item() == pytest.approx(1.5)
    gap.sum().backward()
    assert high.grad[1, 4:].tolist() == [0, 0, 1] and high.grad[0, 4:].tolist() == [0, 0, -1]
