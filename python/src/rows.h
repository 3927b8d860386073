#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include <ist/query.h>

#include "arrays.h"
#include "solid_rows.h"

namespace ist::python {

struct Side {
  const Solid* solid = nullptr;
  Pose pose;
  double scale = 1;

  /// Null: a shape.
  const AssetView* tree() const { return std::get_if<AssetView>(solid); }
  PlacedSolid placed() const {
    return std::visit([&](const auto& what) { return PlacedSolid(what, pose, scale); }, *solid);
  }
};

/// Two placed solids.
struct Row {
  Side a, b;
};

/// Poses and scales of a query: views of the arguments' memory, owned here.
class Rows {
 public:
  /// B at each pose relative to A. Arguments with one row apply to all rows.
  ///
  /// `a`, `b`: an Asset, a Shape, or SolidRows on the CPU. `poses`, `poses_a`: (7,), (n, 7), (4, 4)
  /// or (n, 4, 4); poses_a None: at the origin. `scales`, `scales_a`: a number or (n,), None: 1.
  /// `name`: of `poses`.
  static Rows of_pair(const py::object& a, const py::object& b, const py::object& poses,
                      const py::object& scales, const py::object& poses_a,
                      const py::object& scales_a, const char* name = "poses");

  const Shape& shape() const { return shape_; }  ///< of results with one row per query
  std::size_t count() const { return count_; }
  Row at(std::size_t i) const;

  /// The i-th row in the order of evaluation: pairs of the same assets are consecutive if all of
  /// them together exceed the cache.
  std::size_t asked(std::size_t i) const { return order_.empty() ? i : order_[i]; }

 private:
  /// One or many values of `width` doubles.
  struct Values {
    Values() = default;
    Values(Doubles values, std::size_t width, bool many)
        : held(std::move(values)), data(held.data()), step(many ? width : 0) {}
    explicit Values(const double* same) : data(same) {}
    const double* at(std::size_t i) const { return data + i * step; }

    Doubles held;
    const double* data = nullptr;
    std::size_t step = 0;
  };

  /// The solids of one side: one, or one for each row.
  struct Choice {
    Choice() = default;
    Choice(const py::object& given, const char* name);
    const Solid& at(std::size_t i) const {
      return among[step == 0 ? 0 : static_cast<std::size_t>(indices.data()[i])];
    }

    std::vector<Solid> own;  // of an Asset or a Shape
    py::object owner;
    std::span<const Solid> among;  // these, or those of ist.Solids
    Integers indices;
    std::size_t step = 0;  // 0: the same for all rows
  };

  Shape shape_;
  std::size_t count_ = 0;
  Choice a_, b_;
  Values pose_a_, pose_b_, scale_a_, scale_b_;
  std::vector<std::size_t> order_;  ///< of the rows; empty: unchanged

  void sort_by_asset();
};

/// The status of a single pose is not returned. Throws Error, with a remedy, if a solid lacks the
/// requested data, and ValueError that names the argument if it is invalid.
void refuse_unanswered(const Rows& rows, QueryStatus status, Measure asked = Measure::matched);
inline void refuse_unanswered(const Rows& rows, const Column<std::uint32_t>& status,
                              Measure asked = Measure::matched) {
  if (rows.shape().empty()) refuse_unanswered(rows, QueryStatus{*status.row(0)}, asked);
}

/// The fault that makes a pose or a scale unusable, with the argument's name; nothing if they are
/// usable.
std::string fault_of(const Pose& pose, double scale, const char* pose_name, const char* scale_name);

/// The same for two placed solids, including their relative pose. `name`: of B's pose.
std::string fault_of(const Row& row, const char* name = "poses");

/// Row qw, qx, qy, qz, tx, ty, tz of a matrix (4, 4), NaN if it contains one; or the reason why it
/// is not a rigid motion.
const char* write_pose(const double* matrix, double* row);

/// (…, 7) from (…, 4, 4); ValueError that names the first that is not a rigid motion.
Column<double> rows_of_matrices(const Doubles& matrices, const std::string& name);

/// Rows of seven numbers, from such rows or from matrices (4, 4).
Doubles take_poses(const py::handle& value, const char* name, const std::string& wanted);

/// From (7,) or (4, 4); None: at the origin. Refuses poses and scales that queries reject.
Pose take_pose(const py::object& pose, double scale, const std::string& name = "pose");

using AnswerRow = std::function<void(std::size_t, Workspace&)>;
/// Calls answer(i, workspace) for each i below `count`, on `threads` threads (0: all cores), with
/// the GIL released. Ctrl-C ends it: KeyboardInterrupt.
void for_each_of(std::size_t count, unsigned threads, const AnswerRow& answer);
/// The same for each row, in the order of Rows::asked().
void for_each_row(const Rows& rows, unsigned threads, const AnswerRow& answer);

}  // namespace ist::python
