"""Scenes of concave parts in MuJoCo, each with the solids of ist and with MuJoCo's own collisions.

    python compare.py [SCENE…] [--ways ist hulls sdf pieces] [--measure inner --spheres 20000] [--json FILE]
                      [--films FOLDER]

Ways: ist (ist.mujoco), hulls (type="mesh": a mesh is its convex hull), sdf (type="sdf": MuJoCo's own
mesh SDF), pieces (convex decomposition by CoACD, if it is installed). Times of one run compare with each
other alone. `depth` is that of the deepest patch of an overlap of two meshes, by ist's exact measure,
in the whole run and at its end. A body that falls is a step's way deep when it is first found to touch.
"""

import argparse
import json
import os
import pathlib
import platform
import re
import sys
import tempfile
import time

import ist
import ist.mujoco
import mujoco
import numpy as np

try:
    import coacd
except ImportError:
    coacd = None

STIFF = 'solref="-2e4 -60"'


def turned(profile, around=48):
    """A closed mesh: a closed profile of (radius, height), radii > 0, turned about z."""
    profile = np.asarray(profile, float)
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    vertices = np.stack([np.outer(profile[:, 0], np.cos(angle)), np.outer(profile[:, 0], np.sin(angle)),
                         np.repeat(profile[:, 1:], around, 1)], -1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(len(profile)), np.arange(around), indexing="ij")
    next_row = (row + 1) % len(profile)
    a, b = row * around + column, row * around + (column + 1) % around
    c, d = next_row * around + (column + 1) % around, next_row * around + column
    return vertices, np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3),
                                     np.stack([a, c, d], -1).reshape(-1, 3)])


def sample(name):
    mesh = ist.sample_mesh(name)
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles)


def vessel(radius, height, wall):
    """A cup, almost closed at its axis: a hole of a hundredth of its radius stays."""
    hole = 0.01 * radius
    return turned([(hole, 0), (radius, 0), (radius, height), (radius - wall, height),
                   (radius - wall, wall), (hole, wall)])


def bent_rod(radius, thickness, start, end, along=24, around=12):
    """A rod along an arc of the x-z plane, from one angle to another [rad], with flat ends."""
    arc = np.linspace(start, end, along)[:, None]
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :]
    out = radius + thickness * np.cos(turn)
    rings = np.stack([out * np.cos(arc), thickness * np.sin(turn) + 0 * arc, out * np.sin(arc)], -1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
    a, b = row * around + column, row * around + (column + 1) % around
    c, d = b + around, a + around
    cap = np.arange(1, around - 1)
    first, last = np.zeros_like(cap), (along - 1) * around
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3),
                            np.stack([first, cap + 1, cap], -1),
                            np.stack([first + last, last + cap, last + cap + 1], -1)])
    return rings, faces


def together(*meshes):
    """Meshes in one, as they are: where they overlap they meet each other."""
    counts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    return (np.concatenate([vertices for vertices, _ in meshes]),
            np.concatenate([faces + count for (_, faces), count in zip(meshes, counts)]))


class Scene:
    """Meshes, bodies and a judgement."""

    seconds, step, options = 1.0, 0.001, ""
    settings = {"spheres": 4000}  # of ist.mujoco.attach
    meshes = {}

    def start(self, model, data):
        """Before the first step."""

    def judge(self, model, data, log):
        """(holds, words)"""
        raise NotImplementedError


class Nut(Scene):
    """A nut runs down its bolt without friction: 2 mm a turn."""

    seconds = 0.6
    settings = {"spheres": 10000}
    meshes = {"bolt": (sample("bolt"), ".001"), "nut": (sample("nut"), ".001")}
    bodies = f"""<geom name="bolt" mesh="bolt" {STIFF} friction="0"/>
      <body name="nut" pos="0 0 .010"><freejoint/><geom name="nut" mesh="nut" {STIFF} friction="0"/></body>"""

    def judge(self, model, data, log):
        log = np.array(log)[len(log) // 5:]
        turn = np.unwrap(2 * np.arctan2(log[:, 6], log[:, 3]), period=2 * np.pi)
        turns = abs(turn[-1] - turn[0]) / (2 * np.pi)
        off = 1e3 * np.abs(log[:, :2]).max()
        if turns < 0.1 or off > 1:
            return False, f"does not turn, {off:.2g} mm off its axis"
        pitch = 1e3 * abs(np.polyfit(turn / (2 * np.pi), log[:, 2], 1)[0])
        return abs(pitch - 2) < 0.05, f"{pitch:.3f} mm a turn over {turns:.2f}, {off:.3f} mm off its axis"


class Thread(Nut):
    """The bolt stands on its head, and the nut runs down from its end by 3.2 turns and more."""

    seconds = 1.2
    bodies = f"""<geom name="bolt" mesh="bolt" {STIFF} friction="0" pos="0 0 .021" euler="180 0 0"/>
      <body name="nut" pos="0 0 .0185"><freejoint/><geom name="nut" mesh="nut" {STIFF} friction="0"/></body>"""

    def judge(self, model, data, log):
        log = np.array(log)
        turn = np.unwrap(2 * np.arctan2(log[:, 6], log[:, 3]), period=2 * np.pi) / (2 * np.pi)
        log = log[100:int(np.searchsorted(np.abs(turn), 3.2))]
        turn = turn[100:100 + len(log)]
        if len(log) < 100:
            return False, "does not turn"
        off = min(np.ptp(1e3 * log[:, 2] + sign * 2 * turn) / 2 for sign in (-1, 1))
        return bool(off < 0.2), f"{abs(turn[-1]):.2f} turns, height within {off:.3f} mm of the helix, {1e3 * np.abs(log[:, :2]).max():.3f} mm off its axis"


class Mug(Scene):
    """Twenty knots fall into a mug and come to rest."""

    seconds, step, count = 3.0, 0.002, 20
    settings = {"spheres": 2000}
    meshes = {"mug": (vessel(0.05, 0.12, 0.004), "1"), "knot": (sample("torus_knot"), ".004")}
    bodies = f'<geom name="mug" mesh="mug" solref="-5e4 -310" friction=".5"/>' + "".join(
        f'<body name="knot {i}" pos="{0.015 * np.cos(2 * i):.4f} {0.015 * np.sin(2 * i):.4f} {0.03 + 0.025 * i:.4f}" '
        f'euler="{50 * i} {35 * i} 0"><freejoint/><geom name="knot {i}" mesh="knot" solref="-5e4 -310" friction=".5"/></body>'
        for i in range(count))

    def judge(self, model, data, log):
        places = data.qpos.reshape(-1, 7)[:, :3]
        inside = int(((np.hypot(places[:, 0], places[:, 1]) < 0.05) & (places[:, 2] > 0)).sum())
        speed = 1e3 * np.linalg.norm(data.qvel.reshape(-1, 6)[:, :3], axis=1).max()
        return inside == self.count, f"{inside} of {self.count} inside, fastest {speed:.1f} mm/s at the end"


class Pin(Scene):
    """A pin of 10 mm falls through a hole with 0.05 mm of play a side."""

    seconds = 0.35
    settings = {"spheres": 1000}
    meshes = {"plate": (turned([(.00505, 0), (.02, 0), (.02, .01), (.00505, .01)], 64), "1"),
              "pin": (turned([(1e-5, 0), (.005, 0), (.005, .03), (1e-5, .03)], 64), "1")}
    bodies = f"""<geom name="plate" mesh="plate" {STIFF} friction=".1"/>
      <body name="pin" pos=".00003 0 .008" euler="0 .2 0"><freejoint/><geom name="pin" mesh="pin" {STIFF} friction=".1"/></body>"""

    def judge(self, model, data, log):
        lowest = min(q[2] for q in log)
        return lowest < -0.03, f"falls {1e3 * (0.008 - lowest):.1f} mm"


class Bowl(Scene):
    """A ball rolls in a bowl, and stays in it."""

    seconds, step = 2.0, 0.002
    meshes = {"bowl": (turned([(.108 * np.sin(a), .1 - .108 * np.cos(a)) for a in np.linspace(.02, 1.4, 24)]
                              + [(.1 * np.sin(a), .1 - .1 * np.cos(a)) for a in np.linspace(1.4, .02, 24)]), "1")}
    bodies = f"""<geom name="bowl" mesh="bowl" solref="-2e4 -200"/>
      <body name="ball" pos=".06 0 .06"><freejoint/><geom type="sphere" size=".012" solref="-2e4 -200"/></body>"""

    def judge(self, model, data, log):
        low = 1e3 * min(q[2] for q in log)
        end = 1e3 * data.qpos[2]
        return bool(low > 9 and end < 20), f"the ball's centre is {low:.1f} mm high at its lowest (12 on the surface)"


class Chain(Scene):
    """Five rings hang in each other, and a spring lifts the first by 20 mm."""

    seconds, step, count = 1.0, 0.001, 5
    meshes = {"ring": (turned([(.01 + .002 * np.cos(a), .002 * np.sin(a))
                               for a in np.linspace(0, 2 * np.pi, 16, endpoint=False)]), "1")}
    bodies = "".join(
        f'<body name="ring {i}" pos="0 0 {-0.0155 * i:.4f}" quat="{"1 0 0 0" if i % 2 else ".7071 0 0 .7071"}">'
        + ("<freejoint/>" if i else '<joint type="slide" axis="0 0 1" stiffness="50" damping="20" springref=".02"/>')
        + f'<geom name="ring {i}" mesh="ring" euler="90 0 0" {STIFF} friction=".3"/></body>' for i in range(count))

    def judge(self, model, data, log):
        places = np.vstack([[[0, 0, data.qpos[0]]], data.qpos[1:].reshape(-1, 7)[:, :3]])
        gaps = 1e3 * np.linalg.norm(np.diff(places, axis=0), axis=1)
        return (bool(gaps.max() < 20 and data.qpos[0] > .015),
                f"lifted by {1e3 * data.qpos[0]:.1f} mm, links {gaps.min():.1f} to {gaps.max():.1f} mm apart (16 where they hang)")


class Hook(Scene):
    """A mug is hung on a hook by its handle: two meshes in one that overlap, as mugs are drawn."""

    seconds, step = 3.0, 0.002
    handle = bent_rod(.025, .005, -1.8, 1.8)
    meshes = {"hook": (bent_rod(.04, .004, np.pi, 2 * np.pi), "1"),
              "mug": (together(vessel(.04, .09, .004), (handle[0] + [.042, 0, .045], handle[1])), "1")}
    bodies = """<geom name="hook" mesh="hook" euler="0 0 90" pos="0 0 .04" solref="-2e4 -200"/>
      <body name="mug" pos="-.047 0 -.056"><freejoint/><geom name="mug" mesh="mug" solref="-2e4 -200"/></body>"""

    def judge(self, model, data, log):
        speed = 1e3 * np.linalg.norm(data.qvel[:3])
        return bool(data.qpos[2] > -0.15), f"{1e3 * data.qpos[2]:.0f} mm high, {speed:.1f} mm/s at the end"


class Pipe(Scene):
    """Four balls roll through a pipe that is 4 mm wider."""

    seconds, step, count = 1.5, 0.002, 4
    meshes = {"pipe": (turned([(.014, -.1), (.018, -.1), (.018, .1), (.014, .1)]), "1")}
    bodies = '<geom name="pipe" mesh="pipe" euler="0 70 0" solref="-2e4 -200"/>' + "".join(
        f'<body name="ball {i}" pos="{.02 + .021 * i:.3f} 0 {.0073 + .00764 * i:.4f}"><freejoint/>'
        '<geom type="sphere" size=".010" solref="-2e4 -200"/></body>' for i in range(count))

    def judge(self, model, data, log):
        out = int((data.qpos.reshape(-1, 7)[:, 2] < -.06).sum())
        return out == self.count, f"{out} of {self.count} balls are through"


class Gears(Scene):
    """A spring turns a gear, which turns another with friction in its bearing. Bearings give a little: a body that
    turns about its own centre of mass alone has rigid contacts in MuJoCo."""

    seconds, step = 2.0, 0.001
    meshes = {"gear": (sample("gear"), ".01")}
    bearing = "".join(f'<joint type="slide" axis="{axis}" stiffness="1e4" damping="60"/>' for axis in ("1 0 0", "0 1 0"))
    bodies = "".join(
        f'<body name="gear {name}" pos="{x} 0 0" euler="0 0 {turn}">BEARING<joint axis="0 0 1" {joint}/>'
        f'<geom name="gear {name}" mesh="gear" solref="-2e4 -60" friction=".1"/></body>'
        for name, x, turn, joint in (("driver", 0, -2.8125, 'stiffness=".02" springref="360"'),
                                     ("driven", .097, -14.0625, 'damping=".02"'))).replace("BEARING", bearing)

    def judge(self, model, data, log):
        driver, driven = (np.array(log)[:, k] / (2 * np.pi) for k in (2, 5))
        off = 16 * np.abs(driver + driven).max()
        return bool(driver[-1] > 0.5 and off < 0.25), f"{driver[-1]:.2f} turns drive {driven[-1]:.2f}, {off:.2f} of a tooth apart at most"


class Torch(Scene):
    """A torch, a cylinder, drops aslant into a cavity with 1 mm of play, and stands on its flat floor."""

    seconds, step = 2.0, 0.002
    meshes = {"holder": (vessel(.03, .04, .009), "1"),
              "torch": (turned([(1e-4, 0), (.02, 0), (.02, .1), (1e-4, .1)]), "1")}
    bodies = """<geom name="holder" mesh="holder" solref="-2e4 -200"/>
      <body name="torch" pos="0 0 .014" euler="0 1 0"><freejoint/><geom name="torch" mesh="torch" solref="-2e4 -200"/></body>"""

    def judge(self, model, data, log):
        tail = np.array(log[len(log) // 2:])
        height, tilt = 1e3 * tail[:, 2], 2 * np.degrees(np.arcsin(np.clip(np.hypot(tail[:, 4], tail[:, 5]), 0, 1)))
        speed = 1e3 * np.linalg.norm(data.qvel[:3])
        return (bool(abs(height[-1] - 9) < 0.5 and tilt.max() < 1 and speed < 5),
                f"{height[-1]:.2f} mm high (9 on the floor), {tilt.max():.2f}° tilted, {speed:.1f} mm/s at the end")


class Rings(Scene):
    """Five flat rings lie on each other: all their faces are in contact. To hulls they are discs."""

    seconds, step, count = 1.2, 0.002, 5
    meshes = {"ring": (turned([(.01, -.002), (.02, -.002), (.02, .002), (.01, .002)]), "1")}
    bodies = '<geom type="plane" size="1 1 .1"/>' + "".join(
        f'<body name="ring {i}" pos="{1e-4 * i:.4f} {5e-5 * i:.5f} {.00205 + .00405 * i:.5f}" euler="0 0 {17 * i}">'
        f'<freejoint/><geom name="ring {i}" mesh="ring" friction=".5"/></body>' for i in range(count))

    def judge(self, model, data, log):
        aside = 1e3 * np.linalg.norm((data.qpos - log[100]).reshape(-1, 7)[:, :2], axis=1).max()
        top = 1e3 * data.qpos[-5]
        return bool(aside < 1 and top > 16), f"the highest is {top:.2f} mm high (18 undeformed), {aside:.3f} mm moved aside"


class Cloth(Scene):
    """A cloth falls over a table's corner: MuJoCo's own contacts of a flex, by distances of the solid."""

    seconds, step = 0.3, 0.001
    options = '<option sdf_iterations="3"/>'
    meshes = {"table": (turned([(.002, -.02), (.05, -.02), (.05, 0), (.002, 0)]), "1")}
    bodies = """<geom name="table" mesh="table"/><flexcomp name="cloth" type="grid" count="9 9 1" spacing=".02 .02 .02"
      dim="2" pos="0 0 .01" radius=".002" mass=".2"><contact selfcollide="none"/>
      <elasticity young="3e3" poisson=".1" thickness="5e-3" elastic2d="stretch"/><edge damping=".001"/></flexcomp>"""

    def judge(self, model, data, log):
        middle = 1e3 * data.flexvert_xpos[40, 2]
        return bool(abs(middle) < 5), f"its middle is {middle:.1f} mm above the table"


class Arm(Scene):
    """A torque turns an arm that a package ships about its first joint: no contact brakes it."""

    seconds, step = 0.5, 0.002
    file, joint = "gym_xarm/tasks/assets/reach.xml", "joint1"

    def spec(self):
        for folder in sys.path:
            if (path := pathlib.Path(folder) / self.file).is_file():
                spec = mujoco.MjSpec.from_file(str(path))
                spec.option.gravity, spec.option.timestep = [0, 0, 0], self.step
                return spec
        raise ValueError(f"no {self.file} in PYTHONPATH: pip install --no-deps gym-xarm==0.1.1")

    def start(self, model, data):
        data.qfrc_applied[model.joint(self.joint).dofadr[0]] = 30

    def judge(self, model, data, log):
        place = model.joint(self.joint).qposadr[0]
        free, flags = mujoco.MjData(model), model.opt.disableflags
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        self.start(model, free)
        for _ in log:
            mujoco.mj_step(model, free)
        model.opt.disableflags = flags
        turned, expected = log[-1][place], free.qpos[place]
        return bool(abs(turned - expected) < 0.02 * abs(expected)), f"turns {turned:.3f} rad, {expected:.3f} without contacts"


SCENES = {scene.__name__.lower(): scene for scene in (Nut, Thread, Mug, Pin, Bowl, Chain, Hook, Pipe, Gears, Torch, Rings, Arm, Cloth)}


def write_obj(path, mesh):
    vertices, faces = mesh
    path.write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist())
                    + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in np.asarray(faces).tolist()))


def spec_of(scene, way, folder, measure=None):
    """The scene as an mjSpec; its meshes are files of a folder. `measure`: of ist.mujoco.attach."""
    if isinstance(scene, Arm):
        spec = scene.spec()
        for geom in spec.geoms if way == "sdf" else ():
            if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
                geom.type = mujoco.mjtGeom.mjGEOM_SDF
        if way == "ist":
            ist.mujoco.attach(spec, cache=folder.parent / "cache", measure=measure)
        elif way == "pieces":
            raise ValueError("not divided")
        return spec
    assets, pieces = [], {}
    for name, (mesh, scale) in scene.meshes.items():
        if way == "pieces":
            parts = coacd.run_coacd(coacd.Mesh(*mesh), threshold=0.03)
            pieces[name] = len(parts)
            for k, part in enumerate(parts):
                write_obj(folder / f"{name}{k}.obj", part)
                assets.append(f'<mesh name="{name}{k}" file="{name}{k}.obj" scale="{scale} {scale} {scale}"/>')
            continue
        write_obj(folder / f"{name}.obj", mesh)
        assets.append(f'<mesh name="{name}" file="{name}.obj" scale="{scale} {scale} {scale}" inertia="exact"/>')
    bodies = scene.bodies
    if way == "pieces":  # a geom for each
        bodies = re.sub(r'<geom name="([^"]*)" mesh="(\w+)"([^>]*)/>', lambda found: "".join(
            f'<geom name="{found[1]} {k}" mesh="{found[2]}{k}"{found[3]}/>'
            for k in range(pieces[found[2]])), bodies)
    bodies = bodies.replace(' mesh="', f' type="{"sdf" if way == "sdf" else "mesh"}" mesh="')
    xml = f"""<mujoco><compiler meshdir="{folder}"/><option timestep="{scene.step}"/>
      <asset>{"".join(assets)}</asset><worldbody>{bodies}</worldbody>{scene.options}</mujoco>"""
    spec = mujoco.MjSpec.from_string(xml)
    if way == "ist":
        ist.mujoco.attach(spec, cache=folder.parent / "cache", measure=measure, **scene.settings)
    return spec


class Truth:
    """Exact overlaps of the geoms' own meshes."""

    def __init__(self, scene):
        self.assets = {name: (ist.bake_mesh_only(ist.close_mesh(ist.Mesh(mesh[0], np.asarray(mesh[1], np.uint32)),
                                                              name=name)), float(scale))
                       for name, (mesh, scale) in scene.meshes.items()}

    def depth(self, model, data, scene):
        solids = []
        for geom in range(model.ngeom):
            mesh = model.geom(geom).name.split(" ")[0]
            if mesh in self.assets:
                solids.append((mesh, self.pose(model, data, geom)))
        deepest = 0.0
        for i, (first, pose) in enumerate(solids):
            for second, other in solids[i + 1:]:
                a, scale_a = self.assets[first]
                b, scale_b = self.assets[second]
                patches = ist.contact_patches(a, b, other, poses_a=pose, scales=scale_b, scales_a=scale_a,
                                              measure="exact", max_patches=64)
                deepest = max(deepest, float(patches.depth.max()))
        return deepest

    @staticmethod
    def pose(model, data, geom):
        """Of the mesh's file: MuJoCo moves a mesh to its centre and turns it to its axes."""
        turn, back, q, t = np.empty(4), np.empty(4), np.empty(4), np.empty(3)
        mujoco.mju_mat2Quat(turn, data.geom_xmat[geom])
        mesh = model.geom_dataid[geom]
        mujoco.mju_negQuat(back, model.mesh_quat[mesh])
        mujoco.mju_mulQuat(q, turn, back)
        mujoco.mju_rotVecQuat(t, model.mesh_pos[mesh], q)
        return np.concatenate([q / np.linalg.norm(q), data.geom_xpos[geom] - t])


def run(name, way, folder, films, measure=None):
    scene = SCENES[name]()
    row = {"scene": name, "way": way}
    try:
        model = spec_of(scene, way, folder, measure).compile()
    except ValueError as error:
        return row | {"holds": False, "words": str(error).splitlines()[0]}
    data = mujoco.MjData(model)
    scene.start(model, data)
    truth = Truth(scene) if way != "pieces" and scene.meshes else None
    film = None
    if films and way == "ist":
        from ist.mujoco.film import Film
        film = Film(model)
    log, spent, depth, steps = [], 0.0, 0.0, round(scene.seconds / scene.step)
    for step in range(steps):
        start = time.perf_counter()
        mujoco.mj_step(model, data)
        spent += time.perf_counter() - start
        if not np.isfinite(data.qpos).all() or np.abs(data.qpos).max() > 10:
            return row | {"holds": False, "words": f"thrown out after {step + 1} steps",
                          "steps_per_second": (step + 1) / spent}
        log.append(data.qpos.copy())
        if film:
            film.add(data)
        if truth and step % max(1, steps // 50) == 0:
            depth = max(depth, truth.depth(model, data, scene))
    if film:
        film.write(films / f"{name}.glb")
    holds, words = scene.judge(model, data, log)
    row |= {"holds": bool(holds), "words": words, "steps_per_second": steps / spent}
    if truth:
        row["depth_mm"] = 1e3 * depth
        row["depth_at_end_mm"] = 1e3 * truth.depth(model, data, scene)
    return row


def report(rows):
    """As benchmarks/report.h writes one."""
    cpu = re.search(r"model name\s*:\s*(.*)", pathlib.Path("/proc/cpuinfo").read_text())
    return {"benchmark": "mujoco", "commit": os.environ.get("IST_COMMIT", "–"), "date": time.strftime("%Y-%m-%d"),
            "quick": False, "cpu": cpu[1] if cpu else platform.machine(), "cores": os.cpu_count(),
            "compiler": f"MuJoCo {mujoco.__version__}",
            "remarks": ["Made by examples/mujoco/compare.py --json, one core a scene."],
            "tables": {"Scenes of concave parts": rows}, "targets": []}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"{', '.join(SCENES)}; default all")
    parser.add_argument("--ways", nargs="+", default=["ist", "hulls", "sdf"] + (["pieces"] if coacd else []),
                        choices=["ist", "hulls", "sdf", "pieces"])
    parser.add_argument("--measure", choices=["matched", "inner", "exact"],
                        help="of ist's way, for all meshes; default by mesh")
    parser.add_argument("--spheres", type=int, help="of ist's way, for each mesh; default by scene")
    parser.add_argument("--json", type=pathlib.Path, help="write the rows to this file")
    parser.add_argument("--films", type=pathlib.Path, help="folder for films (.glb) of ist's way")
    options = parser.parse_args()
    if options.spheres is not None:
        for scene in SCENES.values():
            scene.settings = {"spheres": options.spheres}
    unknown = set(options.scenes) - set(SCENES)
    if unknown:
        parser.error(f"no scene is named {sorted(unknown)[0]}: {', '.join(SCENES)}")
    if options.films:
        options.films.mkdir(parents=True, exist_ok=True)
    rows = []
    print(f"{'scene':8}{'way':8}{'holds':7}{'steps/s':>9}{'depth mm':>10}{'at end':>8}  what is seen")
    with tempfile.TemporaryDirectory() as temporary:
        for name in options.scenes or SCENES:
            for way in options.ways:
                folder = pathlib.Path(temporary) / f"{name}-{way}"
                folder.mkdir()
                row = run(name, way, folder, options.films, options.measure)
                rows.append(row)
                depth = f"{row['depth_mm']:10.3f}{row['depth_at_end_mm']:8.3f}" if "depth_mm" in row else " " * 18
                print(f"{name:8}{way:8}{'yes' if row['holds'] else 'no':7}{row.get('steps_per_second', 0):9.0f}"
                      f"{depth}  {row['words']}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(report(rows), indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
