#!/usr/bin/env python3
"""A walk through the module, to be read from top to bottom; every line runs in the tests."""
import pathlib
import tempfile

import numpy as np

import ist

folder = pathlib.Path(tempfile.mkdtemp())

# %% A mesh, from a file (ist.load_mesh) or from arrays. It must bound a solid; ist.close_mesh says
# what it found, and repairs if asked to.
cube = ist.close_mesh(ist.Mesh(
    vertices=[(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)],
    triangles=[(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
               (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]), name="cube")
assert abs(cube.report.volume - 1) < 1e-12
gear = ist.close_mesh(ist.sample_mesh("gear"), name="gear")

# %% An asset: the solid filled with spheres. Progress comes ten times a second.
stages = []
box = ist.bake(cube, max_spheres=500)
wheel = ist.bake(gear, max_spheres=1000, progress=lambda p: stages.append(p.stage))
print(wheel)
wheel.save(folder / "wheel.ist")
assert ist.Asset.load(folder / "wheel.ist").to_bytes() == wheel.to_bytes()
assert all(i.violations == 0 for i in ist.check(wheel, gear))
mass = wheel.mass_properties()
print(f"volume {mass.volume:.4g} u³, centre of mass {mass.centre_of_mass}")

# %% One pose: qw, qx, qy, qz, tx, ty, tz of the second solid; the first stays at the origin.
low, high = wheel.bounds().lower, wheel.bounds().upper
pose = np.array([1, 0, 0, 0, high[0] - 0.5, -0.5, -0.5])
met = ist.penetration(wheel, box, pose)
print(f"overlap {met.volume:.4g} u³ around {met.centroid}, push on the box {met.force} u²")
assert met.status == ist.QueryStatus.ok and met.force[0] > 0

# %% Ten thousand poses: the same call, arrays in and arrays out, on all cores.
random = np.random.default_rng(0)
poses = np.empty((10_000, 7))
poses[:, :4] = random.normal(size=(len(poses), 4))
poses[:, :4] /= np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
poses[:, 4:] = random.uniform(1.5 * low, 1.5 * high, (len(poses), 3))
many = ist.penetration(wheel, box, poses)
print(f"{np.mean(many.volume > 0):.0%} of the poses overlap, by {many.volume.max():.3g} u³ at most")
assert many.volume.shape == (10_000,) and many.force.shape == (10_000, 3)

# %% A row that is no pose spoils only itself.
poses[7, 2] = np.nan
spoiled = ist.penetration(wheel, box, poses).status == ist.QueryStatus.invalid_input
assert np.flatnonzero(spoiled).tolist() == [7]

# %% How far apart, certified; a quick yes or no; contact points for a solver.
gaps = ist.separation(wheel, box, poses)
sure = ist.overlap(wheel, box, poses)
assert (many.volume[sure == ist.YesNo.yes] > 0).all()
print(f"largest gap {gaps.distance_max.max():.3g} u, proven free {np.mean(gaps.distance_min > 0):.0%}")
patches = ist.contact_patches(wheel, box, pose, max_patches=4)
assert np.allclose(patches.force.sum(axis=0), patches.penetration.force, atol=1e-9)

# %% Floors and walls need no bake. Scales are of the objects.
floor = ist.HalfSpaceShape(normal=(0, 0, 1))
sunk = ist.penetration(floor, box, [1, 0, 0, 0, 0, 0, -0.25], scales=2.0)
print(f"a box of edge 2 that is 0.25 deep: {sunk.volume:.3g} u³ (exact: 1)")
assert abs(sunk.volume - 1) < 0.02

# %% When does it land?
fall = ist.time_of_impact(floor, box, [1, 0, 0, 0, 0, 0, 3], [1, 0, 0, 0, 0, 0, -1], duration=1.0)
print(f"it lands at {fall.time:.3f} (exact: 0.75)")
assert fall.kind == ist.ImpactKind.impact and abs(fall.time - 0.75) < 0.01

# %% A scene: solids, a pose each, and the pairs to query. Returns gradients by every pose.
solids = ist.Solids([floor, wheel, box])
poses = np.array([[1, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0], pose])
a, b = np.array([(0, 1), (0, 2), (1, 2)]).T
scene = ist.penetration(solids[a], solids[b], poses[b], poses_a=poses[a])
step = -1e-3 * scene.pose_gradient[2] / np.linalg.norm(scene.pose_gradient[2])
moved = pose + step
moved[:4] /= np.linalg.norm(moved[:4])
assert ist.penetration(wheel, box, moved).volume < met.volume

# %% What is refused is an exception that says why.
for wrong in (lambda: ist.penetration(wheel, box, np.zeros((5, 6))),
              lambda: ist.load_mesh("nowhere.obj"), lambda: ist.bake(cube, grid="square")):
    try:
        wrong()
    except (ist.Error, ValueError) as error:
        print(type(error).__name__ + ":", error)
