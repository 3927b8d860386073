#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
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

/// How far apart an overlap pushes its solids [u]. Where forces cancel, as of a solid inside
/// another: the size of the overlap.
double depth_of(double volume, double area) {
  return std::min(volume / std::max(area, 1e-300), std::cbrt(volume));
}

struct Deepest {
  double distance = std::numeric_limits<double>::infinity();  ///< minus the depth; 0: touching
  std::int64_t row = -1;                                      ///< −1: none
  double volume = 0;
  Eigen::Vector3d force{0, 0, 0}, centroid{0, 0, 0};  ///< on B
  QueryStatus status = QueryStatus::ok;               ///< else of `row`, which stopped it

  /// Takes one more row. Where faces are flush beside an overlap, the slope of its volume jumps:
  /// the overlap is the mean of two queries, with B moved by `way`, in sizes of A, and by −way.
  void ask(const Row& given, std::int64_t number, const Eigen::Vector3d& way,
           Workspace& workspace) {
    const Bounds own = bounds(*given.a.tree());
    const Eigen::Vector3d step = (own.upper - own.lower).maxCoeff() * way;
    PenetrationSettings settings;
    settings.measure = Measure::exact;
    const auto beside = [&](double steps) {
      Row at = given;
      for (int k = 0; k < 3; ++k) at.b.pose.t[k] += steps * step[k];
      const Penetration answer = penetration(at.a.placed(), at.b.placed(), settings, workspace);
      if (answer.status != QueryStatus::ok) {
        status = answer.status;
        row = number;
      }
      return answer;
    };
    const bool first = distance >= 0;
    if (first) {
      const Penetration answer = beside(0);
      if (answer.touching && distance > 0) {
        distance = 0;
        row = number;
      }
      if (!(answer.volume > 0)) return;
    }
    const Penetration under = beside(-1);
    // Half of what the volume gains by both steps adds at most one of them to the depth.
    if (status != QueryStatus::ok || -std::cbrt(under.volume) - step.norm() >= distance) return;
    const Penetration over = beside(1);
    if (status != QueryStatus::ok) return;
    const double of_both = (under.volume + over.volume) / 2;
    const Eigen::Vector3d push = (under.force + over.force) / 2;
    const double depth = depth_of(of_both, push.norm());
    if (-depth >= distance) return;
    // Between them solids may only touch.
    const bool sure =
        first || (depth > 1e5 * step.norm() && under.volume_min > 0 && over.volume_min > 0);
    if (!sure && !(beside(0).volume > 0)) return;
    distance = -depth;
    row = number;
    volume = of_both;
    force = push;
    centroid = (under.centroid + over.centroid) / 2;
  }
};

/// The deepest overlap of the rows. Those that may be deepest are asked first, one, four, 16 … at a
/// time: the best of them bounds the others.
Deepest deepest(const GivenPair& pair, const Eigen::Vector3d& way) {
  const Rows rows = pair.rows();
  std::vector<std::pair<double, std::int64_t>> bounded;  // that may overlap or touch
  for (std::size_t i = 0; i < rows.count(); ++i)
    if (const double bound = nearness(rows.at(i)); bound <= 0)
      bounded.emplace_back(bound, static_cast<std::int64_t>(i));
  std::sort(bounded.begin(), bounded.end());
  Deepest best;
  for (std::size_t begin = 0, size = 1;
       begin < bounded.size() && bounded[begin].first < best.distance; begin += size, size *= 4) {
    std::vector<Deepest> some(std::min(size, bounded.size() - begin), best);
    for_each_of(some.size(), 0, [&](std::size_t i, Workspace& workspace) {
      const auto& [bound, row] = bounded[begin + i];
      if (bound < best.distance)
        some[i].ask(rows.at(static_cast<std::size_t>(row)), row, way, workspace);
    });
    for (const Deepest& one : some) {
      if (one.status != QueryStatus::ok) return one;
      if (one.distance < best.distance) best = one;
    }
  }
  return best;
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
  add_pair_query(
      module, "_deepest",
      +[](const GivenPair& pair, const py::object& way) {
        const Deepest found = deepest(pair, take_vector(way, "way"));
        const Column<double, 3> vectors({2});
        vectors.write(0, found.force);
        vectors.write(1, found.centroid);
        return std::tuple(found.distance, found.row, found.volume, vectors.handed_out(),
                          static_cast<std::uint32_t>(found.status));
      },
      py::arg("way"));
  module.def("_depth", depth_of, py::arg("volume"), py::arg("area"));
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
