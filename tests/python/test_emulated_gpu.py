"""ist.gpu over a device that is host memory (emulated_device.cpp): who waits, holds and frees.

What a batch was lent is spoiled as soon as it is given back, and work of a stream is done when
somebody waits for it. On a card: test_on_gpu.py.
"""
import ctypes
import gc

import numpy as np
import pytest

import ist
from test_gpu import CUDA, DELETER, Interface, Managed, Tensor, Versioned, new_capsule

FLOATS, UINTS = 2, 1
lent = {}  # whatever some batch still holds


class OnDevice:
    """An array that says that it is a device's."""

    def __init__(self, array, *, flags=0, kept=False):
        self.array = np.ascontiguousarray(array)
        self.flags = flags
        self.kept = kept
        self.streams = []

    def __dlpack_device__(self):
        return CUDA

    def __dlpack__(self, *, stream, max_version):
        self.streams.append(stream)
        array = self.array
        shape = (ctypes.c_int64 * array.ndim)(*array.shape)
        code = dict(f=2, u=1, i=0)[array.dtype.kind]

        def give_back(_):
            del lent[ctypes.addressof(managed)]
            if not self.kept:
                array.view(np.uint8)[...] = 0xDD

        tensor = Tensor(array.ctypes.data, *CUDA, array.ndim, code, 8 * array.itemsize, 1, shape, None, 0)
        managed = Versioned(1, 0, None, DELETER(give_back), self.flags, tensor)
        lent[ctypes.addressof(managed)] = managed, shape, array
        return new_capsule(ctypes.addressof(managed), b"dltensor_versioned", None)


@pytest.fixture(scope="module")
def solids(gear, knot, cube):
    return [gear, knot, cube]


@pytest.fixture
def arguments(random_poses):
    random = np.random.default_rng(3)
    return dict(
        solid_a=random.integers(0, 3, 40).astype(np.uint32),
        solid_b=random.integers(0, 3, 40).astype(np.int32),
        pose_a=random_poses(40, 0.8), pose_b=random_poses(80, 0.8)[40:].copy(),
        scale_a=random.uniform(0.5, 2, 40), scale_b=random.uniform(0.5, 2, 40))


def ask(assets, arguments, **settings):
    return ist.gpu.penetration(assets, **{n: OnDevice(x.copy()) for n, x in arguments.items()},
                               **settings)


def expected_of(solids, arguments, **settings):
    found = [ist.penetration(solids[a], solids[b], [pose_b], poses_a=pose_a, scales=scale_b,
                             scales_a=scale_a, field="never", **settings)
             for a, b, pose_a, pose_b, scale_a, scale_b in zip(*arguments.values())]
    return dict(volume=np.concatenate([f.volume for f in found]),
                centroid=np.concatenate([f.centroid for f in found]),
                translation_gradient=-np.concatenate([f.force for f in found]),
                rotation_gradient=-np.concatenate([f.torque for f in found]),
                status=np.concatenate([f.status for f in found]))


def expect_close(found, expected):
    size = np.nanmax(expected["volume"]) ** (1 / 3)
    for name, column in expected.items():
        ours = getattr(found, name).numpy()
        assert ours.shape == column.shape
        power = dict(volume=3, centroid=1, translation_gradient=2, rotation_gradient=3, status=0)[name]
        assert (np.isnan(ours.astype(float)) == np.isnan(column.astype(float))).all(), name
        assert np.nanmax(np.abs(ours.astype(float) - column)) <= 1e-5 * size**power, name


@pytest.mark.parametrize("measure", ["matched", "inner"])
def test_answers_are_those_of_the_cpu(solids, arguments, measure):
    arguments["pose_b"][3, 5] = np.nan
    expected = expected_of(solids, arguments, measure=measure)
    assert (expected["volume"] > 0).sum() > 10 and expected["status"][3] == 2
    found = ask(ist.gpu.Solids(solids), arguments, measure=measure)
    expect_close(found, expected)
    assert found.node_visits is None and found.volume.dtype == np.float64
    assert found.volume.shape == (40,) and found.centroid.shape == (40, 3) and len(found.status) == 40


def test_budgets_are_those_of_the_cpu(solids, arguments):
    assets = ist.gpu.Solids(solids)
    whole, bound = ask(assets, arguments), ask(assets, arguments, pair_budget=60)
    expect_close(bound, expected_of(solids, arguments, pair_budget=60))
    assert not np.array_equal(bound.volume.numpy(), whole.volume.numpy())
    with pytest.raises(TypeError):
        ask(assets, arguments, pair_budget=-1)


def test_separations_are_those_of_the_cpu(solids, arguments):
    arguments["pose_b"][:, 4:] *= 8
    arguments["pose_b"][3, 5] = np.nan
    lent_arguments = {n: OnDevice(x.copy()) for n, x in arguments.items()}
    found = ist.gpu.separation(ist.gpu.Solids(solids), **lent_arguments)
    size = 2 * max(solid.bounds().radius for solid in solids)
    apart = 0
    for i, (a, b, pose_a, pose_b, scale_a, scale_b) in enumerate(zip(*arguments.values())):
        one = ist.separation(solids[a], solids[b], [pose_b], poses_a=pose_a, scales=scale_b,
                             scales_a=scale_a, inner_spheres=True)
        assert found.status.numpy()[i] == one.status[0]
        if i == 3:
            assert np.isnan(found.distance.numpy()[3]) and np.isnan(found.normal.numpy()[3]).all()
            continue
        assert abs(found.distance.numpy()[i] - one.distance[0]) <= 2e-6 * size
        for name in ("distance_min", "distance_max"):
            assert getattr(found, name).numpy()[i] == pytest.approx(getattr(one, name)[0], abs=1e-5 * size)
        apart += one.distance[0] > 0
        if one.distance[0] > 0:
            gap = found.point_b.numpy()[i] - found.point_a.numpy()[i]
            assert gap == pytest.approx(found.distance.numpy()[i] * found.normal.numpy()[i], abs=1e-9)
    assert apart > 10 and found.status.numpy()[3] == 2
    assert found.node_visits is None and found.normal.shape == (40, 3)
    few = ist.gpu.separation(ist.gpu.Solids(solids), 0, 1, None, OnDevice(arguments["pose_b"].copy()),
                             max_visits=1, wanted=["status", "distance_min", "distance_max"])
    assert few.distance is None and (few.status.numpy() == 1).any()
    assert np.delete(few.distance_min.numpy() <= few.distance_max.numpy(), 3).all()
    with pytest.raises(ValueError, match="wanted: 'volume'; there are 'distance', 'distance_min'"):
        ist.gpu.separation(ist.gpu.Solids(solids), 0, 1, None, OnDevice(arguments["pose_b"]),
                           wanted=["volume"])


def test_patches_are_those_of_the_cpu(solids, arguments):
    arguments["pose_b"][3, 5] = np.nan
    assets = ist.gpu.Solids(solids)
    given = {n: OnDevice(x.copy()) for n, x in arguments.items()}
    found = ist.gpu.contact_patches(assets, **given, max_patches=4)
    ours = {name: getattr(found, name).numpy() for name in (
        "count", "id", "centroid", "normal", "area", "depth", "volume", "force", "torque", "status")}
    assert ours["id"].shape == (40, 4) and ours["id"].dtype == np.uint64
    assert ours["force"].shape == (40, 4, 3) and ours["count"].max() == 4 and ours["status"][3] == 2
    whole = ask(assets, arguments)
    valid = np.arange(40) != 3
    assert ours["volume"].sum(1)[valid] == pytest.approx(whole.volume.numpy()[valid], rel=1e-5)
    for i, (a, b, pose_a, pose_b, scale_a, scale_b) in enumerate(zip(*arguments.values())):
        if i == 3:
            assert ours["count"][3] == 0 and np.isnan(whole.volume.numpy()[3])
            continue
        one = ist.contact_patches(solids[a], solids[b], pose_b, poses_a=pose_a, scales=scale_b,
                                  scales_a=scale_a, max_patches=4, field="never")
        n = int(one.count)
        assert ours["count"][i] == n
        assert (ours["id"][i, :n] == one.id[:n]).all() and not ours["volume"][i, n:].any()
        for name, power in dict(centroid=1, area=2, volume=3, force=2, torque=3).items():
            size = max(1, np.abs(getattr(one, name)).max())
            assert np.abs(ours[name][i, :n] - getattr(one, name)[:n]).max(initial=0) <= 1e-4 * size, name
    out = dict(volume=kept(np.full((40, 2), 7.0)), id=kept(np.zeros((40, 2), np.int64)))
    again = ist.gpu.contact_patches(assets, **given, max_patches=2, out=out)
    assert again.volume is out["volume"] and again.count is None
    del found
    ask(assets, arguments).volume.numpy()
    assert out["volume"].array[3, 0] == 7 and (out["volume"].array[:, 0] > 0).all()
    for wrong, error, text in [
            (dict(max_patches=0), ValueError, "max_patches: 0; wanted 1 to 32"),
            (dict(max_patches=33), ValueError, "max_patches: 33; wanted 1 to 32"),
            (dict(max_patches=3, out=out), ValueError,
             r"out\['.*'\]: shape \(40, 2\); wanted .* \(n, 3\) on CUDA"),
            (dict(wanted=["distance"]), ValueError, "wanted: 'distance'; there are 'count', 'id'")]:
        with pytest.raises(error, match=text):
            ist.gpu.contact_patches(assets, **given, **wrong)


@pytest.fixture(scope="module")
def some_fields(knot):
    heights = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 8)).astype(np.float32)
    return [ist.HalfSpaceField(), ist.BoxField([1, 2, 0.5]), ist.BallField(1),
            ist.HeightField(heights, lowest=-0.5, highest=0.5), ist.MeshField(knot)], heights


@pytest.mark.parametrize("measure", ["matched", "inner"])
def test_fields_are_those_of_the_cpu(solids, some_fields, arguments, measure):
    fields, heights = some_fields
    arguments["solid_a"] = np.random.default_rng(4).integers(0, 5, 40).astype(np.uint32)
    arguments["pose_b"][3, 5] = np.nan
    expected = [ist.penetration(fields[a], solids[b], [pose_b], poses_a=pose_a, scales=scale_b,
                                scales_a=scale_a, measure=measure)
                for a, b, pose_a, pose_b, scale_a, scale_b in zip(*arguments.values())]
    there = ist.gpu.Solids([*fields, *solids])
    assert len(there) == 8 and there.device == 0 and there.bytes > heights.nbytes
    arguments["solid_b"] += 5
    turned = {name[:-1] + dict(a="b", b="a")[name[-1]]: x for name, x in arguments.items()}
    heights += 1000  # what was uploaded stays
    try:
        found, over = (ask(there, given, measure=measure) for given in (arguments, turned))
        volume = found.volume.numpy()
        assert np.array_equal(over.volume.numpy(), volume, equal_nan=True)
        assert np.array_equal(over.translation_gradient.numpy(), -found.translation_gradient.numpy(),
                              equal_nan=True)
    finally:
        heights -= 1000
    theirs = np.concatenate([one.volume for one in expected])
    assert (theirs > 0).sum() > 15 and found.status.numpy()[3] == 2
    assert volume == pytest.approx(theirs, rel=1e-9, abs=1e-9, nan_ok=True)
    push = np.concatenate([-one.force for one in expected])
    assert found.translation_gradient.numpy() == pytest.approx(push, rel=1e-6, abs=1e-6, nan_ok=True)


def test_what_cannot_be_answered_is_not_held(solids, some_fields):
    there = ist.gpu.Solids([*some_fields[0], *solids])
    for batch, held in ((ist.gpu.penetration, [0, 0, 3]), (ist.gpu.separation, [0, 3, 3]),
                        (ist.gpu.contact_patches, [0, 3, 3])):
        numbers = (OnDevice(np.array(rows, np.uint32)) for rows in ([5, 0, 1], [6, 5, 2]))
        found = batch(there, *numbers, None, OnDevice(np.tile([1.0, 0, 0, 0, 0, 0, 0], (3, 1))))
        assert found.status.numpy().tolist() == held, batch


def test_wrong_solids_are_named(solids):
    with pytest.raises(ist.Error, match=r"GPU: solid 1 is an asset without spheres: bake it with"):
        ist.gpu.Solids([solids[0], ist.bake_surface(ist.close_mesh(ist.sample_mesh("cube")))])
    with pytest.raises(TypeError, match=r"solids\[0\]: a int; wanted an Asset or a Field"):
        ist.gpu.Solids([3])


def test_nothing_is_given_back_before_the_batch_is_done(solids, arguments):
    assets = ist.gpu.Solids(solids)
    expected = expected_of(solids, arguments)
    first = ask(assets, arguments, stream=5)
    assert len(lent) == 6
    second = ask(assets, {**arguments, "pose_b": arguments["pose_b"][::-1]}, stream=6)
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
    found = ask(ist.gpu.Solids(solids), arguments, stream=5)
    gc.collect()  # the assets are gone
    assert not lent
    expect_close(found, expected_of(solids, arguments))


def test_a_larger_batch_waits_for_its_room(solids, arguments):
    assets = ist.gpu.Solids(solids)
    few = ask(assets, arguments, stream=5)
    many = {n: np.concatenate([x] * 120) for n, x in arguments.items()}
    for name in many:
        many[name][40:] = arguments[name][0]
    many["pose_b"][40:, 4:] = 1e6
    found = ask(assets, many, stream=6)
    assert np.array_equal(found.volume.numpy()[:40], few.volume.numpy())


def test_what_was_asked_before_does_not_show(solids, arguments):
    assets = ist.gpu.Solids(solids)
    few = ask(assets, arguments).volume.numpy()
    many = {n: np.concatenate([x] * 500) for n, x in arguments.items()}
    many["pose_b"][40:, 4:] = 1e6
    of_many = ask(assets, many).volume.numpy()[:40]
    assert np.allclose(of_many, few, rtol=1e-6, atol=0)
    assert (of_many != few).any()  # as many are cut up otherwise
    assert np.array_equal(ask(assets, arguments).volume.numpy(), few)


def test_streams_are_passed_on(solids, arguments):
    assets = ist.gpu.Solids(solids)

    class Torch:
        cuda_stream = 12

    class CuPy:
        ptr = 13

    class Core:
        def __cuda_stream__(self):
            return 0, 14

    for given, handle in ((None, 1), (0, 1), (2, 2), (Torch(), 12), (CuPy(), 13), (Core(), 14)):
        poses = OnDevice(arguments["pose_b"].copy())
        found = ist.gpu.penetration(assets, 0, 1, None, poses, stream=given)
        assert poses.streams == [handle]
        assert found.volume.numpy().shape == (40,)
    with pytest.raises(TypeError, match="stream: a str is not a stream"):
        ist.gpu.penetration(assets, 0, 1, None, OnDevice(arguments["pose_b"]), stream="mine")


def test_arguments_may_be_left_out(solids, arguments):
    assets = ist.gpu.Solids(solids)
    poses = arguments["pose_b"]
    ones = np.ones(40)
    whole = dict(solid_a=np.zeros(40, np.uint32), solid_b=np.full(40, 2, np.uint32),
                 pose_a=np.tile([1.0, 0, 0, 0, 0, 0, 0], (40, 1)), pose_b=poses, scale_a=ones,
                 scale_b=ones)
    found = ist.gpu.penetration(assets, 0, 2, None, OnDevice(poses.copy()))
    expected = ask(assets, whole)
    assert expected.volume.numpy().max() > 0
    assert np.array_equal(found.volume.numpy(), expected.volume.numpy())
    few = ist.gpu.penetration(assets, 0, 2, None, OnDevice(poses.copy()), wanted=["node_visits"])
    assert few.volume is None and few.node_visits.numpy().max() > 0
    empty = ist.gpu.penetration(assets, 0, 2, None, OnDevice(np.zeros((0, 7))))
    assert empty.volume.shape == (0,) and empty.centroid.numpy().shape == (0, 3)
    for wrong, error, text in [
            (dict(solid_b=3), ValueError, "solid_b: 3; there are 3 solids"),
            (dict(solid_a=-1), ValueError, "solid_a: -1; there are 3 solids"),
            (dict(pose_b=None), ValueError, "one argument must have rows"),
            (dict(scale_b=OnDevice(np.ones(3))), ValueError,
             "scale_b: 3 rows; the arguments before it have 40"),
            (dict(solid_a=OnDevice(np.zeros(40, np.int64))), TypeError,
             "solid_a: dtype int64; wanted uint32 or int32"),
            (dict(wanted=["force"]), ValueError, "wanted: 'force'; there are 'volume'"),
            (dict(wanted="volume"), TypeError, "wanted: a str; must be a sequence"),
            (dict(measure="outer"), ValueError, "measure: 'outer'"),
            (dict(measure="exact"), ValueError, "measure: 'exact'; one of 'matched', 'inner'"),
            (dict(solids=solids), TypeError, "solids: a list; wanted ist.gpu.Solids")]:
        given = dict(solids=assets, solid_a=0, solid_b=2, pose_a=None, pose_b=OnDevice(poses.copy()))
        with pytest.raises(error, match=text):
            ist.gpu.penetration(**{**given, **wrong})
    del assets, given
    assert not lent  # what was refused is given back too


def kept(array):
    """Memory of the caller's, which giving back does not spoil."""
    return OnDevice(array, kept=True)


def test_what_is_given_is_written(solids, arguments):
    assets = ist.gpu.Solids(solids)
    expected = ask(assets, arguments).volume.numpy()
    out = dict(volume=kept(np.zeros(40)), status=kept(np.full(40, 9, np.int32)))
    found = ask(assets, arguments, out=out)
    assert found.volume is out["volume"] and found.status is out["status"] and found.centroid is None
    ours = ask(assets, arguments)  # behind it
    again = ask(assets, {**arguments, "pose_b": arguments["pose_b"][::-1]}, out=ours)
    assert again.volume is ours.volume and again.status is ours.status
    assert np.array_equal(ours.volume.numpy(), again.volume.numpy())
    assert np.array_equal(out["volume"].array, expected) and (out["status"].array == 0).all()
    assert not np.array_equal(ours.volume.numpy(), expected)
    for wrong, error, text in [
            ([1], TypeError, "out: wanted a dict of arrays"),
            (dict(force=1), ValueError, "out: 'force'; there are"),
            (dict(volume=kept(np.zeros(3))), ValueError, r"out\['volume'\]: 3 rows; the batch has 40"),
            (dict(volume=kept(np.zeros(40, np.float32))), TypeError, r"out\['volume'\]: dtype float32"),
            (dict(status=kept(np.zeros(40))), TypeError, r"out\['status'\]: dtype float64; wanted uint32"),
            (dict(volume=OnDevice(np.zeros(40), flags=1)), ValueError, r"out\['volume'\]: read-only")]:
        with pytest.raises(error, match=text):
            ask(assets, arguments, out=wrong)
    with pytest.raises(ValueError, match="wanted: excludes `out`"):
        ask(assets, arguments, out=out, wanted=["volume"])


def test_answers_outlive_what_they_came_from(solids, arguments):
    assets = ist.gpu.Solids(solids)
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
    assets = ist.gpu.Solids(solids)
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
    assets = ist.gpu.Solids(solids)
    out = dict(volume=kept(np.zeros(40)))
    with pytest.raises(ist.Error, match="no batch this large ran before"):
        ask(assets, arguments, out=out, stream=captured)
    expected = ask(assets, arguments).volume.numpy()
    with pytest.raises(ValueError, match="out: None; wanted arrays for the answers, because the stream"):
        ask(assets, arguments, stream=captured)
    inputs = {n: kept(x) for n, x in arguments.items()}
    ist.gpu.penetration(assets, **inputs, out=out, stream=captured)
    assert len(lent) <= 6  # a graph's memory is its maker's to keep
    many = {n: np.concatenate([x] * 120) for n, x in arguments.items()}
    many["pose_b"][:, 4:] = 1e6
    ask(assets, many, out=dict(volume=kept(np.ones(4800))))
    # The graph goes on in its own room, which is not freed: who waits for its stream does its work.
    poses = arguments["pose_b"].copy()
    waits = Interface(shape=(40, 7), data=(poses.ctypes.data, False), stream=captured)
    ist.gpu.penetration(assets, 0, 1, None, waits).volume.numpy()
    assert np.array_equal(out["volume"].array, expected)
