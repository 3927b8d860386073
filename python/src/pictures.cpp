#include <ist/c.h>
#include <ist/lenses.h>
#include <ist/mass_properties.h>

#include <memory>
#include <vector>

#include <ist/types.h>

#include "penetration.h"
#include "query/base/relative_pose.h"

// Data of assets and contacts for drawing, and for choosing query settings.

namespace ist::python {
namespace {

struct Lenses {
  Shape rows;
  Column<double, 3> centre{rows}, axis{rows};
  Column<double> radius{rows}, thickness{rows};
  Column<std::uint32_t> sphere_a{rows}, sphere_b{rows};
};

std::unique_ptr<Lenses> lenses(const py::object& a, const py::object& b, const py::object& pose,
                               const py::object& pose_a, double scale, double scale_a,
                               const std::string& measure, unsigned detail_a, unsigned detail_b) {
  if (pose.is_none()) take_poses(pose, "pose", "(7,) or (4, 4)");
  const PlacedAsset first{tree_of(a, "a"), take_pose(pose_a, scale_a), scale_a};
  const PlacedAsset second{tree_of(b, "b"), take_pose(pose, scale), scale};
  const LensSettings settings{named(measure, "measure", kSphereMeasures), detail_a, detail_b};
  std::vector<OverlapLens> room(4096);
  OverlapLenses found;
  {
    const py::gil_scoped_release released;
    found = overlap_lenses(first, second, settings, room);
    if (found.total > room.size()) {
      room.resize(found.total);
      found = overlap_lenses(first, second, settings, room);
    }
  }
  if (found.status == QueryStatus::missing_data)
    throw Error("a, b: one is a mesh alone, without spheres; bake it with bake()");
  if (found.status == QueryStatus::invalid_input)
    throw value_error("pose, detail_a, detail_b: too far away, or an asset has no such detail");
  auto answers = std::make_unique<Lenses>(Lenses{{found.count}});
  for (std::size_t i = 0; i < found.count; ++i) write_row(*answers, i, room[i]);
  return answers;
}

std::shared_ptr<Penetrations> corrected(const Penetrations& whole, const Rows& rows) {
  if (whole.volume.shape != rows.shape())
    throw value_error("whole: shape " + text_of(whole.volume.shape) + " of rows; poses have " +
                      text_of(rows.shape()));
  auto answers = std::make_shared<Penetrations>(Penetrations{rows.shape()});
  for (std::size_t i = 0; i < rows.count(); ++i) {
    const Row row = rows.at(i);
    for (const Side* const side : {&row.a, &row.b})
      if (side->tree() == nullptr)
        throw type_error(std::string(side == &row.a ? "a" : "b") + ": a Shape; wanted an Asset");
    Penetration before;
    for_each_member([i](auto& value, const auto& column) { column.read(i, value); }, before, whole);
    answers->write(i, row,
                   without_protrusion(before, {*row.a.tree(), row.a.pose, row.a.scale},
                                      {*row.b.tree(), row.b.pose, row.b.scale}));
  }
  return answers;
}

SizeMatch fit_of(const py::object& a, const py::object& b, double scale, double scale_a) {
  take_pose(py::none(), scale_a);
  take_pose(py::none(), scale);
  return size_match(PlacedAsset{tree_of(a, "a"), {}, scale_a},
                    PlacedAsset{tree_of(b, "b"), {}, scale});
}

}  // namespace

py::tuple kept_mesh_of(const Asset& asset) {
  const std::span<const std::byte> bytes = asset.bytes();
  ist_asset_t tree = {};
  ist_mesh_t surface = {};
  surface.size = sizeof surface;
  if (ist_asset_view(bytes.data(), bytes.size(), &tree) != IST_OK ||
      ist_asset_get_mesh(&tree, &surface) != IST_OK || surface.triangle_count == 0)
    throw Error("the asset holds no mesh; bake it with keep_mesh=True");
  const Column<double, 3> vertices({surface.vertex_count});
  const Column<std::uint32_t, 3> triangles({surface.triangle_count});
  surface.vertices = reinterpret_cast<double(*)[3]>(vertices.row(0));
  surface.triangles = reinterpret_cast<std::uint32_t(*)[3]>(triangles.row(0));
  surface.vertex_capacity = surface.vertex_count;
  surface.triangle_capacity = surface.triangle_count;
  ist_asset_get_mesh(&tree, &surface);
  return py::make_tuple(vertices.handed_out(), triangles.handed_out());
}

void add_pictures(py::module_& module) {
  py::class_<Lenses> type(module, "Lenses", "Lenses in which spheres of two assets overlap.");
  add_column(type, "centre", &Lenses::centre, "(n, 3) [u] middle of the thickness, world.");
  add_column(type, "axis", &Lenses::axis, "(n, 3) unit, from A's sphere to B's, world.");
  add_column(type, "radius", &Lenses::radius, "(n,) [u] where it is widest, across the axis.");
  add_column(type, "thickness", &Lenses::thickness, "(n,) [u] along the axis.");
  add_column(type, "sphere_a", &Lenses::sphere_a, "(n,) uint32, row of A's spheres().");
  add_column(type, "sphere_b", &Lenses::sphere_b, "(n,) uint32, row of B's spheres().");
  add_pickling(type);
  module.def("lenses", &lenses, py::arg("a"), py::arg("b"), py::arg("pose").none(), py::kw_only(),
             py::arg("pose_a") = py::none(), py::arg("scale") = 1.0, py::arg("scale_a") = 1.0,
             py::arg("measure") = "matched", py::arg("detail_a") = 0, py::arg("detail_b") = 0,
             R"(The lenses that penetration() sums when it sums lenses, for pictures.

a, b: Assets. pose, scale: of B. pose_a, scale_a: of A; None: at the origin.
measure: 'matched' or 'inner'. detail_a, detail_b: levels of detail of the matched spheres, 0 the
    finest; `sphere_a` and `sphere_b` then index that level's spheres.

Returns Lenses: an ellipsoid of the radius and the thickness about the centre resembles each.)");

  module.def(
      "without_protrusion",
      [](const Penetrations& whole, const py::object& a, const py::object& b,
         const py::object& poses, const py::object& scales, const py::object& poses_a,
         const py::object& scales_a) {
        return corrected(whole, Rows::of_pair(a, b, poses, scales, poses_a, scales_a));
      },
      py::arg("whole"), py::arg("a"), py::arg("b"), py::arg("poses").none(), py::kw_only(),
      py::arg("scales") = py::none(), py::arg("poses_a") = py::none(),
      py::arg("scales_a") = py::none(),
      R"(Removes the volume that protruding spheres add where flat faces meet.

whole: the answer of penetration() at these poses with spheres_only=True, in the matched measure
    without a pair budget.

The result is zero across a gap of a fifth of a mean sphere radius or more. Between this gap and a
depth of a fifth of that radius, the volume is reduced and the force scaled with it. Round and
deeper contacts are unchanged. The force is the volume's gradient to within 15 %: use it for contacts, not where energy must be
conserved.

Returns a Penetration.)");

  py::class_<SizeMatch>(module, "SizeMatch", "Whether the sizes of two assets suit each other.")
      .def_ro("feature_size_a", &SizeMatch::feature_size_a,
              "[u] mean radius of A's spheres over the share of the solid that they cover: finer "
              "features are not resolved.")
      .def_ro("feature_size_b", &SizeMatch::feature_size_b, "[u] likewise.")
      .def_ro("ratio", &SizeMatch::ratio, "≥ 1, the coarser grain over the finer.")
      .def_ro("a_is_coarser", &SizeMatch::a_is_coarser, "Or both are equal.")
      .def_ro("has_mesh", &SizeMatch::has_mesh, "Whether both assets hold their meshes.")
      .def_ro("needs_mesh", &SizeMatch::needs_mesh,
              "Whether volumes and forces by spheres alone are misleading.")
      .def_prop_ro("fits", &SizeMatch::fits, "has_mesh, or not needs_mesh.");
  module.def(
      "size_match", &fit_of, py::arg("a"), py::arg("b"), py::kw_only(), py::arg("scale") = 1.0,
      py::arg("scale_a") = 1.0,
      "Whether the sizes of two Assets suit each other, whatever their poses: a SizeMatch.\n\n"
      "scale, scale_a: of B and of A.");
}

}  // namespace ist::python
