"""Solids on a device that is host memory (emulated_device.cpp): who waits, holds and frees.

What a batch was lent is spoiled as soon as it is given back, and work of a stream is done when
somebody waits for it. On a card: test_on_gpu.py.
"""
import ctypes
import gc

import numpy as np
import pytest

import ist
from test_rows import ask as batch
from test_gpu import CUDA, DELETER, Interface, Managed, Tensor, Versioned, new_capsule

FLOATS, UINTS = 2, 1
lent = {}  # whatever some batch still holds


def on_card(array, card):
    """A copy in the memory of a card beyond the first (emulated_device.cpp)."""
    if card == 0:
        return array
    libc = ctypes.CDLL(None, use_errno=True)
    libc.mmap.restype = ctypes.c_void_p
    size = max(array.nbytes, 1)
    for place in range(0x300 + card << 36, 0x301 + card << 36, 1 << 24):
        private_anonymous_no_replace = 0x100022
        at = libc.mmap(ctypes.c_void_p(place), ctypes.c_size_t(size), 3, private_anonymous_no_replace, -1, 0)
        if at == place:
            memory = (ctypes.c_char * size).from_address(at)
            copy = np.frombuffer(memory, array.dtype, array.size).reshape(array.shape)
            copy[...] = array
            return copy
    raise MemoryError


class OnDevice:
    """An array that says that it is a device's."""

    def __init__(self, array, *, flags=0, kept=False, card=0):
        self.array = on_card(np.ascontiguousarray(array), card)
        self.device = CUDA[0], card
        self.flags = flags
        self.kept = kept
        self.streams = []

    def __dlpack_device__(self):
        return self.device

    def __dlpack__(self, *, stream, max_version):
        self.streams.append(stream)
        array = self.array
        shape = (ctypes.c_int64 * array.ndim)(*array.shape)
        code = dict(f=2, u=1, i=0)[array.dtype.kind]

        def give_back(_):
            del lent[ctypes.addressof(managed)]
            if not self.kept:
                array.view(np.uint8)[...] = 0xDD

        tensor = Tensor(array.ctypes.data, *self.device, array.ndim, code, 8 * array.itemsize, 1, shape, None, 0)
        managed = Versioned(1, 0, None, DELETER(give_back), self.flags, tensor)
        lent[ctypes.addressof(managed)] = managed, shape, array
        return new_capsule(ctypes.addressof(managed), b"dltensor_versioned", None)


@pytest.fixture
def arguments(random_poses):
    random = np.random.default_rng(3)
    return dict(
        a=random.integers(0, 3, 40).astype(np.uint32),
        b=random.integers(0, 3, 40).astype(np.int32),
        poses_a=random_poses(40, 0.8), poses=random_poses(80, 0.8)[40:].copy(),
        scales_a=random.uniform(0.5, 2, 40), scales=random.uniform(0.5, 2, 40))


def ask(assets, arguments, **settings):
    return batch(assets, **{n: OnDevice(x.copy()) for n, x in arguments.items()}, **settings)


def expected_of(solids, arguments, **settings):
    found = [ist.penetration(solids[a], solids[b], [pose_b], poses_a=pose_a, scales=scale_b,
                             scales_a=scale_a, spheres_only=True, **settings)
             for a, b, pose_a, pose_b, scale_a, scale_b in zip(*arguments.values())]
    return dict(volume=np.concatenate([f.volume for f in found]),
                centroid=np.concatenate([f.centroid for f in found]),
                force=np.concatenate([f.force for f in found]),
                torque=np.concatenate([f.torque for f in found]),
                status=np.concatenate([f.status for f in found]))


def expect_close(found, expected):
    size = np.nanmax(expected["volume"]) ** (1 / 3)
    for name, column in expected.items():
        ours = getattr(found, name).numpy()
        assert ours.shape == column.shape
        power = dict(volume=3, centroid=1, force=2, torque=3, status=0)[name]
        assert (np.isnan(ours.astype(float)) == np.isnan(column.astype(float))).all(), name
        assert np.nanmax(np.abs(ours.astype(float) - column)) <= 1e-5 * size**power, name


@pytest.mark.parametrize("measure", ["matched", "inner"])
def test_answers_are_those_of_the_cpu(solids, arguments, measure):
    arguments["poses"][3, 5] = np.nan
    expected = expected_of(solids, arguments, measure=measure)
    assert (expected["volume"] > 0).sum() > 10 and expected["status"][3] == 2
    found = ask(ist.Solids(solids, device="cuda"), arguments, measure=measure)
    expect_close(found, expected)
    assert found.node_visits is None and found.volume.dtype == np.float64
    assert found.volume.shape == (40,) and found.centroid.shape == (40, 3) and len(found.status) == 40


def test_the_exact_measure_is_that_of_the_cpu(random_poses):
    mesh = ist.sample_mesh("cube")
    cube, edge = ist.bake_mesh_only(mesh), np.ptp(mesh.vertices[:, 0])
    poses = np.concatenate([random_poses(40, 0.5), [[1, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 1, 0, 0]]])
    poses[:, 4:] *= edge
    expected = ist.penetration(cube, cube, poses, measure="exact")
    found = batch(ist.Solids([cube], device="cuda"), a=0, b=0, poses=OnDevice(poses.copy()),
                  measure="exact")
    assert (expected.volume > 0).sum() > 20
    touching = found.touching.numpy()
    assert touching.dtype == bool and touching[-1] and np.array_equal(touching, expected.touching)
    for name in ("contact_area", "contact_normal"):
        assert np.allclose(getattr(found, name).numpy(), getattr(expected, name), rtol=1e-9, atol=0), name
    assert np.abs(found.volume.numpy() - expected.volume).max() < 1e-12 * edge**3
    assert np.abs(found.force.numpy() - expected.force).max() < 1e-12 * edge**2
    assert (found.volume_min.numpy() <= expected.volume_max).all()
    assert (found.volume_max.numpy() >= expected.volume_min).all()
    assert (found.status.numpy() == 0).all()


def test_a_pair_id_keeps_what_is_near(random_poses):
    mesh = ist.sample_mesh("cube")
    cube, edge = ist.bake_mesh_only(mesh), np.ptp(mesh.vertices[:, 0])
    solids, plain = (ist.Solids([cube], device="cuda") for _ in range(2))
    poses = random_poses(80, 0.5)
    poses[:, 4:] *= edge
    names = ("volume", "force", "torque", "status", "node_visits")
    searched = []
    for count, pair_id in [(40, 7), (40, 7), (40, 7), (40, 8), (80, 7), (80, 7), (80, 0)]:
        poses[:, 4] += 1e-9 * edge
        asked = dict(a=0, b=0, measure="exact", wanted=names)
        found, expected = (
            {n: getattr(answer, n).numpy() for n in names}
            for answer in (batch(solids, poses=OnDevice(poses[:count].copy()), pair_id=pair_id, **asked),
                           batch(plain, poses=OnDevice(poses[:count].copy()), **asked)))
        searched.append((found.pop("node_visits") != 0).mean() / (expected.pop("node_visits") != 0).mean())
        for name in expected:
            assert np.array_equal(found[name], expected[name]), name
    # Another id, more rows than before and no id begin anew.
    assert [share < 1 for share in searched] == [False, True, True, False, False, True, False], searched


def test_exact_patches_are_those_of_the_cpu(random_poses):
    mesh = ist.sample_mesh("cube")
    cube, edge = ist.bake_mesh_only(mesh), np.ptp(mesh.vertices[:, 0])
    poses = np.concatenate([random_poses(40, 0.5), [[1, 0, 0, 0, 0, 0, 0.9], [1, 0, 0, 0, 1, 0, 0]]])
    poses[:, 4:] *= edge
    expected = ist.contact_patches(cube, cube, poses, measure="exact", max_patches=6)
    found = batch(ist.Solids([cube], device="cuda"), a=0, b=0, poses=OnDevice(poses.copy()),
                  query=ist.contact_patches, measure="exact", max_patches=6)
    count = found.count.numpy()
    assert (found.status.numpy() == 0).all() and (count > 1).any()
    for i, some in enumerate(count):
        order = np.argsort(expected.id[i, :some], kind="stable")
        assert np.array_equal(found.id.numpy()[i, :some], expected.id[i, order]), i
        assert not expected.volume[i, some:].any()
        for name, power in (("volume", 3), ("force", 2), ("torque", 3), ("centroid", 1), ("point", 1)):
            ours, theirs = getattr(found, name).numpy()[i, :some], getattr(expected, name)[i, order]
            assert np.abs(ours - theirs).max(initial=0) <= 1e-9 * edge**power, (i, name)


def test_any_number_of_cards(solids, arguments):
    """docs/batch.md: rows are shared out, one Solids a card; nobody waits before all are asked."""
    expected = ask(ist.Solids(solids, device="cuda"), arguments, measure="matched")
    cards = [ist.Solids(solids, device=f"cuda:{k}") for k in range(5)]
    found = []
    for k, (card, rows) in enumerate(zip(cards, np.array_split(np.arange(40), len(cards)))):
        there = {name: OnDevice(x[rows].copy(), card=k) for name, x in arguments.items()}
        found.append(batch(card, **there, measure="matched"))
        assert card.device == f"cuda:{k}" and found[-1].volume.device == k
    for name in ("volume", "centroid", "force", "torque", "status"):
        ours = np.concatenate([getattr(part, name).numpy() for part in found])
        assert np.array_equal(ours, getattr(expected, name).numpy()), name
    with pytest.raises(TypeError, match="poses: on CUDA device 0; wanted .* on CUDA device 4"):
        ask(cards[4], arguments)


@pytest.mark.parametrize("most", [0, 0.5])
def test_distances_are_those_of_the_cpu(random_poses, most):
    mesh = ist.sample_mesh("cube")
    cube, edge = ist.bake_mesh_only(mesh), np.ptp(mesh.vertices[:, 0])
    poses = np.concatenate([random_poses(40, 3.0), [[1, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 1.5, 0, 0]]])
    poses[:, 4:] *= edge
    expected = ist.separation(cube, cube, poses, max_distance=most * edge)
    names = ["distance", "distance_min", "distance_max", "point_a", "point_b", "normal", "status"]
    found = batch(ist.Solids([cube], device="cuda"), a=0, b=0, poses=OnDevice(poses.copy()),
                  query=ist.separation, max_distance=most * edge, wanted=names)
    assert np.isinf(expected.distance_max).any() == (most > 0)
    for name in names:
        assert np.allclose(getattr(found, name).numpy(), getattr(expected, name), rtol=1e-9,
                           atol=1e-12 * edge, equal_nan=True), name
    with pytest.raises(ValueError, match="inner_spheres"):
        batch(ist.Solids([cube], device="cuda"), a=0, b=0, poses=OnDevice(poses.copy()),
              query=ist.separation, inner_spheres=True)


def test_stopped_separations_keep_their_interval(solids, arguments):
    arguments["poses"][:, 4:] *= 8
    arguments["poses"][3, 5] = np.nan
    assets = ist.Solids(solids, device="cuda")
    few = batch(assets, a=0, b=1, poses=OnDevice(arguments["poses"].copy()), query=ist.separation,
                max_visits=1, wanted=["status", "distance_min", "distance_max"])
    assert few.distance is None and (few.status.numpy() == 1).any()
    assert np.delete(few.distance_min.numpy() <= few.distance_max.numpy(), 3).all()
    with pytest.raises(ValueError, match="wanted: 'volume'; there are 'distance', 'distance_min'"):
        batch(assets, a=0, b=1, poses=OnDevice(arguments["poses"]), query=ist.separation,
              wanted=["volume"])


def test_patches_are_written_where_they_are_wanted(solids, arguments):
    arguments["poses"][3, 5] = np.nan
    assets = ist.Solids(solids, device="cuda")
    found = ask(assets, arguments, query=ist.contact_patches, max_patches=4)
    ours = {name: getattr(found, name).numpy() for name in ("count", "id", "volume", "force", "status")}
    assert ours["id"].shape == (40, 4) and ours["id"].dtype == np.uint64
    assert ours["force"].shape == (40, 4, 3) and ours["count"].max() == 4
    assert ours["status"][3] == 2 and ours["count"][3] == 0
    assert not ours["volume"][np.arange(4) >= ours["count"][:, None]].any()
    whole = ask(assets, arguments).volume.numpy()
    assert np.delete(ours["volume"].sum(1), 3) == pytest.approx(np.delete(whole, 3), rel=1e-5)
    out = dict(volume=kept(np.full((40, 2), 7.0)), id=kept(np.zeros((40, 2), np.int64)))
    again = ask(assets, arguments, query=ist.contact_patches, max_patches=2, out=out)
    assert again.volume is out["volume"] and again.count is None
    del found
    ask(assets, arguments).volume.numpy()
    assert out["volume"].array[3, 0] == 7 and (out["volume"].array[:, 0] > 0).all()
    for wrong, text in [
            (dict(max_patches=33), "max_patches: 33; wanted 1 to 32"),
            (dict(max_patches=3, out=out), r"out\['.*'\]: shape \(40, 2\); wanted .* \(n, 3\) on CUDA"),
            (dict(wanted=["distance"]), "wanted: 'distance'; there are 'count', 'id'")]:
        with pytest.raises(ValueError, match=text):
            ask(assets, arguments, query=ist.contact_patches, **wrong)


@pytest.fixture(scope="module")
def some_fields():
    heights = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 8)).astype(np.float32)
    return [ist.HalfSpaceShape(), ist.BoxShape([1, 2, 0.5]), ist.BallShape(1),
            ist.HeightFieldShape(heights, lowest=-0.5, highest=0.5), ist.CapsuleShape(0.5, 0.3)], heights


@pytest.mark.parametrize("measure", ["matched", "inner"])
def test_fields_are_those_of_the_cpu(solids, some_fields, arguments, measure):
    fields, heights = some_fields
    arguments["a"] = np.random.default_rng(4).integers(0, 5, 40).astype(np.uint32)
    arguments["poses"][3, 5] = np.nan
    expected = [ist.penetration(fields[a], solids[b], [pose_b], poses_a=pose_a, scales=scale_b,
                                scales_a=scale_a, measure=measure)
                for a, b, pose_a, pose_b, scale_a, scale_b in zip(*arguments.values())]
    there = ist.Solids([*fields, *solids], device="cuda")
    assert len(there) == 8 and there.device == "cuda:0" and there.bytes > heights.nbytes
    arguments["b"] += 5
    names = dict(a="b", poses_a="poses", scales_a="scales")
    names |= {b: a for a, b in names.items()}
    turned = {names[name]: x for name, x in arguments.items()}
    heights += 1000  # what was uploaded stays
    try:
        found, over = (ask(there, given, measure=measure) for given in (arguments, turned))
        volume = found.volume.numpy()
        assert np.array_equal(over.volume.numpy(), volume, equal_nan=True)
        assert np.array_equal(over.force.numpy(), -found.force.numpy(), equal_nan=True)
    finally:
        heights -= 1000
    theirs = np.concatenate([one.volume for one in expected])
    assert (theirs > 0).sum() > 15 and found.status.numpy()[3] == 2
    assert volume == pytest.approx(theirs, rel=1e-9, abs=1e-9, nan_ok=True)
    push = np.concatenate([one.force for one in expected])
    assert found.force.numpy() == pytest.approx(push, rel=1e-6, abs=1e-6, nan_ok=True)


def test_what_cannot_be_answered_is_not_held(solids, some_fields):
    there = ist.Solids([*some_fields[0], *solids], device="cuda")
    poses = np.tile([1.0, 0, 0, 0, 0, 0, 0], (3, 1))
    for query, held in ((ist.penetration, [0, 0, 3]), (ist.separation, [0, 3, 3]),
                        (ist.contact_patches, [0, 3, 3])):
        found = batch(there, a=OnDevice(np.array([5, 0, 1], np.uint32)),
                      b=OnDevice(np.array([6, 5, 2], np.uint32)), poses=OnDevice(poses.copy()), query=query)
        assert found.status.numpy().tolist() == held, query


def test_a_mesh_alone_has_no_spheres_to_sum(solids):
    there = ist.Solids([solids[0], ist.bake_mesh_only(ist.sample_mesh("cube"))], device="cuda")
    poses = np.array([[1.0, 0, 0, 0, 0, 0, 0]])
    for measure, status in [("matched", 3), ("exact", 0)]:
        found = batch(there, a=0, b=1, poses=OnDevice(poses.copy()), measure=measure)
        assert found.status.numpy().tolist() == [status], measure


def test_nothing_is_given_back_before_the_batch_is_done(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    expected = expected_of(solids, arguments)
    first = ask(assets, arguments, stream=5)
    assert len(lent) == 6
    second = ask(assets, {**arguments, "poses": arguments["poses"][::-1]}, stream=6)
    assert len(lent) == 12
    third = ask(assets, arguments)
    gc.collect()
    expect_close(third, expected)  # after those on other streams
    assert len(lent) == 18
    ask(assets, arguments)
    assert len(lent) == 6  # the new one's
    expect_close(first, expected)
    assert not np.array_equal(second.volume.numpy(), first.volume.numpy())
    del assets
    assert not lent


def test_assets_wait_for_their_batches(solids, arguments):
    found = ask(ist.Solids(solids, device="cuda"), arguments, stream=5)
    gc.collect()  # the assets are gone
    assert not lent
    expect_close(found, expected_of(solids, arguments))


def test_a_larger_batch_waits_for_its_room(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    few = ask(assets, arguments, stream=5)
    many = {n: np.concatenate([x] * 120) for n, x in arguments.items()}
    for name in many:
        many[name][40:] = arguments[name][0]
    many["poses"][40:, 4:] = 1e6
    found = ask(assets, many, stream=6)
    assert np.array_equal(found.volume.numpy()[:40], few.volume.numpy())


def test_what_was_asked_before_does_not_show(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    few = ask(assets, arguments).volume.numpy()
    many = {n: np.concatenate([x] * 500) for n, x in arguments.items()}
    many["poses"][40:, 4:] = 1e6
    of_many = ask(assets, many).volume.numpy()[:40]
    assert np.allclose(of_many, few, rtol=1e-6, atol=0)
    assert (of_many != few).any()  # as many are cut up otherwise
    assert np.array_equal(ask(assets, arguments).volume.numpy(), few)


def test_streams_are_passed_on(solids, arguments):
    assets = ist.Solids(solids, device="cuda")

    class Torch:
        cuda_stream = 12

    class CuPy:
        ptr = 13

    class Core:
        def __cuda_stream__(self):
            return 0, 14

    for given, handle in ((None, 1), (0, 1), (2, 2), (Torch(), 12), (CuPy(), 13), (Core(), 14)):
        poses = OnDevice(arguments["poses"].copy())
        found = batch(assets, a=0, b=1, poses=poses, stream=given)
        assert poses.streams == [handle]
        assert found.volume.numpy().shape == (40,)
    with pytest.raises(TypeError, match="stream: a str is not a stream"):
        batch(assets, a=0, b=1, poses=OnDevice(arguments["poses"]), stream="mine")


def test_arguments_may_be_left_out(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    poses = arguments["poses"]
    ones = np.ones(40)
    whole = dict(a=np.zeros(40, np.uint32), b=np.full(40, 2, np.uint32),
                 poses_a=np.tile([1.0, 0, 0, 0, 0, 0, 0], (40, 1)), poses=poses, scales_a=ones,
                 scales=ones)
    found = batch(assets, a=0, b=2, poses=OnDevice(poses.copy()))
    expected = ask(assets, whole)
    assert expected.volume.numpy().max() > 0
    assert np.array_equal(found.volume.numpy(), expected.volume.numpy())
    few = batch(assets, a=0, b=2, poses=OnDevice(poses.copy()), wanted=["node_visits"])
    assert few.volume is None and few.node_visits.numpy().max() > 0
    empty = batch(assets, a=0, b=2, poses=OnDevice(np.zeros((0, 7))))
    assert empty.volume.shape == (0,) and empty.centroid.numpy().shape == (0, 3)
    for wrong, error, text in [
            (dict(poses=None), TypeError, "poses: a NoneType is not a device array"),
            (dict(scales=OnDevice(np.ones(3))), ValueError,
             "scales: 3 rows; the arguments before it have 40"),
            (dict(a=OnDevice(np.zeros(40, np.int64))), TypeError,
             "a: dtype int64; wanted uint32 or int32"),
            (dict(wanted=["pose_gradient"]), ValueError, "wanted: 'pose_gradient'; there are 'volume'"),
            (dict(wanted="volume"), TypeError, "wanted: a str; must be a sequence"),
            (dict(measure="outer"), ValueError, "measure: 'outer'")]:
        given = dict(a=0, b=2, poses=OnDevice(poses.copy()))
        with pytest.raises(error, match=text):
            batch(assets, **{**given, **wrong})
    del assets, given
    assert not lent  # what was refused is given back too


def kept(array):
    """Memory of the caller's, which giving back does not spoil."""
    return OnDevice(array, kept=True)


def test_what_is_given_is_written(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    expected = ask(assets, arguments).volume.numpy()
    out = dict(volume=kept(np.zeros(40)), status=kept(np.full(40, 9, np.int32)))
    found = ask(assets, arguments, out=out)
    assert found.volume is out["volume"] and found.status is out["status"] and found.centroid is None
    ours = ask(assets, arguments)  # behind it
    again = ask(assets, {**arguments, "poses": arguments["poses"][::-1]}, out=ours)
    assert again.volume is ours.volume and again.status is ours.status
    assert np.array_equal(ours.volume.numpy(), again.volume.numpy())
    assert np.array_equal(out["volume"].array, expected) and (out["status"].array == 0).all()
    assert not np.array_equal(ours.volume.numpy(), expected)
    for wrong, error, text in [
            ([1], TypeError, "out: wanted a dict of arrays"),
            (dict(volumes=1), ValueError, "out: 'volumes'; there are"),
            (dict(volume=kept(np.zeros(3))), ValueError, r"out\['volume'\]: 3 rows; the batch has 40"),
            (dict(volume=kept(np.zeros(40, np.float32))), TypeError, r"out\['volume'\]: dtype float32"),
            (dict(status=kept(np.zeros(40))), TypeError, r"out\['status'\]: dtype float64; wanted uint32"),
            (dict(volume=OnDevice(np.zeros(40), flags=1)), ValueError, r"out\['volume'\]: read-only")]:
        with pytest.raises(error, match=text):
            ask(assets, arguments, out=wrong)
    with pytest.raises(ValueError, match="wanted: excludes `out`"):
        ask(assets, arguments, out=out, wanted=["volume"])


def test_answers_outlive_what_they_came_from(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    expected = ask(assets, arguments).volume.numpy()
    volume, status = (lambda found: (found.volume, found.status))(ask(assets, arguments))
    gc.collect()
    for _ in range(4):
        ask(assets, arguments).volume.numpy()
    assert np.array_equal(volume.numpy(), expected) and (status.numpy() == 0).all()


get_pointer = ctypes.pythonapi.PyCapsule_GetPointer
get_pointer.restype = ctypes.c_void_p
get_pointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
set_name = ctypes.pythonapi.PyCapsule_SetName
set_name.argtypes = [ctypes.py_object, ctypes.c_char_p]


def test_capsules_hold_what_they_show(solids, arguments):
    assets = ist.Solids(solids, device="cuda")
    expected = ask(assets, arguments).centroid.numpy()
    for version, name, layout in ((None, b"dltensor", Managed),
                                  ((1, 1), b"dltensor_versioned", Versioned)):
        array = ask(assets, arguments).centroid
        assert array.__dlpack_device__() == CUDA
        capsule = array.__dlpack__(stream=8, max_version=version)
        array.numpy()
        del array
        gc.collect()
        ask(assets, arguments).volume.numpy()
        managed = layout.from_address(get_pointer(capsule, name))
        tensor = managed.tensor
        assert (tensor.ndim, tensor.shape[0], tensor.shape[1]) == (2, 40, 3)
        assert (tensor.code, tensor.bits, tensor.lanes) == (FLOATS, 64, 1)
        shown = np.ctypeslib.as_array(ctypes.cast(tensor.data, ctypes.POINTER(ctypes.c_double)), (40, 3))
        assert np.array_equal(shown, expected)
        set_name(capsule, b"used")
        del capsule
        gc.collect()
        assert np.array_equal(shown, expected)
        managed.deleter(ctypes.addressof(managed))
        ask(assets, arguments).volume.numpy()  # which may have the memory now
    array = ask(assets, arguments).status
    array.__dlpack__(), array.__dlpack__(stream=-1, max_version=(1, 0))  # nobody takes them
    with pytest.raises(BufferError, match="copy=True"):
        array.__dlpack__(copy=True)
    with pytest.raises(BufferError, match="another device"):
        array.__dlpack__(dl_device=(1, 0))
    array.__dlpack__(dl_device=CUDA, copy=False)
    shown = array.__cuda_array_interface__
    assert shown["typestr"] == "<u4" and shown["shape"] == (40,) and shown["strides"] is None
    assert shown["version"] == 3 and shown["stream"] == 1 and shown["data"][1] is False
    array.numpy()
    again = np.ctypeslib.as_array(ctypes.cast(shown["data"][0], ctypes.POINTER(ctypes.c_uint32)), (40,))
    assert np.array_equal(again, array.numpy())


def test_a_captured_stream_needs_memory_for_answers(solids, arguments):
    captured = 77  # emulated_device.cpp
    assets = ist.Solids(solids, device="cuda")
    out = dict(volume=kept(np.zeros(40)))
    with pytest.raises(ist.Error, match="no batch this large ran before"):
        ask(assets, arguments, out=out, stream=captured)
    expected = ask(assets, arguments).volume.numpy()
    with pytest.raises(ValueError, match="out: None; wanted arrays for the answers, because the stream"):
        ask(assets, arguments, stream=captured)
    inputs = {n: kept(x) for n, x in arguments.items()}
    batch(assets, **inputs, out=out, stream=captured)
    assert len(lent) <= 6  # a graph's memory is its maker's to keep
    many = {n: np.concatenate([x] * 120) for n, x in arguments.items()}
    many["poses"][:, 4:] = 1e6
    ask(assets, many, out=dict(volume=kept(np.ones(4800))))
    # The graph continues in its own memory, which is not freed: waiting for its stream runs its work.
    poses = arguments["poses"].copy()
    waits = Interface(shape=(40, 7), data=(poses.ctypes.data, False), stream=captured)
    batch(assets, a=0, b=1, poses=waits).volume.numpy()
    assert np.array_equal(out["volume"].array, expected)


def scene_pairs(solids, kinds, poses, scales, moves, worlds, excluded):
    """Pairs whose boxes meet, as ist.Scene has them."""
    pairs = []
    for world in np.unique(worlds):
        scene = ist.Scene(max_bodies=len(poses), max_pairs=8192)
        scene.set_rule(answer="boxes")
        for i in np.flatnonzero((worlds == world) & np.isfinite(poses).all(1)):
            scene.add(solids[kinds[i]], poses[i], scale=scales[i], number=int(i), moves=bool(moves[i]))
        for a, b in excluded:
            scene.exclude(int(a), int(b))
        found = scene.step()
        pairs.append(found.pairs)
    pairs = np.concatenate(pairs)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def test_a_scene_finds_pairs_and_their_arguments(solids, random_poses):
    random = np.random.default_rng(7)
    n = 120
    kinds, poses = random.integers(0, 3, n), random_poses(n, 2.5)
    poses[:40, 4:] = np.round(poses[:40, 4:])  # flush, or in one place
    poses[:20, :4] = [1, 0, 0, 0]
    scales, moves, worlds = random.uniform(0.3, 1, n), random.uniform(size=n) < 0.7, random.integers(0, 2, n)
    excluded = random.integers(0, n, (300, 2))
    assets = ist.Solids(solids, device="cuda")
    scene = ist.gpu.Scene(assets, kinds, scales=scales, moves=moves, worlds=worlds, excluded=excluded,
                          max_pairs=4000)
    assert len(scene) == n
    poses[5, 4] = np.nan
    found = scene.find_pairs(OnDevice(poses.copy()))
    expected = scene_pairs(solids, kinds, poses, scales, moves, worlds, excluded)
    count = found.count.numpy()[0]
    assert count == len(expected) > 100 and found.boxes_met.numpy()[0] == count
    a, b = found.a.numpy()[:count], found.b.numpy()[:count]
    assert (np.stack([a, b], 1) == expected).all()
    assert np.flatnonzero(found.status.numpy()).tolist() == [5]
    answers = ist.penetration(assets[found.solid_a], assets[found.solid_b], found.poses,
                              poses_a=found.poses_a, scales=found.scales, scales_a=found.scales_a,
                              wanted=["volume", "status"])
    volume, status = answers.volume.numpy(), answers.status.numpy()
    assert (status[:count] == 0).all() and (status[count:] == 2).all() and np.isnan(volume[count:]).all()
    rows = ist.Solids(solids)
    here = ist.penetration(rows[kinds[a]], rows[kinds[b]], poses[b], poses_a=poses[a], scales=scales[b],
                           scales_a=scales[a], spheres_only=True)
    assert (volume[:count] > 0).sum() > 20
    assert np.abs(volume[:count] - here.volume).max() <= 1e-5 * here.volume.max()
    # Arrays are the scene's, which they keep; the next step writes them again.
    poses[:, 4:] += 1e6 * np.arange(n)[:, None]
    again = scene.find_pairs(OnDevice(poses.copy()))
    del scene
    gc.collect()
    assert again.count.numpy()[0] == 0 and found.count.numpy()[0] == 0
    # Nothing keeps the solids, and with them what their last batch was lent.
    del again, found, answers, assets
    gc.collect()
    assert not lent


def test_a_scene_refuses_what_it_cannot_hold(solids):
    assets = ist.Solids(solids, device="cuda")
    with pytest.raises(TypeError, match="solids: on the CPU; wanted ist.Solids on a GPU"):
        ist.gpu.Scene(ist.Solids(solids), [0])
    with pytest.raises(ist.Error, match="body 1 is of solid 3; there are 3"):
        ist.gpu.Scene(assets, [0, 3])
    with pytest.raises(ValueError, match=r"worlds: shape \(3,\); wanted \(2,\)"):
        ist.gpu.Scene(assets, [0, 1], worlds=[0, 1, 2])
    with pytest.raises(ValueError, match="layers: -1; wanted a whole number from 0"):
        ist.gpu.Scene(assets, [0, 1], layers=[0, -1])
    for number in (-1, 2, 2**32):
        with pytest.raises(ValueError, match=f"excluded: {number}; there are 2 bodies"):
            ist.gpu.Scene(assets, [0, 1], excluded=[[0, number]])
    with pytest.raises(ValueError, match="poses: 3 rows; there are 2 bodies"):
        ist.gpu.Scene(assets, [0, 1]).find_pairs(OnDevice(np.zeros((3, 7))))
