"""Arrays on a GPU as far as it goes without a card: what it says, and arguments that do not fit.

With a card: tests/python/test_on_gpu.py.
"""
import ctypes

import numpy as np
import pytest

import ist
from ist.gpu import _lend

CUDA = (2, 0)


class Tensor(ctypes.Structure):
    """DLTensor."""
    _fields_ = [("data", ctypes.c_void_p), ("device_type", ctypes.c_int32),
                ("device_id", ctypes.c_int32), ("ndim", ctypes.c_int32), ("code", ctypes.c_uint8),
                ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)),
                ("strides", ctypes.POINTER(ctypes.c_int64)), ("byte_offset", ctypes.c_uint64)]


DELETER = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class Managed(ctypes.Structure):
    _fields_ = [("tensor", Tensor), ("context", ctypes.c_void_p), ("deleter", DELETER)]


class Versioned(ctypes.Structure):
    _fields_ = [("major", ctypes.c_uint32), ("minor", ctypes.c_uint32),
                ("context", ctypes.c_void_p), ("deleter", DELETER), ("flags", ctypes.c_uint64),
                ("tensor", Tensor)]


new_capsule = ctypes.pythonapi.PyCapsule_New
new_capsule.restype = ctypes.py_object
new_capsule.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]


class Exporter:
    """Says that host memory is a device's; counts what is given back."""

    def __init__(self, shape=(4, 7), *, strides=None, code=2, bits=64, lanes=1, offset=0,
                 device=CUDA, said=None, version=(1, 0), flags=0, rounded=True):
        self.memory = np.zeros(1000)
        self.said = said or device
        self.given_back = 0
        self.asked = []
        dims = len(shape)
        self.held = [(ctypes.c_int64 * dims)(*shape)]
        tensor = Tensor(self.memory.ctypes.data + (0 if rounded else 4), *device, dims, code, bits,
                        lanes, self.held[0], None, offset)
        if strides is not None:
            self.held.append((ctypes.c_int64 * dims)(*strides))
            tensor.strides = self.held[1]
        deleter = DELETER(self._give_back)
        if version is None:
            self.managed, self.name = Managed(tensor, None, deleter), b"dltensor"
        else:
            self.managed = Versioned(*version, None, deleter, flags, tensor)
            self.name = b"dltensor_versioned"

    def _give_back(self, _):
        self.given_back += 1

    def __dlpack_device__(self):
        return self.said

    def __dlpack__(self, **arguments):
        if "max_version" in arguments and self.name == b"dltensor":
            raise TypeError("__dlpack__() got an unexpected keyword argument 'max_version'")
        self.asked.append(arguments)
        return new_capsule(ctypes.addressof(self.managed), self.name, None)


class Interface:
    """Says by __cuda_array_interface__ what it is told to."""

    def __init__(self, **entries):
        self.memory = np.zeros((4, 7))
        self.__cuda_array_interface__ = dict(
            shape=(4, 7), typestr="<f8", data=(self.memory.ctypes.data, False), version=3) | entries


WANTED = r"; wanted float64 \(n, 7\) on CUDA device 0"


@pytest.mark.parametrize("version", [None, (1, 0), (1, 3)])
@pytest.mark.parametrize("arguments, error, text", [
    (dict(), TypeError, "poses: on no CUDA device" + WANTED),  # whatever it says, it is the host's
    (dict(shape=(4, 6)), ValueError, r"poses: shape \(4, 6\)" + WANTED),
    (dict(shape=(28,)), ValueError, r"poses: shape \(28,\)" + WANTED),
    (dict(shape=(2, 2, 7)), ValueError, r"poses: shape \(2, 2, 7\)" + WANTED),
    (dict(bits=32), TypeError, "poses: dtype float32" + WANTED),
    (dict(code=0), TypeError, "poses: dtype int64" + WANTED),
    (dict(code=4), TypeError, "poses: dtype of DLPack's code 4" + WANTED),
    (dict(lanes=2), TypeError, "poses: dtype of DLPack's code 2" + WANTED),
    (dict(strides=(1, 4)), ValueError, "poses: not in C order"),
    (dict(strides=(14, 1)), ValueError, "poses: not in C order"),
    (dict(rounded=False), ValueError, "poses: its address is not a multiple"),
    (dict(device=(1, 0)), TypeError, "poses: on the CPU" + WANTED),
    (dict(device=(3, 0)), TypeError, r"poses: on the CPU \(pinned memory\)" + WANTED),
    (dict(device=(2, 1)), TypeError, "poses: on CUDA device 1" + WANTED),
    (dict(device=(10, 0)), TypeError, "poses: on a device of DLPack's type 10" + WANTED),
    (dict(device=(1, 0), said=CUDA), TypeError, "poses: on the CPU" + WANTED),
])
def test_tensors_that_do_not_fit_are_named_and_given_back(version, arguments, error, text):
    exporter = Exporter(version=version, **arguments)
    with pytest.raises(error, match=text):
        _lend(exporter, "poses", 7)
    assert exporter.given_back == len(exporter.asked)  # each that was taken out of its capsule
    assert all(asked["stream"] == 1 for asked in exporter.asked)


def test_tensors_of_no_rows_need_no_memory():
    for version in (None, (1, 0)):
        exporter = Exporter((0, 7), version=version)
        assert _lend(exporter, "poses", 7) == 0 and exporter.given_back == 1
    assert _lend(Interface(shape=(0, 7), data=(0, False)), "poses", 7) == 0


def test_strides_of_one_row_do_not_matter():
    with pytest.raises(TypeError, match="on no CUDA device"):
        _lend(Exporter((1, 7), strides=(99, 1)), "poses", 7)


def test_what_is_read_only_is_not_written():
    with pytest.raises(ValueError, match="out: read-only"):
        _lend(Exporter(flags=1), "out", 7, written=True)
    with pytest.raises(ValueError, match="out: read-only"):
        _lend(Interface(data=(8, True)), "out", 7, written=True)


def test_other_versions_of_dlpack_are_refused():
    exporter = Exporter(version=(2, 0))
    with pytest.raises(TypeError, match="poses: DLPack 2; wanted 1"):
        _lend(exporter, "poses", 7)
    assert exporter.given_back == 0  # it stays in its capsule, which is the exporter's to free


@pytest.mark.parametrize("entries, error, text", [
    (dict(), TypeError, "poses: on no CUDA device" + WANTED),
    (dict(shape=(4, 6)), ValueError, r"poses: shape \(4, 6\)" + WANTED),
    (dict(shape=(28,)), ValueError, r"poses: shape \(28,\)" + WANTED),
    (dict(typestr="<f4"), TypeError, "poses: dtype float32" + WANTED),
    (dict(typestr="<i8"), TypeError, "poses: dtype int64" + WANTED),
    (dict(typestr=">f8"), TypeError, "poses: dtype >f8" + WANTED),
    (dict(typestr="<c16"), TypeError, "poses: dtype <c16" + WANTED),
    (dict(mask=object()), TypeError, "poses: masked" + WANTED),
    (dict(strides=(112, 8)), ValueError, "poses: not in C order"),
    (dict(strides=(8, 32)), ValueError, "poses: not in C order"),
    (dict(strides=(56, 8)), TypeError, "poses: on no CUDA device"),
    (dict(strides=None), TypeError, "poses: on no CUDA device"),
])
def test_interfaces_that_do_not_fit_are_named(entries, error, text):
    with pytest.raises(error, match=text):
        _lend(Interface(**entries), "poses", 7)


def test_what_is_no_device_array_is_named():
    for value in ([1.0] * 7, "poses", 3.0, object()):
        with pytest.raises(TypeError, match="poses: a .* is not a device array; wanted float64"):
            _lend(value, "poses", 7)
    with pytest.raises(TypeError, match="poses: on the CPU" + WANTED):
        _lend(np.zeros((4, 7)), "poses", 7)

    class Broken(Exporter):
        def __dlpack__(self, **arguments):
            raise BufferError("Can't export tensors that require gradient")

    with pytest.raises(TypeError, match="poses: Can't export tensors that require") as raised:
        _lend(Broken(), "poses", 7)
    assert isinstance(raised.value.__cause__, BufferError)

    class Odd(Exporter):
        def __dlpack__(self, **arguments):
            return 7

    with pytest.raises(TypeError, match="poses: its __dlpack__ does not return a tensor capsule"):
        _lend(Odd(), "poses", 7)


def test_a_capsule_is_taken_once():
    exporter = Exporter()
    capsule = exporter.__dlpack__()
    exporter.__dlpack__ = None

    class Again:
        def __dlpack_device__(self):
            return CUDA

        def __dlpack__(self, **_):
            return capsule

    with pytest.raises(TypeError, match="on no CUDA device"):
        _lend(Again(), "poses", 7)
    assert exporter.given_back == 1
    with pytest.raises(TypeError, match="does not return a tensor capsule"):
        _lend(Again(), "poses", 7)
    assert exporter.given_back == 1


def test_without_a_card_it_says_so(cube):
    if ist.gpu.available():
        assert ist.gpu.why_not() is None
        pytest.skip("there is a card: tests/python/test_on_gpu.py")
    reason = ist.gpu.why_not()
    assert "GPU" in reason
    with pytest.raises(ist.Error, match=reason):
        ist.Solids([cube], device="cuda")
    for cls in (ist.gpu.Array, ist.gpu.Penetration):
        with pytest.raises(TypeError, match="no constructor defined"):
            cls()
