#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

// Arguments and answers as NumPy arrays. What does not fit is a TypeError (dtype) or a ValueError
// (shape, value) that names the argument, what it is and what was wanted.

namespace ist::python {

namespace py = pybind11;

using Shape = std::vector<py::ssize_t>;
using Doubles = py::array_t<double, py::array::c_style>;
using Integers = py::array_t<std::int64_t, py::array::c_style>;
using Floats = py::array_t<float, py::array::c_style>;

/// Real numbers. The argument's own memory if that holds them in C order, else a copy.
/// `wanted`: for the message, "(n, 7)".
Doubles take_doubles(const py::handle& value, const std::string& name, const std::string& wanted);
Floats take_floats(const py::handle& value, const std::string& name, const std::string& wanted);

/// Whole numbers, likewise.
Integers take_integers(const py::handle& value, const std::string& name, const std::string& wanted);

/// "(3, 7)"
std::string text_of(const Shape& shape);
Shape shape_of(const py::array& array);

[[noreturn]] void refuse_shape(const py::array& array, const std::string& name,
                               const std::string& wanted);

/// A new array of shape `rows` + `each`, all zero, and where its data is. What nobody writes to is
/// not touched: of a long one it takes no memory and no time.
template <class T>
struct Column {
  Column() = default;
  Column(Shape rows, const Shape& each) : width(1) {
    for (const py::ssize_t n : each) width *= static_cast<std::size_t>(n);
    rows.insert(rows.end(), each.begin(), each.end());
    std::size_t count = 1;
    for (const py::ssize_t n : rows) count *= static_cast<std::size_t>(n);
    if (count * sizeof(T) < kLong) {
      array = py::array_t<T>(rows);
      data = static_cast<T*>(array.mutable_data());
      std::fill_n(data, count, T());
    } else {
      data = static_cast<T*>(std::calloc(count, sizeof(T)));
      if (data == nullptr) throw std::bad_alloc();
      array = py::array_t<T>(rows, data, py::capsule(data, std::free));
    }
  }

  T* row(std::size_t i) const { return data + i * width; }

  static constexpr std::size_t kLong = 1 << 16;  // bytes

  py::array array;
  T* data = nullptr;
  std::size_t width = 0;
};

/// An array as it is handed out: a number where it has no dimension.
inline py::object handed_out(const py::array& array) {
  if (array.ndim() == 0) return array[py::tuple()];
  return array;
}

}  // namespace ist::python
