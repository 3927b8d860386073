#!/usr/bin/env python3
"""Parts placed in a box, one after another, as a planner that fills a crate would do it.

The walls are half-spaces. For each part thousands of poses are asked at once; those that meet
neither wall nor part are free, and the one that lies lowest is taken and let down until it rests.
What is placed is then proven apart, pair by pair.
usage: packing.py [--parts N] [--seed S] [--picture PNG]
"""
import argparse
import time

import numpy as np

import ist
from scene import Scaled, draw, palette, random_rotations

SHAPES = ["gear", "nut", "torus", "capsule", "torus_knot"]
SIZE = 1.0  # [u] radius of the ball around each part
SPHERES = 1000
BOX = np.array([4.0, 4.0, 3.5])  # [u] inner size; it stands on z = 0, its corner at the origin
TRIED = 2000  # poses a part
MARGIN = 1.02  # parts are queried this much larger

WALLS = [ist.HalfSpaceShape(normal=(1, 0, 0)), ist.HalfSpaceShape(normal=(-1, 0, 0), offset=-BOX[0]),
         ist.HalfSpaceShape(normal=(0, 1, 0)), ist.HalfSpaceShape(normal=(0, -1, 0), offset=-BOX[1]),
         ist.HalfSpaceShape(normal=(0, 0, 1)), ist.HalfSpaceShape(normal=(0, 0, -1), offset=-BOX[2])]


class Crate:
    def __init__(self):
        self.parts, self.poses, self.scales = [], [], []

    def volumes(self, part, poses, scale):
        """(n,) [u³] what the part, a little grown, shares with walls and parts at each pose."""
        grown = scale * MARGIN
        total = sum(ist.penetration(wall, part, poses, scales=grown).volume for wall in WALLS)
        for other, pose, its_scale in zip(self.parts, self.poses, self.scales):
            near = np.flatnonzero(np.linalg.norm(poses[:, 4:] - pose[4:], axis=1) < 4.4 * SIZE)
            total[near] += ist.penetration(other, part, poses[near], poses_a=pose,
                                           scales_a=its_scale, scales=grown).volume
        return total

    def place(self, random, part, scale):
        """Whether there was room."""
        poses = np.empty((TRIED, 7))
        poses[:, :4] = random_rotations(random, TRIED)
        poses[:, 4:] = random.uniform(0, 1, (TRIED, 3)) * BOX
        free = poses[self.volumes(part, poses, scale) == 0]
        if len(free) == 0:
            return False
        height = np.array([part.mass_properties(pose, scale).centre_of_mass[2] for pose in free])
        pose = free[height.argmin()]
        step = 0.25 * SIZE
        while step > 0.01 * SIZE:  # down, or down and aside, as long as there is room
            ways = step * np.array([(0, 0, -1), (1, 0, -.3), (-1, 0, -.3), (0, 1, -.3), (0, -1, -.3)])
            tried = np.tile(pose, (len(ways), 1))
            tried[:, 4:] += ways
            fits = np.flatnonzero(self.volumes(part, tried, scale) == 0)
            if len(fits) > 0:
                pose = tried[fits[0]]
            else:
                step /= 2
        self.parts.append(part)
        self.poses.append(pose)
        self.scales.append(scale)
        return True


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--parts", type=int, default=40)
    options.add_argument("--seed", type=int, default=2)
    options.add_argument("--picture")
    options = options.parse_args()

    meshes = [ist.close_mesh(ist.sample_mesh(name), name=name) for name in SHAPES]
    assets = [ist.bake(mesh, max_spheres=SPHERES) for mesh in meshes]
    scales = [SIZE / asset.bounds().radius for asset in assets]
    random = np.random.default_rng(options.seed)
    crate, kinds = Crate(), []
    start = time.perf_counter()
    for i in range(options.parts):
        kind = i % len(SHAPES)
        if crate.place(random, assets[kind], scales[kind]):
            kinds.append(kind)
    seconds = time.perf_counter() - start

    n = len(kinds)
    solids = ist.Solids(WALLS + crate.parts)
    poses = np.concatenate((np.tile([1.0, 0, 0, 0, 0, 0, 0], (len(WALLS), 1)), crate.poses))
    sizes = np.concatenate((np.ones(len(WALLS)), crate.scales))
    a, b = np.array([(i, j) for j in range(len(WALLS), len(solids)) for i in range(j)]).T
    gaps = ist.separation(solids[a], solids[b], poses[b], poses_a=poses[a], scales=sizes[b],
                          scales_a=sizes[a])
    filled = sum(part.volume * scale**3 for part, scale in zip(crate.parts, crate.scales))
    print(f"{n} of {options.parts} parts found room in {seconds:.2f} s; they fill "
          f"{filled / BOX.prod():.0%} of the box")
    print(f"{np.count_nonzero(gaps.distance_min > 0)} of {len(a)} pairs of parts and walls are "
          f"proven apart, the nearest spheres are {gaps.distance.min():.3g} u apart")
    if options.picture:
        picture(options.picture, meshes, kinds, crate)
    return 0 if n > 0 and gaps.distance.min() > 0 else 1


def picture(path, meshes, kinds, crate):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    shapes = [Scaled(mesh, scale) for mesh, scale in
              zip((meshes[k] for k in kinds), crate.scales)]
    figure, axes = plt.subplots(figsize=(5, 5))
    onto = draw(axes, shapes, range(len(kinds)), np.array(crate.poses), palette(len(kinds)))
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * BOX
    for i in range(8):
        for j in range(i):
            if np.count_nonzero(corners[i] != corners[j]) == 1:
                hidden = min(corners[i][0] + corners[j][0], 1) == 0
                axes.plot(*onto(corners[[i, j]]).T, color="0.3", lw=1, zorder=0 if hidden else 3)
    figure.tight_layout()
    figure.savefig(path, dpi=80)


if __name__ == "__main__":
    raise SystemExit(main())
