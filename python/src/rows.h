#pragma once

#include <cstring>
#include <functional>
#include <memory>
#include <vector>

#include <ist/query.h>

#include "arrays.h"
#include "solids.h"

namespace ist::python {

/// Two placed solids.
struct Row {
  const Solid* a = nullptr;
  Pose pose_a;
  double scale_a = 1;
  PlacedTree b;

  /// ask(placed a, b) for a tree or a field.
  template <class Ask>
  auto answer(const Ask& ask) const {
    if (const TreeView* const tree = std::get_if<TreeView>(a))
      return ask(PlacedTree{*tree, pose_a, scale_a}, b);
    return ask(PlacedField{std::get<Field>(*a), pose_a, scale_a}, b);
  }
};

/// Poses and scales that are asked about: views of the arguments' memory, held here.
class Rows {
 public:
  /// B at each pose beside A. Arguments of one row serve all rows.
  ///
  /// `poses`, `poses_a`: (7,) or (n, 7), None: at the origin. `scales`, `scales_a`: a number or
  /// (n,), None: 1.
  static Rows of_pair(const py::object& a, const py::object& b, const py::object& poses,
                      const py::object& scales, const py::object& poses_a,
                      const py::object& scales_a);

  /// Solids of a scene, or of many alike, two at a time.
  ///
  /// `poses`: (k, 7) or (w, k, 7); `scales`: None, (k,) or (w, k); `pairs`: (n, 2), numbers of
  /// solids, the second an asset.
  static Rows of_scene(const py::sequence& solids, const py::object& poses, const py::object& pairs,
                       const py::object& scales);

  const Shape& shape() const { return shape_; }  ///< of what is answered once a row
  std::size_t count() const { return count_; }
  Row at(std::size_t i) const;

  /// The row that is asked i-th: pairs of the same assets one after another, where all of them
  /// together are more than a cache holds.
  std::size_t asked(std::size_t i) const {
    if (order_.empty()) return i;
    const std::size_t scenes = count_ / pairs_of_scene_;
    return i % scenes * pairs_of_scene_ + order_[i / scenes];
  }

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

  Shape shape_;
  std::size_t count_ = 0;
  std::vector<Solid> solids_;
  std::vector<py::object> owners_;  // of the solids
  Values pose_a_, pose_b_, scale_a_, scale_b_;
  Integers held_pairs_;
  const std::int64_t* pairs_ = nullptr;  // null: solid 0 and solid 1
  std::size_t pairs_of_scene_ = 0;
  std::vector<std::size_t> order_;  ///< of the pairs; empty: as they come

  void sort_by_asset();
};

/// Nobody looks at the status of one pose: throws Error, with the way out, where that is all there
/// is and a solid does not hold what was asked. `exact`: by Measure::exact.
void refuse_not_held(const Rows& rows, const Column<std::uint32_t>& status, std::uint32_t not_held,
                     bool exact = false);

/// answer(i, workspace) for each row, on `threads` threads (0: all cores), the GIL released.
/// Ctrl-C ends it: KeyboardInterrupt.
void for_each_row(const Rows& rows, unsigned threads,
                  const std::function<void(std::size_t, Workspace&)>& answer);

}  // namespace ist::python
