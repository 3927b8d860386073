#!/usr/bin/env python3
"""`ist.trimesh.CollisionManager` beside trimesh's own, which asks FCL: the same calls of the same meshes.

usage: collision_manager.py --out FILE.json     (pip install trimesh==5.2.0 python-fcl==0.7.0.11 scipy)
"""
import argparse
import datetime
import importlib.metadata
import json
import os
import pathlib
import platform
import time

import numpy as np
import trimesh
import trimesh.collision
from trimesh.transformations import random_rotation_matrix

import ist.trimesh

MESHES = (trimesh.creation.icosphere(3), trimesh.creation.torus(1, 0.3), trimesh.creation.annulus(0.5, 1, 1))
SMALL = trimesh.creation.icosphere(2, radius=0.2)
BOXES = (trimesh.creation.box((2, 2, 2)),)
# Spacing of a lattice, and solids: turned ones of radius 1, or boxes that lie face on face.
SCENES = {"apart": (3.2, MESHES), "some overlap": (1.7, MESHES), "flush boxes": (2, BOXES)}


def transforms(count, spacing, turned, seed):
    side, rng = int(np.ceil(count ** (1 / 3))), np.random.default_rng(seed)
    made = []
    for i in range(count):
        transform = random_rotation_matrix(rng.random(3)) if turned else np.eye(4)
        transform[:3, 3] = spacing * np.array([i % side, i // side % side, i // side**2])
        transform[:3, 3] += 0.3 * turned * rng.random(3)
        made.append(transform)
    return made


def filled(placed, meshes):
    """Ours and trimesh's."""
    managers = ist.trimesh.CollisionManager(), trimesh.collision.CollisionManager()
    for manager in managers:
        for i, transform in enumerate(placed):
            manager.add_object(str(i), meshes[i % len(meshes)], transform)
    return managers


def calls(spacing, first, moved, others):
    middle = np.eye(4)
    middle[:3, 3] = spacing / 2

    def move(manager, count):
        for i in range(count):
            manager.set_transform(str(i), moved[i])
        return manager.in_collision_internal()

    return {
        "in_collision_internal": lambda m: m.in_collision_internal(),
        "… names": lambda m: len(m.in_collision_internal(return_names=True)[1]),
        "… contacts": lambda m: len(m.in_collision_internal(return_data=True)[1]),
        "in_collision_single": lambda m: m.in_collision_single(SMALL, middle),
        "min_distance_internal": lambda m: m.min_distance_internal(),
        "min_distance_internal of one": lambda m: m.min_distance_internal(name="3"),
        "min_distance_single": lambda m: m.min_distance_single(SMALL, middle),
        "one moves, in_collision_internal": lambda m: move(m, 1),
        "all move, in_collision_internal": lambda m: move(m, len(first)),
        "in_collision_other": lambda m: m.in_collision_other(others[type(m)]),
        "in_collision_other names": lambda m: len(m.in_collision_other(others[type(m)], return_names=True)[1]),
    }


def timed(call, manager):
    """The least of five [ms], and what it answers."""
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        answer = call(manager)
        times.append(1e3 * (time.perf_counter() - begin))
        if sum(times) > 2e4:
            break
    return min(times), answer


def rows(count, spacing, meshes):
    first, moved = (transforms(count, spacing, meshes is MESHES, seed) for seed in (5, 8))
    managers = filled(first, meshes)
    aside = np.eye(4)
    aside[:3, 3] = spacing * np.array([np.ceil(count ** (1 / 3)) - 1, 0.5, 0.5])  # where ours end
    others = {type(manager): manager for manager in filled([aside @ transform for transform in moved], meshes)}
    for name, call in calls(spacing, first, moved, others).items():
        (own, answer), (other, others) = (timed(call, manager) for manager in managers)
        yield {"call": name, "ist ms": own, "FCL ms": other, "FCL/ist": other / own, "ist": answer, "FCL": others,
               "same": "yes" if answer == others or abs(answer - others) <= 1e-6 * abs(answer) else "no"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    out = parser.parse_args().out
    tables = {f"{count} meshes, {how}": list(rows(count, *scene))
              for count in (24, 100, 1000) for how, scene in SCENES.items()}
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("trimesh", "python-fcl"))
    remarks = [
        f"{versions}; one thread; the least of five calls. Of the meshes, some 1,300, 2,000 and 250 triangles, each "
        "is prepared once here; trimesh prepares the mesh of a `_single` call each time.",
        "FCL/ist compares equal work at most where both answer the `same`. Distances of what overlaps or touches: FCL "
        "tells that of the first pair that it finds, here it is the deepest of all, 0 too. "
        "Contacts have volumes here, one for each connected part of an overlap; FCL's are of triangles.",
        "Alone, `in_collision_internal` asks two objects first that collided before.",
        "In `in_collision_other` the other manager's objects begin among the last of these.",
        "Of flush boxes FCL finds no collision at all where faces match (findings/fcl_flush_boxes.sh)."]
    out.write_text(json.dumps({
        "benchmark": "collision_manager", "page": "trimesh's CollisionManager",
        "made_by": "benchmarks/collision_manager.py",
        "commit": os.environ.get("IST_COMMIT", "–"), "date": datetime.date.today().isoformat(),
        "cpu": next((line.split(": ")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")),
                    platform.machine()),
        "cores": 1, "compiler": "–", "quick": False, "remarks": remarks, "tables": tables, "targets": [],
    }, indent=1, ensure_ascii=False))


if __name__ == "__main__":
    main()
