#include <algorithm>
#include <cmath>
#include <vector>

#include <nanobind/stl/tuple.h>

#include "module.h"
#include "pair_queries.h"
#include "query/find_solid_box.h"
#include "query/kernel/lens.h"

// Queries of many pairs that ist.trimesh makes at every call.

namespace ist::python {
namespace {

/// A lower bound of the distance of two placed assets [u]. Negative if they may overlap: minus the
/// cube root of the volume that the boxes and balls around them share. 0 if boxes share no more
/// than rounding.
double nearness(const Row& row) {
  Bounds around[2];
  for (const auto& [side, to] : {std::pair(&row.a, &around[0]), std::pair(&row.b, &around[1])})
    *to = bounds(PlacedAsset{*side->tree(), side->pose, side->scale});
  const auto& [a, b] = around;
  const Eigen::Array3d between = (a.lower - b.upper).cwiseMax(b.lower - a.upper).array();
  const double balls = (a.centre - b.centre).norm() - a.radius - b.radius;
  // Exceeds the rounding of placing a solid.
  const double rounded = 1e-12 * (a.centre.cwiseAbs().maxCoeff() + b.centre.cwiseAbs().maxCoeff() +
                                  a.radius + b.radius);
  const double apart = std::max(between.max(0).matrix().norm(), balls) - rounded;
  if (apart > 0) return apart;
  if (between.maxCoeff() >= -rounded) return 0;
  const double volume =
      std::min((rounded - between).max(0).prod(),
               lens(a.radius + rounded, b.radius + rounded, (a.centre - b.centre).norm()).volume());
  return -std::cbrt(std::max(volume, 0.0));
}

/// Rows whose solids overlap or touch, or the first of them alone; whether they only touch; and the
/// row and the status that stopped it, −1 and ok if none did.
using Collisions = std::tuple<py::object, py::object, std::int64_t, std::uint32_t>;

/// `tells_touching`: else touching ones count as overlapping, where that is quicker.
Collisions collisions(const GivenPair& pair, bool only_first, bool tells_touching) {
  const Rows rows = pair.rows();
  PenetrationSettings settings;
  settings.measure = Measure::exact;
  enum Found : unsigned char { apart, overlap, touch };
  std::vector<Found> found(rows.count());
  std::vector<QueryStatus> status(rows.count());
  bool done = false;
  for_each_row(rows, only_first ? 1 : 0, [&](std::size_t i, Workspace& workspace) {
    if (done) return;
    const Row row = rows.at(i);
    if (nearness(row) > 0) return;
    const PlacedSolid a = row.a.placed(), b = row.b.placed();
    const YesNo quick = tells_touching ? YesNo::unknown : ist::overlap(a, b, workspace).answer;
    if (quick == YesNo::unknown) {
      const Penetration answer = penetration(a, b, settings, workspace);
      status[i] = answer.status;
      found[i] = answer.volume > 0 ? overlap : answer.touching ? touch : apart;
    } else {
      found[i] = quick == YesNo::yes ? overlap : apart;
    }
    if (only_first) done = found[i] != apart || status[i] != QueryStatus::ok;
  });
  const auto stop = std::find_if(status.begin(), status.end(),
                                 [](QueryStatus one) { return one != QueryStatus::ok; });
  const auto count =
      rows.count() - static_cast<std::size_t>(std::count(found.begin(), found.end(), apart));
  const Column<std::int64_t> hits({count});
  const Column<bool> touching({count});
  for (std::size_t i = 0, k = 0; i < found.size(); ++i)
    if (found[i] != apart) {
      hits.write(k, i);
      touching.write(k++, found[i] == touch);
    }
  const bool answered = stop == status.end();
  return {hits.handed_out(), touching.handed_out(), answered ? -1 : stop - status.begin(),
          static_cast<std::uint32_t>(answered ? QueryStatus::ok : *stop)};
}

}  // namespace

void add_collisions(py::module_& module) {
  add_pair_query(
      module, "_collisions",
      +[](const GivenPair& pair, bool only_first, bool tells_touching) {
        return collisions(pair, only_first, tells_touching);
      },
      py::arg("only_first"), py::arg("tells_touching"));
  add_pair_query(
      module, "_nearness", +[](const GivenPair& pair) {
        const Rows rows = pair.rows();
        Column<double> out(rows.shape());
        for (std::size_t i = 0; i < rows.count(); ++i) out.write(i, nearness(rows.at(i)));
        return out.handed_out();
      });
  module.def(
      "_poses",
      [](const py::object& matrices, const std::string& name) {
        return rows_of_matrices(take_doubles(matrices, name, "(…, 4, 4)"), name).handed_out();
      },
      py::arg("matrices"), py::arg("name"));
  module.def(
      "_put_pose",
      [](py::ndarray<double, py::shape<7>, py::c_contig, py::device::cpu> to,
         const py::object& matrix) {
        const Doubles given = take_doubles(matrix, "transform", "(4, 4)");
        if (given.ndim() != 2 || given.shape(0) != 4 || given.shape(1) != 4)
          throw value_error("transform must be (4,4)!");
        if (!std::all_of(given.data(), given.data() + 16,
                         [](double x) { return std::isfinite(x); }))
          throw value_error("must be finite");
        double row[7];
        if (const char* const fault = write_pose(given.data(), row))
          throw value_error(std::string("it is no rigid motion: ") + fault +
                            "; scale or mirror the mesh");
        std::copy_n(row, 7, to.data());
      },
      py::arg("to"), py::arg("matrix"));
}

}  // namespace ist::python
