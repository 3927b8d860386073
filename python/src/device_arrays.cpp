#include "device_arrays.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

namespace ist::python {
namespace {

constexpr const char* kKinds[] = {"int", "uint", "float"};  // DLPack's first codes
constexpr std::uint32_t kDlpack = 1;                        // major version

std::string name_of(const ElementType& type) {
  if (type == py::dtype<bool>()) return "bool";
  if (type.lanes != 1 || type.code >= std::size(kKinds))
    return "of DLPack's code " + std::to_string(type.code);
  return kKinds[type.code] + std::to_string(type.bits);
}

bool of_cuda(int type) {
  return type == py::device::cuda::value || type == py::device::cuda_managed::value;
}

std::string name_of_device(int type, int id) {
  if (type == py::device::cpu::value) return "the CPU";
  if (type == py::device::cuda_host::value) return "the CPU (pinned memory)";
  if (of_cuda(type)) return "CUDA device " + std::to_string(id);
  return "a device of DLPack's type " + std::to_string(type);
}

/// "float64 (n, 7) on CUDA device 0"
std::string describe(const WantedArray& wanted, int device) {
  std::string text;
  for (const ElementType& type : wanted.types) text += (text.empty() ? "" : " or ") + name_of(type);
  text += " (n,";
  for (std::size_t k = 0; k < wanted.inner_shape.size(); ++k)
    text += (k == 0 ? " " : ", ") + std::to_string(wanted.inner_shape[k]);
  return text + ") on CUDA device " + std::to_string(device);
}

/// An array as described by its framework.
struct Described {
  void* data = nullptr;
  ElementType type = {};
  std::vector<std::int64_t> shape, strides;  ///< strides of elements; empty: C order
  bool read_only = false;
  std::shared_ptr<void> keep;
};

[[noreturn]] void refuse_device(const WantedArray& wanted, int device, const std::string& where) {
  throw type_error(wanted.name + ": on " + where + "; wanted " + describe(wanted, device));
}

void check_device(const WantedArray& wanted, int device, int type, int id) {
  if (!of_cuda(type) || id != device) refuse_device(wanted, device, name_of_device(type, id));
}

/// Takes the tensor out of a capsule that may contain a `Tensor`.
template <class Tensor>
std::optional<Described> taken_out(const py::object& capsule, const WantedArray& wanted,
                                   int device) {
  const auto tensor = std::make_shared<Tensor>();
  if (!py::try_cast(capsule, *tensor, false)) return std::nullopt;
  check_device(wanted, device, tensor->device_type(), tensor->device_id());
  Described array;
  array.data = const_cast<void*>(static_cast<const void*>(tensor->data()));
  array.type = tensor->dtype();
  array.read_only = Tensor::ReadOnly;
  for (std::size_t k = 0; k < tensor->ndim(); ++k) {
    array.shape.push_back(static_cast<std::int64_t>(tensor->shape(k)));
    array.strides.push_back(tensor->stride(k));
  }
  array.keep = tensor;
  return array;
}

Described by_dlpack(const py::object& value, const WantedArray& wanted, int device,
                    cuda::Stream stream) {
  const auto [type, id] = py::cast<std::pair<py::object, int>>(value.attr("__dlpack_device__")());
  check_device(wanted, device, py::cast<int>(py::int_(type)), id);
  const py::object export_by = value.attr("__dlpack__");
  const py::int_ handle(reinterpret_cast<std::uintptr_t>(stream));
  py::object capsule;
  try {
    try {
      capsule = export_by(py::arg("stream") = handle,
                          py::arg("max_version") = py::make_tuple(kDlpack, 0));
    } catch (py::python_error& error) {
      const bool unknown = error.matches(PyExc_TypeError) &&
                           std::string(error.what()).find("max_version") != std::string::npos;
      if (!unknown) throw;
      capsule = export_by(py::arg("stream") = handle);  // for frameworks without versions
    }
  } catch (py::python_error& error) {
    const std::string text = wanted.name + ": " + text_of(error.value());
    py::raise_from(error, PyExc_TypeError, "%s", text.c_str());
  }
  // A versioned tensor begins with its version.
  constexpr const char* kVersioned = "dltensor_versioned";
  if (PyCapsule_IsValid(capsule.ptr(), kVersioned)) {
    const auto major =
        *static_cast<const std::uint32_t*>(PyCapsule_GetPointer(capsule.ptr(), kVersioned));
    if (major != kDlpack)
      throw type_error(wanted.name + ": DLPack " + std::to_string(major) + "; wanted 1");
  }
  if (auto array = taken_out<py::ndarray<>>(capsule, wanted, device)) return *array;
  if (auto array = taken_out<py::ndarray<py::ro>>(capsule, wanted, device)) return *array;
  throw type_error(wanted.name + ": its __dlpack__ does not return a tensor capsule");
}

/// Letters of typestr, indexed by DLPack's codes.
constexpr const char* kLetters = "iuf???b";

std::optional<ElementType> type_of(const std::string& typestr) {
  if (typestr.size() < 3 || typestr[0] == '>') return std::nullopt;
  const char* const kind = std::strchr(kLetters, typestr[1]);
  if (kind == nullptr || typestr[2] < '1' || typestr[2] > '8') return std::nullopt;
  return ElementType{static_cast<std::uint8_t>(kind - kLetters),
                     static_cast<std::uint8_t>(8 * (typestr[2] - '0')), 1};
}

Described by_interface(const py::object& value, const WantedArray& wanted, int device,
                       cuda::Stream stream) {
  const auto given = py::cast<py::dict>(value.attr("__cuda_array_interface__"));
  const auto entry = [&](const char* key) -> py::object {
    return given.contains(key) ? py::object(given[key]) : py::none();
  };
  Described array;
  const auto typestr = py::cast<std::string>(given["typestr"]);
  const auto type = type_of(typestr);
  if (!type || !entry("mask").is_none())
    throw type_error(wanted.name + ": " + (type ? "masked" : "dtype " + typestr) + "; wanted " +
                     describe(wanted, device));
  array.type = *type;
  array.shape = py::cast<std::vector<std::int64_t>>(given["shape"]);
  const auto [address, read_only] = py::cast<std::pair<std::uintptr_t, bool>>(given["data"]);
  array.data = reinterpret_cast<void*>(address);
  array.read_only = read_only;
  if (const py::object strides = entry("strides"); !strides.is_none()) {
    array.strides = py::cast<std::vector<std::int64_t>>(strides);
    for (std::int64_t& stride : array.strides) stride = stride * 8 / type->bits;
  }
  // From version 3 on, the stream of the producer's pending work is stated.
  if (const py::object maker = entry("stream"); !maker.is_none()) {
    const auto theirs = reinterpret_cast<cuda::Stream>(py::cast<std::uintptr_t>(maker));
    if (theirs != stream) cuda::Moment(device, theirs).hold(stream);
  }
  array.keep = std::make_shared<py::object>(value);
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

constexpr const char* kNoArray = " is not a device array; wanted ";

}  // namespace

LentArray lend(const py::object& value, const WantedArray& wanted, int device,
               cuda::Stream stream) {
  Described array;
  if (py::hasattr(value, "__dlpack__") && py::hasattr(value, "__dlpack_device__")) {
    array = by_dlpack(value, wanted, device, stream);
  } else if (py::hasattr(value, "__cuda_array_interface__")) {
    array = by_interface(value, wanted, device, stream);
  } else {
    throw type_error(wanted.name + ": a " + type_name_of(value) + kNoArray +
                     describe(wanted, device) + ", by __dlpack__ or __cuda_array_interface__");
  }
  const bool right_type = std::any_of(wanted.types.begin(), wanted.types.end(),
                                      [&](const ElementType& type) { return array.type == type; });
  if (!right_type)
    throw type_error(wanted.name + ": dtype " + name_of(array.type) + "; wanted " +
                     describe(wanted, device));
  const bool right_shape =
      !array.shape.empty() && std::equal(array.shape.begin() + 1, array.shape.end(),
                                         wanted.inner_shape.begin(), wanted.inner_shape.end());
  if (!right_shape)
    throw value_error(wanted.name + ": shape " +
                      text_of(Shape(array.shape.begin(), array.shape.end())) + "; wanted " +
                      describe(wanted, device));
  LentArray lent{array.data, array.shape[0], std::move(array.keep)};
  if (lent.rows == 0) return {nullptr, 0, std::move(lent.keep)};
  if (!in_c_order(array))
    throw value_error(wanted.name + ": not in C order; wanted " + describe(wanted, device) +
                      " without gaps");
  if (wanted.written && array.read_only)
    throw value_error(wanted.name + ": read-only; wanted writable memory");
  if (reinterpret_cast<std::uintptr_t>(lent.data) % (array.type.bits / 8u) != 0)
    throw value_error(wanted.name + ": its address is not a multiple of the element size");
  const int found = cuda::device_of(lent.data);
  if (found != device)
    refuse_device(wanted, device,
                  found < 0 ? "no CUDA device" : name_of_device(py::device::cuda::value, found));
  return lent;
}

cuda::Stream stream_of(const py::object& stream) {
  const auto handle = [&]() -> std::uintptr_t {
    if (stream.is_none()) return 1;
    if (py::isinstance<py::int_>(stream)) return py::cast<std::uintptr_t>(stream);
    if (py::hasattr(stream, "__cuda_stream__"))
      return py::cast<std::pair<int, std::uintptr_t>>(stream.attr("__cuda_stream__")()).second;
    for (const char* const name : {"cuda_stream", "ptr"})  // PyTorch's, CuPy's
      if (py::hasattr(stream, name)) return py::cast<std::uintptr_t>(stream.attr(name));
    throw type_error("stream: a " + type_name_of(stream) +
                     " is not a stream; wanted a handle, or an object with __cuda_stream__, "
                     "cuda_stream or ptr");
  }();
  // 0 is the legacy default stream for CUDA, and no stream for DLPack.
  return reinterpret_cast<cuda::Stream>(handle == 0 ? std::uintptr_t{1} : handle);
}

namespace {

py::object to_dlpack(const py::object& held, const py::object& stream,
                     const py::object& max_version, const py::object& dl_device,
                     const py::object& copy) {
  const DeviceArray& self = py::cast<const DeviceArray&>(held);
  if (!copy.is_none() && py::cast<bool>(copy)) throw py::buffer_error("copy=True is not supported");
  if (!dl_device.is_none()) {
    const auto [type, id] = py::cast<std::pair<py::object, int>>(dl_device);
    if (py::cast<int>(py::int_(type)) != py::device::cuda::value || id != self.block->device())
      throw py::buffer_error(
          "a copy on another device is not supported; numpy() copies to the host");
  }
  // −1: the consumer ensures that nothing is read before it is written.
  if (!py::isinstance<py::int_>(stream) || py::cast<std::intptr_t>(stream) != -1)
    self.ready->hold(stream_of(stream));
  return py::cast(py::ndarray<py::array_api, py::device::cuda>(
                      self.data, self.shape.size(), self.shape.data(), held, nullptr, self.type,
                      py::device::cuda::value, self.block->device()))
      .attr("__dlpack__")(py::arg("max_version") = max_version);
}

std::string typestr_of(const ElementType& type) {
  return std::string("<") + kLetters[type.code] + std::to_string(type.bits / 8);
}

py::dict interface_of(const DeviceArray& self) {
  // Our own stream may be gone by now; the default stream never is.
  self.ready->hold(cuda::legacy_stream());
  py::dict out;
  const bool empty = self.shape[0] == 0;
  out["shape"] = py::tuple(py::cast(self.shape));
  out["typestr"] = typestr_of(self.type);
  out["data"] = py::make_tuple(empty ? 0 : reinterpret_cast<std::uintptr_t>(self.data), false);
  out["strides"] = py::none();
  out["stream"] = 1;
  out["version"] = 3;
  return out;
}

py::object to_numpy(const DeviceArray& self) {
  std::size_t bytes = self.type.bits / 8u;
  for (const std::size_t n : self.shape) bytes *= n;
  const Column<std::byte> memory({bytes});
  const DeviceArray held = self;  // another thread may overwrite it meanwhile
  {
    const py::gil_scoped_release released;
    cuda::copy_to_host(memory.data.get(), held.data, bytes, held.block->device(), *held.ready);
  }
  return memory.handed_out(held.shape, held.type);
}

}  // namespace

void add_device_array(py::module_& module) {
  py::class_<DeviceArray>(
      module, "Array",
      "An array in device memory that any framework takes without a copy: torch.from_dlpack(x), "
      "cupy.from_dlpack(x), jax.dlpack.from_dlpack(x), or by __cuda_array_interface__.\n\n"
      "The memory lives as long as a reference to it. A consumer's stream, not the host, waits "
      "until it is written.")
      .def_prop_ro(
          "shape", [](const DeviceArray& self) { return py::tuple(py::cast(self.shape)); },
          "(n,) or (n, 3)")
      .def_prop_ro(
          "dtype",
          [](const DeviceArray& self) {
            return py::module_::import_("numpy").attr("dtype")(typestr_of(self.type));
          },
          "NumPy's.")
      .def_prop_ro(
          "device", [](const DeviceArray& self) { return self.block->device(); }, "CUDA's number.")
      .def("__len__", [](const DeviceArray& self) { return self.shape[0]; })
      .def("__dlpack__", &to_dlpack, py::kw_only(), py::arg("stream") = py::none(),
           py::arg("max_version") = py::none(), py::arg("dl_device") = py::none(),
           py::arg("copy") = py::none(),
           "A capsule of DLPack 1.0, or 0.x without `max_version`. stream: the reading stream; "
           "-1: no synchronisation here.")
      .def("__dlpack_device__",
           [](const DeviceArray& self) {
             return py::make_tuple(py::device::cuda::value, self.block->device());
           })
      .def_prop_ro("__cuda_array_interface__", &interface_of)
      .def("numpy", &to_numpy, "A copy on the host; waits until it is written.");
}

}  // namespace ist::python
