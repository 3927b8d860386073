"""Queries of ist.Solids: the same call on the CPU and on a GPU.

Without a card, and without the emulated one of test_emulated_gpu.py, the latter is skipped.
"""
import pickle

import numpy as np
import pytest

import ist

IDENTITY = [1.0, 0, 0, 0, 0, 0, 0]


def ask(solids, *, a, b, poses, query=ist.penetration, **arguments):
    """The query of solids[a] and solids[b], as both devices take it."""
    if query is not ist.separation:
        arguments.setdefault("spheres_only", True)
    return query(solids[a], solids[b], poses, **arguments)


@pytest.fixture(params=["cpu", "cuda"])
def device(request):
    if request.param == "cuda" and not ist.gpu.available():
        pytest.skip(ist.gpu.why_not())
    return request.param


@pytest.fixture
def there(device):
    """there(array) → the array where the device reads it."""
    if device == "cpu":
        return lambda array: array
    if "emulated" in ist.__file__:
        from test_emulated_gpu import OnDevice
        return lambda array: OnDevice(array.copy())
    torch = pytest.importorskip("torch", reason="no PyTorch")
    return lambda array: torch.from_numpy(array.copy()).cuda()


def back(column):
    return column if isinstance(column, np.ndarray) else column.numpy()


@pytest.fixture
def arguments(random_poses):
    random = np.random.default_rng(3)
    return dict(
        a=random.integers(0, 3, 60).astype(np.int32), b=random.integers(0, 3, 60).astype(np.int32),
        poses_a=random_poses(60, 0.8), poses=random_poses(120, 1.6)[60:].copy(),
        scales_a=random.uniform(0.5, 2, 60), scales=random.uniform(0.5, 2, 60))


def alone(solids, arguments, i, query, **settings):
    """Row i by itself, on the CPU."""
    return ask(solids, query=query, **{name: x[i] for name, x in arguments.items()}, **settings)


@pytest.mark.parametrize("query, settings, columns", [
    (ist.penetration, {}, dict(volume=3, centroid=1, force=2, torque=3)),
    (ist.penetration, dict(measure="inner"), dict(volume=3, centroid=1, force=2, torque=3)),
    (ist.penetration, dict(pair_budget=60), dict(volume=3, centroid=1, force=2, torque=3)),
    (ist.separation, {}, dict(distance=1, distance_min=1, distance_max=1)),
    (ist.contact_patches, dict(max_patches=4),
     dict(count=0, id=0, volume=3, area=2, depth=1, centroid=1, normal=0, force=2, torque=3, point=1, torsion=3)),
])
def test_rows_are_their_pairs(device, there, solids, arguments, query, settings, columns):
    if query is ist.separation:
        arguments["poses"][:, 4:] *= 4
    found = ask(ist.Solids(solids, device=device), query=query, **settings,
                **{name: there(x) for name, x in arguments.items()})
    met = 0
    for i in range(60):
        one = alone(solids, arguments, i, query, **settings)
        met += np.any(getattr(one, next(iter(columns))) > 0)
        for name, power in columns.items():
            ours, theirs = back(getattr(found, name))[i], getattr(one, name)
            if device == "cpu":
                assert np.array_equal(ours, theirs), name
                continue
            size = max(1.0, np.abs(theirs).max()) if power > 1 else 2.0
            if name in ("point", "normal", "torsion"):  # of contacts whose forces do not cancel
                ours, theirs = (x[one.area > 0.1 * one.volume ** (2 / 3)] for x in (ours, theirs))
            assert np.abs(np.subtract(ours, theirs, dtype=float)).max(initial=0) <= 1e-4 * size, name
    assert met > 20 and (back(found.status) == 0).all()


def test_points_and_normals_give_the_distance(device, there, solids, arguments):
    arguments["poses"][:, 4:] *= 4
    found = ask(ist.Solids(solids, device=device), query=ist.separation,
                **{name: there(x) for name, x in arguments.items()})
    gap = back(found.distance)[:, None] * back(found.normal)
    assert back(found.point_b) - back(found.point_a) == pytest.approx(gap, abs=1e-6)


def test_one_index_serves_all_rows(device, there, solids, arguments):
    held = ist.Solids(solids, device=device)
    poses = arguments["poses"]
    whole = dict(a=np.full(60, 1, np.int32), b=np.full(60, 2, np.int32), poses=poses,
                 poses_a=np.tile(IDENTITY, (60, 1)), scales=np.ones(60), scales_a=np.ones(60))
    few = back(ask(held, a=1, b=2, poses=there(poses)).volume)
    assert few.max() > 0
    assert np.array_equal(few, back(ask(held, **{n: there(x) for n, x in whole.items()}).volume))
    assert back(ask(held, a=1, b=2, poses=there(np.zeros((0, 7)))).force).shape == (0, 3)


def test_a_row_spoils_only_itself(device, there, solids, arguments):
    held = ist.Solids([*solids, ist.BallShape(1.0), ist.HalfSpaceShape()], device=device)
    arguments["poses"][3, 5] = np.nan
    arguments["scales_a"][7] = -1
    arguments["a"][11], arguments["b"][11] = 3, 4
    found = ask(held, **{n: there(x) for n, x in arguments.items()})
    status = back(found.status)
    assert status[[3, 7, 11]].tolist() == [2, 2, 3] and (np.delete(status, [3, 7, 11]) == 0).all()
    assert np.isnan(back(found.volume)).nonzero()[0].tolist() == [3, 7, 11]
    assert np.isnan(back(found.torque)).all(axis=1).nonzero()[0].tolist() == [3, 7, 11]


def test_solids_say_what_they_are(device, solids):
    held = ist.Solids([*solids, ist.BallShape(1.0)], device=device)
    assert len(held) == 4 and held.shapes == [3] and held.device == dict(cpu="cpu", cuda="cuda:0")[device]
    assert (held.bytes > 0) == (device == "cuda")
    assert repr(held) == f"<ist.Solids of 4 on {held.device}>"
    assert len(list(held)) == 4
    for index in (4, -1):
        with pytest.raises(IndexError, match=r"solids\[-?\d\]: there are 4 solids"):
            held[index]


def test_what_a_device_does_not_take_is_named(device, there, solids, arguments):
    held = ist.Solids(solids, device=device)
    poses = there(arguments["poses"])
    if device == "cpu":
        wrong = [(ist.penetration, dict(out={}), "out: for solids on a GPU only"),
                 (ist.separation, dict(wanted=["distance"]), "wanted: for solids on a GPU only"),
                 (ist.contact_patches, dict(stream=1), "stream: for solids on a GPU only")]
    else:
        wrong = [(ist.contact_patches, dict(measure="nearest"),
                  "measure: 'nearest'; one of 'matched', 'inner', 'exact'"),
                 (ist.penetration, dict(max_visits=9), "max_visits: not on a GPU"),
                 (ist.penetration, dict(relative_error=0.1), "relative_error: not on a GPU"),
                 (ist.penetration, dict(scale_gradients=True), "scale_gradients: not on a GPU"),
                 (ist.contact_patches, dict(pair_budget=9), "pair_budget: not on a GPU"),
                 (ist.contact_patches, dict(max_patches=0), "max_patches: 0; wanted 1 to 32 on a GPU"),
                 (ist.separation, dict(pair_id=1), "pair_id: not on a GPU"),
                 (ist.separation, dict(inner_spheres=True), "inner_spheres: not on a GPU")]
    for query, settings, text in wrong:
        with pytest.raises(ValueError, match=text):
            ask(held, a=0, b=1, poses=poses, query=query, **settings)


def test_the_defaults_work_on_both(device, there, solids, arguments):
    """On a GPU they mean lenses."""
    held = ist.Solids(solids, device=device)
    for query, meant, name in [(ist.penetration, dict(spheres_only=True), "volume"),
                               (ist.contact_patches, dict(spheres_only=True), "volume")]:
        found, same = (back(getattr(query(held[0], held[1], there(arguments["poses"]), **settings), name))
                       for settings in ({}, meant))
        assert found.shape == ((60, 8) if query is ist.contact_patches else (60,))
        assert device == "cpu" or np.array_equal(found, same)


def test_both_solids_are_on_one_device(solids, arguments):
    if not ist.gpu.available():
        pytest.skip(ist.gpu.why_not())
    there, other, here = (ist.Solids(solids, device=d) for d in ("cuda", "cuda", "cpu"))
    for b in (other[0], here[0], solids[0]):
        with pytest.raises(TypeError, match="a, b: one is on cuda:0; wanted both of the same ist.Solids"):
            ist.penetration(there[0], b, arguments["poses"])
    for query in (lambda: ist.overlap(there[0], there[1], arguments["poses"]),
                  lambda: ist.time_of_impact(there[0], there[1], arguments["poses"], arguments["poses"])):
        with pytest.raises(TypeError, match="a: on cuda:0; this query is for the CPU alone"):
            query()


def test_every_query_takes_unlike_rows(solids, arguments):
    """Those of the CPU alone, and shapes."""
    held = ist.Solids([*solids, ist.HalfSpaceShape()])
    arguments["a"][:6] = 3
    a, b, poses = (arguments.pop(name) for name in ("a", "b", "poses"))
    poses_to = poses[::-1]
    by = dict(poses_a=arguments["poses_a"], scales=arguments["scales"], scales_a=arguments["scales_a"])
    meet = ist.overlap(held[a], held[b], poses, **by)
    times = ist.time_of_impact(held[a], held[b], poses, poses_to, **by)
    whole = ist.penetration(held[a], held[b], poses, spheres_only=True, scale_gradients=True, **by)
    assert {0, 1} <= set(meet.tolist()) and len(set(times.kind.tolist())) > 1
    everything = [*solids, ist.HalfSpaceShape()]
    for i in range(60):
        one = {name: x[i] for name, x in by.items()}
        pair = everything[a[i]], everything[b[i]], poses[i]
        assert ist.overlap(*pair, **one) == meet[i]
        assert ist.time_of_impact(*pair, poses_to[i], **one).time == times.time[i]
        single = ist.penetration(*pair, spheres_only=True, scale_gradients=True, **one)
        for name in ("volume", "pose_gradient", "pose_gradient_a", "scale_gradient_a"):
            assert np.array_equal(getattr(single, name), getattr(whole, name)[i]), name


@pytest.mark.parametrize("wrong, error, text", [
    (dict(a=[0, 3]), ValueError, "a: row 1 is solid 3; there are 3 solids"),
    (dict(b=[-1, 0]), ValueError, "b: row 0 is solid -1; there are 3 solids"),
    (dict(a=[0.0, 1.0]), TypeError, "a: dtype float64; wanted int64"),
    (dict(a=[[0, 1]]), ValueError, r"a: shape \(1, 2\); wanted \(n,\) indices of solids"),
    (dict(a=[0, 1, 2]), ValueError, "poses: 2 rows; the arguments before it have 3"),
])
def test_wrong_rows_are_named(solids, wrong, error, text):
    with pytest.raises(error, match=text):
        ask(ist.Solids(solids), **{**dict(a=0, b=1, poses=[IDENTITY] * 2), **wrong})


def test_slices_and_empty_lists_are_rows(solids):
    held, poses = ist.Solids(solids), np.tile(IDENTITY, (2, 1)).astype(float)
    by_slice = ask(held, a=slice(1, None), b=slice(0, 2), poses=poses).volume
    assert np.array_equal(by_slice, ask(held, a=[1, 2], b=[0, 1], poses=poses).volume)
    assert len(ask(held, a=[], b=slice(0, 0), poses=poses[:0])) == 0


def test_wrong_solids_are_named(solids):
    with pytest.raises(TypeError, match="a: an ist.Solids; wanted solids"):
        ist.penetration(ist.Solids(solids), solids[0], IDENTITY)
    for device in ("gpu", "cuda:x", "cuda:", 0):
        with pytest.raises(ValueError, match=f"device: '{device}'; one of 'cpu', 'cuda'"):
            ist.Solids(solids, device=device)
    with pytest.raises(TypeError, match=r"solids\[1\]: a int; wanted an Asset or a Shape"):
        ist.Solids([solids[0], 3])


def test_assets_that_no_cache_holds_are_asked_in_order(knot, random_poses):
    """They are sorted; the answers are not."""
    copies = [ist.Asset.from_bytes(knot.to_bytes())
              for _ in range(1 + (32 << 20) // len(knot.to_bytes()))]
    a, b = np.random.default_rng(1).integers(0, len(copies), (2, 60))
    poses_a, poses = random_poses(60, 1), random_poses(60, 1)
    held = ist.Solids(copies)
    found = ist.penetration(held[a], held[b], poses, poses_a=poses_a).volume
    for i in range(60):
        one = ist.penetration(copies[a[i]], copies[b[i]], poses[i], poses_a=poses_a[i])
        assert one.volume == found[i]
    assert (found > 0).any()


def rows_of_answers(cube):
    poses = np.tile([1.0, 0, 0, 0, 0, 0, 0], (5, 1))
    poses[:, 4] = [0, .3, .9, 1.5, np.nan]
    yield ist.penetration(cube, cube, poses, measure="exact", scale_gradients=True)
    yield ist.penetration(cube, cube, poses)
    yield ist.separation(cube, cube, poses)
    yield ist.contact_patches(cube, cube, poses, max_patches=3)
    yield ist.raycast(cube, None, poses[:, 4:] * [5, 0, 0], poses[:, 4:] + [1, 0, 0])
    yield ist.closest_point(cube, None, poses[:, 4:])


def test_answers_are_counted_and_indexed(cube):
    for answer in rows_of_answers(cube):
        assert len(answer) == 5 and answer
        for index in (slice(1, 3), [4, 0], np.arange(5) % 2 == 0, slice(0, 0)):
            some = answer[index]
            assert type(some) is type(answer) and len(some) == len(np.arange(5)[index]) and some
            assert np.array_equal(some.status, answer.status[index])
        one = answer[-2]
        assert one.status == answer.status[3] and repr(one).startswith(f"ist.{type(one).__name__}(")
        assert [a.status for a in answer] == answer.status.tolist()
        with pytest.raises(IndexError):
            answer[5]
        with pytest.raises(TypeError, match="of one pose"):
            len(one)
    patches = ist.contact_patches(cube, cube, [[1, 0, 0, 0, .3, 0, 0], [1, 0, 0, 0, .9, 0, 0]])
    assert patches[1].penetration.volume == patches.penetration.volume[1]
    assert np.array_equal(patches[1].point, patches.point[1])


def test_solids_and_their_rows_pickle(cube):
    solids = ist.Solids([cube, ist.BallShape(.3)])
    first, second = pickle.loads(pickle.dumps((solids[0], solids[np.array([1, 0])])))
    poses = np.tile([1.0, 0, 0, 0, .4, 0, 0], (2, 1))
    found = ist.penetration(first, second, poses)
    assert np.array_equal(found.volume, ist.penetration(solids[0], solids[np.array([1, 0])], poses).volume)
    assert len(pickle.loads(pickle.dumps(solids))) == 2


def test_meshes_and_reports_show_what_they_are():
    mesh = ist.sample_mesh("cube")
    closed = ist.close_mesh(mesh, name="die")
    assert repr(mesh) == "<ist.Mesh of 8 vertices, 12 triangles>"
    assert repr(closed) == "<ist.ClosedMesh 'die' of 8 vertices, 12 triangles>"
    assert repr(closed.report).startswith("ist.MeshReport(vertices=8, triangles=12, components=1")
    asset = ist.bake_mesh_only(closed)
    assert "volume=1" in repr(asset.mass_properties()) and "radius=" in repr(asset.bounds())
    with pytest.raises(TypeError, match=r"poses: a Asset; several solids are a list: plot\(\[a, b\]\)"):
        ist.plot(asset, asset)
