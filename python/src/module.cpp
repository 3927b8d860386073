// The Python module ist._core; package ist shows it to users (../ist/__init__.py).

#include "module.h"

#include <ist/error.h>
#include <ist/version.h>

#include "library/bake_revision.h"
#include "offline.h"

namespace {

constexpr const char* kDoc = R"(Collision of solids by inner sphere trees.

Lengths are [u], whatever unit the meshes have. Poses are rows qw, qx, qy, qz, tx, ty, tz of float64:
x_world = R(q) (scale · x) + t.)";

}  // namespace

NB_MODULE(_core, module) {
  namespace python = ist::python;
  namespace py = python::py;
  module.attr("__doc__") = kDoc;
  // Users know what is here by the package's name.
  const py::object own_name = module.attr("__name__");
  module.attr("__name__") = "ist";
  py::set_leak_warnings(false);  // what is alive at the end is the system's to free
  const py::exception<ist::Error> error(module, "Error", PyExc_RuntimeError);
  error.attr("__doc__") =
      "An error of the library. The message names the file, the place and a way out.";
  py::exception<ist::OpenMeshError>(module, "OpenMeshError", error.ptr()).attr("__doc__") =
      "A mesh is not closed, and repair was not requested or failed.";
  module.attr("__version__") = IST_VERSION_STRING;
  module.attr("_bake_revision") = ist::kBakeRevision;  // for what keeps assets (ist.mujoco)
  python::add_offline(module);
  python::add_meshes(module);
  python::add_assets(module);
  python::add_fields(module);
  python::add_penetration(module);
  python::add_pictures(module);
  python::add_separation(module);
  python::add_surfaces(module);
  python::add_time_of_impact(module);
  python::add_gpu(module);
  module.attr("__name__") = own_name;
}
