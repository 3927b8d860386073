#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/types.h>

#include "arrays.h"
#include "clash/clash.h"
#include "library/text.h"
#include "meshes.h"
#include "module.h"
#include "offline.h"
#include "rows.h"
#include "solids.h"

namespace ist::python {
namespace {

double rounding_of_array(const py::object& array) {
  return py::hasattr(array, "dtype") && text_of(array.attr("dtype")) == "float32" ? kFloat32
                                                                                  : kFloat64;
}

/// The file or the array determines whether coordinates are float32.
double rounding_of(const py::object& mesh) {
  if (py::isinstance<py::str>(mesh) || py::hasattr(mesh, "__fspath__"))
    return rounding_of_file(path_of(mesh));
  const bool pair = py::isinstance<py::tuple>(mesh) || py::isinstance<py::list>(mesh);
  const py::object vertices = pair && py::len(mesh) > 0       ? py::object(mesh[0])
                              : py::hasattr(mesh, "vertices") ? py::object(mesh.attr("vertices"))
                              : py::hasattr(mesh, "points")   ? py::object(mesh.attr("points"))
                                                              : py::object(py::none());
  return rounding_of_array(vertices);
}

py::object clash(const py::object& given, const py::object& poses, const py::object& names,
                 const py::object& scales, double clearance, std::optional<double> tolerance,
                 std::optional<double> touch_within, unsigned threads) {
  if (py::isinstance<py::dict>(given))
    throw type_error("meshes: a dict; wanted a list, and names=[…] for what they are called");
  const py::list meshes(given);
  const std::size_t count = py::len(meshes);
  const auto fits = [&](const py::object& list, const char* name) {
    if (!list.is_none() && py::len(list) != count)
      throw value_error(std::string(name) + ": " + std::to_string(py::len(list)) + " for " +
                        std::to_string(count) + " meshes");
  };
  fits(poses, "poses");
  fits(names, "names");
  fits(scales, "scales");
  ClashSettings settings;
  settings.clearance = take_limit(clearance, "clearance");
  if (touch_within) settings.touch_within = take_limit(*touch_within, "touch_within");
  settings.threads = take_threads(threads);
  ClashReport report;
  report.parts = count;
  if (tolerance) report.tolerance = take_limit(*tolerance, "tolerance");
  std::vector<ClashPart> parts;
  std::set<std::string> known;
  std::vector<std::shared_ptr<const Asset>> baked;
  for (std::size_t i = 0; i < count; ++i) {
    const py::object mesh = meshes[i];
    ClashPart part;
    part.name = names.is_none() ? std::to_string(i) : text_of(names[i]);
    if (!known.insert(part.name).second)
      throw value_error("names[" + std::to_string(i) + "]: '" + part.name + "' is given twice");
    part.rounding = rounding_of(mesh);
    part.placing = rounding_of_array(poses);
    part.solid.scale = scales.is_none() ? 1 : py::cast<double>(scales[i]);
    part.solid.pose = take_pose(poses.is_none() ? poses : py::object(poses[i]), part.solid.scale,
                                "poses[" + std::to_string(i) + "]");
    try {
      if (type_name_of(mesh) == "Asset") {
        part.solid.asset = tree_of(mesh, "meshes");
        if (!part.solid.asset.has_mesh()) throw Error("the asset keeps no mesh");
      } else {
        baked.push_back(offline(
            [closed = closed_of(mesh, py::float_(1.0)), threads](const ProgressCallback& progress) {
              return std::make_shared<const Asset>(bake_mesh_only(*closed, threads, progress));
            }));
        part.solid.asset = baked.back()->view();
      }
    } catch (const Error& error) {
      report.faults.emplace_back(part.name, error.what());
      continue;
    }
    report.names.push_back(part.name);
    parts.push_back(std::move(part));
  }
  const std::vector<Clash> pairs =
      offline([parts, settings](const ProgressCallback&) { return find_clashes(parts, settings); });
  report.pairs = pairs;
  note_rounding(parts, settings, report.notes);
  return py::module_::import_("json").attr("loads")(json_text(clashes_json(report), -1));
}

}  // namespace

void add_clash(py::module_& module) {
  module.def("clash", &clash, py::arg("meshes"), py::arg("poses") = py::none(), py::kw_only(),
             py::arg("names") = py::none(), py::arg("scales") = py::none(),
             py::arg("clearance") = 0.0, py::arg("tolerance") = py::none(),
             py::arg("touch_within") = py::none(), py::arg("threads") = 0u,
             R"(All pairs of an assembly's parts that overlap or touch, by the exact measure.

meshes: list of Assets that keep a mesh, or of what bake() accepts.
poses: (n, 7) of the parts; None: all stand where they are.
names, scales: one a part; None: numbers, and 1.
clearance: [u] pairs that are nearer are listed too.
tolerance: [u³] each pair gets a verdict: certainly above, certainly below, or undecided.
touch_within: [u] parts that reach no further into each other touch. None: what rounding of the
    coordinates comes to, float32 for arrays and files of it.
threads: 0: all cores. The result does not depend on it.

Returns the dictionary of `ist clash --json`: docs/json.md. A mesh that is open or cannot be read is
among its "faults", and the rest is answered. Raises Error, which names the part, for an invalid
scale.)");
}

}  // namespace ist::python
