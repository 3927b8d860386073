"""ist.jax on a card."""
import os

os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # or JAX takes most of the memory

import numpy as np
import pytest

import ist

pytestmark = pytest.mark.skipif(not ist.gpu.available(), reason=f"{ist.gpu.why_not()}")

jax = pytest.importorskip("jax", reason="no jax: pip install jax[cuda13]")
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp  # noqa: E402

from ist.jax import overlap, separation  # noqa: E402

if ist.gpu.available() and jax.default_backend() != "gpu":
    pytest.skip("this JAX has no GPU: pip install jax[cuda13]", allow_module_level=True)

EXACT = dict(measure="exact")


@pytest.fixture
def scenes(random_poses):
    """(40, 3, 7) float64, quaternions of any length."""
    poses = random_poses(120, 1.2).reshape(40, 3, 7)
    poses[..., :4] *= np.random.default_rng(5).uniform(0.2, 5, (40, 3, 1))
    return poses


def gradients(query, solids, poses, scales, device, **settings):
    def sum_of(poses, scales):
        values = query(solids, poses, scales=scales, **settings)
        return (values * jnp.linspace(-1, 2, values.size).reshape(values.shape)).sum(), values

    with jax.default_device(jax.devices(device)[0]):
        poses, scales = (None if x is None else jnp.asarray(x) for x in (poses, scales))
        wanted = (0, 1) if scales is not None else 0
        (_, values), found = jax.jit(jax.value_and_grad(sum_of, wanted, has_aux=True))(poses, scales)
    return [np.asarray(x) for x in (values, *(found if scales is not None else (found,)))]


@pytest.mark.parametrize("scaled", [False, True])
@pytest.mark.parametrize("query, reach, settings, bounds", [
    (overlap, 1, EXACT, (1e-9, 1e-9, 1e-6)),
    (overlap, 1, dict(spheres_only=True), (1e-5, 1e-5, 2e-3)),  # scales' are differences
    (separation, 5, {}, (1e-9, 1e-9, 1e-9))])
def test_values_and_gradients_are_those_of_the_cpu(gear, knot, cube, scenes, query, reach, settings,
                                                   bounds, scaled):
    solids = [gear, knot, cube]
    there = ist.Solids(solids, device="cuda")
    scenes[..., 4:] *= reach
    scales = np.linspace(0.7, 1.3, 120).reshape(40, 3)
    for p, s in ((scenes, scales), (scenes[0], scales[0])):
        s = s if scaled else None
        ours = gradients(query, there, p, s, "gpu", **settings)
        theirs = gradients(query, solids, p, s, "cpu", **settings)
        assert np.abs(theirs[0]).max() > 0.05
        for one, other, bound in zip(ours, theirs, bounds):
            assert one.shape == other.shape
            assert np.abs(one - other).max() <= bound * np.abs(other).max()


def test_aligned_poses_and_copies(gear, knot, cube):
    solids = [cube, cube, gear]
    random = np.random.default_rng(6)
    poses = np.zeros((200, 3, 7))
    poses[..., 0] = 1
    turned = random.integers(0, 4, (200, 3))  # not, or by 90 degrees about an axis
    for axis in (1, 2, 3):
        poses[turned == axis, 0] = poses[turned == axis, axis] = np.sqrt(0.5)
    poses[..., 4:] = 0.5 * random.integers(-2, 3, (200, 3, 3))
    ours, theirs = (gradients(overlap, of, poses, None, device, **EXACT)
                    for of, device in ((ist.Solids(solids, device="cuda"), "gpu"), (solids, "cpu")))
    assert 0.2 < (theirs[0] > 0).mean() < 0.9
    for one, other in zip(ours, theirs):
        assert np.abs(one - other).max() <= 1e-9 * np.abs(other).max()


def test_every_transformation_gives_the_same(gear, knot, cube, scenes):
    there = ist.Solids([gear, knot, cube], device="cuda")
    scenes = jnp.asarray(scenes)

    def ask(poses):
        return overlap(there, poses, **EXACT)

    expected = ask(scenes)
    assert next(iter(expected.devices())).platform == "gpu" and expected.max() > 0.1
    for found in (jax.jit(ask)(scenes), jax.vmap(ask)(scenes),
                  jax.jit(jax.vmap(jax.vmap(ask)))(scenes.reshape(8, 5, 3, 7)).reshape(40, 3)):
        assert (found == expected).all()
    one = jax.vmap(jax.grad(lambda p: ask(p).sum()))(scenes)
    assert (one == jax.grad(lambda p: ask(p).sum())(scenes)).all()
    assert overlap(there, scenes.astype(jnp.float32), **EXACT).dtype == jnp.float32


def test_nothing_goes_to_the_host(gear, knot, scenes):
    there = ist.Solids([gear, knot], device="cuda")
    poses = jnp.asarray(scenes[:, :2])
    slope = jax.jit(jax.grad(lambda p: overlap(there, p, **EXACT).sum()))
    expected = slope(poses)  # compiled, with its constants in place
    with jax.transfer_guard("disallow"):
        found = slope(poses)
    assert (found == expected).all() and jnp.abs(found).max() > 0.01


def test_an_invalid_pose_is_nan_where_it_is(gear, knot, cube, scenes):
    there = ist.Solids([gear, knot, cube], device="cuda")
    poses = jnp.asarray(scenes[0]).at[2].set(jnp.nan)
    slope = jax.grad(lambda p: overlap(there, p, **EXACT)[0])(poses)
    assert jnp.isnan(overlap(there, poses, **EXACT)).tolist() == [False, True, True]
    assert jnp.isfinite(slope[:2]).all()


def test_float64_must_be_on(gear, knot, scenes):
    there = ist.Solids([gear, knot], device="cuda")
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(TypeError, match=r"float32; wanted float64 for solids on cuda:0: jax.config"):
            overlap(there, jnp.asarray(scenes[0, :2], jnp.float32))
    finally:
        jax.config.update("jax_enable_x64", True)
