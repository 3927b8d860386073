"""ist.mujoco: meshes of a scene collide as solids."""

import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import warnings

import numpy as np
import pytest

import ist

mujoco = pytest.importorskip("mujoco")
import ist.mujoco  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples/mujoco"))
import drops  # noqa: E402

CUBE = """
<mujoco>
  <option timestep="0.002"/>
  <asset>
    <hfield name="hills" nrow="3" ncol="3" size="1 1 .1 .1" elevation="0 0 0 0 0 0 0 0 1"/>
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
    '<geom type="capsule" size=".5 1" euler="0 90 0" pos="0 0 -.5"/>',
    '<geom type="ellipsoid" size="2 3 .5" pos="0 0 -.5"/>',
    '<geom type="hfield" hfield="hills"/>',
    '<geom name="other" type="mesh" mesh="cube" pos="0 0 -.03"/>',  # left out: its hull
])
def test_a_scaled_box_rests_on_what_it_meets(folder, ground):
    model, data = cube(folder, ground, geoms=["cube"])
    assert model.body_mass[1] == pytest.approx(1000 * 8 * .05 * .04 * .03, rel=1e-6)
    run(model, data, 500)
    assert -2e-4 < data.qpos[2] - 0.03 < 1e-6
    assert np.abs(data.qvel[:3]).max() < 0.01
    weight = sum(contact_force(model, data, i)[0] for i in range(data.ncon))
    assert weight == pytest.approx(9.81 * model.body_mass[1], rel=0.05)


@pytest.mark.parametrize("measure", ["matched", "inner"])
def test_spheres_rest_within_what_they_lack(folder, measure):
    for ground in ('<geom type="box" size="1 1 .1" pos="0 0 -.1"/>', '<geom type="ellipsoid" size="2 3 .5" pos="0 0 -.5"/>'):
        model, data = cube(folder, ground, measure=measure, spheres=300)
        assert abs(run(model, data, 300).qpos[2] - 0.03) < 3e-3 and data.ncon > 0


@pytest.mark.parametrize("kind, size", [
    ("box", ".02 .02 .02"), ("sphere", ".02"), ("cylinder", ".02 .02"), ("capsule", ".02 .03"), ("ellipsoid", ".03 .04 .02")])
def test_primitives_rest_on_a_solid(folder, kind, size):
    upright = 'euler="0 90 0"' if kind == "capsule" else ""
    ground = f'<body pos="0 0 .0205"><freejoint/><geom type="{kind}" size="{size}" {upright} friction="1 .1 .1" condim="6"/></body>'
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=ground, height=-.03).replace("<freejoint/><geom name", "<geom name")
                                     .replace('.05 .04 .03', '.2 .2 .03'))
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    data = run(model, mujoco.MjData(model), 500)
    assert -2e-4 < data.qpos[2] - 0.02 < 1e-6
    model.geom_size *= 0.5  # seen at once
    model.geom_size[1:] *= [1, 1, 1.1]  # even in another shape
    data.qpos[2] = 0.0095
    mujoco.mj_forward(model, data)
    assert data.ncon > 0


@pytest.mark.parametrize("kind, gain", [("capsule", 1.05), ("cylinder", 1.35)])
def test_what_rolls_on_a_stiff_floor_gains_little(folder, kind, gain):
    """By the bumps of its facets, in ten seconds; with 96 around the axis it was 2.5."""
    ground = f'<body pos="-.15 0 .01997" euler="90 0 0"><freejoint/><geom type="{kind}" size=".02 .03"/></body>'
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=ground, height=-.03).replace("<freejoint/><geom name", "<geom name")
                                     .replace('.05 .04 .03', '.2 .2 .03'))
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = [0.3 * 0.02, 0, 0, 0, 0, -0.3]  # about its axis, which is z of its frame
    first = run(model, data, 1000).qvel[0]
    last = run(model, data, 5000).qvel[0]
    assert 0.2 * 0.02 < first and last < gain * first


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
    ist.mujoco.attach(spec, cache=folder / "cache", spheres=2000, patches=50, measure="matched")
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


@pytest.mark.parametrize("hz", [240, 1000])
def test_impacts_gain_no_energy(hz):
    """The short form of examples/mujoco/drops.py. A plate of 10 mm is wholly inside the table in one step; a bolt spins by
    half a radian in one, and would gain energy in flight if its frame were not at its centre of mass."""
    rows = drops.drops("ist", hz, 3, names=["plate", "ring"]) + drops.drops("ist", hz, 10, names=["bolt"])
    for name, worst, gains, passed in rows:
        assert (worst <= drops.MOST, gains, passed) == (True, 0, 0), (name, worst)


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


def test_meshes_with_findings_share_a_warning(folder):
    """Of two that are baked and two that are not, each kind is told at once."""
    corners, faces = box((0, 0, 0), (1, 1, 1))
    apart = [(x + .5, y, z) for x, y, z in corners]
    twice = faces + [tuple(8 + i for i in face) for face in faces]
    names = {}
    for k in range(2):
        write(folder / f"both{k}.obj", ([(x, y, z + k) for x, y, z in corners + apart], twice))
        write(folder / f"open{k}.obj", (corners, faces[k + 1:]))
        names |= {f"both{k}": k, f"open{k}": k}
    (folder / "some.xml").write_text("<mujoco><asset>" + "".join(
        f'<mesh name="{name}" file="{name}.obj" inertia="shell"/>' for name in names) + "</asset><worldbody>" + "".join(
        f'<geom type="mesh" mesh="{name}"/>' for name in names) + "</worldbody></mujoco>")
    with pytest.warns(UserWarning) as told:
        assert ist.mujoco.attach(mujoco.MjSpec.from_file(str(folder / "some.xml")), cache=folder / "cache") == 2
    hulls, findings = sorted((str(one.message) for one in told), key=lambda text: "hulls" not in text)
    assert hulls.startswith("ist.mujoco: 2 of 4 meshes stay") and "open0: " in hulls and "open1: " in hulls
    assert findings.startswith("ist.mujoco: 2 of 4 meshes became solids") and "both0: " in findings and "both1: " in findings


OPEN = CUBE.format(ground=PLANE, height=.031).replace("0 2 1  1 2 3  ", "").replace('scale="', 'inertia="shell" scale="')


def test_an_open_mesh_stays_a_hull_and_is_named(folder):
    spec = mujoco.MjSpec.from_string(OPEN)
    with pytest.warns(UserWarning, match="1 of 1 meshes stay.*repair=True.*geoms=.*: cube: .*not closed$") as told:
        assert ist.mujoco.attach(spec, cache=folder / "cache") == 0
    assert len(told) == 1
    model = spec.compile()
    assert abs(run(model, mujoco.MjData(model), 500).qpos[2] - .03) < 2e-4
    before = spec.to_xml()
    with pytest.raises(ist.OpenMeshError, match="cube"):
        ist.mujoco.attach(spec, geoms=["cube"], cache=folder / "cache")
    assert spec.to_xml() == before
    with pytest.warns(UserWarning, match="cube"):
        assert ist.mujoco.attach(spec, cache=folder / "cache", repair=True) == 1


def test_rays_meet_a_solid_where_they_meet_its_mesh(folder):
    (folder / "gear.xml").write_text("""<mujoco><asset><mesh name="gear" file="gear.obj" scale=".1 .1 .1"/></asset>
      <worldbody><geom type="mesh" mesh="gear" pos="1 2 3" euler="0 90 0"/></worldbody></mujoco>""")
    subprocess.run([os.environ["IST_PROGRAM"], "sample", "gear", "-o", str(folder / "gear.obj")], check=True, capture_output=True)
    spec = mujoco.MjSpec.from_file(str(folder / "gear.xml"))
    stock = spec.compile()
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    assert model.noct < 100  # octrees of geoms of type sdf have tens of thousands of cells
    both = [(m, mujoco.MjData(m)) for m in (stock, model)]
    for m, d in both:
        mujoco.mj_forward(m, d)
    rng = np.random.default_rng(1)
    axes = np.repeat(np.vstack([np.eye(3), -np.eye(3)]), 50, axis=0)
    starts = [1, 2, 3] + np.where(axes == 0, rng.uniform(-.12, .12, axes.shape), -3 * axes)
    ways = np.vstack([axes, rng.normal(size=(900, 3))])
    starts = np.vstack([starts, [1, 2, 3] + rng.normal(size=(900, 3)) * rng.choice([.02, .2, 5], (900, 1))])
    hits = 0
    for start, way in zip(starts, ways):
        if rng.random() < .7 and not (way == np.round(way)).all():
            way = [1, 2, 3] + rng.uniform(-.1, .1, 3) - start
        (far, normal), (own, ours) = (cast(m, d, start, way) for m, d in both)
        assert (far < 0) == (own < 0)
        hits += own >= 0
        if own >= 0:
            assert abs(own - far) * np.linalg.norm(way) < 1e-6 and normal @ ours > 0.999
    assert hits > 500
    many = np.zeros(len(ways))
    mujoco.mj_multiRay(model, both[1][1], starts[-1], ways.ravel(), None, 1, -1, np.zeros(len(ways), np.int32), many, None, len(ways), 100)
    assert [x for x in many] == [cast(*both[1], starts[-1], way)[0] for way in ways]


def cast(model, data, start, way):
    normal = np.zeros(3)
    return mujoco.mj_ray(model, data, start, way, None, 1, -1, np.zeros(1, np.int32), normal), normal


def test_a_cloth_lies_on_a_solid(folder):
    text = CUBE.format(ground="""<flexcomp name="cloth" type="grid" count="4 4 1" spacing=".03 .03 .03" dim="DIM" pos="0 0 .035"
        radius=".002" mass=".05"><contact selfcollide="none"/><elasticity young="1e4" poisson=".1" thickness="1e-2" elastic2d="both"/>
        </flexcomp>""", height=0).replace("<freejoint/>", "").replace('.05 .04 .03', '.2 .2 .03')
    spec = mujoco.MjSpec.from_string(text.replace("DIM", "2"))
    spec.option.sdf_iterations = 3
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    data = run(model, mujoco.MjData(model), 200)
    assert data.flexvert_xpos[:, 2].min() > .025 and data.ncon > 0
    spec = mujoco.MjSpec.from_string(text.replace("DIM", "3").replace("4 4 1", "3 3 3").replace(' elastic2d="both"', ""))
    with pytest.warns(UserWarning, match="'cloth' does not meet solids"):
        ist.mujoco.attach(spec, cache=folder / "cache")


def test_an_sdf_of_another_plug_in_meets_a_solid(folder):
    mujoco.mj_loadPluginLibrary(os.path.join(os.path.dirname(mujoco.__file__), "plugin", "libsdf_plugin.so"))
    bolt = """<body name="torus"><geom type="sdf" mesh="torus" pos="0 0 -.1"><plugin instance="torus"/></geom></body>"""
    text = CUBE.format(ground=bolt, height=.02).replace("<asset>", """<extension><plugin plugin="mujoco.sdf.torus">
        <instance name="torus"><config key="radius1" value=".1"/><config key="radius2" value=".1"/></instance></plugin></extension>
        <asset><mesh name="torus"><plugin instance="torus"/></mesh>""").replace('body name="cube" pos="0', 'body name="cube" pos=".1')
    spec = mujoco.MjSpec.from_string(text)
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon > 0 and -.012 < data.contact.dist.min() < -.001


def test_geoms_of_a_pair_alone_are_solids(folder):
    text = CUBE.format(ground='<geom name="box" type="box" size="1 1 .1" pos="0 0 -.1" contype="0" conaffinity="0"/>', height=.0305)
    text = text.replace('mesh="cube"/></body>', 'mesh="cube" contype="0" conaffinity="0"/></body>').replace(
        "</mujoco>", '<contact><pair geom1="box" geom2="cube"/></contact></mujoco>')
    spec = mujoco.MjSpec.from_string(text)
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    data = run(model, mujoco.MjData(model), 20)
    assert data.ncon == 4 and model.geom_type[data.contact.geom.max()] == mujoco.mjtGeom.mjGEOM_SDF


def test_a_ball_rests_on_both_walls_of_a_groove(folder):
    profile = [(-.1, 0), (.1, 0), (.1, .1), (0, .02), (-.1, .1)]
    n = len(profile)
    sides = [(i, n + i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    write(folder / "groove.obj", ([(x, y, z) for y in (-.1, .1) for x, z in profile],
                                  [list(range(n)), [n + i for i in range(n)][::-1]] + sides))
    (folder / "groove.xml").write_text("""<mujoco><asset><mesh name="groove" file="groove.obj"/></asset>
      <default><geom solref="-2e4 -200" condim="6" friction="1 .1 .1"/></default><worldbody><geom type="mesh" mesh="groove"/>
        <body pos=".002 0 .0604"><freejoint/><geom type="sphere" size=".03"/></body></worldbody></mujoco>""")
    spec = mujoco.MjSpec.from_file(str(folder / "groove.xml"))
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    model = spec.compile()
    data = run(model, mujoco.MjData(model), 1500)
    assert data.ncon == 2 and np.abs(data.qvel).max() < 1e-3
    assert data.qpos[2] == pytest.approx(.02 + .03 * np.hypot(1, .8), abs=1e-4) and abs(data.qpos[0]) < 1e-4


def test_a_link_that_fits_is_free(folder):
    """A hub in a ring with a gap of 1 mm, and with shoulders 1 mm over it, aligned: matched spheres lock it."""
    turn = 2 * np.pi * np.arange(48) / 48
    write(folder / "ring.obj", turned([(.021, -.02), (.03, -.02), (.03, .02), (.021, .02)], turn))
    write(folder / "hub.obj", turned([(1e-4, -.03), (.02, -.03), (.02, .021), (.035, .021), (.035, .03), (1e-4, .03)], turn))
    (folder / "hub.xml").write_text("""<mujoco><option gravity="0 0 0"/>
      <asset><mesh name="ring" file="ring.obj"/><mesh name="hub" file="hub.obj"/></asset>
      <worldbody><geom name="ring" type="mesh" mesh="ring"/>
        <body><joint type="hinge" axis="0 0 1"/><geom name="hub" type="mesh" mesh="hub"/></body></worldbody></mujoco>""")
    spec = mujoco.MjSpec.from_file(str(folder / "hub.xml"))
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 2
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[0] = 1
    for _ in range(300):
        mujoco.mj_step(model, data)
        assert data.ncon == 0
    assert data.qpos[0] == pytest.approx(300 * model.opt.timestep, rel=1e-9)
    gap = np.zeros(6)
    assert .021 * np.cos(np.pi / 48) - .02 <= mujoco.mj_geomDistance(model, data, 0, 1, 1, gap) <= .001
    assert all(ist.Asset.load(path).sphere_count == 0 for path in (folder / "cache").glob("*.ist") if "-" not in path.stem)


def turned(profile, angles):
    """A closed profile (r, z), counter-clockwise, about z."""
    n, m = len(profile), len(angles)
    vertices = [(r * np.cos(a), r * np.sin(a), z) for a in angles for r, z in profile]
    faces = []
    for i in range(m):
        for k in range(n):
            a, b, c, d = i * n + k, i * n + (k + 1) % n, (i + 1) % m * n + (k + 1) % n, (i + 1) % m * n + k
            faces += [(a, d, c), (a, c, b)]
    return vertices, faces


def write(path, mesh, name="o"):
    path.write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(mesh[0]).tolist())
                    + "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in mesh[1]))


def box(low, high):
    vertices = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
    return vertices, [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]


def falls(folder, name, mesh, attributes="", density=1000.0):
    """The file's mesh as a free body, attached: spec, model."""
    write(folder / f"{name}.obj", mesh) if mesh else None
    (folder / f"{name}.xml").write_text(f"""<mujoco><asset><mesh name="{name}" file="{name}.obj" {attributes}/></asset>
      <worldbody><body pos="0 0 1"><freejoint/><geom type="mesh" mesh="{name}" density="{density}" euler="10 20 30"/></body>
      </worldbody></mujoco>""")
    spec = mujoco.MjSpec.from_file(str(folder / f"{name}.xml"))
    assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    return spec.compile()


def test_masses_are_those_of_solids(folder):
    a, b = box((0, 0, 0), (.2, .1, .1)), box((.1, 0, 0), (.3, .1, .1))
    both = (a[0] + b[0], a[1] + [tuple(8 + i for i in face) for face in b[1]])
    with pytest.warns(UserWarning, match="both.*pairs of triangles"):
        model = falls(folder, "both", both)
    assert model.body_mass[1] == pytest.approx(3, rel=1e-6)  # not 4
    assert sorted(model.body_inertia[1]) == pytest.approx([3 * (.01 + .01) / 12, 3 * (.09 + .01) / 12, 3 * (.09 + .01) / 12], rel=1e-6)
    inside_out = (a[0], [face[::-1] for face in a[1]])
    with pytest.warns(UserWarning, match="turned outward"):
        model = falls(folder, "inside_out", inside_out, density=500)
    assert model.body_mass[1] == pytest.approx(1, rel=1e-6)
    twice = (a[0], a[1] + a[1])
    with pytest.warns(UserWarning, match="coincident triangles removed"):
        assert falls(folder, "twice", twice).body_mass[1] == pytest.approx(2, rel=1e-6)


def test_a_body_far_from_the_origin_is_no_warning(folder):
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=PLANE, height=30))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
        spec.compile()


def test_other_masses_of_a_body_stay(folder):
    text = CUBE.format(ground=PLANE, height=1).replace('mesh="cube"/></body>', """mesh="cube" density="2000" pos=".1 0 0" euler="30 0 0"/>
        <geom type="box" size=".1 .1 .1" mass="3"/></body>""")
    spec = mujoco.MjSpec.from_string(text)
    stock = spec.compile()  # of a convex mesh MuJoCo's are right
    ist.mujoco.attach(spec, cache=folder / "cache")
    model = spec.compile()
    assert model.body_mass == pytest.approx(stock.body_mass, rel=1e-6)
    assert model.body_ipos[1] == pytest.approx(stock.body_ipos[1], abs=1e-8)
    assert sorted(model.body_inertia[1]) == pytest.approx(sorted(stock.body_inertia[1]), rel=1e-6)


def test_the_solid_is_the_file_not_mujocos_copy(folder):
    a, b = box((0, 0, 0), (.1, .1, .1)), box((.3, 0, 0), (.4, .1, .1))
    text = "o a\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in a[0] + b[0])
    text += "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in a[1])
    text += "o b\n" + "".join("f " + " ".join(str(i + 9) for i in face) + "\n" for face in b[1])
    (folder / "two.obj").write_text(text)
    with pytest.warns(UserWarning, match="'two': MuJoCo's copy differs from its file: 12 of 24 triangles"):
        model = falls(folder, "two", None, 'scale="1 1 -1" refpos=".1 .2 .3" refquat="1 1 0 0"')
    assert model.body_mass[1] == pytest.approx(2, rel=1e-6)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    turn, back = np.zeros(9), np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[0])
    mujoco.mju_quat2Mat(back, np.array([1, 1, 0, 0]) / np.sqrt(2))
    for x in ((.05, .05, .05), (.35, .05, .05)):  # in both parts a ray starts inside, and meets the nearest face
        x = ((np.array(x) - [.1, .2, .3]) @ back.reshape(3, 3) * [1, 1, -1] - model.mesh_pos[0]) @ turn.reshape(3, 3)
        place = data.geom_xpos[0] + data.geom_xmat[0].reshape(3, 3) @ x
        assert .05 <= cast(model, data, place, np.array([0., 0, 1]))[0] < .09
    text = (folder / "two.xml").read_text()
    spec = mujoco.MjSpec.from_string(text, assets={"two.obj": (folder / "two.obj").read_bytes()})
    with pytest.warns(UserWarning, match="12 of 24 triangles"):
        assert ist.mujoco.attach(spec, cache=folder / "cache") == 1
    assert spec.compile().body_mass[1] == pytest.approx(2, rel=1e-6)
    ell = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
    vertices = [(.1 * x, .1 * y, z) for z in (0, .1) for x, y in ell]
    for k in range(6):  # a concave face, from each of its corners on
        face = [(i + k) % 6 for i in range(6)]
        sides = [(i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i) for i in range(6)]
        model = falls(folder, f"ell{k}", (vertices, [face[::-1], [6 + i for i in face]] + sides))
        assert model.body_mass[1] == pytest.approx(5, rel=1e-6)


@pytest.mark.parametrize("compiler, inertia", [
    ('meshdir="sub"', ""), ('meshdir="sub" inertiafromgeom="true"', 'diaginertia="1 1 1"'),
    ('meshdir="sub" inertiafromgeom="true"', 'fullinertia="1 1 1 .1 .1 .1"')])
@pytest.mark.parametrize("way", ["spec", "file", "assets"])
def test_a_model_within_a_model_keeps_its_files_and_masses(tmp_path, compiler, inertia, way):
    a, b = box((0, 0, 0), (.1, .1, .1)), box((.3, 0, 0), (.4, .1, .1))
    (tmp_path / "child/sub").mkdir(parents=True)
    write(tmp_path / "child/sub/two.obj", (a[0] + b[0], a[1]))
    with open(tmp_path / "child/sub/two.obj", "a") as file:  # MuJoCo keeps the first object's faces
        file.write("o b\n" + "".join("f " + " ".join(str(i + 9) for i in face) + "\n" for face in b[1]))
    mass = f'<inertial pos="0 0 0" mass="7" {inertia}/>' if "true" in compiler else ""
    text = f"""<mujoco><compiler {compiler}/><asset><mesh name="two" file="two.obj"/></asset><worldbody>
      <body name="b">{mass}<freejoint/><geom type="mesh" mesh="two"/></body></worldbody></mujoco>"""
    (tmp_path / "child/child.xml").write_text(text)
    if way == "file":
        (tmp_path / "scene.xml").write_text("""<mujoco><asset><model name="c" file="child/child.xml"/></asset>
          <worldbody><attach model="c" body="b" prefix="x "/></worldbody></mujoco>""")
        spec = mujoco.MjSpec.from_file(str(tmp_path / "scene.xml"))
    else:
        spec = mujoco.MjSpec()
        assets = {"elsewhere/two.obj": (tmp_path / "child/sub/two.obj").read_bytes()}
        child = (mujoco.MjSpec.from_string(text, assets=assets) if way == "assets"
                 else mujoco.MjSpec.from_file(str(tmp_path / "child/child.xml")))
        spec.attach(child, prefix="x ", frame=spec.worldbody.add_frame())
    with pytest.warns(UserWarning, match="12 of 24 triangles"):
        assert ist.mujoco.attach(spec, cache=tmp_path / "cache") == 1
    model = spec.compile()
    assert model.body_mass[1] == pytest.approx(2, rel=1e-6)
    assert sorted(model.body_inertia[1]) == pytest.approx([2 * .02 / 12, 2 * (.02 / 12 + .0225), 2 * (.02 / 12 + .0225)], rel=1e-6)


def test_a_binary_model_travels_without_its_assets(folder, tmp_path):
    (tmp_path / "cache").mkdir()
    spec = mujoco.MjSpec.from_file(str(folder / "nut.xml"))
    ist.mujoco.attach(spec, cache=tmp_path / "cache")
    model = spec.compile()
    there = run(model, mujoco.MjData(model), 50).qpos
    mujoco.mj_saveModel(model, str(tmp_path / "nut.mjb"))
    for path in (tmp_path / "cache").iterdir():
        path.unlink()
    del model, spec
    said = subprocess.run([sys.executable, "-c", """if True:
        import ist.mujoco, mujoco
        model = mujoco.MjModel.from_binary_path("nut.mjb")
        data = mujoco.MjData(model)
        for _ in range(50):
            mujoco.mj_step(model, data)
        print(*data.qpos)
    """], check=True, capture_output=True, text=True, cwd=tmp_path)
    qpos = said.stdout.splitlines()[-1].split()
    # The copy is in floats: in a thread of 2 mm the nut moves as before, to a few of their digits.
    assert np.array(qpos, float) == pytest.approx(there, abs=1e-5)
    assert "MuJoCo's copy of the mesh" in said.stdout + said.stderr


@pytest.mark.parametrize("arguments, error, words", [
    (dict(patches=99), ValueError, "patches=99 is not a whole number from 1 to 50"),
    (dict(patches=2.5), ValueError, "patches=2.5"),
    (dict(geoms="cube"), TypeError, "geoms is a list of names"),
    (dict(measure="best"), ValueError, "measure='best'"),
    (dict(spec="scene.xml"), TypeError, "MjSpec.from_file"),
])
def test_a_wrong_argument_gets_a_sentence(folder, arguments, error, words):
    arguments = {"spec": mujoco.MjSpec.from_string(CUBE.format(ground=PLANE, height=1))} | arguments
    with pytest.raises(error, match=words):
        ist.mujoco.attach(**arguments, cache=folder / "cache")


def test_a_pose_that_is_no_number_is_no_contact(folder):
    model, data = cube(folder, '<geom type="box" size="1 1 .1" pos="0 0 -.1"/>')
    data.qpos[0] = np.nan
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


@pytest.mark.parametrize("config, words", [
    ({"file": __file__}, "test_mujoco.py"),
    ({"measure": "matched"}, "needs an asset with spheres"),
    ({"file": "nowhere.ist", "measure": "magic"}, "magic"),
    ({"patches": "51"}, "patches=\"51\""),
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


def test_an_asset_that_lies_elsewhere_is_said(tmp_path, capfd):
    path = str(tmp_path / "moved.ist")
    corners = 2 * ist.sample_mesh("cube").vertices * (.05, .04, .03)
    for moved, said in ((0, False), (.02, True)):
        ist.bake_mesh_only((corners + (moved, 0, 0), ist.sample_mesh("cube").triangles)).save(path)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            with_instance({"file": path, "scale": "1"})
        assert any("lies elsewhere than the mesh" in text
                   for text in [str(one.message) for one in caught] + [capfd.readouterr().err]) == said


def test_solids_that_no_measure_serves_collide_as_hulls(tmp_path, capfd):
    ist.bake(ist.sample_mesh("cube"), max_spheres=100, keep_mesh=False).save(tmp_path / "spheres.ist")
    ist.bake_mesh_only(ist.sample_mesh("cube")).save(tmp_path / "mesh.ist")
    ground = '<geom type="sdf" mesh="cube" pos="0 0 -.03"><plugin instance="j"/></geom>'
    spec = mujoco.MjSpec.from_string(CUBE.format(ground=ground, height=.0295).replace("<asset>", f"""<extension>
      <plugin plugin="ist.solid"><instance name="i"><config key="file" value="{tmp_path}/spheres.ist"/></instance>
      <instance name="j"><config key="file" value="{tmp_path}/mesh.ist"/></instance></plugin></extension><asset>""")
      .replace('type="mesh" mesh="cube"/>', 'type="sdf" mesh="cube"><plugin instance="i"/></geom>').replace(".05 .04 .03", ".05 .05 .03"))
    for mesh in spec.meshes:
        mesh.scale = [.03, .03, .03]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon > 0 and data.contact.dist.min() == pytest.approx(-.0005, abs=1e-6)
    assert "their hulls collide" in "".join(capfd.readouterr())


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
    with pytest.raises(ImportError, match="4.0, not 3.2.0"):
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
