"""Queries of solids on a card, with the arrays of PyTorch, CuPy and JAX."""
import functools
import gc
import os
import threading
import time

os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # or JAX takes most of the memory

import numpy as np
import pytest

import ist
from test_rows import ask

pytestmark = pytest.mark.skipif(not ist.gpu.available(), reason=f"{ist.gpu.why_not()}")

if ist.gpu.available():
    torch = pytest.importorskip("torch", reason="no PyTorch")

COLUMNS = ["volume", "centroid", "force", "torque"]


@pytest.fixture(scope="module")
def assets(solids):
    return ist.Solids(solids, device="cuda")


@pytest.fixture
def pairs(random_poses):
    """pairs(count) → host arrays of the arguments of a batch, by name: the same for a count."""

    @functools.cache
    def draw(count, reach):
        random = np.random.default_rng(count)
        return dict(
            a=random.integers(0, 3, count).astype(np.uint32),
            b=random.integers(0, 3, count).astype(np.uint32),
            poses_a=random_poses(count, reach), poses=random_poses(count, reach)[::-1].copy(),
            scales_a=random.uniform(0.5, 2, count), scales=random.uniform(0.5, 2, count))

    def make(count, reach=1.5):
        return {name: column.copy() for name, column in draw(count, reach).items()}

    return make


def on_card(arguments):
    """The same as tensors; uint32 as int32, which older versions of PyTorch do not know."""
    return {name: torch.from_numpy(x.view(np.int32) if x.dtype == np.uint32 else x).cuda()
            for name, x in arguments.items()}


def kinds(arguments):
    """(a, b, rows) of all pairs of the same solids."""
    for a, b in np.unique(np.stack((arguments["a"], arguments["b"])), axis=1).T:
        yield a, b, (arguments["a"] == a) & (arguments["b"] == b)


def on_cpu(solids, arguments, first=None, **settings):
    """What ist.penetration says of each kind of pair; `a` are places in `first`."""
    rows = len(arguments["poses"])
    answers = dict(volume=np.zeros(rows), centroid=np.zeros((rows, 3)),
                   force=np.zeros((rows, 3)), torque=np.zeros((rows, 3)),
                   status=np.zeros(rows, np.uint32))
    for a, b, rows in kinds(arguments):
        found = ist.penetration(
            (first or solids)[a], solids[b], arguments["poses"][rows],
            poses_a=arguments["poses_a"][rows], scales=arguments["scales"][rows],
            scales_a=arguments["scales_a"][rows], spheres_only=True, **settings)
        for name, column in zip([*COLUMNS, "status"], [
                found.volume, found.centroid, found.force, found.torque, found.status]):
            answers[name][rows] = column
    return answers


def expect_close(ours, theirs):
    """The GPU's volumes are within 1e-6 of sums in double; the CPU's differ by up to 4e-6 where solids
    graze each other, and gradients likewise."""
    assert (ours["status"] == theirs["status"]).all()
    invalid = theirs["status"] == ist.QueryStatus.invalid_input
    for name in COLUMNS:
        assert np.isnan(ours[name][invalid]).all() and np.isnan(theirs[name][invalid]).all(), name
    ours = {name: column[~invalid] for name, column in ours.items()}
    theirs = {name: column[~invalid] for name, column in theirs.items()}
    volume = theirs["volume"]
    assert ((ours["volume"] > 0) == (volume > 0)).all()
    assert (np.abs(ours["volume"] - volume) <= 1e-5 * volume).all()
    size = volume ** (1 / 3)
    for name, power in (("force", 2), ("torque", 3)):
        largest = np.abs(theirs[name]).max(axis=1)
        error = np.abs(ours[name] - theirs[name]).max(axis=1)
        assert (error <= 1e-4 * (largest + size**power)).all(), name
        assert (error <= 1e-5 * (largest + size**power)).mean() > 0.99, name
    assert (np.abs(ours["centroid"] - theirs["centroid"]) < 1e-5).all()


def host(found, names=(*COLUMNS, "status")):
    return {name: getattr(found, name).numpy() for name in names}


def expect_same_bits(one, other):
    for name in one:
        assert np.array_equal(one[name], other[name], equal_nan=one[name].dtype.kind == "f"), name


@pytest.mark.parametrize("measure", ["matched", "inner"])
def test_answers_are_those_of_the_cpu(solids, assets, pairs, measure):
    arguments = pairs(20_000)
    arguments["poses"][10, 3] = np.nan
    arguments["scales_a"][20] = -1
    arguments["poses_a"][30, :4] = 0
    found = ask(assets, **on_card(arguments), measure=measure)
    ours, theirs = host(found), on_cpu(solids, arguments, measure=measure)
    assert (theirs["volume"] > 0).sum() > 5000
    assert (theirs["status"] == ist.QueryStatus.invalid_input).nonzero()[0].tolist() == [10, 20, 30]
    expect_close(ours, theirs)
    assert found.node_visits is None and found.sphere_pairs is None
    arguments["a"][40] = 3
    arguments["b"][50] = 2**32 - 1
    again = host(ask(assets, **on_card(arguments), measure=measure))
    assert again["status"][[40, 50]].tolist() == [2, 2]
    kept = np.ones(len(ours["volume"]), bool)
    kept[[40, 50]] = False
    expect_same_bits({n: x[kept] for n, x in again.items()}, {n: x[kept] for n, x in ours.items()})


def test_budgets_are_those_of_the_cpu(solids, assets, pairs):
    arguments = pairs(2000)
    whole = host(ask(assets, **on_card(arguments)))
    ours = host(ask(assets, **on_card(arguments), pair_budget=100))
    expect_close(ours, on_cpu(solids, arguments, pair_budget=100))
    assert not np.array_equal(ours["volume"], whole["volume"])


def test_fields_are_those_of_the_cpu(solids, pairs):
    heights = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 8)).astype(np.float32)
    fields = [ist.HalfSpaceShape(), ist.BoxShape([1, 2, 0.5]), ist.BallShape(1),
              ist.CapsuleShape(0.5, 0.3), ist.HeightFieldShape(heights, lowest=-0.5, highest=0.5),
              ist.CylinderShape(0.4, 0.6)]
    there = ist.Solids([*fields, *solids], device="cuda")
    arguments = pairs(3000)
    arguments["a"] = np.random.default_rng(4).integers(0, 6, 3000).astype(np.uint32)
    arguments["poses"][10, 3] = np.nan
    numbers = arguments | dict(b=(arguments["b"] + 6).astype(arguments["b"].dtype))
    ours = host(ask(there, **on_card(numbers)))
    theirs = on_cpu(solids, arguments, first=fields)
    assert (theirs["volume"] > 0).sum() > 1000 and theirs["status"][10] == 2
    assert (ours["status"] == theirs["status"]).all() and np.isnan(ours["volume"][10])
    for name, part in (("volume", 1e-9), ("force", 1e-6), ("torque", 1e-6)):
        error, size = np.abs(ours[name] - theirs[name]), np.abs(theirs[name])
        assert np.nanmax(error) <= part * np.nanmax(size), name


def test_separations_are_those_of_the_cpu(solids, assets, pairs):
    arguments = pairs(3000, reach=4)
    arguments["poses"][10, 3] = np.nan
    found = ask(assets, query=ist.separation, **on_card(arguments))
    names = ("distance", "distance_min", "distance_max")
    ours, theirs = host(found, (*names, "status")), {n: np.zeros(3000) for n in (*names, "status")}
    for a, b, rows in kinds(arguments):
        answer = ist.separation(
            solids[a], solids[b], arguments["poses"][rows], poses_a=arguments["poses_a"][rows],
            scales=arguments["scales"][rows], scales_a=arguments["scales_a"][rows])
        for name in theirs:
            theirs[name][rows] = getattr(answer, name)
    size = 2 * max(solid.bounds().radius for solid in solids)
    assert (ours["status"] == theirs["status"]).all() and theirs["status"][10] == 2
    for name in names:
        assert np.isnan(ours[name][10]) and np.isnan(theirs[name][10])
        assert np.nanmax(np.abs(ours[name] - theirs[name])) <= 1e-12 * size, name
    assert (theirs["distance"] > 0).sum() > 500
    assert found.normal.shape == (3000, 3) and found.node_visits is None


def test_a_pair_id_keeps_what_is_near(assets, pairs):
    arguments = pairs(2000, 0.8)
    names = ("volume", "force", "torque", "status", "node_visits")
    for step in range(3):
        arguments["poses"][:, 4] += 1e-7
        kept, searched = (
            host(ask(assets, **on_card(arguments), measure="exact", pair_id=number, wanted=names), names)
            for number in (5, 0))
        visits, all_visits = kept.pop("node_visits"), searched.pop("node_visits")
        assert step == 0 or (visits != 0).sum() < (all_visits != 0).sum()
        expect_same_bits(kept, searched)


def test_exact_patches_are_those_of_the_cpu(solids, assets, pairs):
    arguments = pairs(2000)
    arguments["poses"][10, 3] = np.nan
    names = ("count", "id", "volume", "force", "torque", "status")
    ours = host(ask(assets, query=ist.contact_patches, **on_card(arguments), max_patches=4,
                    measure="exact"), names)
    assert ours["status"][10] == 2 and ours["count"][10] == 0
    size = 2 * max(solid.bounds().radius for solid in solids) * arguments["scales"].max()
    for a, b, rows in kinds(arguments):
        theirs = ist.contact_patches(
            solids[a], solids[b], arguments["poses"][rows], poses_a=arguments["poses_a"][rows],
            scales=arguments["scales"][rows], scales_a=arguments["scales_a"][rows], max_patches=4,
            measure="exact")
        last = np.where(np.arange(4) < ours["count"][rows][:, None], ours["id"][rows], 2**64 - 1)
        order = np.argsort(np.where(np.arange(4) < ours["count"][rows][:, None], theirs.id, 2**64 - 1), 1)
        assert (np.sort(last, 1) == last).all()
        for name in ("id", "volume", "force", "torque"):
            column = getattr(theirs, name)
            column = np.take_along_axis(column, order.reshape(order.shape + (1,) * (column.ndim - 2)), 1)
            error = np.abs(ours[name][rows].astype(float) - column.astype(float)).max(initial=0)
            assert error <= (0 if name == "id" else 1e-9 * size**3), name


def test_patches_are_those_of_the_cpu(solids, assets, pairs):
    arguments = pairs(2000)
    arguments["poses"][10, 3] = np.nan
    names = ("count", "id", "volume", "force", "centroid", "status")
    ours = host(ask(assets, query=ist.contact_patches, **on_card(arguments), max_patches=4), names)
    assert ours["status"][10] == 2 and ours["count"][10] == 0
    other_regions = 0
    for a, b, rows in kinds(arguments):
        theirs = ist.contact_patches(
            solids[a], solids[b], arguments["poses"][rows], poses_a=arguments["poses_a"][rows],
            scales=arguments["scales"][rows], scales_a=arguments["scales_a"][rows], max_patches=4,
            spheres_only=True)
        # Unless two divisions are worth the same: then a cell is in another patch.
        alike = (ours["id"][rows] == theirs.id).all(1)
        alike &= (np.abs(ours["volume"][rows] - theirs.volume) < 1e-4 * theirs.volume.max(initial=1)).all(1)
        other_regions += (~alike).sum()
        for name in ("volume", "force", "centroid"):
            column = getattr(theirs, name)[alike]
            error = np.abs(ours[name][rows][alike] - column).max(initial=0)
            assert error <= 1e-4 * np.abs(column).max(initial=1), name
    assert other_regions <= 4
    whole = host(ask(assets, **on_card(arguments)))
    error = np.abs(ours["volume"].sum(1) - whole["volume"])
    assert np.nanmax(error) <= 1e-5 * np.nanmax(whole["volume"])


def test_arguments_may_be_left_out(assets, pairs):
    arguments = on_card(pairs(500))
    for name in ("a", "b"):
        arguments[name].fill_(1)
    for name in ("scales_a", "scales"):
        arguments[name].fill_(1)
    arguments["poses_a"].copy_(torch.tensor([1.0, 0, 0, 0, 0, 0, 0]))
    whole = host(ask(assets, **arguments))
    expect_same_bits(host(ask(assets, a=1, b=1, poses=arguments["poses"])), whole)
    few = ask(assets, a=1, b=1, poses=arguments["poses"],
                              wanted=["status", "node_visits", "sphere_pairs"])
    assert few.volume is None and few.status.dtype == np.uint32
    assert few.node_visits.numpy().max() > 0 and few.sphere_pairs.numpy().max() > 0
    with pytest.raises(IndexError, match="there are 3 solids"):
        ask(assets, a=0, b=3, poses=arguments["poses"])
    with pytest.raises(TypeError, match="poses: a NoneType is not a device array"):
        ask(assets, a=0, b=1, poses=None)
    with pytest.raises(ValueError, match="wanted: 'pose_gradient'; there are 'volume'"):
        ask(assets, a=0, b=1, poses=arguments["poses"], wanted=["pose_gradient"])
    with pytest.raises(ValueError, match="measure: 'outer'"):
        ask(assets, a=0, b=1, poses=arguments["poses"], measure="outer")


@pytest.mark.parametrize("count", [0, 1, 10_000_000])
def test_batches_of_any_size(assets, pairs, count):
    few = on_card(pairs(min(count, 1000)))
    found = ask(assets, **few)
    if count > 1000:
        # Up to 16,384 pairs are cut up otherwise than more: their answers differ by rounding.
        some, all_of_them = (host(ask(assets, **{
            n: x.repeat(size // 1000, *[1] * (x.ndim - 1)) for n, x in few.items()}))
            for size in (20_000, count))
        expect_same_bits({n: x[-1000:] for n, x in all_of_them.items()},
                         {n: x[-1000:] for n, x in some.items()})
        expect_close({n: x[-1000:] for n, x in some.items()}, host(found))
    assert len(found.volume) == min(count, 1000) and found.centroid.shape[1] == 3
    assert torch.from_dlpack(found.volume).shape == (min(count, 1000),)


def test_frameworks_take_and_give_the_same_memory(assets, pairs):
    arguments = pairs(2000)
    expected = host(ask(assets, **on_card(arguments)))
    found = ask(assets, **on_card(arguments))
    address = found.volume.__cuda_array_interface__["data"][0]
    assert found.volume.__dlpack_device__() == (2, 0) and found.volume.device == 0
    tensor = torch.from_dlpack(found.volume)
    assert tensor.data_ptr() == address and tensor.device.index == 0
    assert torch.as_tensor(found.volume, device="cuda").data_ptr() == address
    assert np.array_equal(tensor.cpu().numpy(), expected["volume"])
    assert torch.from_dlpack(found.centroid).shape == (2000, 3)
    with pytest.raises(BufferError, match="copy"):
        found.volume.__dlpack__(copy=True)
    with pytest.raises(BufferError, match="device"):
        found.volume.__dlpack__(dl_device=(1, 0))
    with pytest.raises(Exception):
        np.from_dlpack(found.volume)
    found.volume.__dlpack__(), found.volume.__dlpack__(max_version=(1, 0))  # nobody takes them


def test_cupy_takes_and_gives(assets, pairs):
    cupy = pytest.importorskip("cupy", reason="no CuPy")
    arguments = pairs(2000)
    expected = host(ask(assets, **on_card(arguments)))
    arrays = {name: cupy.asarray(x) for name, x in arguments.items()}
    stream = cupy.cuda.Stream(non_blocking=True)
    cupy.cuda.get_current_stream().synchronize()
    for how in (None, stream, stream.ptr):
        found = ask(assets, **arrays, stream=how)
        by_dlpack, by_interface = cupy.from_dlpack(found.volume), cupy.asarray(found.volume)
        assert by_dlpack.data.ptr == by_interface.data.ptr
        assert np.array_equal(cupy.asnumpy(by_dlpack), expected["volume"])
        assert np.array_equal(cupy.asnumpy(cupy.from_dlpack(found.status)), expected["status"])

    class Interface:  # nothing but that
        def __init__(self, array):
            self.array = array
            self.__cuda_array_interface__ = array.__cuda_array_interface__

    found = ask(assets, **{n: Interface(x) for n, x in arrays.items()})
    expect_same_bits(host(found), expected)
    out = dict(volume=cupy.empty(2000), status=cupy.empty(2000, cupy.uint32))
    given = ask(assets, **arrays, out=out)
    assert given.volume is out["volume"] and np.array_equal(out["volume"].get(), expected["volume"])


def test_jax_takes_and_gives(assets, pairs):
    jax = pytest.importorskip("jax", reason="no JAX")
    jax.config.update("jax_enable_x64", True)
    if jax.default_backend() != "gpu":
        pytest.skip("JAX without a GPU")
    arguments = pairs(2000)
    expected = host(ask(assets, **on_card(arguments)))
    arrays = {name: jax.numpy.asarray(x) for name, x in arguments.items()}
    found = ask(assets, **arrays)
    del arrays
    volume = jax.dlpack.from_dlpack(found.volume)
    del found
    gc.collect()
    assert np.array_equal(np.asarray(volume), expected["volume"])
    assert float(jax.jit(lambda v: v.sum())(volume)) == pytest.approx(expected["volume"].sum())


def test_arguments_that_do_not_fit_are_named(assets, pairs):
    arguments = on_card(pairs(8))
    cases = [
        (dict(poses=arguments["poses"].float()), TypeError, "poses: dtype float32; wanted float64"),
        (dict(poses_a=arguments["poses_a"].cpu()), TypeError, "poses_a: on the CPU; wanted float64"),
        (dict(poses_a=arguments["poses_a"].cpu().pin_memory()), TypeError, "poses_a: on the CPU"),
        (dict(poses=arguments["poses"][:, :6]), ValueError, r"poses: shape \(8, 6\); wanted"),
        (dict(poses=arguments["poses"].T.contiguous().T), ValueError, "poses: not in C order"),
        (dict(scales=arguments["scales"][::2]), ValueError, "scales: not in C order"),
        (dict(scales=arguments["scales"][:5]), ValueError, "scales: 5 rows; the arguments before"),
        (dict(a=arguments["a"].long()), TypeError, "a: dtype int64; wanted uint32 or int32"),
        (dict(scales_a=2.0), TypeError, "scales_a: a float is not a device array"),
        (dict(poses=arguments["poses"].clone().requires_grad_()), TypeError, "poses: .*grad"),
        (dict(stream="mine"), TypeError, "stream: a str is not a stream"),
        (dict(out=[1]), TypeError, "out: wanted a dict of arrays"),
        (dict(out=dict(volumes=1)), ValueError, "out: 'volumes'; there are"),
        (dict(out=dict(volume=torch.empty(7).cuda().double())), ValueError, "out.'volume'.: 7 rows"),
        (dict(out=dict(volume=torch.empty(8).cuda())), TypeError, "out.'volume'.: dtype float32"),
        (dict(out=dict(), wanted=["volume"]), ValueError, "wanted: excludes `out`"),
    ]
    for wrong, error, text in cases:
        fitting = {n: x.detach() if hasattr(x, "detach") else x for n, x in arguments.items()}
        with pytest.raises(error, match=text):
            ask(assets, **{**fitting, **wrong})


def test_what_is_given_is_written(assets, pairs):
    arguments = on_card(pairs(1000))
    expected = host(ask(assets, **arguments))
    out = dict(volume=torch.empty(1000, dtype=torch.float64, device="cuda"),
               status=torch.empty(1000, dtype=torch.int32, device="cuda"))
    found = ask(assets, **arguments, out=out)
    assert found.volume is out["volume"] and found.status is out["status"] and found.centroid is None
    assert np.array_equal(found.volume.cpu().numpy(), expected["volume"])
    ours = ask(assets, **arguments)
    arguments["poses"] = arguments["poses"].flip(0)
    other = host(ask(assets, **arguments))
    again = ask(assets, **arguments, out=ours)
    assert again.volume is ours.volume
    expect_same_bits(host(again), other)
    torch.cuda.synchronize()


CYCLES = 1_000_000_000  # a good part of a second


def test_nothing_waits_on_the_host(assets, pairs):
    arguments = on_card(pairs(1000))
    host(ask(assets, **arguments))
    for stream in (torch.cuda.current_stream(), torch.cuda.Stream()):
        torch.cuda.synchronize()
        with torch.cuda.stream(stream):
            torch.cuda._sleep(CYCLES)
            start = time.perf_counter()
            for _ in range(5):
                found = ask(assets, **arguments, stream=stream)
                tensor = torch.from_dlpack(found.volume)
                del found
            took = time.perf_counter() - start
            assert not stream.query(), "all is done: it must have waited"
            assert took < 0.1
            assert tensor.sum().item() > 0


def test_streams_wait_for_each_other(assets, pairs):
    arguments = on_card(pairs(1000))
    expected = host(ask(assets, **arguments))
    torch.cuda.synchronize()
    late = torch.cuda.Stream()
    other = torch.cuda.Stream()
    for made_on, asked_on, read_on in (
            (late, None, None), (late, late, None), (late, other, late), (None, late, other)):
        poses = torch.zeros_like(arguments["poses"])
        torch.cuda.synchronize()
        with torch.cuda.stream(made_on):
            torch.cuda._sleep(CYCLES // 4)
            poses.copy_(arguments["poses"])
            # PyTorch says on which stream it is written: the current one.
            found = ask(assets, **{**arguments, "poses": poses}, stream=asked_on)
        with torch.cuda.stream(read_on):
            volume = torch.from_dlpack(found.volume) * 1
            assert np.array_equal(volume.cpu().numpy(), expected["volume"])


def test_what_a_batch_reads_stays_until_it_is_done(solids, pairs):
    assets = ist.Solids(solids, device="cuda")
    expected = host(ask(assets, **on_card(pairs(1000))))
    side = torch.cuda.Stream()
    for _ in range(3):
        arguments = on_card(pairs(1000))
        torch.cuda.synchronize()
        side.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(side):
            torch.cuda._sleep(CYCLES // 4)
        found = ask(assets, **arguments, stream=side)
        del arguments  # PyTorch may give the memory to others now
        spoiled = [torch.full((1000, 7), 3.0, dtype=torch.float64, device="cuda") for _ in range(20)]
        expect_same_bits(host(found), expected)
        del spoiled
    arguments = on_card(pairs(1000))
    torch.cuda.synchronize()
    with torch.cuda.stream(side):
        torch.cuda._sleep(CYCLES // 4)
    found = ask(assets, **arguments, stream=side)
    del assets, arguments  # waits for the batch
    gc.collect()
    others = ist.Solids(solids[::-1], device="cuda")
    expect_same_bits(host(found), expected)
    del others


def test_answers_outlive_what_they_came_from(assets, pairs):
    arguments = on_card(pairs(5000))
    expected = host(ask(assets, **arguments))
    found = ask(assets, **arguments)
    volume, interface = torch.from_dlpack(found.volume), torch.as_tensor(found.centroid, device="cuda")
    status = found.status
    del found
    gc.collect()
    for _ in range(20):  # would take the memory if it were free
        ask(assets, a=0, b=1, poses=arguments["poses"])
    assert np.array_equal(volume.cpu().numpy(), expected["volume"])
    assert np.array_equal(interface.cpu().numpy(), expected["centroid"])
    assert np.array_equal(status.numpy(), expected["status"])


def test_a_reader_that_drops_answers_early_is_not_disturbed(assets, pairs):
    arguments = on_card(pairs(5000))
    expected = host(ask(assets, **arguments))["volume"]
    reader = torch.cuda.Stream()
    copies = []
    for _ in range(10):
        volume = torch.from_dlpack(ask(assets, **arguments).volume)
        reader.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(reader):
            torch.cuda._sleep(CYCLES // 40)
            copies.append(volume * 1)
        del volume  # read later, on another stream
    torch.cuda.synchronize()
    for copy in copies:
        assert np.array_equal(copy.cpu().numpy(), expected)


def test_memory_is_used_again(assets, pairs):
    arguments = on_card(pairs(100_000))
    for _ in range(5):
        ask(assets, **arguments)
    torch.cuda.synchronize()
    before = torch.cuda.mem_get_info()[0]
    for batch in range(300):
        ask(assets, **arguments)
        if batch % 20 == 0:
            torch.cuda.synchronize()  # what is not done yet holds memory
    assert before - torch.cuda.mem_get_info()[0] < 600e6  # 300 of them are 2.8 GB


def test_no_memory_left_is_an_error_with_a_way_out(assets, pairs):
    arguments = on_card(pairs(1000))
    many = {n: x.repeat(4000, *[1] * (x.ndim - 1)) for n, x in arguments.items()}
    host(ask(assets, **arguments))
    torch.cuda.synchronize()
    free = torch.cuda.mem_get_info()[0]
    filled = torch.empty(free - 150_000_000, dtype=torch.uint8, device="cuda")
    with pytest.raises(ist.Error, match="no device memory left"):
        held = [ask(assets, **many) for _ in range(100)]  # 37 GB
        pytest.fail(f"{len(held)} batches had room")
    del filled
    torch.cuda.empty_cache()
    host(ask(assets, **arguments))


def test_graphs_capture_batches(assets, pairs):
    arguments = on_card(pairs(3000))
    out = {name: torch.empty((3000, 3) if name != "volume" else 3000, dtype=torch.float64,
                             device="cuda") for name in COLUMNS}
    expected = host(ask(assets, **arguments))
    flipped = {**arguments, "poses": arguments["poses"].flip(0)}
    expected_flipped = host(ask(assets, **flipped))
    torch.cuda.synchronize()
    graph = torch.cuda.CUDAGraph()
    side = torch.cuda.Stream()
    with torch.cuda.graph(graph, stream=side):
        ask(assets, **arguments, out=out, stream=side)
        ask(assets, a=0, b=1, poses=arguments["poses"], out=dict(volume=out["volume"]),
                            stream=side)
        ask(assets, **arguments, out=out, stream=side)
    for rows, answers in ((arguments["poses"].clone(), expected),
                          (flipped["poses"], expected_flipped)):
        arguments["poses"].copy_(rows)
        graph.replay()
        torch.cuda.synchronize()
        for name in COLUMNS:
            assert np.array_equal(out[name].cpu().numpy(), answers[name]), name
    refused = torch.cuda.CUDAGraph()
    with pytest.raises(ValueError, match="out: None; wanted arrays for the answers, because the stream"):
        with torch.cuda.graph(refused, stream=side):
            ask(assets, **arguments, stream=side)
    # A captured graph still works after a larger batch.
    host(ask(assets, **{n: x.repeat(2000, *[1] * (x.ndim - 1))
                                        for n, x in arguments.items()}))
    graph.replay()
    torch.cuda.synchronize()
    assert np.array_equal(out["volume"].cpu().numpy(), expected_flipped["volume"])


def test_threads_share_assets(assets, pairs):
    arguments = on_card(pairs(2000))
    expected = host(ask(assets, **arguments))
    torch.cuda.synchronize()
    failed = []

    def work():
        stream = torch.cuda.Stream()
        try:
            for _ in range(20):
                expect_same_bits(host(ask(assets, **arguments, stream=stream)),
                                 expected)
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed, failed[0]


def test_another_device(solids, pairs):
    if torch.cuda.device_count() < 2:
        pytest.skip("one card")
    second = ist.Solids(solids, device="cuda:1")
    assert second.device == "cuda:1"
    arguments = on_card(pairs(1000))
    expected = host(ask(ist.Solids(solids, device="cuda"), **arguments))
    with pytest.raises(TypeError, match="poses: on CUDA device 0; wanted .* on CUDA device 1"):
        ask(second, **arguments)
    moved = {name: x.to("cuda:1") for name, x in arguments.items()}
    stream = torch.cuda.current_stream(1)
    found = ask(second, **moved, stream=stream)
    assert torch.from_dlpack(found.volume).device.index == 1
    expect_same_bits(host(found), expected)
    assert torch.cuda.current_device() == 0


def test_assets_say_what_they_take(solids, assets):
    assert len(assets) == 3 and assets.device == "cuda:0"
    assert assets.bytes >= sum(len(solid.to_bytes()) for solid in solids)
    assert len(ist.Solids([], device="cuda")) == 0


def test_too_large_a_device_is_an_error(solids):
    with pytest.raises(ist.Error, match="GPU"):
        ist.Solids(solids, device=f"cuda:{torch.cuda.device_count()}")
