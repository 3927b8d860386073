#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "mesh/samples/samples.h"
#include "meshes.h"
#include "module.h"
#include "offline.h"

namespace ist::python {
namespace {

// NumPy sees rows of vectors.
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
static_assert(sizeof(std::array<std::uint32_t, 3>) == 3 * sizeof(std::uint32_t));

TriangleMesh mesh_of_arrays(const py::object& vertices, const py::object& triangles) {
  const Doubles points = take_doubles(vertices, "vertices", "(n, 3)");
  if (points.ndim() != 2 || points.shape(1) != 3) refuse_shape(points, "vertices", "(n, 3)");
  const Integers corners = take_integers(triangles, "triangles", "(m, 3)");
  if (corners.ndim() != 2 || corners.shape(1) != 3) refuse_shape(corners, "triangles", "(m, 3)");
  TriangleMesh mesh;
  mesh.vertices.resize(points.shape(0));
  std::copy_n(points.data(), points.size(), reinterpret_cast<double*>(mesh.vertices.data()));
  mesh.triangles.resize(corners.shape(0));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::int64_t corner = corners.data()[i];
    if (corner < 0 || corner >= static_cast<std::int64_t>(points.shape(0)))
      throw value_error("triangles[" + std::to_string(i / 3) + "]: vertex " +
                        std::to_string(corner) + "; there are vertices 0 to " +
                        std::to_string(points.shape(0) - 1));
    mesh.triangles[i / 3][i % 3] = static_cast<std::uint32_t>(corner);
  }
  return mesh;
}

/// (n, 3), read-only, in memory that `owner` owns.
template <class T, class Row>
py::object view_of(const std::vector<Row>& rows, const py::object& owner) {
  return py::cast(py::ndarray<py::numpy, const T>(reinterpret_cast<const T*>(rows.data()),
                                                  {rows.size(), 3}, owner));
}

Eigen::Vector3d factors_of(const py::object& scale) {
  double factor = 1;
  return py::try_cast(scale, factor) ? Eigen::Vector3d::Constant(factor).eval()
                                     : take_vector(scale, "scale");
}

/// The solid bounded by a mesh.
ClosedMesh close(TriangleMesh mesh, const std::string& name, bool repair,
                 const Eigen::Vector3d& factors) {
  scale_mesh(mesh, factors);
  return close_mesh(std::move(mesh), name,
                    repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
}

bool is_path(const py::object& value) {
  return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
}

/// load_mesh(), with notes as Python warnings.
std::shared_ptr<TriangleMesh> loaded(const std::string& path, const ImportSettings& settings) {
  auto mesh = offline([=](const ProgressCallback&) {
    return std::make_shared<TriangleMesh>(load_mesh(path, settings));
  });
  for (const std::string& note : mesh->notes)
    if (PyErr_WarnEx(PyExc_UserWarning, (path + ": " + note).c_str(), 1) != 0)
      throw py::python_error();
  return mesh;
}

template <class Mesh>
py::object declared_up(const Mesh& mesh) {
  if (mesh.declared.up_axis == 0) return py::none();
  return py::str(&mesh.declared.up_axis, 1);
}

void add_report(py::module_& module) {
  py::class_<MeshReport>(module, "MeshReport",
                         "Findings of import and validation. Counts refer to the welded input mesh "
                         "unless stated otherwise.")
      .def_ro("vertices", &MeshReport::vertices, "Referenced vertices after welding.")
      .def_ro("triangles", &MeshReport::triangles, "As imported.")
      .def_ro("components", &MeshReport::components, "Edge-connected shells.")
      .def_ro("boundary_edges", &MeshReport::boundary_edges, "Edges with one triangle.")
      .def_ro("nonmanifold_edges", &MeshReport::nonmanifold_edges,
              "Edges with three or more triangles.")
      .def_ro("flipped_components", &MeshReport::flipped_components, "Shells turned outward.")
      .def_ro("degenerate_triangles", &MeshReport::degenerate_triangles,
              "Zero area or repeated corners.")
      .def_ro("self_intersections", &MeshReport::self_intersections,
              "Pairs of triangles that intersect outside shared corners.")
      .def_ro("shells", &MeshReport::shells, "Of the closed mesh.")
      .def_ro("meets_itself", &MeshReport::meets_itself,
              "Whether triangles of the closed mesh intersect, or may.")
      .def_ro("filled_holes", &MeshReport::filled_holes, "Closed by repair.")
      .def_ro("repaired", &MeshReport::repaired, "Repair changed the mesh.")
      .def_ro("volume", &MeshReport::volume,
              "[u³] by the divergence theorem; counts self-overlaps twice.")
      .def_ro("notes", &MeshReport::notes, "One printable sentence per finding.");
}

}  // namespace

std::shared_ptr<TriangleMesh> mesh_of(const py::object& value) {
  std::shared_ptr<TriangleMesh> mesh;
  if (py::try_cast(value, mesh)) return mesh;
  if (is_path(value)) return loaded(path_of(value), {});
  if ((py::isinstance<py::tuple>(value) || py::isinstance<py::list>(value)) && py::len(value) == 2)
    return std::make_shared<TriangleMesh>(mesh_of_arrays(value[0], value[1]));
  // attributes of trimesh, Open3D, and PyVista if all faces are triangles
  for (const auto& [vertices, triangles] :
       {std::pair("vertices", "faces"), std::pair("vertices", "triangles"),
        std::pair("points", "regular_faces")})
    if (py::hasattr(value, vertices) && py::hasattr(value, triangles))
      return std::make_shared<TriangleMesh>(
          mesh_of_arrays(value.attr(vertices), value.attr(triangles)));
  throw type_error(
      "mesh: a " + type_name_of(value) +
      "; wanted a ClosedMesh, a Mesh, a path, (vertices, triangles), or an object with "
      "vertices and faces");
}

std::shared_ptr<ClosedMesh> closed_of(const py::object& value, const py::object& scale) {
  std::shared_ptr<ClosedMesh> closed;
  const Eigen::Vector3d factors = factors_of(scale);
  if (py::try_cast(value, closed)) {
    if (factors != Eigen::Vector3d::Ones())
      throw value_error("scale: a ClosedMesh is not scaled; close_mesh(mesh, scale=…) makes one");
    return closed;
  }
  return offline([mesh = mesh_of(value), factors,
                  name = is_path(value) ? path_of(value) : "mesh"](const ProgressCallback&) {
    return std::make_shared<ClosedMesh>(close(*mesh, name, false, factors));
  });
}

/// (Mesh, (vertices, triangles)) for pickles, without the frame that a file declared.
static py::tuple remade(const py::object& mesh) {
  return py::make_tuple(py::module_::import_("ist").attr("Mesh"),
                        py::make_tuple(mesh.attr("vertices"), mesh.attr("triangles")));
}

void add_meshes(py::module_& module) {
  add_report(module);
  py::class_<TriangleMesh>(module, "Mesh",
                           "Triangles over shared vertices, in the file's own unit [u] and frame.")
      .def(py::new_(&mesh_of_arrays), py::arg("vertices"), py::arg("triangles"),
           "Copies arrays.\n\nvertices: (n, 3) [u]. triangles: (m, 3) vertex indices, "
           "counter-clockwise seen from outside.")
      .def_prop_ro(
          "vertices",
          [](const py::object& self) {
            return view_of<double>(py::cast<const TriangleMesh&>(self).vertices, self);
          },
          "(n, 3) float64 [u], read-only: a view that keeps the mesh alive.")
      .def_prop_ro(
          "triangles",
          [](const py::object& self) {
            return view_of<std::uint32_t>(py::cast<const TriangleMesh&>(self).triangles, self);
          },
          "(m, 3) uint32, read-only: a view that keeps the mesh alive.")
      .def_prop_ro("declared_up_axis", &declared_up<TriangleMesh>,
                   "'X', 'Y' or 'Z' as the file declares, or None. The mesh is not rotated.")
      .def_prop_ro(
          "declared_unit", [](const TriangleMesh& mesh) { return mesh.declared.unit; },
          "[m] length of the file's unit; 0: not declared. Vertices of COLLADA are scaled by it, "
          "to metres; those of other files are not.")
      .def_ro("notes", &TriangleMesh::notes,
              "What the file holds and was not read though it may change the shape: sentences.")
      .def("__reduce__", &remade);
  py::class_<ClosedMesh>(
      module, "ClosedMesh",
      "A mesh that bounds a solid. A point is inside if its winding number is 1 or more.")
      .def_prop_ro(
          "vertices",
          [](const py::object& self) {
            return view_of<double>(py::cast<const ClosedMesh&>(self).mesh.vertices, self);
          },
          "(n, 3) float64 [u], read-only: a view that keeps the mesh alive.")
      .def_prop_ro(
          "triangles",
          [](const py::object& self) {
            return view_of<std::uint32_t>(py::cast<const ClosedMesh&>(self).mesh.triangles, self);
          },
          "(m, 3) uint32, read-only: a view that keeps the mesh alive.")
      .def_ro("name", &ClosedMesh::name, "For messages.")
      .def_prop_ro(
          "report", [](const ClosedMesh& mesh) { return mesh.report; }, "MeshReport, a copy.")
      .def("__reduce__", [](const py::object& self) {
        // Closes the arrays again: the report describes the mesh as it is.
        const py::tuple mesh = remade(self);
        const py::module_ package = py::module_::import_("ist");
        const py::object again =
            py::module_::import_("functools")
                .attr("partial")(package.attr("close_mesh"), py::arg("name") = self.attr("name"));
        return py::make_tuple(again, py::make_tuple(mesh[1]));
      });
  module.def(
      "load_mesh",
      [](const py::object& path, double weld_tolerance) {
        return loaded(path_of(path), {weld_tolerance});
      },
      py::arg("path"), py::kw_only(), py::arg("weld_tolerance") = 0.0,
      R"(Reads OBJ, STL, PLY, OFF, GLB/glTF, DAE and other formats of assimp.

path: str or os.PathLike.
weld_tolerance: [0, 0.1]; vertices closer than this share of the bounding box's diagonal are merged.

What the file holds and was not read though it may change the shape is a UserWarning, and in
Mesh.notes.

Raises Error, which names the file, the place and the remedy.)");
  module.def(
      "close_mesh",
      [](const py::object& mesh, const std::string& name, bool repair, const py::object& scale) {
        return offline([mesh = mesh_of(mesh), name, repair,
                        factors = factors_of(scale)](const ProgressCallback&) {
          return close(*mesh, name, repair, factors);
        });
      },
      py::arg("mesh"), py::kw_only(), py::arg("name") = "mesh", py::arg("repair") = false,
      py::arg("scale") = 1.0,
      R"(Validates a mesh and orients its shells.

mesh: a Mesh, or anything that bake() accepts.
name: for messages.
repair: close an open mesh (weld cracks, fill holes) instead of refusing it; see ClosedMesh.report.
scale: factor of all coordinates, or (3,) of each axis; negative ones mirror. 0 and NaN raise Error.

Raises OpenMeshError for an open mesh, Error for one that is flat, empty, not finite or
non-orientable.)");
  module.def("from_trimesh", &mesh_of, py::arg("mesh"),
             "A Mesh of any object with `vertices` and `faces` (or `triangles`), such as "
             "trimesh's; a copy.");
  module.def(
      "sample_mesh", [](const std::string& name) { return make_sample(name); }, py::arg("name"),
      "A generated closed mesh: 'bolt', 'nut', 'gear', 'cube', …\n\nAn unknown name raises Error, "
      "which lists all names.");
}

}  // namespace ist::python
