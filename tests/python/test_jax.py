"""ist.jax: volumes that JAX can differentiate, and arrays of JAX as arguments."""
import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="no jax: pip install jax")
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_platforms", "cpu")
import jax.numpy as jnp  # noqa: E402

import ist  # noqa: E402
from ist.jax import overlap, separation  # noqa: E402


@pytest.fixture
def scenes(random_poses):
    """(6, 3, 7) float64, quaternions of any length."""
    poses = random_poses(18, 1.2).reshape(6, 3, 7)
    poses[..., :4] *= np.random.default_rng(5).uniform(0.2, 5, (6, 3, 1))
    return jnp.asarray(poses)


def test_arrays_of_jax_are_arguments(gear, cube, scenes):
    poses = scenes[:, 0].at[:, :4].divide(jnp.linalg.norm(scenes[:, 0, :4], axis=1, keepdims=True))
    expected = ist.penetration(gear, cube, np.array(poses))
    assert np.array_equal(ist.penetration(gear, cube, poses).volume, expected.volume)
    assert np.array_equal(jnp.from_dlpack(expected.volume), expected.volume)


def test_volumes_are_the_librarys_under_every_transformation(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    unit = np.array(scenes)
    unit[..., :4] /= np.linalg.norm(unit[..., :4], axis=-1, keepdims=True)
    expected = np.stack([ist.penetration(solids[a], solids[b], unit[:, b], poses_a=unit[:, a]).volume
                         for a, b in ((0, 1), (0, 2), (1, 2))], axis=-1)

    def ask(poses):
        return overlap(solids, poses)

    for found in (ask(scenes), jax.jit(ask)(scenes), jax.vmap(ask)(scenes)):
        assert found.shape == (6, 3) and found.dtype == jnp.float64
        assert np.array(found) == pytest.approx(expected, rel=1e-9)
    assert overlap(solids, scenes.astype(jnp.float32)).dtype == jnp.float32


def test_gradients_are_differences(gear, knot, scenes):
    def volume(poses, scales):
        return overlap([gear, knot], poses, scales=scales, measure="exact").sum()

    poses, scales = scenes[0, :2] * 0.3, jnp.array([1.0, 0.8])
    by_pose, by_scale = jax.jit(jax.grad(volume, (0, 1)))(poses, scales)
    assert jnp.abs(by_pose).max() > 0.1
    for x, slope, ask in ((poses, by_pose, lambda x: volume(x, scales)),
                          (scales, by_scale, lambda x: volume(poses, x))):
        h = 1e-5
        for index in np.ndindex(*x.shape):
            difference = (ask(x.at[index].add(h)) - ask(x.at[index].add(-h))) / (2 * h)
            assert float(slope[index]) == pytest.approx(float(difference), abs=1e-3 * float(jnp.abs(slope).max()))


def test_invalid_pairs_are_nan_and_spoil_no_others(gear, knot, cube, scenes):
    poses = scenes[0].at[2].set(jnp.nan)
    slope = jax.grad(lambda p: overlap([gear, knot, cube], p)[0])(poses)
    found = overlap([gear, knot, cube], poses)
    assert jnp.isnan(found).tolist() == [False, True, True]
    assert jnp.isfinite(slope[:2]).all()


def test_distances_and_their_gradients(gear, knot, cube, scenes):
    solids = [gear, knot, cube]
    poses = scenes.at[..., 4:].multiply(3)
    sizes = jnp.full((6, 3), 0.5)

    def energy(poses, sizes):
        return (separation(solids, poses, scales=sizes) * jnp.array([1.0, -0.3, 2.0])).sum(-1)

    by_pose, by_size = jax.jit(jax.grad(lambda x, s: energy(x, s).sum(), (0, 1)))(poses, sizes)
    step = 1e-6
    for k in range(3):
        for place in range(7):
            by = (energy(poses.at[:, k, place].add(step), sizes)
                  - energy(poses.at[:, k, place].add(-step), sizes)) / (2 * step)
            assert np.array(by_pose[:, k, place]) == pytest.approx(np.array(by), abs=2e-3)
        by = (energy(poses, sizes.at[:, k].add(step)) - energy(poses, sizes.at[:, k].add(-step))) / (2 * step)
        assert np.array(by_size[:, k]) == pytest.approx(np.array(by), abs=2e-3)
