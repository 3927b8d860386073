"""ist.mujoco on models that packages ship: only their MJCF and meshes are used."""

import pathlib
import sys
import time
import warnings

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
import ist.mujoco  # noqa: E402

# Folders of sys.path, so that no package is imported.
MODELS = {
    "gymnasium_robotics/envs/assets": [
        "fetch/pick_and_place.xml", "fetch/slide.xml", "hand/manipulate_block.xml", "hand/manipulate_pen_touch_sensors.xml",
        "kitchen_franka/kitchen_assets/kitchen_env_model.xml"],
    "gym_aloha/assets": ["bimanual_viperx_transfer_cube.xml", "bimanual_viperx_end_effector_insertion.xml"],
    "gym_xarm/tasks/assets": ["lift.xml", "peg_in_box.xml", "push.xml"],
}
FILES = [(folder, file) for folder, files in MODELS.items() for file in files]
SDF = mujoco.mjtGeom.mjGEOM_SDF


def path_of(folder, file):
    for root in sys.path:
        if (path := pathlib.Path(root) / folder / file).is_file():
            return str(path)
    pytest.skip(f"no {folder}: ./dev setup --mujoco")


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.mark.parametrize("folder, file", FILES, ids=[pathlib.Path(file).stem for _, file in FILES])
def test_a_model_as_it_is(folder, file, cache):
    path = path_of(folder, file)
    stock = mujoco.MjModel.from_xml_path(path)
    spec = mujoco.MjSpec.from_file(path)
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of meshes that are open, or that meet themselves
        count = ist.mujoco.attach(spec, cache=cache)
    assert time.process_time() - start < 15
    assert count > 0
    model = spec.compile()
    solids = np.flatnonzero(model.geom_type == SDF)
    assert len(solids) == count and model.ngeom == stock.ngeom
    assert (model.body_mass <= 1.01 * stock.body_mass + 1e-9).all()  # MuJoCo's default counts dents too
    data, own = mujoco.MjData(model), mujoco.MjData(stock)
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(stock, own)
    no_false_contacts(model, data, stock, own)
    rays(model, data, stock, own, solids)
    for _ in range(3):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all() and not data.warning.number.any()


def no_false_contacts(model, data, stock, own):
    """Whatever touches as a solid touches as a hull."""
    hulls = {tuple(sorted(pair)) for pair in own.contact.geom[:own.ncon].tolist()}
    for contact in data.contact[:data.ncon]:
        assert tuple(sorted(contact.geom.tolist())) in hulls
    for pair in hulls - {tuple(sorted(pair)) for pair in data.contact.geom[:data.ncon].tolist()}:
        if all(model.geom_type[g] == SDF for g in pair):
            assert mujoco.mj_geomDistance(model, data, *pair, 1, None) > 0


def rays(model, data, stock, own, solids):
    rng, hits, aside = np.random.default_rng(7), 0, 0
    for geom in solids:
        size, place = model.geom_rbound[geom], data.geom_xpos[geom]
        for k in range(40):
            start = place + rng.normal(size=3) * size * (1, 5)[k % 2]
            way = place + rng.uniform(-.6, .6, 3) * size - start
            if k % 4 == 0:  # along an axis
                way = np.eye(3)[k // 4 % 3] * (1 if k % 8 else -1)
            (far, normal), (ours, other) = cast(stock, own, start, way), cast(model, data, start, way)
            assert (far < 0) == (ours < 0)
            if ours >= 0:
                hits += 1
                # Inside a mesh that meets itself, MuJoCo's ray stops at the surface within.
                aside += abs(ours - far) * np.linalg.norm(way) > 1e-5 * size or abs(normal @ other) < .99
    assert hits > 10 * len(solids) and aside <= .02 * hits


def cast(model, data, start, way):
    normal = np.zeros(3)
    return mujoco.mj_ray(model, data, start, way, None, 1, -1, np.zeros(1, np.int32), normal), normal


@pytest.mark.parametrize("file", ["lift.xml", "push.xml"])
def test_an_arm_turns(file, cache):
    """Without gravity, friction and drives, each hinge of the arm goes on at its speed as in the stock model without
    contacts: nothing brakes it at once."""
    path = path_of("gym_xarm/tasks/assets", file)
    models = []
    for way in ("stock", "ist"):
        spec = mujoco.MjSpec.from_file(path)
        spec.option.gravity = [0, 0, 0]
        if way == "ist":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                ist.mujoco.attach(spec, cache=cache)
        else:
            for geom in spec.geoms:
                geom.contype = geom.conaffinity = 0
        models.append(spec.compile())
    joint = models[0].jnt_dofadr[mujoco.mj_name2id(models[0], mujoco.mjtObj.mjOBJ_JOINT, "joint1")]
    ends = []
    for model in models:
        data = mujoco.MjData(model)
        data.qvel[joint] = 1
        for _ in range(20):
            mujoco.mj_step(model, data)
        ends.append(data.qpos.copy())
    address = models[0].jnt_qposadr[mujoco.mj_name2id(models[0], mujoco.mjtObj.mjOBJ_JOINT, "joint1")]
    assert ends[1][address] == pytest.approx(ends[0][address], rel=.02) and ends[0][address] > .01
