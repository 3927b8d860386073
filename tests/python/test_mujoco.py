"""ist.mujoco: meshes of a scene collide as solids."""

import concurrent.futures
import json
import os
import subprocess
import sys

import numpy as np
import pytest

import ist

mujoco = pytest.importorskip("mujoco")
import ist.mujoco  # noqa: E402

CUBE = """
<mujoco>
  <option timestep="0.002"/>
  <asset>
    <mesh name="cube" vertex="-1 -1 -1  1 -1 -1  -1 1 -1  1 1 -1  -1 -1 1  1 -1 1  -1 1 1  1 1 1"
          face="0 2 1  1 2 3  4 5 6  5 7 6  0 1 4  1 5 4  2 6 3  3 6 7  0 4 2  2 4 6  1 3 5  3 7 5"
          scale=".05 .04 .03"/>
  </asset>
  <default><geom solref="-2e4 -200"/></default>
  <worldbody>
    {ground}
    <body name="cube" pos="0 0 {height}"><freejoint/><geom name="cube" type="mesh" mesh="cube"/></body>
  </worldbody>
</mujoco>
"""
PLANE = '<geom name="ground" type="plane" size="1 1 1"/>'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mujoco")
    for name in ("bolt", "nut"):
        subprocess.run([os.environ["IST_PROGRAM"], "sample", name, "-o", str(folder / f"{name}.obj")],
                       check=True, capture_output=True)
    (folder / "nut.xml").write_text("""
<mujoco>
  <option timestep="0.001"/>
  <asset>
    <mesh name="bolt" file="bolt.obj" scale=".001 .001 .001"/>
    <mesh name="nut" file="nut.obj" scale=".001 .001 .001"/>
  </asset>
  <default><geom solref="-2e4 -60" friction="0"/></default>
  <worldbody>
    <geom name="bolt" type="mesh" mesh="bolt"/>
    <body name="nut" pos="0 0 .010"><freejoint/><geom name="nut" type="mesh" mesh="nut"/></body>
  </worldbody>
</mujoco>
""")
    return folder


def cube(folder, ground=PLANE, height=0.031, **settings):
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=ground, height=height))
    assert ist.mujoco.attach(spec, cache=folder / "cache", **settings) == 1
    model = spec.compile()
    return model, mujoco.MjData(model)


def run(model, data, steps):
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return data


def nut(folder, **settings):
    spec = mujoco.MjSpec.from_file(str(folder / "nut.xml"))
    assert ist.mujoco.attach(spec, cache=folder / "cache", spheres=10000, **settings) == 2
    model = spec.compile()
    return model, mujoco.MjData(model)


def test_a_nut_runs_down_its_bolt(folder):
    as_mesh = mujoco.MjModel.from_xml_path(str(folder / "nut.xml"))
    model, data = nut(folder)
    assert as_mesh.body_mass[1] / model.body_mass[1] == pytest.approx(1.72, abs=0.01)
    heights, angles, last, angle = [], [], 0.0, 0.0
    for _ in range(400):
        mujoco.mj_step(model, data)
        now = 2 * np.arctan2(data.qpos[6], data.qpos[3])
        angle += (now - last + np.pi) % (2 * np.pi) - np.pi
        last = now
        heights.append(data.qpos[2])
        angles.append(angle)
    turns = np.abs(angles[-1] - angles[99]) / (2 * np.pi)
    assert turns > 0.5
    climb = np.polyfit(np.array(angles[99:]) / (2 * np.pi), heights[99:], 1)[0]
    assert abs(climb) == pytest.approx(2e-3, rel=0.02)
    assert np.abs(data.qpos[:2]).max() < 5e-5


@pytest.mark.parametrize("ground", [
    PLANE, '<geom type="box" size="1 1 .1" pos="0 0 -.1"/>',
    '<geom type="sphere" size="50" pos="0 0 -50"/>',
    '<geom type="cylinder" size="1 .1" pos="0 0 -.1"/>',
])
def test_a_scaled_box_rests_on_primitives(folder, ground):
    model, data = cube(folder, ground)
    assert model.body_mass[1] == pytest.approx(1000 * 8 * .05 * .04 * .03, rel=1e-6)
    run(model, data, 500)
    above = 1e-4 if ground == PLANE else protrusion(folder)  # matched spheres meet what is no mesh
    assert -2e-4 < data.qpos[2] - 0.03 < above
    assert np.abs(data.qvel).max() < 0.02
    weight = sum(contact_force(model, data, i)[0] for i in range(data.ncon))
    assert weight == pytest.approx(9.81 * model.body_mass[1], rel=0.02)


def protrusion(folder):
    return max(ist.Asset.load(path).protrusion for path in (folder / "cache").glob("*.ist"))


def contact_force(model, data, i):
    force = np.zeros(6)
    mujoco.mj_contactForce(model, data, i, force)
    return force


def test_the_distance_of_two_geoms(folder):
    model, data = cube(folder, height=0.09)
    mujoco.mj_forward(model, data)
    points = np.zeros(6)
    distance = mujoco.mj_geomDistance(model, data, 0, 1, 1.0, points)
    assert distance == pytest.approx(0.06, abs=2e-3)


def test_threads_copies_and_files_change_no_bit(folder, tmp_path):
    model, data = nut(folder)
    first = run(model, data, 100).qpos.copy()
    model, again = nut(folder)
    assert np.array_equal(run(model, again, 100).qpos, first)
    copy = run(model, mujoco.MjData(model), 50).__copy__()
    assert np.array_equal(run(model, copy, 50).qpos, first)
    mujoco.mj_saveModel(model, str(tmp_path / "nut.mjb"))
    stored = mujoco.MjModel.from_binary_path(str(tmp_path / "nut.mjb"))
    assert np.array_equal(run(stored, mujoco.MjData(stored), 100).qpos, first)
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        for each in pool.map(lambda one: run(model, one, 100), [mujoco.MjData(model) for _ in range(4)]):
            assert np.array_equal(each.qpos, first)


def test_fifty_contacts_fit(folder):
    spec = mujoco.MjSpec.from_file(str(folder / "nut.xml"))
    ist.mujoco.attach(spec, cache=folder / "cache", spheres=10000, patches=50, measure="matched")
    spec.option.sdf_initpoints = 50
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = 0.0105
    mujoco.mj_forward(model, data)
    assert 20 < data.ncon <= 50


def test_exact_contacts_hold_no_gap(folder):
    model, data = nut(folder, measure="exact")
    mujoco.mj_forward(model, data)
    assert data.ncon == 0  # in clearance, where matched spheres protrude and touch


def test_small_meshes_are_exact_by_default(folder):
    tower = "".join(f'<body pos="0 0 {-.03 - .0602 * i}"><freejoint/><geom type="mesh" mesh="cube"/></body>'
                    for i in range(4)) + '<geom type="mesh" mesh="cube" pos="0 0 -.2708" euler="0 0 20"/>'
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=tower, height=.0303))
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 6
    model = spec.compile()
    data = run(model, mujoco.MjData(model), 1500)
    assert data.ncon == 5 * 4  # four a face
    places = data.qpos.reshape(-1, 7)
    assert np.abs(data.qvel).max() < 1e-2 and np.abs(places[:, :2]).max() < 1e-6
    assert np.abs(places[:, 4:6]).max() < 1e-6  # upright
    assert places[:, 2].min() == pytest.approx(-0.2108, abs=2e-4)  # matched spheres: 2 mm and more higher


def test_models_side_by_side_do_not_meet(folder):
    """Two models and two data of one of them, stepped in turn, as each alone."""
    (cubes, first), (threads, second) = cube(folder), nut(folder)
    third = mujoco.MjData(cubes)
    third.qpos[2] += 0.01
    together = [(cubes, first), (threads, second), (cubes, third)]
    starts = [data.qpos.copy() for _, data in together]
    for _ in range(60):
        for model, data in together:
            mujoco.mj_step(model, data)
    for (model, data), start in zip(together, starts):
        alone = mujoco.MjData(model)
        alone.qpos[:] = start
        assert np.array_equal(run(model, alone, 60).qpos, data.qpos)


def test_a_mesh_that_is_no_solid_is_named_once(folder, capfd):
    other = '<geom name="other" type="mesh" mesh="cube" pos="0 0 -.03"/>'
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=other, height=.029))
    assert ist.mujoco.attach(spec, geoms=["cube"], cache=folder / "cache") == 1
    model = spec.compile()
    assert run(model, mujoco.MjData(model), 3).ncon == 0
    said = "".join(capfd.readouterr())
    assert said.count("they do not collide. ist.mujoco.attach() makes solids of meshes.") == 1


def test_an_open_mesh_is_refused(folder):
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=PLANE, height=1).replace("0 2 1  1 2 3  ", "")
                                     .replace('scale="', 'inertia="shell" scale="'))
    with pytest.raises(ist.OpenMeshError, match="cube.*repair=True"):
        ist.mujoco.attach(spec, cache=folder / "cache")
    assert ist.mujoco.attach(spec, cache=folder / "cache", repair=True) == 1


def test_a_pose_that_is_no_number_is_no_contact(folder):
    model, data = cube(folder, '<geom type="box" size="1 1 .1" pos="0 0 -.1"/>')
    data.qpos[0] = np.nan
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


@pytest.mark.parametrize("config, words", [
    ({"file": "nowhere.ist"}, "nowhere.ist"),
    ({"file": __file__}, "test_mujoco.py"),
    ({}, "no config key"),
    ({"file": "nowhere.ist", "measure": "magic"}, "magic"),
    ({"file": "nowhere.ist", "patches": "many"}, "many"),
])
def test_what_cannot_be_read_is_an_error(config, words):
    with pytest.raises(ValueError, match=words):
        with_instance(config)


def test_a_damaged_file_is_an_error(tmp_path):
    whole = ist.bake(ist.sample_mesh("cube"), max_spheres=100).to_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 1
    for i, damaged in enumerate((b"", whole[:100], whole[:-8], bytes(flipped))):
        path = tmp_path / f"damaged{i}.ist"
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match=path.name):
            with_instance({"file": str(path), "scale": "1"})


def test_a_damaged_cache_is_baked_again(tmp_path):
    cube(tmp_path)
    [path] = (tmp_path / "cache").iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[:-8])
    cube(tmp_path)
    assert [path] == list((tmp_path / "cache").iterdir()) and path.read_bytes() == whole


def with_instance(config, height=1):
    ist.mujoco.load()
    text = "".join(f'<config key="{k}" value="{v}"/>' for k, v in config.items())
    xml = CUBE.format(ground=PLANE, height=height).replace("<asset>", f"""
      <extension><plugin plugin="ist.solid"><instance name="i">{text}</instance></plugin></extension>
      <asset>""").replace('type="mesh" mesh="cube"/>', 'type="sdf" mesh="cube"><plugin instance="i"/></geom>')
    return mujoco.MjModel.from_xml_string(xml)


def test_a_scale_of_each_axis_is_baked(tmp_path):
    cube, path = ist.sample_mesh("cube"), str(tmp_path / "cube.ist")
    corners = 2 * cube.vertices  # CUBE's mesh is 2 u wide
    ist.bake((corners, cube.triangles), max_spheres=100).save(path)
    for config in ({"file": path}, {"file": path, "scale": "0"}):
        with pytest.raises(ValueError, match="bake with --scale 0.05,0.04,0.03"):
            with_instance(config)
    ist.bake((corners, cube.triangles), max_spheres=100, scale=(.05, .04, .03)).save(path)
    model = with_instance({"file": path, "scale": "1"}, height=.09)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert mujoco.mj_geomDistance(model, data, 0, 1, 1.0, np.zeros(6)) == pytest.approx(.06, abs=2e-3)


def test_what_is_not_there_has_a_name(folder):
    spec = mujoco.MjSpec.from_file(str(folder / "nut.xml"))
    with pytest.raises(ValueError, match="no mesh geom named 'nuts'"):
        ist.mujoco.attach(spec, geoms=["nuts"], cache=folder / "cache")
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=PLANE, height=1))
    with pytest.raises(ValueError, match="no mesh geom named 'ground'"):
        ist.mujoco.attach(spec, geoms=["ground"], cache=folder / "cache")


def test_the_plug_in_is_loaded_once(tmp_path):
    assert ist.mujoco.load() == ist.mujoco.load() == ist.mujoco.plugin_path()
    mujoco.mj_loadPluginLibrary(ist.mujoco.plugin_path())
    (tmp_path / "cube.xml").write_text(CUBE.format(ground=PLANE, height=1))
    said = subprocess.run([sys.executable, "-c", """if True:
        import shutil, ist.mujoco, mujoco
        shutil.copy(ist.mujoco.load(), "copy.so")
        mujoco.mj_loadPluginLibrary("./copy.so")
        print(ist.mujoco.attach(mujoco.MjSpec.from_file("cube.xml"), cache="."))
    """], check=True, capture_output=True, text=True, cwd=tmp_path)
    assert "registered already" in said.stdout + said.stderr and said.stdout.endswith("1\n")


def test_another_version_of_mujoco_is_refused(monkeypatch):
    monkeypatch.setattr(ist.mujoco, "_loaded", False)
    monkeypatch.setattr(mujoco, "__version__", "3.2.0")
    with pytest.raises(ImportError, match="4.0.0, not 3.2.0"):
        ist.mujoco.load()


def test_the_command(folder):
    command = [sys.executable, "-m", "ist.mujoco", str(folder / "nut.xml"), "--seconds", "0.05",
               "--cache", str(folder / "cache"), "--film", str(folder / "nut.glb"), "--json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    assert report["solids"] == 2 and report["steps"] == 50
    assert (folder / "nut.glb").read_bytes()[:4] == b"glTF"
    command[3] = "nowhere.xml"
    failed = subprocess.run(command, capture_output=True, text=True)
    assert failed.returncode == 1 and "nowhere.xml" in failed.stderr
