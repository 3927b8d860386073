"""Assets and poses that the tests share."""
import numpy as np
import pytest

import ist


def baked(name, spheres):
    return ist.bake(ist.close_mesh(ist.sample_mesh(name), name=name), max_spheres=spheres, device="cpu")


@pytest.fixture(scope="session")
def cube():
    return baked("cube", 300)


@pytest.fixture(scope="session")
def knot_mesh():
    return ist.close_mesh(ist.sample_mesh("torus_knot"), name="knot")


@pytest.fixture(scope="session")
def knot(knot_mesh):
    return ist.bake(knot_mesh, max_spheres=1000, device="cpu")


@pytest.fixture(scope="session")
def gear():
    return baked("gear", 1000)


@pytest.fixture(scope="session")
def solids(gear, knot, cube):
    return [gear, knot, cube]


@pytest.fixture
def random_poses():
    """random_poses(count, reach) → (count, 7): any rotation, translations up to reach an axis."""
    random = np.random.default_rng(7)

    def make(count, reach):
        poses = np.empty((count, 7))
        poses[:, :4] = random.normal(size=(count, 4))
        poses[:, :4] /= np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
        poses[:, 4:] = random.uniform(-reach, reach, (count, 3))
        return poses

    return make


def pytest_sessionfinish(session, exitstatus):
    """Where every test was skipped, ctest is told so."""
    kinds = set(session.config.pluginmanager.get_plugin("terminalreporter").stats) - {""}
    if kinds == {"skipped"}:
        session.exitstatus = 77
