#include "arrays.h"

#include <cstring>

namespace ist::python {
namespace {

/// `kinds`: letters of NumPy's dtype.kind that are converted.
template <class T>
Array<T> take_array(const py::handle& value, const std::string& name, const std::string& wanted,
                    const char* kinds, const char* type) {
  Array<T> array;
  if (py::try_cast(value, array, false)) return array;
  const py::module_ numpy = py::module_::import_("numpy");
  py::object given;
  try {
    given = numpy.attr("asarray")(value);
  } catch (py::python_error&) {
    throw type_error(name + ": a " + type_name_of(value) + " is not an array; wanted " + type +
                     " " + wanted);
  }
  const py::object dtype = given.attr("dtype");
  if (std::strchr(kinds, text_of(dtype.attr("kind"))[0]) == nullptr)
    throw type_error(name + ": dtype " + text_of(dtype) + "; wanted " + type + " " + wanted);
  given = numpy.attr("asarray")(given, type, "C");
  if (!py::try_cast(given, array, false))
    throw type_error(name + ": dtype " + text_of(dtype) + " does not convert");
  return array;
}

}  // namespace

Doubles take_doubles(const py::handle& value, const std::string& name, const std::string& wanted) {
  return take_array<double>(value, name, wanted, "fiu", "float64");
}

Floats take_floats(const py::handle& value, const std::string& name, const std::string& wanted) {
  return take_array<float>(value, name, wanted, "fiu", "float32");
}

Integers take_integers(const py::handle& value, const std::string& name,
                       const std::string& wanted) {
  return take_array<std::int64_t>(value, name, wanted, "iu", "int64");
}

double take_limit(double value, const char* name) {
  if (!(value >= 0))
    throw value_error(std::string(name) + ": " + text_of(py::float_(value)) +
                      "; wanted a number ≥ 0");
  return value;
}

unsigned take_threads(unsigned threads) {
  constexpr unsigned kMost = 4096;
  if (threads > kMost)
    throw value_error("threads: " + std::to_string(threads) + "; wanted 0, all cores, to " +
                      std::to_string(kMost));
  return threads;
}

Eigen::Vector3d take_vector(const py::handle& value, const char* name) {
  const Doubles array = take_doubles(value, name, "(3,)");
  if (array.ndim() != 1 || array.shape(0) != 3) refuse_shape(array, name, "(3,)");
  return Eigen::Vector3d(array.data());
}

std::string text_of(const Shape& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

}  // namespace ist::python
