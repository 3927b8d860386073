#!/usr/bin/env python3
"""Six robots by `ist spheres` with its defaults, and the Panda by cuRobo's own spheres beside it.

usage: robot_planners.py --ist PROGRAM --robots DIR --out FILE.json [--only NAME,…]
(pip install --no-deps --target DIR example-robot-data==6.0.0 curobo-metal==1.0.1;
pip install numpy==2.4.6 trimesh==5.2.0 python-fcl==0.7.0.11 pyyaml==6.0.4 lxml==6.1.3)
"""
import argparse
import datetime
import json
import math
import os
import pathlib
import subprocess
import tempfile
import time

import fcl
import numpy as np
import trimesh
import yaml
from lxml import etree

DATA = "cmeel.prefix/share/example-robot-data"
ROBOTS = {
    "Panda": ("panda_description/urdf/panda.urdf", []),
    "UR5": ("ur_description/urdf/ur5_robot.urdf", []),
    "xArm7": ("xarm_description/urdf/xarm7.urdf", ["--repair"]),
    "Solo12": ("solo_description/robots/solo12.urdf", ["--repair"]),
    "Go2": ("go2_description/urdf/go2.urdf", []),
    "PR2": ("pr2_description/urdf/pr2.urdf", ["--repair"]),
    "PR2 and its SRDF": ("pr2_description/urdf/pr2.urdf", ["--repair", "--srdf", "pr2_description/srdf/pr2.srdf"]),
}
POSES = 2000


def spheres_of(program, urdf, options):
    """The file that `ist spheres` writes, its report, and seconds."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "robot.json"
        start = time.monotonic()
        done = subprocess.run([program, "spheres", urdf, "-o", out, "--json", *options], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(out.read_text()), json.loads(done.stdout), time.monotonic() - start


def frame(origin):
    if origin is None:
        return np.eye(4)
    place = [float(x) for x in (origin.get("xyz") or "0 0 0").split()]
    turn = [float(x) for x in (origin.get("rpy") or "0 0 0").split()]
    out = trimesh.transformations.euler_matrix(*turn, "sxyz")
    out[:3, 3] = place
    return out


class Robot:
    """Joints and collision meshes of a URDF all of whose collision shapes are meshes."""

    def __init__(self, urdf):
        root = etree.parse(urdf).getroot()
        self.meshes, self.joints, self.above = {}, {}, {}
        for link in root.findall("link"):
            parts = []
            for shape in link.findall("collision"):
                mesh = trimesh.load(urdf.parent / shape.find("geometry/mesh").get("filename"), force="mesh")
                parts.append(mesh.apply_transform(frame(shape.find("origin"))))
            if parts:
                self.meshes[link.get("name")] = trimesh.util.concatenate(parts)
        for joint in root.findall("joint"):
            limit, axis = joint.find("limit"), joint.find("axis")
            child = joint.find("child").get("link")
            self.above[child] = joint.get("name")
            self.joints[joint.get("name")] = {
                "parent": joint.find("parent").get("link"), "type": joint.get("type"),
                "frame": frame(joint.find("origin")),
                "axis": np.array([float(x) for x in axis.get("xyz").split()]) if axis is not None else None,
                "limits": [float(limit.get(k, 0)) for k in ("lower", "upper")] if limit is not None
                else [-math.pi, math.pi]}

    def holder(self, link):
        """The next link above that has a mesh."""
        while link in self.above:
            link = self.joints[self.above[link]]["parent"]
            if link in self.meshes:
                return link
        return None

    def frames(self, positions):
        done = {}

        def of(link):
            if link not in done:
                done[link] = np.eye(4)
                if link in self.above:
                    name = self.above[link]
                    joint = self.joints[name]
                    moved = of(joint["parent"]) @ joint["frame"]
                    if joint["type"] in ("revolute", "continuous"):
                        moved = moved @ trimesh.transformations.rotation_matrix(positions[name], joint["axis"])
                    elif joint["type"] == "prismatic":
                        moved = moved @ trimesh.transformations.translation_matrix(joint["axis"] * positions[name])
                    done[link] = moved
            return done[link]

        return {link: of(link) for link in self.meshes}


def solids(robot):
    out = {}
    for name, mesh in robot.meshes.items():
        model = fcl.BVHModel()
        model.beginModel(len(mesh.vertices), len(mesh.faces))
        model.addSubModel(mesh.vertices, mesh.faces)
        model.endModel()
        out[name] = fcl.CollisionObject(model)
    return out


def shipped(path):
    """Spheres by link, with their buffers, and pairs that are ignored, of a cuRobo file."""
    kinematics = yaml.safe_load(path.read_text())["robot_cfg"]["kinematics"]
    buffers = kinematics["self_collision_buffer"]
    spheres = {link: np.array([[*s["center"], s["radius"] + buffers.get(link, 0)] for s in some])
               for link, some in kinematics["collision_spheres"].items()}
    ignored = {frozenset((a, b)) for a, others in kinematics["self_collision_ignore"].items() for b in others}
    return spheres, ignored, kinematics["lock_joints"] or {}


def meet(a, b, frame_a, frame_b):
    at, bt = (s[:, :3] @ f[:3, :3].T + f[:3, 3] for s, f in ((a, frame_a), (b, frame_b)))
    return (np.linalg.norm(at[:, None] - bt[None], axis=2) < a[:, 3][:, None] + b[:, 3][None]).any()


def beside(robot, contenders, locked):
    """By contender: of the truly colliding poses the share called free, of the free ones that called colliding.

    Truth is FCL's, of pairs of links that are no neighbours and apart in any pose.
    """
    random = np.random.default_rng(1)
    objects, names = solids(robot), list(robot.meshes)
    pairs = [(a, b) for i, b in enumerate(names) for a in names[:i]
             if robot.holder(a) != b and robot.holder(b) != a]
    truth = np.zeros((POSES, len(pairs)), bool)
    called = {name: np.zeros(POSES, bool) for name in contenders}
    for k in range(POSES):
        positions = {n: random.uniform(*j["limits"]) for n, j in robot.joints.items()} | locked
        frames = robot.frames(positions)
        for name, f in frames.items():
            objects[name].setTransform(fcl.Transform(f[:3, :3], f[:3, 3]))
        for i, (a, b) in enumerate(pairs):
            truth[k, i] = fcl.collide(objects[a], objects[b], fcl.CollisionRequest(), fcl.CollisionResult()) > 0
            for name, (spheres, ignored) in contenders.items():
                if not called[name][k] and frozenset((a, b)) not in ignored and a in spheres and b in spheres:
                    called[name][k] = meet(spheres[a], spheres[b], frames[a], frames[b])
    collides = truth[:, ~truth.all(axis=0)].any(axis=1)
    return collides, {name: ((collides & ~c).sum() / collides.sum(), (~collides & c).sum() / (~collides).sum())
                      for name, c in called.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--ist", required=True)
    parser.add_argument("--robots", required=True, type=pathlib.Path)
    parser.add_argument("--out", required=True)
    parser.add_argument("--only", default=",".join(ROBOTS))
    arguments = parser.parse_args()
    rows, targets, close, mostly = [], [], [], []
    content = arguments.robots / "curobo/content"
    urdf = content / "assets/robot/franka_description/franka_panda.urdf"
    theirs, ignored, locked = shipped(content / "configs/robot/franka.yml")
    file, report, _ = spheres_of(arguments.ist, urdf, [])
    contenders = {
        "cuRobo's franka.yml": (theirs, ignored),
        "ist spheres": ({link: np.array(one["spheres"]) for link, one in file["links"].items()},
                        {frozenset(one["links"]) for one in file["self_collision"]["ignored"]})}
    collides, shares = beside(Robot(urdf), contenders, locked)
    shown = [{"spheres": name, "count": sum(len(s) for link, s in contenders[name][0].items()),
              "truly colliding": int(collides.sum()), "of these called free [%]": 100 * missed,
              "free ones called colliding [%]": 100 * wrong} for name, (missed, wrong) in shares.items()]
    print(shown)

    def write():
        cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "?")
        commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True).stdout.strip()
        report = {
            "benchmark": "robot_planners", "page": "Robots for planners",
            "made_by": "benchmarks/robot_planners.py", "commit": commit, "date": datetime.date.today().isoformat(),
            "cpu": cpu, "cores": len(os.sched_getaffinity(0)), "compiler": "–", "quick": False,
            "tables": {"ist spheres with its defaults": rows, "Links in the way": close,
                       "Links that overlap in most poses": mostly,
                       "The Panda that cuRobo ships": shown},
            "targets": targets,
            "remarks": [
                "Robots of example-robot-data 6.0.0. Shares are those that ist spheres reports: in 2,000 poses in which "
                "nothing was decided, by exact queries of the links' solids.",
                "The Panda of curobo-metal 1.0.1, its spheres, buffers and ignored pairs as shipped; truth by FCL, of "
                "pairs that are no neighbours, the gripper open.",
                "The PR2's shoulders and upper arms overlap in three quarters of the poses; its SRDF excludes these pairs.",
                "cuRobo ships its UR10e without meshes. foam, another maker of spheres, is not on PyPI: not compared.",
                "Seconds are of two cores that other work used too."]}
        pathlib.Path(arguments.out).write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n")

    data = arguments.robots / DATA
    for name in arguments.only.split(","):
        urdf, options = ROBOTS[name]
        options = [str(data / "robots" / one) if one.endswith(".srdf") else one for one in options]
        _, report, seconds = spheres_of(arguments.ist, data / "robots" / urdf,
                                        ["--package", f"example-robot-data={data}", *options])
        self = report["self_collision"]
        free = self["samples"] - self["colliding"]
        share = self["false"] / max(free, 1)
        rows.append({"robot": name, "links": len(report["links"]),
                     "spheres": sum(link["spheres"] for link in report["links"].values()),
                     "largest protrusion [mm]": 1e3 * max(link["protrusion"] or 0 for link in report["links"].values()),
                     "truly colliding": self["colliding"], "of these called free": self["missed"], "free": free,
                     "called colliding [%]": 100 * share, "seconds": seconds})
        targets += [{"what": f"{name}: colliding poses called free", "value": self["missed"], "limit": "≤ 0",
                     "met": self["missed"] == 0},
                    {"what": f"{name}: free poses called colliding [%]", "value": 100 * share, "limit": "≤ 10.0",
                     "met": share <= 0.1}]
        close += [{"robot": name, "links": " and ".join(one["links"]), "gap [mm]": 1e3 * one["gap"],
                   "spheres of both that would tell, about": one["spheres"]} for one in self["too_close"]]
        mostly += [{"robot": name, "links": " and ".join(one["links"]),
                    "of the poses [%]": 100 * one["colliding"] / self["samples"]} for one in self["mostly_colliding"]]
        print(rows[-1], flush=True)
        write()  # a robot may take minutes


main()
