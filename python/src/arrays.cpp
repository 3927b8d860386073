#include "arrays.h"

#include <cstring>

namespace ist::python {
namespace {

std::string type_name(const py::handle& value) {
  return py::str(py::type::handle_of(value).attr("__name__"));
}

/// `kinds`: letters of NumPy's dtype.kind that convert.
py::array take_array(const py::handle& value, const std::string& name, const std::string& wanted,
                     const char* kinds, const char* type) {
  const py::array given = py::array::ensure(value);
  if (!given) {
    PyErr_Clear();
    throw py::type_error(name + ": a " + type_name(value) + " is no array; wanted " + type + " " +
                         wanted);
  }
  if (std::strchr(kinds, given.dtype().kind()) == nullptr)
    throw py::type_error(name + ": dtype " + std::string(py::str(given.dtype())) + "; wanted " +
                         type + " " + wanted);
  return given;
}

template <class Array>
Array converted(const py::array& given, const std::string& name) {
  Array array = Array::ensure(given);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(name + ": dtype " + std::string(py::str(given.dtype())) +
                         " does not convert");
  }
  return array;
}

}  // namespace

Doubles take_doubles(const py::handle& value, const std::string& name, const std::string& wanted) {
  return converted<Doubles>(take_array(value, name, wanted, "fiu", "float64"), name);
}

Floats take_floats(const py::handle& value, const std::string& name, const std::string& wanted) {
  return converted<py::array_t<float, py::array::c_style | py::array::forcecast>>(
      take_array(value, name, wanted, "fiu", "float32"), name);
}

Integers take_integers(const py::handle& value, const std::string& name,
                       const std::string& wanted) {
  return converted<Integers>(take_array(value, name, wanted, "iu", "int64"), name);
}

Shape shape_of(const py::array& array) {
  return Shape(array.shape(), array.shape() + array.ndim());
}

std::string text_of(const Shape& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

void refuse_shape(const py::array& array, const std::string& name, const std::string& wanted) {
  throw py::value_error(name + ": shape " + text_of(shape_of(array)) + "; wanted " + wanted);
}

}  // namespace ist::python
