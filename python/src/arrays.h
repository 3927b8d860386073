#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "query/base/members.h"

// Arguments and answers as arrays. Unsuitable arguments are a TypeError (dtype) or a ValueError
// (shape, value) that names the argument, its type and the expected one.

namespace ist::python {

namespace py = nanobind;

inline py::builtin_exception value_error(const std::string& text) {
  return py::value_error(text.c_str());
}
inline py::builtin_exception type_error(const std::string& text) {
  return py::type_error(text.c_str());
}

inline std::string text_of(const py::handle& value) { return py::str(value).c_str(); }
inline std::string type_name_of(const py::handle& value) {
  return text_of(value.type().attr("__name__"));
}

using Shape = std::vector<std::size_t>;

/// The memory of an argument, in C order, valid as long as this object.
template <class T>
using Array = py::ndarray<const T, py::c_contig, py::device::cpu>;
using Doubles = Array<double>;
using Integers = Array<std::int64_t>;
using Floats = Array<float>;

/// Real numbers. The argument's own memory if it contains them in C order, else a copy. `wanted`:
/// for the message, "(n, 7)".
Doubles take_doubles(const py::handle& value, const std::string& name, const std::string& wanted);
Floats take_floats(const py::handle& value, const std::string& name, const std::string& wanted);

Integers take_integers(const py::handle& value, const std::string& name, const std::string& wanted);

/// "(3, 7)"
std::string text_of(const Shape& shape);

template <class T>
Shape shape_of(const Array<T>& array) {
  Shape shape;
  for (std::size_t k = 0; k < array.ndim(); ++k) shape.push_back(array.shape(k));
  return shape;
}

template <class T>
[[noreturn]] void refuse_shape(const Array<T>& array, const std::string& name,
                               const std::string& wanted) {
  throw value_error(name + ": shape " + text_of(shape_of(array)) + "; wanted " + wanted);
}

/// Refuses NaN and negative numbers, which are not valid limits.
double take_limit(double value, const char* name);

/// Refuses more threads than the machine has. 0: all cores.
unsigned take_threads(unsigned threads);

/// A vector of three numbers.
Eigen::Vector3d take_vector(const py::handle& value, const char* name);

/// A new array of shape `rows` + (`kEach`,), all zero, and a pointer to its data. Memory that
/// nobody writes to is not touched: in a long array it takes no memory and no time.
template <class T, std::size_t kEach = 0>
struct Column {
  static constexpr std::size_t kWidth = kEach > 0 ? kEach : 1;

  Column() = default;
  explicit Column(Shape rows) : shape(std::move(rows)) {
    if (kEach > 0) shape.push_back(kEach);
    std::size_t count = 1;
    for (const std::size_t n : shape) count *= n;
    data.reset(static_cast<T*>(std::calloc(count + 1, sizeof(T))), std::free);
    if (data == nullptr) throw std::bad_alloc();
  }

  T* row(std::size_t i) const { return data.get() + i * kWidth; }
  Eigen::Map<Eigen::Matrix<T, static_cast<int>(kWidth), 1>> vector(std::size_t i) const {
    return Eigen::Map<Eigen::Matrix<T, static_cast<int>(kWidth), 1>>(row(i));
  }

  /// Restores the result of handed_out(), also from another process.
  static Column taken(const py::handle& given) {
    Column column;
    if (given.is_none()) return column;
    constexpr char kind = std::is_same_v<T, bool> ? 'b' : std::is_integral_v<T> ? 'u' : 'f';
    constexpr char type[] = {kind, '0' + sizeof(T), '\0'};
    const auto array = py::cast<Array<T>>(
        py::module_::import_("numpy").attr("asarray")(given, type, py::arg("order") = "C"));
    Shape rows = shape_of(array);
    if (kEach > 0) rows.pop_back();
    column = Column(std::move(rows));
    std::copy_n(array.data(), array.size(), column.data.get());
    return column;
  }

  /// `value`: a number or an enumerator, or a vector.
  template <class Value>
  void write(std::size_t i, const Value& value) const {
    if constexpr (kEach > 0)
      vector(i) = value;
    else
      *row(i) = static_cast<T>(value);
  }
  template <class Value>
  void read(std::size_t i, Value& value) const {
    if constexpr (kEach > 0)
      value = vector(i);
    else
      value = static_cast<Value>(*row(i));
  }

  /// An array of NumPy, a number if it has no dimension; None if there is no column.
  py::object handed_out() const {
    if (data == nullptr) return py::none();
    if (shape.empty()) return py::cast(*data);
    return handed_out(shape, py::dtype<T>());
  }

  py::object handed_out(const Shape& as, const py::dlpack::dtype& type) const {
    const py::capsule owner(new std::shared_ptr<T>(data), [](void* held) noexcept {
      delete static_cast<std::shared_ptr<T>*>(held);
    });
    return py::cast(py::ndarray<py::numpy>(data.get(), as.size(), as.data(), owner, nullptr, type));
  }

  Shape shape;
  std::shared_ptr<T> data;
};

/// Row i of columns named like an answer's members.
template <class Columns, class Answer>
void write_row(const Columns& columns, std::size_t i, const Answer& answer) {
  for_each_member([i](const auto& column, const auto& value) { column.write(i, value); }, columns,
                  answer);
}

}  // namespace ist::python
