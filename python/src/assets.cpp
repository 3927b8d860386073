#include <nanobind/eigen/dense.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include <cstring>
#include <memory>
#include <string>

#include <ist/bake.h>
#include <ist/error.h>
#include <ist/mass_properties.h>

#include "app/asset_summary.h"
#include "app/exported_spheres.h"
#include "app/text.h"
#include "arrays.h"
#include "meshes.h"
#include "module.h"
#include "offline.h"
#include "settings/bake_settings.h"

namespace ist::python {
namespace {

using SharedAsset = std::shared_ptr<Asset>;

constexpr std::pair<const char*, Device> kDevices[] = {
    {"auto", Device::automatic}, {"cpu", Device::cpu}, {"cuda", Device::cuda}};
constexpr std::pair<const char*, GridMode> kGrids[] = {{"banded", GridMode::banded},
                                                       {"uniform", GridMode::uniform},
                                                       {"explicit", GridMode::explicit_refinement},
                                                       {"implicit", GridMode::implicit_refinement},
                                                       {"hybrid", GridMode::hybrid}};
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
  const auto spheres = app::exported_spheres(asset.view(), 0);
  const Column<double> rows({spheres.size()}, {4});
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const app::ExportedSphere& s = spheres[i];
    Eigen::Map<Eigen::Vector4d>(rows.row(i)) << (matched ? s.matched_centre : s.centre),
        (matched ? s.matched_radius : s.radius);
  }
  return rows.handed_out();
}

PlacedTree placed(const Asset& asset, const py::object& pose, double scale) {
  PlacedTree tree{asset.view(), {}, scale};
  if (pose.is_none()) return tree;
  const char* const wanted = "(7,): qw, qx, qy, qz, tx, ty, tz";
  const Doubles values = take_doubles(pose, "pose", wanted);
  if (values.ndim() != 1 || values.shape(0) != 7) refuse_shape(values, "pose", wanted);
  std::memcpy(tree.pose.q, values.data(), sizeof tree.pose.q);
  std::memcpy(tree.pose.t, values.data() + 4, sizeof tree.pose.t);
  return tree;
}

/// What is kept of the mesh, as the command line takes it; a number is as good as its text.
SurfaceSettings surface_settings(const py::object& given) {
  const std::optional<SurfaceSettings> surface = parse_surface(text_of(given));
  if (!surface) throw Error("surface: '" + text_of(given) + "' is none of " + kSurfaceMeaning);
  return *surface;
}

/// Keywords that all bakes share.
PackingSettings packing_settings(std::size_t max_spheres, double target_coverage, double min_radius,
                                 double time_limit, double epsilon, const std::string& grid,
                                 std::uint64_t seed, unsigned threads, const std::string& device,
                                 const py::object& surface) {
  PackingSettings settings;
  settings.max_spheres = max_spheres;
  settings.target_coverage = target_coverage;
  settings.min_radius = min_radius;
  settings.time_limit = time_limit;
  settings.epsilon = epsilon;
  settings.grid = named(grid, "grid", kGrids);
  settings.seed = seed;
  settings.threads = threads;
  settings.device = named(device, "device", kDevices);
  settings.surface = surface_settings(surface);
  return settings;
}

constexpr const char* kSettingsDoc = R"(
mesh: a ClosedMesh; or what is closed first: a Mesh, a path, (vertices, triangles), or an object with
    vertices and faces, such as trimesh's. close_mesh() repairs open ones.
max_spheres: count; 0: no limit.
target_coverage: [0, 1] of the solid's volume.
min_radius: [u] smaller spheres are not inserted.
time_limit: [s], 0: none; the only setting that costs repeatability.
epsilon: greedy slack; 0: the library's schedule.
grid: 'banded', 'uniform', 'explicit', 'implicit' or 'hybrid'.
seed: breaks ties.
threads: 0: all cores; never changes the result.
device: 'auto', 'cpu' or 'cuda'; never changes the result.
surface: what is kept of the mesh for exact queries: 'all' of its triangles, 'none', or as few as
    stay within a length of it: a number [u], or a share of its longest side as '0.1%'.
progress: called with a Progress on this thread; False cancels: packing then keeps what is packed,
    later stages raise Error. What it raises is raised.

Ctrl-C raises KeyboardInterrupt within 0.2 s.
Raises Error if not one sphere fits, and on settings out of range.)";

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
  py::class_<Bounds>(module, "Bounds", "What holds a solid: a box along the axes, and a ball.")
      .def_ro("lower", &Bounds::lower, "(3,) [u] corner of the box")
      .def_ro("upper", &Bounds::upper, "(3,) [u] the opposite corner")
      .def_ro("centre", &Bounds::centre, "(3,) [u] of the ball")
      .def_ro("radius", &Bounds::radius, "[u] of the ball");
  py::class_<Invariant>(module, "Invariant", "One proven property of an asset.")
      .def_ro("name", &Invariant::name, "'sphere inside solid', …")
      .def_ro("worst", &Invariant::worst,
              "Largest violation measure, as `meaning` says; ≤ 0 is sound unless stated.")
      .def_ro("meaning", &Invariant::meaning, "What `worst` measures, with its unit.")
      .def_ro("where", &Invariant::where, "Number of the sphere, node, … that is worst.")
      .def_ro("checked", &Invariant::checked, "How many were looked at.")
      .def_ro("violations", &Invariant::violations, "How many do not hold.");
  py::class_<PartnerError>(module, "PartnerError", "How an asset answers one kind of partner.")
      .def_prop_ro(
          "partner", [](const PartnerError& e) { return app::name_of(e.partner); },
          "'copy', 'plane', 'ball', 'edge', 'corner' or 'plate'.")
      .def_ro("median", &PartnerError::median, "Relative.")
      .def_ro("poses", &PartnerError::poses, "Behind it.");
}

struct Targeted {
  SharedAsset asset;
  double measured_error = 0;
  std::uint32_t poses = 0;
  std::vector<PartnerError> partners;
  bool met = false;
  StopReason stop = StopReason::sphere_count;
};

void add_bakes(py::module_& module) {
  module.def(
      "bake",
      [](const py::object& given, std::size_t max_spheres, double target_coverage,
         double min_radius, double time_limit, double epsilon, const std::string& grid,
         std::uint64_t seed, unsigned threads, const std::string& device, const py::object& surface,
         const py::object& progress) {
        const PackingSettings settings =
            packing_settings(max_spheres, target_coverage, min_radius, time_limit, epsilon, grid,
                             seed, threads, device, surface);
        return offline(
            [mesh = closed_of(given), settings](const ProgressCallback& callback) {
              return bake(*mesh, settings, callback);
            },
            progress);
      },
      py::arg("mesh"), py::kw_only(), py::arg("max_spheres") = PackingSettings().max_spheres,
      py::arg("target_coverage") = 1.0, py::arg("min_radius") = 0.0, py::arg("time_limit") = 0.0,
      py::arg("epsilon") = 0.0, py::arg("grid") = "banded", py::arg("seed") = 0,
      py::arg("threads") = 0, py::arg("device") = "auto", py::arg("surface") = "all",
      py::arg("progress") = py::none(),
      (std::string("Makes the asset of a mesh. Same mesh and settings, same bytes, on any "
                   "machine.\n") +
       kSettingsDoc)
          .c_str());
  py::class_<Targeted>(module, "TargetedAsset", "What bake_to_error made of its target.")
      .def_ro("asset", &Targeted::asset, "The Asset.")
      .def_ro("measured_error", &Targeted::measured_error,
              "Relative, median near the overlap asked about, worst partner's.")
      .def_ro("poses", &Targeted::poses, "Of all partners; 0: none was tried.")
      .def_ro("partners", &Targeted::partners, "A PartnerError for each kind.")
      .def_ro("met", &Targeted::met, "poses > 0 and measured_error no larger than asked.")
      .def_prop_ro(
          "stop", [](const Targeted& t) { return app::name_of(t.stop); }, "What ended the search.");
  module.def(
      "bake_to_error",
      [](const py::object& given, double relative_error, double at_overlap, std::size_t max_spheres,
         double target_coverage, double min_radius, double time_limit, double epsilon,
         const std::string& grid, std::uint64_t seed, unsigned threads, const std::string& device,
         const py::object& surface, const py::object& progress) {
        const PackingSettings settings =
            packing_settings(max_spheres, target_coverage, min_radius, time_limit, epsilon, grid,
                             seed, threads, device, surface);
        return offline(
            [mesh = closed_of(given), settings,
             target = ErrorTarget{relative_error, at_overlap}](const ProgressCallback& callback) {
              TargetedAsset made = bake_to_error(*mesh, target, settings, callback);
              return Targeted{std::make_shared<Asset>(std::move(made.asset)),
                              made.measured_error,
                              made.poses,
                              {made.partners.begin(), made.partners.end()},
                              made.met,
                              made.stop};
            },
            progress);
      },
      py::arg("mesh"), py::arg("relative_error") = ErrorTarget().relative_error,
      py::arg("at_overlap") = ErrorTarget().at_overlap, py::kw_only(), py::arg("max_spheres") = 0,
      py::arg("target_coverage") = 1.0, py::arg("min_radius") = 0.0, py::arg("time_limit") = 0.0,
      py::arg("epsilon") = 0.0, py::arg("grid") = "banded", py::arg("seed") = 0,
      py::arg("threads") = 0, py::arg("device") = "auto", py::arg("surface") = "all",
      py::arg("progress") = py::none(),
      (std::string("bake() with about as few spheres as an error needs.\n\n"
                   "relative_error: (0, 1) median over random poses, for every partner.\n"
                   "at_overlap: [1e-4, 0.5] of the solid's volume.\n"
                   "max_spheres: 0: 200,000. The other settings are those of bake():\n") +
       kSettingsDoc)
          .c_str());
  module.def(
      "bake_surface",
      [](const py::object& given, const py::object& surface, unsigned threads) {
        return offline(
            [mesh = closed_of(given), settings = surface_settings(surface),
             threads](const ProgressCallback&) { return bake_surface(*mesh, settings, threads); });
      },
      py::arg("mesh"), py::kw_only(), py::arg("surface") = "all", py::arg("threads") = 0,
      "Makes the asset of a surface alone: the mesh, mass and bounds, without spheres, for exact "
      "queries.\n\nWhat asks spheres answers QueryStatus.not_held. The settings are those of "
      "bake().\nRaises Error where the mesh counts volume twice.");
  module.def(
      "check",
      [](const SharedAsset& asset, const py::object& given, unsigned threads) {
        return offline([asset, mesh = closed_of(given), threads](const ProgressCallback&) {
          return check(*asset, *mesh, threads);
        });
      },
      py::arg("asset"), py::arg("mesh"), py::kw_only(), py::arg("threads") = 0,
      "Proves every invariant of an asset again, in double, from its bytes and the mesh alone.\n\n"
      "Returns a list of Invariant. Raises Error if the asset is of another mesh.");
}

}  // namespace

void add_assets(py::module_& module) {
  add_bodies(module);
  py::class_<Asset>(module, "Asset", py::type_slots(kAssetSlots),
                    "A baked solid. Immutable, so threads may share it. "
                    "memoryview(asset) is a read-only view of its bytes that holds it; "
                    "pickle works.")
      .def_static(
          "load",
          [](const py::object& path) {
            return offline(
                [name = path_of(path)](const ProgressCallback&) { return Asset::load(name); });
          },
          py::arg("path"), "Reads an .ist file. Raises Error (file, what is wrong, way out).")
      .def_static("from_bytes", &asset_of_bytes, py::arg("data"), py::arg("name") = "asset",
                  "Copies the bytes of an .ist file.\n\ndata: bytes, or any contiguous buffer.\n"
                  "name: for messages. Raises Error unless every check holds.")
      .def(
          "save",
          [](const SharedAsset& self, const py::object& path) {
            offline([self, name = path_of(path)](const ProgressCallback&) {
              self->save(name);
              return true;
            });
          },
          py::arg("path"),
          "Writes an .ist file: the old one or the whole new one is there at every moment.")
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
            return py::module_::import_("json").attr("loads")(app::asset_json(self.view()).dump());
          },
          "All that `ist info --json` prints, as a dict: docs/json.md.")
      .def("__str__", [](const Asset& self) { return app::describe_asset(self.view()); })
      .def("spheres", &spheres_of, py::arg("which") = "matched",
           "(n, 4) float64: centre and radius [u], in the mesh's own frame; a copy.\n\n"
           "which: 'matched' or 'inner'.")
      .def(
          "mass_properties",
          [](const Asset& self, const py::object& pose, double scale) {
            return mass_properties(placed(self, pose, scale));
          },
          py::arg("pose") = py::none(), py::arg("scale") = 1.0,
          "MassProperties, in the frame that the pose leads to; all zero for a pose that a query "
          "calls invalid.")
      .def(
          "bounds",
          [](const Asset& self, const py::object& pose, double scale) {
            return pose.is_none() && scale == 1 ? bounds(self.view())
                                                : bounds(placed(self, pose, scale));
          },
          py::arg("pose") = py::none(), py::arg("scale") = 1.0,
          "Bounds, in the frame that the pose leads to. Matched spheres may reach out by "
          "`protrusion`.")
      .def_prop_ro(
          "sphere_count", [](const Asset& self) { return self.view().sphere_count(); }, "Count.")
      .def_prop_ro(
          "volume", [](const Asset& self) { return self.view().volume(); }, "[u³] of the solid.")
      .def_prop_ro(
          "coverage", [](const Asset& self) { return self.view().coverage(); },
          "[0, 1] share of it in inner spheres.")
      .def_prop_ro(
          "protrusion", [](const Asset& self) { return self.view().protrusion(); },
          "[u] no matched sphere sticks further out of the solid.")
      .def_prop_ro(
          "has_field", [](const Asset& self) { return self.view().has_field(); },
          "It holds the solid's surface.")
      .def_prop_ro(
          "field_error", [](const Asset& self) { return self.view().field_error(); },
          "[u] that surface and the solid's lie within this of each other.")
      .def_prop_ro(
          "mesh_triangles", [](const Asset& self) { return self.view().mesh_triangles(); },
          "Of the mesh that exact queries ask; 0: it holds none.")
      .def_prop_ro(
          "mesh_error", [](const Asset& self) { return self.view().mesh_error(); },
          "[u] the mesh's surface and the solid's lie within this of each other.")
      .def_prop_ro(
          "mesh_state", [](const Asset& self) { return app::name_of(self.view().mesh_state()); },
          "'own', 'resolved', 'simplified', 'none', or 'unresolved': it counts volume twice.")
      .def_prop_ro(
          "counted_twice", [](const Asset& self) { return self.view().counted_twice(); },
          "[u³] that the mesh as it came counts more than once.");
  add_bakes(module);
}

}  // namespace ist::python
