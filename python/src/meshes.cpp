#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>

#include <ist/mesh.h>

#include "arrays.h"
#include "module.h"
#include "offline.h"
#include "samples/samples.h"

namespace ist::python {
namespace {

// Rows of vectors are what NumPy sees.
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
static_assert(sizeof(std::array<std::uint32_t, 3>) == 3 * sizeof(std::uint32_t));

std::shared_ptr<TriangleMesh> mesh_of_arrays(const py::object& vertices,
                                             const py::object& triangles) {
  const Doubles points = take_doubles(vertices, "vertices", "(n, 3)");
  if (points.ndim() != 2 || points.shape(1) != 3) refuse_shape(points, "vertices", "(n, 3)");
  const Integers corners = take_integers(triangles, "triangles", "(m, 3)");
  if (corners.ndim() != 2 || corners.shape(1) != 3) refuse_shape(corners, "triangles", "(m, 3)");
  const auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.resize(static_cast<std::size_t>(points.shape(0)));
  std::copy_n(points.data(), points.size(), reinterpret_cast<double*>(mesh->vertices.data()));
  mesh->triangles.resize(static_cast<std::size_t>(corners.shape(0)));
  for (py::ssize_t i = 0; i < corners.shape(0); ++i)
    for (py::ssize_t k = 0; k < 3; ++k) {
      const std::int64_t corner = corners.at(i, k);
      if (corner < 0 || corner >= points.shape(0))
        throw py::value_error("triangles[" + std::to_string(i) + "]: vertex " +
                              std::to_string(corner) + "; there are vertices 0 to " +
                              std::to_string(points.shape(0) - 1));
      mesh->triangles[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] =
          static_cast<std::uint32_t>(corner);
    }
  return mesh;
}

/// (n, 3), read-only, on memory that `owner` holds.
template <class T, class Row>
py::array view_of(const std::vector<Row>& rows, const py::object& owner) {
  py::array_t<T> view({static_cast<py::ssize_t>(rows.size()), py::ssize_t{3}},
                      reinterpret_cast<const T*>(rows.data()), owner);
  view.attr("setflags")(py::arg("write") = false);
  return py::array(view);
}

template <class Mesh>
py::object declared_up(const Mesh& mesh) {
  if (mesh.declared.up_axis == 0) return py::none();
  return py::str(std::string(1, mesh.declared.up_axis));
}

void add_report(py::module_& module) {
  py::class_<MeshReport>(module, "MeshReport",
                         "What import and validation found; counts are of the welded mesh as it "
                         "came, unless they name the closed one.")
      .def_readonly("vertices", &MeshReport::vertices, "Referenced vertices after welding.")
      .def_readonly("triangles", &MeshReport::triangles, "As imported.")
      .def_readonly("components", &MeshReport::components, "Edge-connected shells.")
      .def_readonly("boundary_edges", &MeshReport::boundary_edges, "Edges with one triangle.")
      .def_readonly("nonmanifold_edges", &MeshReport::nonmanifold_edges,
                    "Edges with three or more triangles.")
      .def_readonly("flipped_components", &MeshReport::flipped_components, "Shells turned outward.")
      .def_readonly("degenerate_triangles", &MeshReport::degenerate_triangles,
                    "Zero area or repeated corners.")
      .def_readonly("self_intersections", &MeshReport::self_intersections,
                    "Pairs of triangles that meet elsewhere than in shared corners.")
      .def_readonly("shells", &MeshReport::shells, "Of the closed mesh.")
      .def_readonly("meets_itself", &MeshReport::meets_itself,
                    "Of the closed mesh: its triangles intersect, or may.")
      .def_readonly("filled_holes", &MeshReport::filled_holes, "Closed by repair.")
      .def_readonly("repaired", &MeshReport::repaired, "Repair changed the mesh.")
      .def_readonly("volume", &MeshReport::volume,
                    "[u³] by the divergence theorem; counts self-overlaps twice.")
      .def_readonly("notes", &MeshReport::notes, "One sentence a finding, ready to print.");
}

}  // namespace

void add_meshes(py::module_& module) {
  add_report(module);
  py::class_<TriangleMesh, std::shared_ptr<TriangleMesh>>(
      module, "Mesh", "Triangles over shared vertices, in the file's own unit [u] and frame.")
      .def(py::init(&mesh_of_arrays), py::arg("vertices"), py::arg("triangles"),
           "Copies arrays.\n\nvertices: (n, 3) [u]. triangles: (m, 3) whole numbers of vertices, "
           "counter-clockwise seen from outside.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            return view_of<double>(self.cast<const TriangleMesh&>().vertices, self);
          },
          "(n, 3) float64 [u], read-only: a view that holds the mesh.")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {
            return view_of<std::uint32_t>(self.cast<const TriangleMesh&>().triangles, self);
          },
          "(m, 3) uint32, read-only: a view that holds the mesh.")
      .def_property_readonly("declared_up_axis", &declared_up<TriangleMesh>,
                             "'X', 'Y' or 'Z' as the file declares, or None. Nothing is turned.")
      .def_property_readonly(
          "declared_unit", [](const TriangleMesh& mesh) { return mesh.declared.unit; },
          "[m] length of the file's unit; 0: the file does not say.");
  py::class_<ClosedMesh, std::shared_ptr<ClosedMesh>>(
      module, "ClosedMesh",
      "A mesh that bounds a solid: inside is where its winding number is 1 or more.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            return view_of<double>(self.cast<const ClosedMesh&>().mesh.vertices, self);
          },
          "(n, 3) float64 [u], read-only: a view that holds the mesh.")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {
            return view_of<std::uint32_t>(self.cast<const ClosedMesh&>().mesh.triangles, self);
          },
          "(m, 3) uint32, read-only: a view that holds the mesh.")
      .def_readonly("name", &ClosedMesh::name, "For messages.")
      .def_property_readonly(
          "report", [](const ClosedMesh& mesh) { return mesh.report; }, "MeshReport, a copy.");
  module.def(
      "load_mesh",
      [](const py::object& path, double weld_tolerance) {
        const auto name = py::module_::import("os").attr("fspath")(path).cast<std::string>();
        return offline([name, weld_tolerance](const ProgressCallback&) {
          return std::make_shared<TriangleMesh>(load_mesh(name, {weld_tolerance}));
        });
      },
      py::arg("path"), py::kw_only(), py::arg("weld_tolerance") = 0.0,
      R"(Reads OBJ, STL, PLY, OFF, GLB/glTF, DAE and what assimp knows.

path: str or os.PathLike.
weld_tolerance: [0, 0.1]; vertices closer than this share of the bounding box's diagonal are one.

Raises Error (file, place, way out).)");
  module.def(
      "close_mesh",
      [](const std::shared_ptr<TriangleMesh>& mesh, const std::string& name, bool repair) {
        return offline([mesh, name, repair](const ProgressCallback&) {
          return std::make_shared<ClosedMesh>(
              close_mesh(*mesh, name, repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse));
        });
      },
      py::arg("mesh"), py::kw_only(), py::arg("name") = "mesh", py::arg("repair") = false,
      R"(Validates a mesh and orients its shells.

name: for messages.
repair: close an open mesh (weld cracks, fill holes) instead of refusing it; see ClosedMesh.report.

Raises OpenMeshError for an open mesh, Error for one that is flat, empty, not finite or
non-orientable.)");
  module.def(
      "sample_mesh",
      [](const std::string& name) { return std::make_shared<TriangleMesh>(make_sample(name)); },
      py::arg("name"),
      "A closed mesh made on the spot: 'bolt', 'nut', 'gear', 'cube', …\n\nAn unknown name raises "
      "Error, which lists all.");
}

}  // namespace ist::python
