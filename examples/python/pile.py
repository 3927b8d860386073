#!/usr/bin/env python3
"""Fifty solids in a heap, pushed apart by gradient descent until none overlaps another.

The energy is the sum of all overlap volumes, its gradient the library's own; Adam takes the steps.
Solids swell while they go, from a third of their size: large ones that are stuck in each other pull
both ways at once. In the end they are asked a little larger than they are, so that nothing is left
between the real ones.
usage: pile.py [--objects N] [--seed S] [--device cpu|cuda] [--picture PNG]
"""
import argparse
import time

import numpy as np
import torch

import ist
from ist.torch import overlap
from scene import Scaled, draw, palette, random_rotations

SHAPES = ["gear", "torus_knot", "nut", "torus", "capsule"]
SIZE = 1.0  # [u] radius of the ball around each solid
SPHERES = 1000
MARGIN = 1.03  # solids are queried this much larger in the end
SWELLING = 100  # steps until they are


def heap(random, objects):
    """Poses (n, 7) in a ball where the solids cannot all have room, and scales (n,)."""
    poses = np.empty((objects, 7))
    poses[:, :4] = random_rotations(random, objects)
    way = random.normal(size=(objects, 3))
    reach = 0.7 * SIZE * objects**(1 / 3) * random.uniform(size=(objects, 1))**(1 / 3)
    poses[:, 4:] = way / np.linalg.norm(way, axis=1, keepdims=True) * reach
    return poses


def push_apart(solids, poses, pairs, scales, device="cpu", most_steps=2000):
    """Poses without overlap, and the energies [u³] on the way there."""
    moved = torch.tensor(poses, device=device, requires_grad=True)
    grown = torch.tensor(scales * MARGIN, device=device)
    descent = torch.optim.Adam([moved], lr=0.03 * SIZE, betas=(0.8, 0.9))
    energies = []
    for step in range(most_steps):
        swollen = min(1, 0.3 + 0.7 * step / SWELLING)
        descent.zero_grad()
        energy = overlap(solids, moved, pairs=pairs, scales=swollen * grown, spheres_only=True).sum()
        energies.append(energy.item())
        if energies[-1] == 0 and swollen == 1:
            break
        if energies[-1] > 0:
            energy.backward()
            descent.step()
            with torch.no_grad():  # Adam's steps are no smaller for a longer quaternion: keep it
                moved[:, :4] /= moved[:, :4].norm(dim=1, keepdim=True)
    return moved.detach().cpu().numpy(), energies


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--objects", type=int, default=50)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--device", default="cpu")
    options.add_argument("--picture")
    options = options.parse_args()

    meshes = [ist.close_mesh(ist.sample_mesh(name), name=name) for name in SHAPES]
    assets = [ist.bake(mesh, max_spheres=SPHERES) for mesh in meshes]
    kinds = np.arange(options.objects) % len(SHAPES)
    solids = [assets[kind] for kind in kinds]
    scales = np.array([SIZE / asset.bounds().radius for asset in assets])[kinds]
    pairs = np.stack(np.triu_indices(options.objects, 1), axis=1)

    poses = heap(np.random.default_rng(options.seed), options.objects)
    start = time.perf_counter()
    apart, energies = push_apart(solids, poses, pairs, scales, options.device)
    seconds = time.perf_counter() - start

    held, (a, b) = ist.Solids(solids), pairs.T
    sizes = dict(scales=scales[b], scales_a=scales[a])
    before = ist.penetration(held[a], held[b], poses[b], poses_a=poses[a], **sizes)
    after = ist.separation(held[a], held[b], apart[b], poses_a=apart[a], **sizes)
    volume = sum(asset.volume * scale**3 for asset, scale in zip(solids, scales))
    print(f"{options.objects} solids of {volume:.3g} u³, {np.count_nonzero(before.volume)} pairs "
          f"overlap by {before.volume.sum():.3g} u³")
    print(f"{len(energies)} steps in {seconds:.2f} s, {1e3 * seconds / len(energies):.2f} ms a step "
          f"of {len(pairs)} pairs; {energies[-1]:.3g} u³ left of the solids grown by "
          f"{MARGIN - 1:.0%}")
    proven = np.count_nonzero(after.distance_min > 0)
    print(f"{proven} of {len(pairs)} pairs are proven apart, the nearest spheres are "
          f"{after.distance.min():.3g} u apart")
    if options.picture:
        picture(options.picture, meshes, kinds, scales, poses, apart, energies)
    return 0 if energies[-1] == 0 and after.distance.min() > 0 else 1


def picture(path, meshes, kinds, scales, poses, apart, energies):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    shapes = [Scaled(mesh, scales[kinds.tolist().index(k)]) for k, mesh in enumerate(meshes)]
    figure, (left, right, curve) = plt.subplots(1, 3, figsize=(11, 4), width_ratios=[3, 4, 3])
    colours = palette(len(kinds))
    draw(left, shapes, kinds, poses, colours)
    draw(right, shapes, kinds, apart, colours)
    left.set_title("a heap")
    right.set_title(f"apart after {len(energies)} steps")
    curve.plot(energies)
    curve.axvline(SWELLING, color="0.7")
    curve.set_xlabel("step (full size from the line on)")
    curve.set_title("sum of overlaps, u³")
    figure.tight_layout()
    figure.savefig(path, dpi=72)


if __name__ == "__main__":
    raise SystemExit(main())
