#include <nanobind/eigen/dense.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <string>

#include <ist/bake.h>
#include <ist/mass_properties.h>
#include <ist/types.h>

#include "arrays.h"
#include "library/asset_summary.h"
#include "library/exported_spheres.h"
#include "library/settings/bake_settings.h"
#include "library/text.h"
#include "meshes.h"
#include "module.h"
#include "offline.h"
#include "rows.h"
#include "solids.h"

namespace ist::python {
namespace {

using SharedAsset = std::shared_ptr<Asset>;

constexpr std::pair<const char*, Device> kDevices[] = {
    {"auto", Device::automatic}, {"cpu", Device::cpu}, {"cuda", Device::cuda}};
constexpr std::pair<const char*, bool> kSpheres[] = {{"matched", true}, {"inner", false}};

Asset asset_of_bytes(const py::object& buffer, const std::string& name) {
  Py_buffer view;
  if (PyObject_GetBuffer(buffer.ptr(), &view, PyBUF_SIMPLE) != 0) throw py::python_error();
  const std::unique_ptr<Py_buffer, decltype(&PyBuffer_Release)> held(&view, PyBuffer_Release);
  return Asset(
      std::span(static_cast<const std::byte*>(view.buf), static_cast<std::size_t>(view.len)), name);
}

py::bytes bytes_of(const Asset& asset) {
  return py::bytes(reinterpret_cast<const char*>(asset.bytes().data()), asset.bytes().size());
}

int show_bytes(PyObject* self, Py_buffer* view, int flags) {
  const auto bytes = py::inst_ptr<Asset>(self)->bytes();
  return PyBuffer_FillInfo(view, self, const_cast<std::byte*>(bytes.data()),
                           static_cast<Py_ssize_t>(bytes.size()), 1, flags);
}

const PyType_Slot kAssetSlots[] = {{Py_bf_getbuffer, reinterpret_cast<void*>(show_bytes)},
                                   {0, nullptr}};

/// (n, 4): centre and radius in the mesh's own unit and frame.
py::object spheres_of(const Asset& asset, const std::string& which) {
  const bool matched = named(which, "which", kSpheres);
  const auto spheres = exported_spheres(asset.view(), 0);
  const Column<double, 4> rows({spheres.size()});
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const ExportedSphere& s = spheres[i];
    rows.vector(i) << (matched ? s.matched_centre : s.centre),
        (matched ? s.matched_radius : s.radius);
  }
  return rows.handed_out();
}

PlacedAsset placed(const Asset& asset, const py::object& pose, double scale) {
  return {asset.view(), take_pose(pose, scale), scale};
}

constexpr const char* kSettingsDoc = R"(
mesh: a ClosedMesh; or a Mesh, a path, (vertices, triangles), or an object with vertices and faces,
    such as trimesh's, which is closed first. close_mesh() repairs open meshes.
max_spheres: largest number of spheres; 0: no limit.
target_coverage: [0, 1] share of the solid's volume at which packing stops.
min_radius: [u] smallest radius of a sphere.
time_limit: [s]; 0: no limit. The only setting that makes a bake unrepeatable.
epsilon: greedy tolerance; 0: automatic schedule.
grid: 'banded', 'uniform', 'explicit', 'implicit' or 'hybrid'.
seed: breaks ties.
threads: 0: all cores. The result does not depend on it.
device: 'auto', 'cpu' or 'cuda'. The result does not depend on it.
keep_mesh: keep the mesh in the asset, all of it. Simplify the mesh first for a smaller one.
scale: as for close_mesh(). [u] is the unit of the scaled mesh.
progress: called with a Progress on this thread; False cancels: packing then keeps its spheres,
    other stages raise Error. An exception that it raises is passed on.

Ctrl-C raises KeyboardInterrupt within 0.2 s.
Raises Error if no sphere fits, or if a setting is out of range.)";

void add_bodies(py::module_& module) {
  py::class_<MassProperties>(module, "MassProperties",
                             "A solid of density 1 as a rigid body, with bounds on the errors.")
      .def_ro("volume", &MassProperties::volume, "[u³]")
      .def_ro("centre_of_mass", &MassProperties::centre_of_mass, "(3,) [u]")
      .def_ro("inertia", &MassProperties::inertia,
              "(3, 3) [u⁵] about the centre of mass: ∫ (|y|² 1 − y yᵀ).")
      .def_ro("volume_error", &MassProperties::volume_error, "[u³]")
      .def_ro("centre_of_mass_error", &MassProperties::centre_of_mass_error,
              "[u] of each component")
      .def_ro("inertia_error", &MassProperties::inertia_error, "[u⁵] of each entry");
  py::class_<Bounds>(module, "Bounds", "Bounds of a solid: an axis-aligned box and a ball.")
      .def_ro("lower", &Bounds::lower, "(3,) [u] corner of the box")
      .def_ro("upper", &Bounds::upper, "(3,) [u] the opposite corner")
      .def_ro("centre", &Bounds::centre, "(3,) [u] of the ball")
      .def_ro("radius", &Bounds::radius, "[u] of the ball");
  py::class_<Invariant>(module, "Invariant", "One proven property of an asset.")
      .def_ro("name", &Invariant::name, "'sphere inside solid', …")
      .def_ro("worst", &Invariant::worst,
              "Largest violation, in the measure of `meaning`; ≤ 0 is sound unless stated.")
      .def_ro("meaning", &Invariant::meaning, "The quantity of `worst`, with its unit.")
      .def_ro("where", &Invariant::where, "Index of the worst sphere, node, ….")
      .def_ro("checked", &Invariant::checked, "Number of objects checked.")
      .def_ro("violations", &Invariant::violations, "Number of violations.");
  py::class_<PartnerError>(module, "PartnerError", "Error of an asset against one kind of partner.")
      .def_prop_ro(
          "partner", [](const PartnerError& e) { return name_of(e.partner); },
          "'copy', 'plane', 'ball', 'edge', 'corner' or 'plate'.")
      .def_ro("median", &PartnerError::median, "Median relative error.")
      .def_ro("poses", &PartnerError::poses, "Number of poses.");
}

struct Targeted {
  SharedAsset asset;
  double measured_error = 0;
  std::uint32_t poses = 0;
  std::vector<PartnerError> partners;
  bool met = false;
  StopReason stop = StopReason::sphere_count;
};

/// Adds a bake function: bake(mesh, settings, callback, more…). `more`: py::arg of each; they
/// precede the keywords common to all.
template <class Made, class... Given, class... More>
void add_bake(py::module_& module, const char* name, const char* doc, std::size_t usual_spheres,
              bool rounds,
              Made (*bake)(const ClosedMesh&, const PackingSettings&, const ProgressCallback&,
                           Given...),
              const More&... more) {
  module.def(
      name,
      [bake, rounds](const py::object& mesh, Given... given, std::size_t max_spheres,
                     double target_coverage, double min_radius, double time_limit, double epsilon,
                     const std::string& grid, std::uint64_t seed, unsigned threads,
                     const std::string& device, bool keep_mesh, const py::object& scale,
                     const py::object& progress) {
        PackingSettings settings;
        settings.max_spheres = max_spheres;
        settings.target_coverage = target_coverage;
        settings.min_radius = min_radius;
        settings.time_limit = time_limit;
        settings.epsilon = epsilon;
        settings.grid = named(grid, "grid", kGridModes);
        settings.seed = seed;
        settings.threads = threads;
        settings.device = named(device, "device", kDevices);
        settings.keep_mesh = keep_mesh;
        return offline(
            [=, closed = closed_of(mesh, scale)](const ProgressCallback& callback) {
              return bake(*closed, settings, callback, given...);
            },
            progress, rounds);
      },
      py::arg("mesh"), more..., py::kw_only(), py::arg("max_spheres") = usual_spheres,
      py::arg("target_coverage") = 1.0, py::arg("min_radius") = 0.0, py::arg("time_limit") = 0.0,
      py::arg("epsilon") = 0.0, py::arg("grid") = "banded", py::arg("seed") = 0,
      py::arg("threads") = 0, py::arg("device") = "auto", py::arg("keep_mesh") = true,
      py::arg("scale") = 1.0, py::arg("progress") = py::none(),
      (std::string(doc) + kSettingsDoc).c_str());
}

void add_bakes(py::module_& module) {
  add_bake(
      module, "bake",
      "Bakes the asset of a mesh. The same mesh and settings give the same bytes on any machine.\n",
      PackingSettings().max_spheres, false,
      +[](const ClosedMesh& mesh, const PackingSettings& settings,
          const ProgressCallback& callback) { return bake(mesh, settings, callback); });
  py::class_<Targeted>(module, "TargetedAsset", "Result of bake_to_error().")
      .def_ro("asset", &Targeted::asset, "The Asset.")
      .def_ro("measured_error", &Targeted::measured_error,
              "Median relative error near the requested overlap, of the worst partner.")
      .def_ro("poses", &Targeted::poses, "Number of poses of all partners; 0: none was measured.")
      .def_ro("partners", &Targeted::partners, "A PartnerError for each kind.")
      .def_ro("met", &Targeted::met, "poses > 0 and measured_error is at most the requested error.")
      .def_prop_ro(
          "stop", [](const Targeted& t) { return name_of(t.stop); },
          "Reason for the end of the search.");
  add_bake(
      module, "bake_to_error",
      "bake() with about the fewest spheres that reach an error.\n\n"
      "relative_error: (0, 1) median over random poses, for every partner.\n"
      "at_overlap: [1e-4, 0.5] of the solid's volume.\n"
      "max_spheres: 0: 200,000. The other settings are those of bake():\n",
      0, true,
      +[](const ClosedMesh& mesh, const PackingSettings& settings, const ProgressCallback& callback,
          double relative_error, double at_overlap) {
        TargetedAsset made = bake_to_error(mesh, {relative_error, at_overlap}, settings, callback);
        return Targeted{std::make_shared<Asset>(std::move(made.asset)),
                        made.measured_error,
                        made.poses,
                        {made.partners.begin(), made.partners.end()},
                        made.met,
                        made.stop};
      },
      py::arg("relative_error") = ErrorTarget().relative_error,
      py::arg("at_overlap") = ErrorTarget().at_overlap);
  module.def(
      "bake_mesh_only",
      [](const py::object& given, const py::object& scale, unsigned threads,
         const py::object& progress) {
        return offline(
            [mesh = closed_of(given, scale), threads](const ProgressCallback& callback) {
              return bake_mesh_only(*mesh, threads, callback);
            },
            progress);
      },
      py::arg("mesh"), py::kw_only(), py::arg("scale") = 1.0, py::arg("threads") = 0,
      py::arg("progress") = py::none(),
      "Bakes the mesh alone: it, mass and bounds, without spheres, for exact "
      "queries.\n\nQueries that need spheres return QueryStatus.missing_data. The settings are "
      "those "
      "of bake().\nRaises Error if parts of the mesh overlap and cannot be resolved.");
  module.def(
      "check",
      [](const SharedAsset& asset, const py::object& given, const py::object& scale,
         unsigned threads) {
        return offline([asset, mesh = closed_of(given, scale), threads](const ProgressCallback&) {
          return check(*asset, *mesh, threads);
        });
      },
      py::arg("asset"), py::arg("mesh"), py::kw_only(), py::arg("scale") = 1.0,
      py::arg("threads") = 0,
      "Verifies every invariant of an asset in double, from its bytes and the mesh alone.\n\n"
      "scale: that of the bake.\n\nReturns a list of Invariant. Raises Error if the asset was "
      "baked from another mesh.");
}

}  // namespace

void add_assets(py::module_& module) {
  add_bodies(module);
  py::class_<Asset>(
      module, "Asset", py::type_slots(kAssetSlots),
      "A baked solid. Immutable, so threads may share it. "
      "memoryview(asset) is a read-only view of its bytes that keeps it alive; pickle works.")
      .def_static(
          "load",
          [](const py::object& path) {
            return offline(
                [name = path_of(path)](const ProgressCallback&) { return Asset::load(name); });
          },
          py::arg("path"), "Reads an .ist file. Raises Error (file, what is wrong, remedy).")
      .def_static("from_bytes", &asset_of_bytes, py::arg("data"), py::arg("name") = "asset",
                  "Copies the bytes of an .ist file.\n\ndata: bytes, or any contiguous buffer.\n"
                  "name: used in messages. Raises Error if a check of the bytes fails.")
      .def(
          "save",
          [](const SharedAsset& self, const py::object& path) {
            offline([self, name = path_of(path)](const ProgressCallback&) {
              self->save(name);
              return true;
            });
          },
          py::arg("path"),
          "Writes an .ist file atomically: readers see the old file or the complete new one.")
      .def("to_bytes", &bytes_of, "The bytes of an .ist file, a copy.")
      .def("__getstate__", &bytes_of)
      .def("__setstate__",
           [](Asset& self, const py::bytes& data) {
             new (&self) Asset(asset_of_bytes(data, "pickle"));
           })
      .def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; })
      .def(
          "info",
          [](const Asset& self) {
            return py::module_::import_("json").attr("loads")(asset_json(self.view()).dump());
          },
          "The output of `ist info --json` as a dict: docs/json.md.")
      .def("__repr__",
           [](const Asset& self) {
             const AssetView& view = self.view();
             return "<ist.Asset: " + std::to_string(view.sphere_count()) + " spheres, volume " +
                    text_of(py::float_(view.volume())) + " u³, mesh of " +
                    std::to_string(view.mesh_triangles()) + " triangles>";
           })
      .def("__str__", [](const Asset& self) { return describe_asset(self.view()); })
      .def("mesh", &kept_mesh_of,
           "The kept mesh: (n, 3) float64 vertices [u] in the mesh's own frame, and (m, 3) uint32 "
           "triangles, counter-clockwise from outside. Raises Error where none is kept.")
      .def("spheres", &spheres_of, py::arg("which") = "matched",
           "(n, 4) float64: centre and radius [u], in the mesh's own frame; a copy.\n\n"
           "which: 'matched' or 'inner'.")
      .def(
          "mass_properties",
          [](const Asset& self, const py::object& pose, double scale) {
            return mass_properties(placed(self, pose, scale));
          },
          py::arg("pose") = py::none(), py::arg("scale") = 1.0,
          "MassProperties in the frame of the pose.")
      .def(
          "bounds",
          [](const Asset& self, const py::object& pose, double scale) {
            return pose.is_none() && scale == 1 ? bounds(self.view())
                                                : bounds(placed(self, pose, scale));
          },
          py::arg("pose") = py::none(), py::arg("scale") = 1.0,
          "Bounds in the frame of the pose. Matched spheres may stick out by `protrusion`.")
      .def_prop_ro(
          "sphere_count", [](const Asset& self) { return self.view().sphere_count(); }, "Count.")
      .def_prop_ro(
          "volume", [](const Asset& self) { return self.view().volume(); }, "[u³] of the solid.")
      .def_prop_ro(
          "coverage", [](const Asset& self) { return self.view().coverage(); },
          "[0, 1] share of the volume in inner spheres.")
      .def_prop_ro(
          "protrusion", [](const Asset& self) { return self.view().protrusion(); },
          "[u] bound on how far matched spheres stick out of the solid.")
      .def_prop_ro(
          "mesh_triangles", [](const Asset& self) { return self.view().mesh_triangles(); },
          "Number of triangles of the kept mesh, for exact queries; 0: none.")
      .def_prop_ro(
          "mesh_error", [](const Asset& self) { return self.view().mesh_error(); },
          "[u] largest distance between the kept mesh's surface and the solid's.")
      .def_prop_ro(
          "mesh_state", [](const Asset& self) { return name_of(self.view().mesh_state()); },
          "'own', 'resolved', 'polygonised', 'none', or 'unresolved' (its parts overlap).")
      .def_prop_ro(
          "self_overlap_volume",
          [](const Asset& self) { return self.view().self_overlap_volume(); },
          "[u³] volume that the input mesh counts more than once.");
  add_bakes(module);
}

}  // namespace ist::python
