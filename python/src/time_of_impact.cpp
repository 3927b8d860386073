#include <ist/time_of_impact.h>

#include <cmath>
#include <memory>

#include "penetration.h"

namespace ist::python {
namespace {

constexpr const char* kDoc =
    R"(Time up to which B, moving between two poses, provably stays clear of A.

B moves from `poses` to `poses_to` in the time `duration`: the point `about` moves straight, and
B rotates at constant speed about one axis, the shorter way. A rests at `poses_a`, or moves to `poses_a_to`.

poses, poses_to: (7,) or (n, 7), as for penetration(); either of one row applies to all rows.
about, about_a: (3,) [u] in the object's own frame, before its scale: its centre of mass for a free
    body.
duration: [T] > 0. tolerance: [u]; 0: a thousandth of the smaller bounding radius.
max_visits: 0: no limit.

Returns a TimeOfImpact: arrays of one row a pose, or numbers and (3,) arrays for one pose.)";

}  // namespace

void add_time_of_impact(py::module_& module) {
  py::class_<Impacts> type(module, "TimeOfImpact", "Time up to which moving solids stay clear.");
  add_column(
      type, "time", &Impacts::time,
      "(n,) [T] in [0, duration]. The solids do not touch before it, certified for every kind.");
  add_column(type, "distance_min", &Impacts::distance_min,
             "(n,) [u] the solids' distance at `time` is at least this, certified.");
  add_column(type, "distance_max", &Impacts::distance_max,
             "(n,) [u] and at most this; infinite where no impact was found.");
  add_column(type, "point_a", &Impacts::point_a, "(n, 3) [u] of A at `time`, world.");
  add_column(type, "point_b", &Impacts::point_b, "(n, 3) [u] of B at `time`, world.");
  add_column(type, "normal", &Impacts::normal, "(n, 3) unit, from A to B, world.");
  add_column(type, "kind", &Impacts::kind, "(n,) uint32, an ImpactKind.");
  add_column(type, "status", &Impacts::status, "(n,) uint32, a QueryStatus.");
  add_column(type, "node_visits", &Impacts::node_visits, "(n,) uint32.");
  add_column(type, "surface_pairs", &Impacts::surface_pairs, "(n,) uint32.");
  add_pickling(type);
  module.def(
      "time_of_impact",
      [](const py::object& a, const py::object& b, const py::object& poses,
         const py::object& poses_to, const py::object& about, const py::object& scales,
         const py::object& poses_a, const py::object& poses_a_to, const py::object& about_a,
         const py::object& scales_a, double duration, double tolerance, std::uint32_t max_visits,
         unsigned threads) {
        if (!(duration > 0) || !std::isfinite(duration))
          throw value_error("duration: " + text_of(py::float_(duration)) + "; wanted > 0");
        const ImpactSettings settings{duration, take_limit(tolerance, "tolerance"), max_visits};
        const Rows from = Rows::of_pair(a, b, poses, scales, poses_a, scales_a);
        const Rows to =
            Rows::of_pair(a, b, poses_to, scales, poses_a_to.is_none() ? poses_a : poses_a_to,
                          scales_a, "poses_to");
        const Rows& rows = from.shape().empty() ? to : from;
        if (!to.shape().empty() && to.shape() != rows.shape())
          throw value_error("poses_to: shape " + text_of(to.shape()) + " of rows; poses have " +
                            text_of(from.shape()));
        const Eigen::Vector3d centre = take_vector(about, "about"),
                              centre_a = take_vector(about_a, "about_a");
        auto answers = std::make_unique<Impacts>(Impacts{rows.shape()});
        for_each_row(rows, threads, [&](std::size_t i, Workspace& workspace) {
          const Row start = from.at(i), end = to.at(i);
          const Motions motions{
              motion_between(start.a.pose, end.a.pose, settings.duration, centre_a, start.a.scale),
              motion_between(start.b.pose, end.b.pose, settings.duration, centre, start.b.scale)};
          write_row(
              *answers, i,
              time_of_impact(start.a.placed(), start.b.placed(), motions, settings, workspace));
        });
        if (rows.shape().empty()) {
          const auto status = QueryStatus{*answers->status.row(0)};
          if (status == QueryStatus::invalid_input && fault_of(from.at(0)).empty()) {
            const std::string fault = fault_of(to.at(0), "poses_to");
            throw value_error(fault.empty() ? "poses_to, about: a motion with NaN, or too far"
                                            : fault);
          }
          refuse_unanswered(from, status);
        }
        return answers;
      },
      py::arg("a"), py::arg("b"), py::arg("poses").none(), py::arg("poses_to").none(),
      py::kw_only(), py::arg("about") = py::make_tuple(0.0, 0.0, 0.0),
      py::arg("scales") = py::none(), py::arg("poses_a") = py::none(),
      py::arg("poses_a_to") = py::none(), py::arg("about_a") = py::make_tuple(0.0, 0.0, 0.0),
      py::arg("scales_a") = py::none(), py::arg("duration") = 1.0, py::arg("tolerance") = 0.0,
      py::arg("max_visits") = 0, py::arg("threads") = 0, kDoc);
}

}  // namespace ist::python
