#include <ist/raycast.h>

#include <limits>
#include <memory>

#include <ist/types.h>

#include "penetration.h"
#include "surfaces.h"

namespace ist::python {
namespace {

PlacedSolid placed_alone(const py::object& solid, const py::object& pose, double scale) {
  const Solid view = solid_of(solid, "solid");
  return Side{&view, take_pose(pose, scale), scale}.placed();
}

/// Calls ask(placed, i) for each place of `shape`, with the GIL released. If the solid lacks the
/// required data, nothing is answered. A single invalid place is a ValueError.
template <class Ask>
void ask_places(const PlacedSolid& placed, const Shape& shape, const char* places, const Ask& ask) {
  bool held = true, valid = true;
  {
    const py::gil_scoped_release released;
    const std::size_t count = shape.empty() ? 1 : shape[0];
    for (std::size_t i = 0; i < count && held; ++i) {
      const QueryStatus status = ask(placed, i);
      held = status != QueryStatus::missing_data;
      valid = status != QueryStatus::invalid_input;
    }
  }
  if (!valid && shape.empty())
    throw value_error(std::string(places) + ": not finite, of length 0, or too far away");
  if (!held)
    throw Error(
        "solid: has no mesh, or is a Shape that no ray can be cast at; bake it with its mesh, or "
        "use another Shape");
}

constexpr const char* kRaycastDoc = R"(Where rays meet a solid's surface first.

solid: an Asset that keeps its mesh, or a Shape (half-space, ball, box, capsule, cylinder).
pose: (7,), None: at the origin. origins, directions: (3,) or (n, 3) [u], world; directions of any
length but 0. max_distance: [u] rays end there. A ray that starts inside meets the surface on its way out.

Returns RayHits: arrays of one row a ray, or numbers and (3,) arrays for one ray.)";

constexpr const char* kClosestPointDoc = R"(Signed distance, nearest point and gradient.

solid, pose: as for raycast(); any Shape. points: (3,) or (n, 3) [u], world.

Returns SurfacePoints: arrays of one row a point, or numbers and (3,) arrays for one point.)";

constexpr const char* kContainsDoc = R"(Whether points are inside a solid.

Arguments as for closest_point().

Returns (n,) uint32, a YesNo: 0 no, 1 yes, 2 unknown: invalid point; a number for one point.)";

}  // namespace

void add_surfaces(py::module_& module) {
  py::class_<RayHits> hits(module, "RayHits", "Where rays meet a surface first.");
  add_column(hits, "distance", &RayHits::distance, "(n,) [u] inf: no hit.");
  add_column(hits, "point", &RayHits::point, "(n, 3) [u] world; zero without a hit.");
  add_column(hits, "normal", &RayHits::normal, "(n, 3) unit, outward, world.");
  add_column(hits, "triangle", &RayHits::triangle,
             "(n,) uint32, of the kept mesh; 2**32 - 1: no hit, or a Shape.");
  add_column(hits, "status", &RayHits::status, "(n,) uint32, a QueryStatus.");
  add_pickling(hits);
  py::class_<SurfacePoints> points(module, "SurfacePoints", "Nearest points of a surface.");
  add_column(points, "distance", &SurfacePoints::distance, "(n,) [u] signed: < 0 inside.");
  add_column(points, "error", &SurfacePoints::error,
             "(n,) [u] the solid's distance is within this of `distance`.");
  add_column(points, "point", &SurfacePoints::point, "(n, 3) [u] on the surface, world.");
  add_column(points, "gradient", &SurfacePoints::gradient,
             "(n, 3) of the distance by the point: unit, outward, world.");
  add_column(points, "triangle", &SurfacePoints::triangle, "(n,) uint32, as in RayHits.");
  add_column(points, "status", &SurfacePoints::status, "(n,) uint32, a QueryStatus.");
  add_pickling(points);

  module.def(
      "raycast",
      [](const py::object& solid, const py::object& pose, const py::object& origins,
         const py::object& directions, double max_distance, double scale) {
        const PlacedSolid placed = placed_alone(solid, pose, scale);
        const Places from(origins, "origins"), along(directions, "directions");
        const Shape& shape = rows_of(from, along);
        auto answers = std::make_unique<RayHits>(RayHits{shape});
        ask_places(placed, shape, "origins, directions, max_distance",
                   [&](const PlacedSolid& at, std::size_t i) {
                     const RayHit hit = raycast(at, Ray{from.at(i), along.at(i), max_distance});
                     write_row(*answers, i, hit);
                     return hit.status;
                   });
        return answers;
      },
      py::arg("solid"), py::arg("pose").none(), py::arg("origins"), py::arg("directions"),
      py::kw_only(), py::arg("max_distance") = std::numeric_limits<double>::infinity(),
      py::arg("scale") = 1.0, kRaycastDoc);
  module.def(
      "closest_point",
      [](const py::object& solid, const py::object& pose, const py::object& points, double scale) {
        const PlacedSolid placed = placed_alone(solid, pose, scale);
        const Places places(points, "points");
        auto answers = std::make_unique<SurfacePoints>(SurfacePoints{places.rows});
        ask_places(placed, places.rows, "points", [&](const PlacedSolid& at, std::size_t i) {
          const SurfacePoint foot = closest_point(at, places.at(i));
          write_row(*answers, i, foot);
          return foot.status;
        });
        return answers;
      },
      py::arg("solid"), py::arg("pose").none(), py::arg("points"), py::kw_only(),
      py::arg("scale") = 1.0, kClosestPointDoc);
  module.def(
      "contains",
      [](const py::object& solid, const py::object& pose, const py::object& points, double scale) {
        const PlacedSolid placed = placed_alone(solid, pose, scale);
        const Places places(points, "points");
        const Column<std::uint32_t> answers(places.rows);
        ask_places(placed, places.rows, "points", [&](const PlacedSolid& at, std::size_t i) {
          const YesNoAnswer found = contains(at, places.at(i));
          *answers.row(i) = static_cast<std::uint32_t>(found.answer);
          return found.status;
        });
        return answers.handed_out();
      },
      py::arg("solid"), py::arg("pose").none(), py::arg("points"), py::kw_only(),
      py::arg("scale") = 1.0, kContainsDoc);
}

}  // namespace ist::python
