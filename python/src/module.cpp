// The Python module ist._core, which package ist exposes (../ist/__init__.py).

#include "module.h"

#include <ist/types.h>
#include <ist/version.h>

#include "library/cache.h"
#include "offline.h"
#include "solid_rows.h"

namespace {

/// A type that is converted only if no other overload accepted the arguments.
struct LateType {
  ist::python::py::handle type;
};

}  // namespace

template <>
struct nanobind::detail::type_caster<LateType> {
  NB_TYPE_CASTER(LateType, const_name("type"))
  bool from_python(handle source, std::uint8_t flags, cleanup_list*) noexcept {
    value.type = source;
    return (flags & static_cast<std::uint8_t>(cast_flags::convert)) != 0;
  }
  static handle from_cpp(LateType late, rv_policy, cleanup_list*) noexcept {
    return late.type.inc_ref();
  }
};

namespace {

constexpr const char* kDoc = R"(Collision of solids by inner sphere trees.

Lengths are [u], whatever unit the meshes have. Poses are rows qw, qx, qy, qz, tx, ty, tz of float64:
x_world = R(q) (scale · x) + t.)";

/// Adds to each class a constructor that is tried last and raises a TypeError that names the
/// argument.
void name_faults_of_constructors(const ist::python::py::module_& module) {
  namespace py = ist::python::py;
  for (const auto& [name, value] : py::borrow<py::dict>(module.attr("__dict__"))) {
    if (!py::isinstance<py::type_object>(value)) continue;
    if (ist::python::type_name_of(value.attr("__new__")) != "nb_func") continue;
    py::cpp_function_def(
        [](LateType cls, const py::args& args, const py::kwargs& kwargs) -> py::object {
          return py::module_::import_("ist._calls").attr("refuse")(cls.type, args, kwargs);
        },
        py::scope(value), py::name("__new__"));
  }
}

}  // namespace

NB_MODULE(_core, module) {
  namespace python = ist::python;
  namespace py = python::py;
  module.attr("__doc__") = kDoc;
  // Users know these objects under the package's name.
  const py::object own_name = module.attr("__name__");
  module.attr("__name__") = "ist";
  py::set_leak_warnings(false);  // the system frees objects that are alive at exit
  const py::exception<ist::Error> error(module, "Error", PyExc_RuntimeError);
  error.attr("__doc__") =
      "An error of the library. The message names the file, the place and the remedy.";
  py::exception<ist::OpenMeshError>(module, "OpenMeshError", error.ptr()).attr("__doc__") =
      "A mesh is not closed, and repair was not requested or failed.";
  module.attr("__version__") = IST_VERSION_STRING;
  module.attr("_bake_revision") = ist::kBakeRevision;  // for what keeps assets (ist.mujoco)
  python::add_offline(module);
  python::add_meshes(module);
  python::add_assets(module);
  python::add_clash(module);
  python::add_collisions(module);
  python::add_fields(module);
  python::add_solid_rows(module);
  python::add_penetration(module);
  python::add_pictures(module);
  python::add_separation(module);
  python::add_scenes(module);
  python::add_surfaces(module);
  python::add_time_of_impact(module);
  python::add_gpu(module);
  name_faults_of_constructors(module);
  module.attr("__name__") = own_name;
}
