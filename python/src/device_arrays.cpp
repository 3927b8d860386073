#include "device_arrays.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <utility>

#include "arrays.h"

namespace ist::python {
namespace {

using dlpack::Tensor;

std::string name_of(const dlpack::DataType& type) {
  static constexpr const char* kKinds[] = {"int", "uint", "float"};
  if (type.lanes != 1 || type.code > dlpack::kFloat)
    return "of DLPack's code " + std::to_string(type.code);
  return kKinds[type.code] + std::to_string(type.bits);
}

dlpack::DataType data_type(const ElementType& type) { return {type.code, type.bits, 1}; }

std::string name_of_device(std::int32_t type, std::int32_t id) {
  if (type == dlpack::kCpu) return "the CPU";
  if (type == dlpack::kCudaHost) return "the CPU (pinned memory)";
  if (type == dlpack::kCuda || type == dlpack::kCudaManaged)
    return "CUDA device " + std::to_string(id);
  return "a device of DLPack's type " + std::to_string(type);
}

/// "float64 (n, 7) on CUDA device 0"
std::string text_of(const WantedArray& wanted, int device) {
  std::string text;
  for (const ElementType& type : wanted.types)
    text += (text.empty() ? "" : " or ") + name_of(data_type(type));
  text += " (n,";
  for (std::size_t k = 0; k < wanted.inner_shape.size(); ++k)
    text += (k == 0 ? " " : ", ") + std::to_string(wanted.inner_shape[k]);
  return text + ") on CUDA device " + std::to_string(device);
}

/// An array as its framework describes it.
struct Described {
  void* data = nullptr;
  dlpack::DataType type = {};
  std::vector<std::int64_t> shape, strides;  ///< strides of elements; empty: C order
  bool read_only = false;
  std::shared_ptr<void> keep;
};

Described described(const Tensor& tensor, bool read_only, std::shared_ptr<void> keep) {
  const auto dims = static_cast<std::size_t>(tensor.ndim);
  Described array;
  array.data = static_cast<std::byte*>(tensor.data) + tensor.byte_offset;
  array.type = tensor.dtype;
  array.shape.assign(tensor.shape, tensor.shape + dims);
  if (tensor.strides != nullptr) array.strides.assign(tensor.strides, tensor.strides + dims);
  array.read_only = read_only;
  array.keep = std::move(keep);
  return array;
}

/// Takes what is in a capsule out of it; it is given back when `keep` is dropped.
template <class Managed>
std::shared_ptr<Managed> taken_out(const py::object& capsule, const char* name, const char* used) {
  auto* const managed = static_cast<Managed*>(PyCapsule_GetPointer(capsule.ptr(), name));
  if (managed == nullptr) throw py::error_already_set();
  PyCapsule_SetName(capsule.ptr(), used);
  return {managed, [](Managed* m) {
            if (m->deleter != nullptr) m->deleter(m);
          }};
}

[[noreturn]] void refuse_device(const WantedArray& wanted, int device, const std::string& where) {
  throw py::type_error(wanted.name + ": on " + where + "; wanted " + text_of(wanted, device));
}

void check_device(const WantedArray& wanted, int device, std::int32_t type, std::int32_t id) {
  if ((type != dlpack::kCuda && type != dlpack::kCudaManaged) || id != device)
    refuse_device(wanted, device, name_of_device(type, id));
}

Described by_dlpack(const py::object& value, const WantedArray& wanted, int device,
                    cuda::Stream stream) {
  const auto [type, id] =
      value.attr("__dlpack_device__")().cast<std::pair<py::object, std::int32_t>>();
  check_device(wanted, device, py::int_(type).cast<std::int32_t>(), id);
  const py::object export_by = value.attr("__dlpack__");
  const py::int_ handle(reinterpret_cast<std::uintptr_t>(stream));
  py::object capsule;
  try {
    try {
      capsule = export_by(
          py::arg("stream") = handle,
          py::arg("max_version") = py::make_tuple(dlpack::kVersion.major, dlpack::kVersion.minor));
    } catch (py::error_already_set& error) {
      const bool unknown = error.matches(PyExc_TypeError) &&
                           std::string(error.what()).find("max_version") != std::string::npos;
      if (!unknown) throw;
      capsule = export_by(py::arg("stream") = handle);  // of a framework that knows no versions
    }
  } catch (py::error_already_set& error) {
    const std::string text = wanted.name + ": " + py::str(error.value()).cast<std::string>();
    py::raise_from(error, PyExc_TypeError, text.c_str());
    throw py::error_already_set();
  }
  if (PyCapsule_IsValid(capsule.ptr(), dlpack::kVersionedCapsule)) {
    const auto held = taken_out<dlpack::VersionedTensor>(capsule, dlpack::kVersionedCapsule,
                                                         dlpack::kUsedVersionedCapsule);
    if (held->version.major != dlpack::kVersion.major)
      throw py::type_error(wanted.name + ": DLPack " + std::to_string(held->version.major) +
                           "; wanted 1");
    const Tensor& tensor = held->tensor;
    check_device(wanted, device, tensor.device.type, tensor.device.id);
    return described(tensor, (held->flags & dlpack::kReadOnly) != 0, held);
  }
  if (!PyCapsule_IsValid(capsule.ptr(), dlpack::kCapsule))
    throw py::type_error(wanted.name + ": its __dlpack__ gives no capsule of a tensor");
  const auto held =
      taken_out<dlpack::ManagedTensor>(capsule, dlpack::kCapsule, dlpack::kUsedCapsule);
  check_device(wanted, device, held->tensor.device.type, held->tensor.device.id);
  return described(held->tensor, false, held);
}

std::optional<dlpack::DataType> type_of(const std::string& typestr) {
  if (typestr.size() < 3 || typestr[0] == '>') return std::nullopt;
  const char* const kinds = "iuf";
  const char* const kind = std::strchr(kinds, typestr[1]);
  if (kind == nullptr || typestr[2] < '1' || typestr[2] > '8') return std::nullopt;
  return dlpack::DataType{static_cast<std::uint8_t>(kind - kinds),
                          static_cast<std::uint8_t>(8 * (typestr[2] - '0')), 1};
}

Described by_interface(const py::object& value, const WantedArray& wanted, int device,
                       cuda::Stream stream) {
  const auto given = value.attr("__cuda_array_interface__").cast<py::dict>();
  const auto entry = [&](const char* key) -> py::object {
    return given.contains(key) ? py::object(given[key]) : py::none();
  };
  Described array;
  const auto typestr = given["typestr"].cast<std::string>();
  const auto type = type_of(typestr);
  if (!type || !entry("mask").is_none())
    throw py::type_error(wanted.name + ": " + (type ? "masked" : "dtype " + typestr) + "; wanted " +
                         text_of(wanted, device));
  array.type = *type;
  array.shape = given["shape"].cast<std::vector<std::int64_t>>();
  const auto [address, read_only] = given["data"].cast<std::pair<std::uintptr_t, bool>>();
  array.data = reinterpret_cast<void*>(address);
  array.read_only = read_only;
  if (const py::object strides = entry("strides"); !strides.is_none()) {
    array.strides = strides.cast<std::vector<std::int64_t>>();
    for (std::int64_t& stride : array.strides) stride = stride * 8 / type->bits;
  }
  // What its maker still does to it, on which stream, is told from version 3 on.
  if (const py::object maker = entry("stream"); !maker.is_none()) {
    const auto theirs = reinterpret_cast<cuda::Stream>(maker.cast<std::uintptr_t>());
    if (theirs != stream) cuda::Moment(device, theirs).hold(stream);
  }
  array.keep = std::shared_ptr<void>(new py::object(value),
                                     [](void* held) { delete static_cast<py::object*>(held); });
  return array;
}

bool in_c_order(const Described& array) {
  if (array.strides.empty()) return true;
  std::int64_t expected = 1;
  for (std::size_t k = array.shape.size(); k-- > 0;) {
    if (array.shape[k] != 1 && array.strides[k] != expected) return false;
    expected *= array.shape[k];
  }
  return true;
}

constexpr const char* kNoArray = " is no device array: wanted ";

}  // namespace

LentArray lend(const py::object& value, const WantedArray& wanted, int device,
               cuda::Stream stream) {
  Described array;
  if (py::hasattr(value, "__dlpack__") && py::hasattr(value, "__dlpack_device__")) {
    array = by_dlpack(value, wanted, device, stream);
  } else if (py::hasattr(value, "__cuda_array_interface__")) {
    array = by_interface(value, wanted, device, stream);
  } else {
    throw py::type_error(
        wanted.name + ": a " + py::type::handle_of(value).attr("__name__").cast<std::string>() +
        kNoArray + text_of(wanted, device) + ", by __dlpack__ or __cuda_array_interface__");
  }
  const bool right_type =
      std::any_of(wanted.types.begin(), wanted.types.end(), [&](const ElementType& type) {
        return array.type.lanes == 1 &&
               type == ElementType{dlpack::TypeCode(array.type.code), array.type.bits};
      });
  if (!right_type)
    throw py::type_error(wanted.name + ": dtype " + name_of(array.type) + "; wanted " +
                         text_of(wanted, device));
  const bool right_shape =
      !array.shape.empty() && std::equal(array.shape.begin() + 1, array.shape.end(),
                                         wanted.inner_shape.begin(), wanted.inner_shape.end());
  if (!right_shape)
    throw py::value_error(wanted.name + ": shape " +
                          text_of(Shape(array.shape.begin(), array.shape.end())) + "; wanted " +
                          text_of(wanted, device));
  LentArray lent{array.data, array.shape[0], std::move(array.keep)};
  if (lent.rows == 0) return {nullptr, 0, std::move(lent.keep)};
  if (!in_c_order(array))
    throw py::value_error(wanted.name + ": not in C order; wanted " + text_of(wanted, device) +
                          " without gaps");
  if (wanted.written && array.read_only)
    throw py::value_error(wanted.name + ": read-only; wanted memory that answers may go to");
  if (reinterpret_cast<std::uintptr_t>(lent.data) % (array.type.bits / 8u) != 0)
    throw py::value_error(wanted.name + ": its address is no multiple of its elements' size");
  const int found = cuda::device_of(lent.data);
  if (found != device)
    refuse_device(wanted, device,
                  found < 0 ? "no CUDA device" : name_of_device(dlpack::kCuda, found));
  return lent;
}

cuda::Stream stream_of(const py::object& stream) {
  const auto handle = [&]() -> std::uintptr_t {
    if (stream.is_none()) return 1;
    if (py::isinstance<py::int_>(stream)) return stream.cast<std::uintptr_t>();
    if (py::hasattr(stream, "__cuda_stream__"))
      return stream.attr("__cuda_stream__")().cast<std::pair<int, std::uintptr_t>>().second;
    for (const char* const name : {"cuda_stream", "ptr"})  // PyTorch's, CuPy's
      if (py::hasattr(stream, name)) return stream.attr(name).cast<std::uintptr_t>();
    throw py::type_error("stream: a " +
                         py::type::handle_of(stream).attr("__name__").cast<std::string>() +
                         " is no stream; wanted a handle, or an object with __cuda_stream__, "
                         "cuda_stream or ptr");
  }();
  // 0 is the legacy default stream for CUDA, and no stream for DLPack.
  return reinterpret_cast<cuda::Stream>(handle == 0 ? std::uintptr_t{1} : handle);
}

namespace {

/// What a capsule of ours owns.
template <class Managed>
struct Exported {
  Managed managed = {};
  DeviceArray array;
};

template <class Managed>
py::capsule exported(const DeviceArray& array, const char* name) {
  auto* const made = new Exported<Managed>;
  made->array = array;
  Tensor& tensor = made->managed.tensor;
  tensor.data = array.data;
  tensor.device = {dlpack::kCuda, array.block->device()};
  tensor.ndim = static_cast<std::int32_t>(array.shape.size());
  tensor.dtype = data_type(array.type);
  tensor.shape = made->array.shape.data();
  made->managed.context = made;
  made->managed.deleter = [](Managed* self) {
    delete static_cast<Exported<Managed>*>(self->context);
  };
  if constexpr (std::is_same_v<Managed, dlpack::VersionedTensor>)
    made->managed.version = dlpack::kVersion;
  return py::capsule(&made->managed, name, [](PyObject* capsule) {
    // Whoever took the tensor out has renamed it.
    for (const char* const unused : {dlpack::kCapsule, dlpack::kVersionedCapsule}) {
      if (!PyCapsule_IsValid(capsule, unused)) continue;
      auto* const left = static_cast<Managed*>(PyCapsule_GetPointer(capsule, unused));
      left->deleter(left);
    }
  });
}

py::capsule to_dlpack(const DeviceArray& self, const py::object& stream,
                      const py::object& max_version, const py::object& dl_device,
                      const py::object& copy) {
  const auto refuse = [](const char* why) {
    PyErr_SetString(PyExc_BufferError, why);
    throw py::error_already_set();
  };
  if (!copy.is_none() && copy.cast<bool>()) refuse("a copy is not made: copy=True");
  if (!dl_device.is_none()) {
    const auto [type, id] = dl_device.cast<std::pair<py::object, int>>();
    if (py::int_(type).cast<int>() != dlpack::kCuda || id != self.block->device())
      refuse("a copy on another device is not made: numpy() makes one on the host");
  }
  // −1: whoever asks sees to it that nothing is read before it is written.
  if (!py::isinstance<py::int_>(stream) || stream.cast<std::intptr_t>() != -1)
    self.ready->hold(stream_of(stream));
  const bool versioned =
      !max_version.is_none() &&
      max_version.cast<std::pair<std::uint32_t, std::uint32_t>>().first >= dlpack::kVersion.major;
  return versioned ? exported<dlpack::VersionedTensor>(self, dlpack::kVersionedCapsule)
                   : exported<dlpack::ManagedTensor>(self, dlpack::kCapsule);
}

std::string typestr_of(const ElementType& type) {
  return std::string("<") + "iuf"[type.code] + std::to_string(type.bytes());
}

py::dict interface_of(const DeviceArray& self) {
  // Our own stream may be gone by now; the default one never is.
  self.ready->hold(cuda::legacy_stream());
  py::dict out;
  py::tuple shape(self.shape.size());
  for (std::size_t k = 0; k < self.shape.size(); ++k) shape[k] = self.shape[k];
  const bool empty = self.shape[0] == 0;
  out["shape"] = shape;
  out["typestr"] = typestr_of(self.type);
  out["data"] = py::make_tuple(empty ? 0 : reinterpret_cast<std::uintptr_t>(self.data), false);
  out["strides"] = py::none();
  out["stream"] = 1;
  out["version"] = 3;
  return out;
}

py::array to_numpy(const DeviceArray& self) {
  py::array out(py::dtype(typestr_of(self.type)),
                std::vector<py::ssize_t>(self.shape.begin(), self.shape.end()));
  void* const to = out.mutable_data();
  const auto bytes = static_cast<std::size_t>(out.nbytes());
  const DeviceArray held = self;  // another thread may have it written again meanwhile
  const py::gil_scoped_release released;
  cuda::copy_to_host(to, held.data, bytes, held.block->device(), *held.ready);
  return out;
}

}  // namespace

void add_device_array(py::module_& module) {
  py::class_<DeviceArray>(
      module, "Array",
      "An array in device memory that any framework takes without a copy: torch.from_dlpack(x), "
      "cupy.from_dlpack(x), jax.dlpack.from_dlpack(x), or by __cuda_array_interface__.\n\n"
      "The memory stays as long as anybody holds it. Whoever takes it waits, on its stream and not "
      "on the host, until it is written.")
      .def_property_readonly(
          "shape", [](const DeviceArray& self) { return py::tuple(py::cast(self.shape)); },
          "(n,) or (n, 3)")
      .def_property_readonly(
          "dtype", [](const DeviceArray& self) { return py::dtype(typestr_of(self.type)); },
          "NumPy's.")
      .def_property_readonly(
          "device", [](const DeviceArray& self) { return self.block->device(); }, "CUDA's number.")
      .def("__len__", [](const DeviceArray& self) { return self.shape[0]; })
      .def("__dlpack__", &to_dlpack, py::kw_only(), py::arg("stream") = py::none(),
           py::arg("max_version") = py::none(), py::arg("dl_device") = py::none(),
           py::arg("copy") = py::none(),
           "A capsule of DLPack 1.0, or 0.x without `max_version`. stream: that will read it; "
           "-1: reads wait otherwise.")
      .def("__dlpack_device__",
           [](const DeviceArray& self) {
             return py::make_tuple(static_cast<int>(dlpack::kCuda), self.block->device());
           })
      .def_property_readonly("__cuda_array_interface__", &interface_of)
      .def("numpy", &to_numpy, "A copy on the host; waits until it is written.");
}

}  // namespace ist::python
