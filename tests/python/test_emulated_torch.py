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


class Index:
    """Of rows, where it is a device's."""

    def __init__(self, tensor):
        self.tensor = tensor

    def reshape(self, count):
        return lent(self.tensor.reshape(count))


@pytest.fixture
def there(monkeypatch):
    """there(ist.torch.overlap) → the same, which takes tensors of the CPU for a GPU's."""
    scene, ask, spread = ist.torch.Scene, ist.torch._ask_gpu, ist.torch._ARRAY.spread

    def of(function):
        def asked(*arguments, **settings):
            held = []

            def on_device(solids, pairs, _):
                held.append(scene(solids, pairs, solids.device if isinstance(solids, ist.Solids) else "cuda"))
                return held[-1]

            def ask_device(query, names, a, b, poses, **arguments):
                def batch(a, b, poses, *, out, poses_a, scales, scales_a, stream, **settings):
                    query(a, b, lent(poses), poses_a=lent(poses_a), scales=lent(scales),
                          scales_a=lent(scales_a), stream=stream, **settings,
                          out={name: lent(tensor) for name, tensor in out.items()})
                    # PyTorch would go on behind the batch; here somebody is to wait for it.
                    solids = held[-1].solids
                    query(solids[0], solids[0], OnDevice(np.zeros((1, 7))), **settings).status.numpy()
                return ask(batch, names, a, b, poses, **arguments)

            with monkeypatch.context() as patch:
                patch.setattr(ist.torch, "Scene", on_device)
                patch.setattr(ist.torch._ARRAY, "ask", ask_device)
                patch.setattr(ist.torch._ARRAY, "spread", lambda *rows: Index(spread(*rows)))
                patch.setattr(torch.cuda, "current_stream", lambda device: Stream())
                return function(*arguments, **settings)
        return asked
    return of


@pytest.fixture
def overlap(there):
    return there(ist.torch.overlap)


def gradients(overlap, solids, poses, scales, **settings):
    poses = poses.clone().requires_grad_()
    scales = scales.clone().requires_grad_() if scales is not None else None
    volumes = overlap(solids, poses, scales=scales, **settings)
    weights = torch.linspace(-1, 2, volumes.numel(), dtype=torch.float64).reshape(volumes.shape)
    (volumes * weights).sum().backward()
    return [volumes.detach(), poses.grad] + ([scales.grad] if scales is not None else [])


@pytest.fixture
def solids(gear, knot, cube):
    return [gear, ist.HalfSpaceShape(), knot, ist.BoxShape([0.5, 0.7, 0.6]), cube, gear]


@pytest.mark.parametrize("pairs", [None, [(3, 0), (0, 2), (1, 4), (5, 0), (1, 2), (4, 2)], [(1, 0)], [(0, 1), (2, 0), (2, 3)],
                                   [(4, 0)], [(0, 5)], []])
@pytest.mark.parametrize("scaled", [False, True])
def test_overlaps_are_those_of_the_cpu(overlap, solids, random_poses, pairs, scaled):
    poses = torch.from_numpy(random_poses(24, 0.8).reshape(4, 6, 7))
    poses[1, 2, 5] = torch.nan
    scales = torch.linspace(0.7, 1.3, 24, dtype=torch.float64).reshape(4, 6) if scaled else None
    for p, s in ((poses, scales), (poses[0], scales[0] if scaled else None)):
        theirs = gradients(ist.torch.overlap, solids, p, s, pairs=pairs, spheres_only=True)
        ours = gradients(overlap, solids, p, s, pairs=pairs, spheres_only=True)
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
            (dict(pairs=[(1, 3)]), ValueError, r"pairs\[0\]: \(1, 3\): two shapes; one of them must"),
            (dict(pairs=[(0, 6)]), ValueError, r"pairs\[0\]: \(0, 6\): solids are numbered 0 to 5"),
            (dict(pairs=[(2, 2)]), ValueError, "a solid cannot be paired with itself"),
            (dict(max_visits=1), ValueError, "max_visits: not on a GPU"),
            (dict(poses=poses[:5]), ValueError, r"poses: shape \(5, 7\); wanted \(6, 7\)"),
            (dict(scales=torch.ones(3)), ValueError, r"scales: shape \(3,\); wanted \(6,\)"),
            (dict(solids=[*solids[:5], 3]), TypeError, r"solids\[5\]: a int; wanted an Asset or a")]:
        with pytest.raises(error, match=text):
            overlap(**{**dict(solids=solids, poses=poses, pairs=[(0, 2)], spheres_only=True), **wrong})


def test_a_budget_is_passed_on(overlap, solids, random_poses):
    poses = torch.from_numpy(random_poses(6, 0.8))
    assert not torch.equal(overlap(solids, poses, pair_budget=60, spheres_only=True),
                           overlap(solids, poses, spheres_only=True))


@pytest.mark.parametrize("held", [False, True])
def test_distances_are_those_of_the_cpu(there, gear, knot, cube, random_poses, held):
    solids = [gear, knot, cube, gear]
    poses = torch.from_numpy(random_poses(16, 6.0).reshape(4, 4, 7))
    poses[1, 2, 5] = torch.nan
    scales = torch.linspace(0.7, 1.3, 16, dtype=torch.float64).reshape(4, 4)
    for s in (None, scales):
        theirs = gradients(ist.torch.separation, solids, poses, s)
        ours = gradients(there(ist.torch.separation),
                         ist.Solids(solids, device="cuda") if held else solids, poses, s)
        assert (theirs[0] > 0).sum() > 12
        for one, other in zip(ours, theirs):
            assert (one.isnan() == other.isnan()).all()
            assert (one - other).nan_to_num().abs().max() <= 1e-4 * other.nan_to_num().abs().max()


def test_solids_are_where_the_poses_are(gear, knot, random_poses):
    poses = torch.from_numpy(random_poses(2, 1.0))
    with pytest.raises(TypeError, match="solids: on cuda:0; wanted them on cpu, as poses are"):
        ist.torch.overlap(ist.Solids([gear, knot], device="cuda"), poses)
    held = ist.Solids([gear, knot])
    assert ist.torch.overlap(held, poses).item() == ist.torch.overlap([gear, knot], poses).item()
