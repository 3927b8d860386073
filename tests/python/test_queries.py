"""Queries of one pose and of arrays of poses."""
import inspect
import re
import threading

import numpy as np
import pytest

import ist

IDENTITY = [1, 0, 0, 0, 0, 0, 0]
AWAY = [1, 0, 0, 0, 100, 0, 0]


def test_boxes_overlap_by_their_volume(cube):
    side = cube.bounds().upper[0] - cube.bounds().lower[0]
    floor = ist.HalfSpaceShape(offset=cube.bounds().lower[2] + 0.25 * side)
    found = ist.penetration(floor, cube, IDENTITY)
    assert found.volume == pytest.approx(0.25 * side**3, rel=0.02)
    assert found.force == pytest.approx([0, 0, side**2], rel=0.03, abs=0.05 * side**2)
    assert isinstance(found.volume, float) and found.force.shape == (3,)
    assert found.status == ist.QueryStatus.ok


def test_distances_up_to_a_limit(gear, knot, random_poses):
    poses = random_poses(64, 9)
    gaps = ist.separation(gear, knot, poses)
    limit = float(np.median(gaps.distance[gaps.distance > 0]))
    found = ist.separation(gear, knot, poses, max_distance=limit, pair_id=3)
    farther = np.isinf(found.distance_max)
    assert np.array_equal(farther, gaps.distance > limit) and farther.any()
    assert (found.distance[farther] == limit).all() and np.isnan(found.normal[farther]).all()
    assert np.array_equal(found.point_a[~farther], gaps.point_a[~farther])
    assert (found.status == ist.QueryStatus.ok).all()
    within = ist.overlap(gear, knot, poses, margin=limit * (1 + 1e-9))
    assert np.array_equal(within == ist.YesNo.yes, gaps.distance <= limit)
    assert (within != ist.YesNo.unknown).all()
    for call in (lambda: ist.separation(gear, knot, poses, max_distance=-1),
                 lambda: ist.overlap(gear, knot, poses, margin=float("nan"))):
        with pytest.raises(ValueError, match="wanted 0 or more"):
            call()


def test_a_batch_is_its_single_queries(gear, knot, random_poses):
    poses = random_poses(64, 3)
    many = ist.penetration(gear, knot, poses, scale_gradients=True)
    gaps = ist.separation(gear, knot, poses)
    meet = ist.overlap(gear, knot, poses)
    contacts = ist.contact_patches(gear, knot, poses, max_patches=4)
    assert many.volume.shape == (64,) and many.force.shape == (64, 3)
    assert many.pose_gradient.shape == (64, 7) and many.status.dtype == np.uint32
    assert contacts.force.shape == (64, 4, 3)
    columns = [name for name in dir(ist.Penetration) if not name.startswith("_")]
    for i, pose in enumerate(poses):
        one = ist.penetration(gear, knot, pose, scale_gradients=True)
        for name in columns:
            assert np.array_equal(getattr(one, name), getattr(many, name)[i]), name
        assert ist.separation(gear, knot, pose).distance_min == gaps.distance_min[i]
        assert ist.overlap(gear, knot, pose) == meet[i]
        assert np.array_equal(ist.contact_patches(gear, knot, pose, max_patches=4).id,
                              contacts.id[i])
    assert (many.volume > 0).sum() > 30 and (gaps.distance > 0).any()
    assert ((meet == ist.YesNo.yes) <= (many.volume > 0)).all()
    lone = contacts.penetration
    assert np.allclose(contacts.force.sum(axis=1), lone.force, atol=1e-9)
    assert np.array_equal(contacts.count > 0, lone.volume > 0)


def test_any_number_of_threads_gives_the_same_bits(gear, knot, random_poses):
    poses = random_poses(200, 3)
    one = ist.penetration(gear, knot, poses, threads=1)
    for threads in (0, 2, 5):
        assert np.array_equal(ist.penetration(gear, knot, poses, threads=threads).volume, one.volume)


def test_python_threads_share_assets(gear, knot, random_poses):
    poses = random_poses(100, 3)
    expected = ist.penetration(gear, knot, poses).volume
    found = [None] * 6

    def ask(k):
        found[k] = ist.penetration(gear, knot, poses, threads=1 + k % 2).volume

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(len(found))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(volume, expected) for volume in found)


def test_batches_of_none_and_of_one(gear, knot):
    none = ist.penetration(gear, knot, np.empty((0, 7)))
    assert none.volume.shape == (0,) and none.force.shape == (0, 3)
    assert ist.separation(gear, knot, np.empty((0, 7))).distance.shape == (0,)
    assert ist.contact_patches(gear, knot, np.empty((0, 7))).id.shape == (0, 8)
    assert ist.penetration(gear, knot, [IDENTITY]).volume.shape == (1,)
    with pytest.raises(ValueError, match="max_patches: 0; wanted 1 or more"):
        ist.contact_patches(gear, knot, IDENTITY, max_patches=0)


def test_an_invalid_row_spoils_only_itself(gear, knot, random_poses):
    poses = random_poses(40, 2)
    expected = ist.penetration(gear, knot, poses)
    spoiled = poses.copy()
    spoiled[3, 5] = np.nan
    spoiled[7, 0] = np.inf
    spoiled[20, 6] = -np.inf
    spoiled[31, :4] = 0
    bad = np.isin(np.arange(40), [3, 7, 20, 31])
    found = ist.penetration(gear, knot, spoiled, scale_gradients=True)
    assert np.array_equal(found.status == ist.QueryStatus.invalid_input, bad)
    assert np.array_equal(found.volume[~bad], expected.volume[~bad])
    for column in (found.volume, found.force, found.pose_gradient, found.scale_gradient):
        assert np.isnan(column[bad]).all()
    scales = np.ones(40)
    scales[11] = -1
    assert np.flatnonzero(ist.separation(gear, knot, poses, scales=scales).status
                          == ist.QueryStatus.invalid_input).tolist() == [11]


@pytest.mark.parametrize("arguments, error, text", [
    (dict(poses=np.zeros((5, 6))), ValueError, r"poses: shape \(5, 6\); wanted \(7,\) or \(n, 7\): qw"),
    (dict(poses=np.zeros((2, 5, 7))), ValueError, r"poses: shape \(2, 5, 7\)"),
    (dict(poses=1.0), ValueError, r"poses: shape \(\)"),
    (dict(poses=np.zeros((5, 7), complex)), TypeError, "poses: dtype complex128; wanted float64"),
    (dict(poses=np.zeros((5, 7), bool)), TypeError, "poses: dtype bool"),
    (dict(poses="east"), TypeError, "poses: dtype <U4"),
    (dict(poses=[None] * 7), TypeError, "poses: dtype object"),
    (dict(scales=[1, 2]), ValueError, "scales: 2 rows; the arguments before it have 5"),
    (dict(scales=[[1.0]]), ValueError, r"scales: shape \(1, 1\); wanted a number or \(n,\)"),
    (dict(poses_a=np.zeros((4, 7))), ValueError, "poses_a: 4 rows"),
    (dict(measure="outer"), ValueError, "measure: 'outer'; one of 'matched', 'inner', 'exact'"),
    (dict(spheres_only="maybe"), TypeError, "spheres_only: a str; wanted True or False"),
    (dict(a=3), TypeError, "a: a int; wanted an Asset or a Shape"),
    (dict(a=ist.BallShape(2), b=ist.BallShape(1)), TypeError, "a, b: two shapes"),
])
def test_wrong_arguments_are_named(gear, knot, arguments, error, text):
    with pytest.raises(error, match=text):
        ist.penetration(**{**dict(a=gear, b=knot, poses=np.tile(IDENTITY, (5, 1))), **arguments})


def test_any_real_dtype_and_layout_will_do(gear, knot, random_poses):
    poses = random_poses(10, 2)
    expected = ist.penetration(gear, knot, poses).volume
    for other in (np.asfortranarray(poses), poses[::-1][::-1], poses.tolist(), poses.astype(">f8")):
        assert np.array_equal(ist.penetration(gear, knot, other).volume, expected)
    single = poses.astype(np.float32)
    assert np.array_equal(ist.penetration(gear, knot, single).volume,
                          ist.penetration(gear, knot, single.astype(float)).volume)


def test_only_the_relative_pose_counts(gear, knot, random_poses):
    poses = random_poses(30, 2)
    moved_a = random_poses(1, 5)[0]
    moved_b = np.array([compose(moved_a, pose) for pose in poses])
    here = ist.penetration(gear, knot, poses)
    there = ist.penetration(gear, knot, moved_b, poses_a=moved_a)
    assert there.volume == pytest.approx(here.volume, rel=1e-6, abs=1e-9)
    turned = here.force @ rotation(moved_a).T
    assert there.force == pytest.approx(turned, rel=1e-5, abs=1e-5)


def rotation(pose):
    w, x, y, z = pose[:4] / np.linalg.norm(pose[:4])
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def compose(a, b):
    """The pose x ↦ a(b(x))."""
    (aw, *av), (bw, *bv) = a[:4], b[:4]
    q = [aw * bw - np.dot(av, bv), *(aw * np.array(bv) + bw * np.array(av) + np.cross(av, bv))]
    return np.concatenate((q, rotation(a) @ b[4:] + a[4:]))


@pytest.mark.parametrize("spheres_only", [False, True])
def test_gradients_are_those_of_the_volume(gear, knot, random_poses, spheres_only):
    poses, poses_a = random_poses(24, 1.5), random_poses(24, 0.5)
    scales, scales_a = np.full(24, 0.8), np.full(24, 1.2)
    found = ist.penetration(gear, knot, poses, poses_a=poses_a, scales=scales, scales_a=scales_a,
                            spheres_only=spheres_only, scale_gradients=True)
    met = found.volume > 1e-2
    assert met.sum() > 12

    def volume(b, a, scale=scales, scale_a=scales_a):
        b, a = b.copy(), a.copy()
        for moved in (b, a):  # the function is of q/|q|
            moved[:, :4] /= np.linalg.norm(moved[:, :4], axis=1, keepdims=True)
        return ist.penetration(gear, knot, b, poses_a=a, scales=scale, scales_a=scale_a,
                               spheres_only=spheres_only).volume

    h = 1e-4
    for k in range(7):
        step = h * np.eye(7)[k]
        by_b = (volume(poses + step, poses_a) - volume(poses - step, poses_a)) / (2 * h)
        by_a = (volume(poses, poses_a + step) - volume(poses, poses_a - step)) / (2 * h)
        for differences, gradient in (by_b, found.pose_gradient), (by_a, found.pose_gradient_a):
            size = np.linalg.norm(gradient, axis=1)
            assert (np.abs(differences - gradient[:, k])[met] < 3e-3 * size[met]).all()
    h = 1e-3
    by_b = (volume(poses, poses_a, scales + h) - volume(poses, poses_a, scales - h)) / (2 * h)
    by_a = (volume(poses, poses_a, scales, scales_a + h)
            - volume(poses, poses_a, scales, scales_a - h)) / (2 * h)
    for differences, gradient in (by_b, found.scale_gradient), (by_a, found.scale_gradient_a):
        error = np.abs(differences - gradient)[met]
        assert np.median(error) < 2e-3 * np.median(np.abs(gradient[met]))
        assert error.max() < 2e-2 * np.abs(gradient[met]).max()
    assert ist.penetration(gear, knot, poses).scale_gradient is None


def test_fields_meet_assets(cube):
    side = cube.bounds().upper[0] - cube.bounds().lower[0]
    centre = cube.mass_properties().centre_of_mass
    grid = np.linspace(-2 * side, 2 * side, 33)
    z, y, x = np.meshgrid(grid, grid, grid, indexing="ij")
    ball = ist.DistanceGridShape((np.sqrt(x**2 + y**2 + z**2) - side).astype(np.float32),
                                 origin=np.full(3, grid[0]), spacing=grid[1] - grid[0])
    pose = np.concatenate(([1, 0, 0, 0], -centre))
    for field in (ist.HalfSpaceShape(offset=side), ist.BoxShape([side, side, side]),
                  ist.BallShape(side), ist.CapsuleShape(side, side), ist.CylinderShape(side, side),
                  ball):
        assert ist.penetration(field, cube, pose).volume == pytest.approx(cube.volume, rel=1e-2)
        assert ist.overlap(field, cube, pose) == ist.YesNo.yes
    with pytest.raises(ValueError, match=r"half_extents: shape \(2,\); wanted \(3,\)"):
        ist.BoxShape([1, 2])
    with pytest.raises(ValueError, match=r"heights: shape \(4,\); wanted \(rows, columns\)"):
        ist.HeightFieldShape(np.zeros(4))
    for refused, text in (
            (lambda: ist.BallShape(-1), "radius=-1.0; wanted > 0"),
            (lambda: ist.BoxShape([-1, 1, 1]), "half_extents="),
            (lambda: ist.HalfSpaceShape([0, 0, 0]), "normal="),
            (lambda: ist.HalfSpaceShape(offset=np.nan), "offset=nan"),
            (lambda: ist.CapsuleShape(1, -1), "half_height=-1.0"),
            (lambda: ist.CylinderShape(1, np.inf), "half_height=inf"),
            (lambda: ist.HeightFieldShape(np.zeros((1, 1))), r"heights: shape \(1, 1\)"),
            (lambda: ist.HeightFieldShape([[0, 1], [np.nan, 2]]), "heights: number 2 is nan, not finite"),
            (lambda: ist.HeightFieldShape([[0, 1], [2, 3]], highest=2), "heights: number 3 is 3.0, not from"),
            (lambda: ist.HeightFieldShape(np.zeros((2, 2)), spacing=(0, 1)), "spacing="),
            (lambda: ist.DistanceGridShape(np.full((2, 2, 2), np.inf), origin=(0, 0, 0), spacing=1),
             "distances: number 0 is inf"),
            (lambda: ist.DistanceGridShape(np.zeros((2, 2, 2)), origin=(0, 0, 0), spacing=-1), "spacing=-1")):
        with pytest.raises(ValueError, match=text):
            refused()
    assert repr(ist.BoxShape([1, 2, 3])) == "ist.BoxShape(half_extents=[1, 2, 3])"


def test_normals_and_quaternions_of_any_length_are_normalised(cube):
    pose = np.array([0.5, 0.5, 0.5, 0.5, 0.1, 0.2, 0.3])
    plane = ist.HalfSpaceShape([0, 0, 1], 0.25)
    expected = ist.penetration(plane, cube, pose).volume
    assert expected > 0
    for length in (1e-100, 0.5, 2, 1e100):
        longer = pose * [length] * 7
        longer[4:] = pose[4:]
        assert ist.penetration(plane, cube, longer).volume == pytest.approx(expected, rel=1e-12)
        other = ist.HalfSpaceShape([0, 0, length], 0.25 * length)
        assert ist.penetration(other, cube, pose).volume == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("pose, text", [
    ([np.nan, 0, 0, 0, 0, 0, 0], "poses: qw is nan"),
    ([0, 0, 0, 0, 0, 0, 0], "poses: the quaternion qw, qx, qy, qz has length 0"),
    ([1, 0, 0, 0, 0, -np.inf, 0], "poses: ty is -inf"),
    ([1, 0, 0, 0, 0, 1e90, 0], "poses: sizes or distances are more than 1e60 : 1 apart"),
])
def test_one_invalid_pose_raises(cube, pose, text):
    for ask in (ist.penetration, ist.separation, ist.contact_patches, ist.overlap, ist.overlap_outline):
        with pytest.raises(ValueError, match=text):
            ask(cube, cube, pose)
    with pytest.raises(ValueError, match=text):
        ist.time_of_impact(cube, cube, pose, AWAY)
    if "apart" not in text:
        with pytest.raises(ValueError, match=text.replace("poses", "poses_to")):
            ist.time_of_impact(cube, cube, IDENTITY, pose)
        for ask in (lambda: cube.mass_properties(pose), lambda: cube.bounds(pose),
                    lambda: ist.closest_point(cube, pose, [0, 0, 0])):
            with pytest.raises(ValueError, match=text.replace("poses", "pose")):
                ask()


def test_an_accepted_error_takes_the_meshes_where_these_are_cheap(cube):
    pose = np.array([0.9, 0.1, 0.3, 0.2, 0.9, 0.3, 0.2])
    exact = ist.penetration(cube, cube, pose, measure="exact")
    found = ist.penetration(cube, cube, pose, relative_error=0.005)
    assert exact.volume > 0 and found.volume == exact.volume and found.status == ist.QueryStatus.ok
    assert ist.penetration(cube, cube, pose).volume != exact.volume
    patches = ist.contact_patches(cube, cube, pose, relative_error=0.005)
    assert patches.penetration.volume == exact.volume
    # A budget keeps the meshes out.
    limited = ist.penetration(cube, cube, pose, relative_error=1e-6, pair_budget=1)
    assert limited.status == ist.QueryStatus.error_exceeded


def test_one_end_of_a_motion_applies_to_all_rows(cube):
    many = [AWAY, np.multiply(AWAY, [1, 1, 1, 1, 2, 2, 2])]
    found = ist.time_of_impact(cube, cube, many, IDENTITY)
    back = ist.time_of_impact(cube, cube, IDENTITY, many)
    for i, pose in enumerate(many):
        assert found.time[i] == ist.time_of_impact(cube, cube, pose, IDENTITY).time
        assert back.kind[i] == ist.ImpactKind.overlapping
    with pytest.raises(ValueError, match=r"poses_to: shape \(3,\) of rows; poses have \(2,\)"):
        ist.time_of_impact(cube, cube, many, [IDENTITY] * 3)


def test_limits_that_are_none_are_refused(cube):
    for arguments, text in ((dict(relative_error=np.nan), "relative_error: nan; wanted a number ≥ 0"),
                            (dict(relative_error=-1.0), "relative_error: -1.0"),
                            (dict(threads=10**9), "threads: 1000000000; wanted 0, all cores, to 4096"),
                            (dict(scales=-1), "scales: -1.0; wanted > 0"),
                            (dict(poses_a=[0] * 7), "poses_a: the quaternion")):
        with pytest.raises(ValueError, match=text):
            ist.penetration(cube, cube, IDENTITY, **arguments)
    with pytest.raises(TypeError, match=r"poses: None; wanted \(7,\)"):
        ist.penetration(cube, cube, None)
    with pytest.raises(ValueError, match="tolerance: nan"):
        ist.time_of_impact(cube, cube, IDENTITY, AWAY, tolerance=np.nan)
    with pytest.raises(ValueError, match="duration: 0.0; wanted > 0"):
        ist.time_of_impact(cube, cube, IDENTITY, AWAY, duration=0)


def test_mistakes_name_the_argument(cube):
    for call, text in (
            (lambda: ist.penetration(cube, cube, IDENTITY, max_visit=3),
             "penetration\\(\\): there is no argument 'max_visit'; did you mean 'max_visits'?"),
            (lambda: ist.penetration(cube, cube), "the argument 'poses' is missing"),
            (lambda: ist.penetration(cube, cube, IDENTITY, 1), "4 arguments without a name; it takes 3"),
            (lambda: ist.penetration(cube, cube, IDENTITY, a=cube), "'a' is given twice"),
            (lambda: ist.penetration(cube, cube, IDENTITY, threads="all"), "threads: a str; wanted a whole"),
            (lambda: ist.penetration(cube, cube, IDENTITY, threads=-1), "threads: -1; wanted a whole number"),
            (lambda: ist.penetration(cube, cube, IDENTITY, measure=1), "measure: a int; wanted a str"),
            (lambda: ist.bake(None), "bake\\(\\): the argument 'mesh' is None"),
            (lambda: ist.Scene().add(None), "add\\(\\): the argument 'solid' is None"),
            (lambda: ist.Solids(None), "Solids\\(\\): the argument 'solids' is None"),
            (lambda: cube.spheres(witch="inner"), "did you mean 'which'?")):
        with pytest.raises(TypeError, match=text):
            call()
    assert "poses_a" in inspect.signature(ist.penetration).parameters


def test_matrices_and_quaternions_of_either_order_are_poses(cube, random_poses):
    rows = random_poses(50, 0.5)
    w, x, y, z = rows[:, :4].T
    matrices = np.zeros((50, 4, 4))
    matrices[:, :3, :3] = np.moveaxis(np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]), -1, 0)
    matrices[:, :3, 3], matrices[:, 3, 3] = rows[:, 4:], 1
    same = np.sign((ist.poses(matrices)[:, :4] * rows[:, :4]).sum(axis=1))[:, None]
    assert ist.poses(matrices)[:, :4] * same == pytest.approx(rows[:, :4], abs=1e-14)
    expected = ist.penetration(cube, cube, rows).volume
    assert ist.penetration(cube, cube, matrices).volume == pytest.approx(expected, rel=1e-9)
    assert ist.penetration(cube, cube, matrices[3]).volume == pytest.approx(expected[3], rel=1e-9)
    assert ist.penetration(cube, cube, IDENTITY, poses_a=matrices[3]).volume > 0
    assert ist.poses(np.roll(3 * rows[:, :4], -1, axis=1), rows[:, 4:], order="xyzw") == pytest.approx(rows)
    assert ist.poses(rows[0, :4], rows[:, 4:], order="wxyz").shape == (50, 7)
    assert ist.poses(matrices[:, :3, :3], rows[:, 4:]) == pytest.approx(ist.poses(matrices))
    spoiled = matrices.copy()
    spoiled[7, 0, 0] = np.nan
    assert (ist.penetration(cube, cube, spoiled).status != 0).nonzero()[0].tolist() == [7]
    mirrored = matrices.copy()
    mirrored[9, :3, 0] *= -1
    endless = matrices.copy()
    endless[8, 1, 2] = -np.inf
    for wrong, text in ((2 * matrices, "poses: matrix 0 is no rigid motion: its last row"),
                        (endless, "poses: matrix 8 is no rigid motion: its columns"),
                        (mirrored, "poses: matrix 9 is no rigid motion: it mirrors")):
        with pytest.raises(ValueError, match=text):
            ist.penetration(cube, cube, wrong)
    with pytest.raises(ValueError, match="order: 'qxyz'; one of"):
        ist.poses(rows[:, :4], order="qxyz")
    with pytest.raises(ValueError, match="rotations: shape"):
        ist.poses(rows[:, :4])


def test_answers_show_what_they_are(cube):
    one = ist.penetration(cube, cube, IDENTITY)
    assert one.status is ist.QueryStatus.ok and repr(one).startswith("ist.Penetration(volume=")
    assert "status=ok" in repr(one)
    many = ist.penetration(cube, cube, [IDENTITY, AWAY, [0] * 7])
    assert repr(many) == "<ist.Penetration of 3 rows: 2 ok, 1 invalid_input>"
    assert "2 ok" in repr(ist.contact_patches(cube, cube, [IDENTITY, AWAY]))
    assert ist.overlap(cube, cube, AWAY) is ist.YesNo.no
    assert ist.time_of_impact(cube, cube, AWAY, AWAY).kind is ist.ImpactKind.no_impact
    assert repr(cube).startswith("<ist.Asset: ") and "spheres" in cube._repr_html_()


def test_pictures_and_corrections(cube, knot):
    vertices, triangles = cube.mesh()
    assert triangles.max() < len(vertices) and triangles.shape == (12, 3)
    corners = vertices[triangles]
    volume = np.einsum("ij,ij->", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6
    assert len(vertices) == 8 and volume == pytest.approx(cube.volume, rel=1e-12)
    with pytest.raises(ist.Error, match="holds no mesh"):
        ist.bake(ist.sample_mesh("cube"), max_spheres=20, keep_mesh=False).mesh()
    side = cube.bounds().upper[0] - cube.bounds().lower[0]
    pose = [1, 0, 0, 0, 1.001 * side, 0, 0]
    whole = ist.penetration(cube, cube, pose, spheres_only=True)
    found = ist.lenses(cube, cube, pose)
    assert len(found.centre) == whole.sphere_pairs > 0
    assert np.linalg.norm(found.axis, axis=1) == pytest.approx(1)
    fewer = ist.without_protrusion(whole, cube, cube, pose)
    assert fewer.volume < whole.volume
    deep = ist.penetration(cube, cube, IDENTITY, spheres_only=True)
    assert ist.without_protrusion(deep, cube, cube, IDENTITY).volume == deep.volume
    with pytest.raises(ValueError, match="whole: shape"):
        ist.without_protrusion(whole, cube, cube, [pose])
    fit = ist.size_match(cube, cube)
    assert fit.fits and fit.ratio == 1 and fit.feature_size_a == fit.feature_size_b > 0
    unlike = ist.size_match(cube, cube, scale=100)
    assert unlike.needs_mesh and unlike.has_mesh and unlike.fits
    inside = [1, 0, 0, 0, 0, 0, 0]
    by_meshes, by_spheres = (ist.penetration(cube, cube, inside, scales=100, spheres_only=only).volume
                             for only in (False, True))
    assert by_meshes == pytest.approx(cube.volume, rel=1e-12)
    assert by_spheres != pytest.approx(cube.volume, rel=1e-9)
    with pytest.raises(ValueError, match="scale: 0.0"):
        ist.size_match(cube, cube, scale=0)


@pytest.fixture(scope="module")
def thread():
    """(bolt, nut): surfaces alone."""
    return [ist.bake_mesh_only(ist.close_mesh(ist.sample_mesh(name), name=name))
            for name in ("bolt", "nut")]


TRUTH = 34.7409603139359  # of nut and bolt at z = 8.5


def test_exact_tells_what_touches(cube):
    side = cube.bounds().upper[0] - cube.bounds().lower[0]
    poses = np.tile([1.0, 0, 0, 0, 0, 0, 0], (5, 1))
    poses[:, 4:] = side * np.array([[0.5, 0, 1], [1, 0, 1], [0, 0, 1 + 1e-9], [0, 0, 1 - 1e-9], [0, 0, 0]])
    found = ist.penetration(cube, cube, poses, measure="exact")
    assert found.touching.dtype == bool and found.touching.tolist() == [True, True, False, False, False]
    assert (found.volume[:3] == 0).all() and (found.volume[3:] > 0).all()
    assert found.contact_area == pytest.approx([0.5 * side**2, 0, 0, 0, 0])
    assert found.contact_normal[0] == pytest.approx([0, 0, 1]) and not found.contact_normal[1:].any()
    assert not ist.penetration(cube, cube, poses).touching.any()  # spheres cannot tell


def test_exact_is_the_true_volume(thread):
    bolt, nut = thread
    found = ist.penetration(bolt, nut, [1, 0, 0, 0, 0, 0, 8.5], measure="exact")
    assert found.volume == pytest.approx(TRUTH, rel=1e-11)
    assert found.volume_min - 1e-13 <= TRUTH <= found.volume_max + 1e-13
    assert found.volume_max - found.volume_min < 1e-9 * TRUTH
    assert found.force[2] == pytest.approx(-71.734, abs=1e-3)
    assert found.status == ist.QueryStatus.ok
    poses = np.tile([1.0, 0, 0, 0, 0, 0, 8.5], (60, 1))
    poses[:, 6] += np.linspace(-1, 1, 60)
    one, many = (ist.penetration(bolt, nut, poses, measure="exact", threads=n) for n in (1, 4))
    for name in ("volume", "volume_min", "volume_max", "force", "torque", "centroid", "pose_gradient"):
        assert np.array_equal(getattr(one, name), getattr(many, name)), name


def test_exact_queries_of_one_pair_are_steps_of_a_motion(thread):
    bolt, nut = thread
    poses = np.tile([1.0, 0, 0, 0, 0, 0, 8.5], (60, 1))
    poses[:, 6] += np.linspace(0, 0.01, 60)
    found = ist.penetration(bolt, nut, poses, measure="exact", threads=1)
    kept = ist.penetration(bolt, nut, poses, measure="exact", threads=1, pair_id=1)
    for name in ("volume", "volume_min", "volume_max", "force", "torque", "centroid"):
        assert np.array_equal(getattr(found, name), getattr(kept, name)), name
    assert (kept.node_visits == 0).sum() > 30 and (found.node_visits > 0).all()
    patches = ist.contact_patches(bolt, nut, poses[0], measure="exact", pair_id=2)
    assert patches.penetration.volume == found.volume[0]
    outline = ist.overlap_outline(bolt, nut, poses[0], pair_id=2)
    assert outline.contact.penetration.volume == found.volume[0]


def test_exact_gradients_are_differences(gear, knot, random_poses):
    poses, poses_a = random_poses(12, 1.2), random_poses(12, 0.4)
    scales, scales_a = np.full(12, 0.8), np.full(12, 1.2)
    found = ist.penetration(gear, knot, poses, poses_a=poses_a, scales=scales, scales_a=scales_a,
                            measure="exact", scale_gradients=True)
    met = found.volume > 1e-2
    assert met.sum() > 6

    def volume(b, a, scale=scales, scale_a=scales_a):
        b, a = b.copy(), a.copy()
        for moved in (b, a):
            moved[:, :4] /= np.linalg.norm(moved[:, :4], axis=1, keepdims=True)
        return ist.penetration(gear, knot, b, poses_a=a, scales=scale, scales_a=scale_a,
                               measure="exact").volume

    h = 1e-5
    for k in range(7):
        step = h * np.eye(7)[k]
        by_b = (volume(poses + step, poses_a) - volume(poses - step, poses_a)) / (2 * h)
        by_a = (volume(poses, poses_a + step) - volume(poses, poses_a - step)) / (2 * h)
        for differences, gradient in (by_b, found.pose_gradient), (by_a, found.pose_gradient_a):
            size = np.linalg.norm(gradient, axis=1)
            assert (np.abs(differences - gradient[:, k])[met] < 1e-5 * size[met]).all()
    by_b = (volume(poses, poses_a, scales + h) - volume(poses, poses_a, scales - h)) / (2 * h)
    assert np.abs(by_b - found.scale_gradient)[met].max() < 1e-3 * np.abs(by_b[met]).max()


def test_what_is_not_held_is_no_zero(thread, cube, random_poses):
    bolt, nut = thread
    bare = ist.bake(ist.close_mesh(ist.sample_mesh("cube"), name="bare"), max_spheres=50,
                    keep_mesh=False, device="cpu")
    poses = random_poses(3, 1)
    for a, b, measure in ((bolt, nut, "matched"), (cube, bare, "exact"), (bare, cube, "exact"),
                          (ist.BallShape(1), cube, "exact")):
        found = ist.penetration(a, b, poses, measure=measure, scale_gradients=True)
        assert (found.status == ist.QueryStatus.missing_data).all()
        for name in ("volume", "volume_min", "volume_max", "force", "torque", "pose_gradient",
                     "pose_gradient_a", "scale_gradient", "scale_gradient_a"):
            assert np.isnan(getattr(found, name)).all(), name
        assert len(ist.penetration(a, b, poses[:0], measure=measure).volume) == 0
    assert np.isnan(ist.separation(bolt, nut, poses, inner_spheres=True).distance).all()
    # The status of a single pose is not returned.
    pose = poses[0]
    for text, ask in (
            ("b: has no mesh, which measure='exact' needs",
             lambda: ist.penetration(cube, bare, pose, measure="exact")),
            ("a: has no mesh", lambda: ist.penetration(bare, cube, pose, measure="exact")),
            ("a: a Shape has no mesh",
             lambda: ist.penetration(ist.BallShape(1), cube, pose, measure="exact")),
            ("b: is a mesh alone", lambda: ist.penetration(bolt, nut, pose)),
            ("b: is a mesh alone", lambda: ist.contact_patches(cube, nut, pose)),
            ("a: is a mesh alone", lambda: ist.separation(nut, cube, pose, inner_spheres=True))):
        with pytest.raises(ist.Error, match=text):
            ask()


def test_rays_and_points(cube):
    low, high = cube.bounds().lower, cube.bounds().upper
    middle, half = (low + high) / 2, (high - low) / 2
    origins = middle + np.array([[-2, 0, 0], [0, 3, 0], [0, 0, 0]]) * half
    directions = np.array([[5, 0, 0], [0, -1, 0], [0, 0, 1]])
    hits = ist.raycast(cube, None, origins, directions)
    assert hits.distance == pytest.approx([half[0], 2 * half[1], half[2]], rel=1e-6)
    assert hits.normal == pytest.approx(np.array([[-1, 0, 0], [0, 1, 0], [0, 0, 1]]))
    assert ist.raycast(cube, None, origins[0], [-1, 0, 0]).distance == np.inf
    assert ist.raycast(cube, None, origins[0], [1, 0, 0], max_distance=0.5 * half[0]).distance == np.inf
    feet = ist.closest_point(cube, None, origins)
    assert feet.distance == pytest.approx([half[0], 2 * half[1], -half.min()], rel=1e-6)
    assert (ist.contains(cube, None, origins) == [0, 0, 1]).all()
    pose = [1, 0, 0, 0, 1, 2, 3]
    moved = ist.closest_point(cube, pose, origins[0] * 2 + [1, 2, 3], scale=2)
    assert moved.distance == pytest.approx(2 * half[0], rel=1e-6)
    ball = ist.BallShape(2)
    assert ist.raycast(ball, None, [0, 0, 5], [0, 0, -1]).distance == pytest.approx(3)
    assert ist.closest_point(ball, None, [0, 0, 5]).distance == pytest.approx(3)
    assert ist.contains(ball, None, [[0, 0, 1], [np.nan, 0, 0]]).tolist() == [1, 2]
    with pytest.raises(ValueError, match="origins, directions, max_distance: not finite, of length 0"):
        ist.raycast(cube, None, origins[0], [0, 0, 0])
    assert (ist.raycast(cube, None, origins, [0, 0, 0]).status == ist.QueryStatus.invalid_input).all()
    with pytest.raises(ValueError, match="origins: shape"):
        ist.raycast(cube, None, [1, 2], [1, 0, 0])
    bare = ist.bake(ist.sample_mesh("cube"), max_spheres=20, keep_mesh=False)
    with pytest.raises(ist.Error, match="has no mesh"):
        ist.contains(bare, None, middle)


def test_outlines_are_closed_curves(thread, cube):
    bolt, nut = thread
    pose = [1, 0, 0, 0, 0, 0, 8.5]
    found = ist.overlap_outline(bolt, nut, pose, max_patches=16)
    assert found.segments.shape == (len(found.patch), 2, 3) and len(found.patch) > 1024
    whole, count = found.contact.penetration, found.contact.count
    assert whole.volume == ist.penetration(bolt, nut, pose, measure="exact").volume
    patches = ist.contact_patches(bolt, nut, pose, max_patches=16, measure="exact")  # divided
    assert patches.volume.sum() == pytest.approx(whole.volume, rel=1e-12) and patches.count > count > 0
    again = np.cross(patches.point - pose[4:], patches.force) + patches.torsion[:, None] * patches.normal
    assert again == pytest.approx(patches.torque, abs=1e-11)
    for patch in range(count):  # one segment begins where another ends
        begin, end = np.moveaxis(found.segments[found.patch == patch], 1, 0)
        assert len(begin) > 2
        assert np.array_equal(begin[np.lexsort(begin.T)], end[np.lexsort(end.T)])
        force = 0.5 * np.cross(begin - pose[4:], end - pose[4:]).sum(axis=0)  # Stokes
        assert force == pytest.approx(found.contact.force[patch], abs=1e-11)
    assert found.patch.max() == count - 1
    moved = ist.overlap_outline(bolt, nut, [1, 0, 0, 0, 7, 0, 8.5], poses_a=[1, 0, 0, 0, 7, 0, 0])
    assert moved.segments - [7, 0, 0] == pytest.approx(found.segments, abs=1e-12)
    alone = ist.overlap_outline(bolt, nut, pose, max_patches=0)
    assert np.array_equal(alone.segments, found.segments) and not alone.patch.any()
    apart = ist.overlap_outline(bolt, nut, AWAY)
    assert apart.segments.shape == (0, 2, 3) and apart.contact.count == 0
    stopped = ist.overlap_outline(bolt, nut, pose, max_visits=1)
    assert stopped.contact.penetration.status == ist.QueryStatus.budget_exhausted
    assert len(stopped.segments) == 0
    with pytest.raises(ValueError, match="poses: qw is nan"):
        ist.overlap_outline(bolt, nut, [np.nan, 0, 0, 0, 0, 0, 0])

    bare = ist.bake(ist.close_mesh(ist.sample_mesh("cube"), name="bare"), max_spheres=50,
                    keep_mesh=False, device="cpu")
    for text, a, b in (("b: has no mesh", cube, bare), ("a: has no mesh", bare, cube),
                       ("a: a Shape has no mesh", ist.BallShape(1), cube)):
        with pytest.raises(ist.Error, match=text):
            ist.overlap_outline(a, b, IDENTITY)
    with pytest.raises(ValueError, match="poses: 2 rows; an outline is that of one pose"):
        ist.overlap_outline(bolt, nut, [pose, pose])


def test_impacts_come_in_time(cube):
    side = cube.bounds().upper[0] - cube.bounds().lower[0]
    wall = ist.HalfSpaceShape(normal=(1, 0, 0), offset=0)  # x ≤ 0
    start = np.tile([1, 0, 0, 0, 10 * side, 0, 0], (3, 1))
    end = start.copy()
    end[:, 4] = [-10 * side, 5 * side, np.nan]
    found = ist.time_of_impact(wall, cube, start, end, duration=2)
    assert found.kind.tolist() == [ist.ImpactKind.impact, ist.ImpactKind.no_impact,
                                   ist.ImpactKind.no_impact]
    assert found.status.tolist() == [0, 0, ist.QueryStatus.invalid_input]
    lower = cube.bounds().lower[0]
    assert found.time[0] == pytest.approx((10 * side + lower) / (10 * side), rel=1e-2)
    assert found.normal[0] == pytest.approx([1, 0, 0], abs=1e-6)
    assert ist.time_of_impact(wall, cube, start[0], end[0]).time < 1


def test_limits_are_taken(gear, knot, random_poses):
    poses = random_poses(20, 1)
    whole = ist.penetration(gear, knot, poses)
    few = ist.penetration(gear, knot, poses, max_visits=20)
    assert (few.status == ist.QueryStatus.budget_exhausted).any()
    assert (few.volume_min <= whole.volume_max).all() and (few.volume_max >= whole.volume_min).all()
    inner = ist.penetration(gear, knot, poses, measure="inner")
    assert inner.volume.sum() < whole.volume.sum()


def test_a_field_may_be_either_solid(gear):
    ball, pose = ist.BallShape(5.0), np.array([0.9, 0.1, 0.2, -0.1, 0.3, 0.2, 0.5])
    first = ist.penetration(ball, gear, IDENTITY, poses_a=pose)
    second = ist.penetration(gear, ball, pose, poses_a=IDENTITY)
    assert first.volume == second.volume > 0
    assert np.allclose(first.pose_gradient_a, second.pose_gradient, rtol=1e-12, atol=1e-15)
    assert np.allclose(first.force, -second.force, rtol=0, atol=0)
    with pytest.raises(TypeError, match="two shapes"):
        ist.penetration(ball, ball, pose)


def test_constructors_name_the_argument():
    for make, text in ((lambda: ist.BoxShape(half=[1, 1, 1]),
                        "BoxShape(): there is no argument 'half'; it takes half_extents"),
                       (lambda: ist.BallShape("x"), "radius: a str; wanted a number"),
                       (lambda: ist.BallShape(1, 2), "BallShape(): 2 arguments without a name"),
                       (lambda: ist.HeightFieldShape([[1, 0], [0, 0]], [1, 1]), "all others by name"),
                       (lambda: ist.DistanceGridShape([[[0, 0], [0, 0]]] * 2, spacing=1),
                        "the argument 'origin' is missing"),
                       (lambda: ist.Mesh([]), "Mesh(): the argument 'triangles' is missing")):
        with pytest.raises(TypeError, match=re.escape(text)):
            make()
    for make in (lambda: ist.HalfSpaceShape([0, 0, 0]), lambda: ist.BoxShape([-1, 1, 1]),
                 lambda: ist.HeightFieldShape([[1.0]]), lambda: ist.HeightFieldShape([[1, float("nan")]] * 2)):
        with pytest.raises(ValueError):
            make()


def test_a_scene_asks_what_pairs_are_asked(gear, knot):
    rng = np.random.default_rng(5)
    side = 3 * (gear.bounds().upper - gear.bounds().lower).max()
    poses = np.hstack([rng.normal(size=(12, 4)), rng.uniform(0, side, (12, 3))])
    poses[3] = poses[2]  # copies in place
    solids = [gear if i % 2 == 0 else knot for i in range(12)]
    scene = ist.Scene(max_bodies=20, threads=2)
    scene.set_rule(measure="exact", margin=0.1 * side)
    for solid, pose in zip(solids, poses):
        scene.add(solid, pose)
    floor = scene.add(ist.HalfSpaceShape(offset=-side), number=40, moves=False, layers=2, meets=0)
    assert floor == 40 and len(scene) == 13
    step = scene.step()
    assert len(step) > 3 and step.begins.all() and step.refused.size == 0
    told = {tuple(pair) for pair in step.pairs}
    for i in range(12):
        for j in range(i + 1, 12):
            alone = ist.penetration(solids[i], solids[j], poses[j], poses_a=poses[i], measure="exact")
            gap = ist.separation(solids[i], solids[j], poses[j], poses_a=poses[i], max_distance=0.1 * side)
            meet = alone.volume > 0 or alone.touching or gap.distance_min < 0.1 * side
            assert ((i, j) in told) == meet
            if meet:
                row = step.pairs.tolist().index([i, j])
                assert step.penetration.volume[row] == alone.volume
                assert np.array_equal(step.penetration.torque[row], alone.torque)
                if alone.volume == 0:
                    assert step.separation.distance[row] == gap.distance
    poses[:, 4] += 10 * side * np.arange(12)
    with pytest.raises(ValueError, match="poses: 11 rows; wanted 12"):
        scene.step(poses[:11])
    apart = scene.step(poses)
    assert len(apart) == 0 and {tuple(pair) for pair in apart.ended} == told
    poses[0] = np.nan
    assert list(scene.step(poses[:1], numbers=[0]).refused) == [0]
    scene.remove(0)
    assert scene.step().refused.size == 0 and len(scene) == 12


def test_a_recorded_scene_is_asked_again_to_the_same_bits(gear, knot):
    scene = ist.Scene(threads=1)
    scene.set_rule(measure="exact")
    size = (gear.bounds().upper - gear.bounds().lower).max()
    for i, solid in enumerate((gear, knot, gear)):
        scene.add(solid, [1, 0.1 * i, 0, 0, 0.4 * i * size, 0, 0], number=10 - i)
    scene.add(ist.HalfSpaceShape(), moves=False, group=1)
    scene.step()
    scene.step([[1, 0, 0.2, 0, 0.3 * size, 0, 0]], numbers=[9])
    record = scene.record()
    again = ist.Scene.replay(record, [knot, gear], threads=2)
    assert len(again) == 4 and again.record() == record
    first, second = scene.step(), again.step()
    assert np.array_equal(first.pairs, second.pairs) and len(first) > 0
    assert np.array_equal(first.begins, second.begins)
    assert first.penetration.volume.tobytes() == second.penetration.volume.tobytes()
    with pytest.raises(ist.Error, match="content hash .* is not among those given"):
        ist.Scene.replay(record, [gear])
    with pytest.raises(ist.Error, match="its content was changed"):
        ist.Scene.replay(record[:-1], [gear, knot])


def test_mistakes_of_scenes_are_told(gear):
    scene = ist.Scene(max_bodies=4, max_pairs=1)
    scene.set_rule(answer="boxes")
    for _ in range(3):
        scene.add(gear, IDENTITY)
    with pytest.raises(ist.Error, match="make the Scene with a larger max_pairs"):
        scene.step()
    for call, words in ((lambda: scene.remove(9), "there is no body 9"),
                        (lambda: scene.step([IDENTITY], numbers=[9]), "there is no body 9"),
                        (lambda: scene.step(numbers=[1]), "without poses"),
                        (lambda: scene.set_rule(answer="all"), "one of 'nothing', 'boxes'"),
                        (lambda: scene.set_rule(margin=-1), "margin")):
        with pytest.raises(ValueError, match=words):
            call()
    with pytest.raises(ist.Error, match="body 1 is in the scene already"):
        scene.add(gear, IDENTITY, number=1)
    with pytest.raises(ist.Error, match="group 8 is not below 8"):
        scene.add(gear, IDENTITY, group=8)


def test_a_scene_tells_impacts_as_time_of_impact_does(gear, knot):
    side = (gear.bounds().upper - gear.bounds().lower).max()
    scene = ist.Scene(threads=1)
    scene.set_rule(answer="impact", duration=2.0)
    poses = np.array([[1, 0, 0, 0, 0, 0, 0], [1, 0.2, 0, 0, 4 * side, 0, 0], [1, 0, 0, 0, 0, 9 * side, 0]])
    for solid, pose in zip((gear, knot, gear), poses):
        scene.add(solid, pose)
    velocities = np.zeros((3, 6))
    velocities[1] = [-2 * side, 0, 0, 0.1, 0.2, 0.3]
    scene.set_motions(velocities)
    step = scene.step()
    assert step.pairs.tolist() == [[0, 1]]
    end = ist.time_of_impact(gear, knot, poses[1], poses[1], poses_a=poses[0], duration=2.0)
    assert end.kind == ist.ImpactKind.no_impact
    assert step.impact.kind[0] == ist.ImpactKind.impact and 0.5 < step.impact.time[0] < 2
    # At that time the bodies are as near as reported.
    moved = poses[1].copy()
    angle = velocities[1, 3:] * step.impact.time[0]
    half = np.linalg.norm(angle) / 2
    turn = np.r_[np.cos(half), np.sin(half) * angle / np.linalg.norm(angle)]
    q = poses[1][:4] / np.linalg.norm(poses[1][:4])
    moved[0] = turn[0] * q[0] - turn[1:] @ q[1:]
    moved[1:4] = turn[0] * q[1:] + q[0] * turn[1:] + np.cross(turn[1:], q[1:])
    moved[4:] += velocities[1, :3] * step.impact.time[0]
    gap = ist.separation(gear, knot, moved)
    assert 0 < gap.distance <= step.impact.distance_max[0] * (1 + 1e-6)
    scene.set_motions(-velocities[1:2], numbers=[1], about=[0, 0, 0])
    assert len(scene.step()) == 0
    with pytest.raises(ValueError, match=r"velocities: shape \(3,\); wanted \(n, 6\)"):
        scene.set_motions([1, 2, 3])
    with pytest.raises(ValueError, match="about: 2 rows; velocities have 3"):
        scene.set_motions(velocities, about=np.zeros((2, 3)))
    with pytest.raises(ist.Error, match="duration"):
        scene.set_rule(answer="impact", duration=0)


def test_a_scene_finds_bodies_by_rays_points_and_boxes(gear):
    side = (gear.bounds().upper - gear.bounds().lower).max()
    poses = [[1, 0, 0, 0, 3 * side * i, 0, 0] for i in range(4)]
    scene = ist.Scene()
    for i, pose in enumerate(poses):
        scene.add(gear, pose, number=10 + i)
    points = np.array([[0.1 * side, 0.3 * side, 0], [5.5 * side, 0, 0], [20 * side, 0, 0]])
    found = scene.nearest(points, max_distance=4 * side)
    assert found.number.tolist() == [10, 12, 0]
    for k, body in enumerate([0, 2]):
        alone = ist.closest_point(gear, poses[body], points[k])
        assert found.surface.distance[k] == alone.distance
        assert np.array_equal(found.surface.point[k], alone.point)
    assert found.surface.distance[2] == np.inf
    one = scene.nearest(points[1])
    assert one.number == 12 and one.surface.point.shape == (3,)
    rays = scene.raycast([-9 * side, 0.31 * side, 0.013], [[1, 0, 0], [0, 0, 1]])
    assert rays.number[0] == 10 and rays.hit.distance[1] == np.inf
    assert scene.in_box([2 * side, -side, -side], [7 * side, side, side]).tolist() == [11, 12]
    with pytest.raises(ValueError, match="lower is above upper"):
        scene.in_box([7 * side, -side, -side], [2 * side, side, side])
    with pytest.raises(ValueError, match="points: shape"):
        scene.nearest([1, 2])
