#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "arrays.h"
#include "cuda_calls.h"

// Arrays in device memory: those of any framework as arguments, by DLPack or
// __cuda_array_interface__, and ours for any framework. Nothing is copied.

namespace ist::python {

using ElementType = py::dlpack::dtype;

inline constexpr ElementType kFloat64 = py::dtype<double>();
inline constexpr ElementType kUInt32 = py::dtype<std::uint32_t>();
inline constexpr ElementType kInt32 = py::dtype<std::int32_t>();
inline constexpr ElementType kUInt64 = py::dtype<std::uint64_t>();
inline constexpr ElementType kInt64 = py::dtype<std::int64_t>();

struct WantedArray {
  std::string name;                       ///< of the argument, for messages
  std::vector<ElementType> types;         ///< any of them
  std::vector<std::int64_t> inner_shape;  ///< (n, inner shape)
  bool written = false;
};

/// An argument's memory, valid as long as `keep`.
struct LentArray {
  void* data = nullptr;  ///< null: no rows
  std::int64_t rows = 0;
  std::shared_ptr<void> keep;  ///< must be dropped with the GIL held
};

/// Takes a view of an argument. Pending work of the argument's framework on it precedes the work
/// that `stream` is given from now on.
///
/// Anything other than an array of `device` in C order is a TypeError (kind, dtype, device) or a
/// ValueError (shape, order).
LentArray lend(const py::object& value, const WantedArray& wanted, int device, cuda::Stream stream);

/// A part of a block, as a Python object that any framework accepts.
struct DeviceArray {
  std::shared_ptr<const cuda::Block> block;
  std::shared_ptr<const cuda::Moment> ready;
  std::byte* data = nullptr;
  Shape shape;
  ElementType type = kFloat64;
};

/// The class of DeviceArray.
void add_device_array(py::module_& module);

/// From None, a handle, or a framework's stream; else TypeError.
cuda::Stream stream_of(const py::object& stream);

}  // namespace ist::python
