#pragma once

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/unique_ptr.h>

#include <ist/query.h>

#include <string>

#include "arrays.h"
#include "module.h"
#include "rows.h"

namespace ist::python {

inline constexpr std::pair<const char*, Measure> kMeasures[] = {
    {"matched", Measure::matched}, {"inner", Measure::inner}, {"exact", Measure::exact}};
/// What a GPU's batches answer.
inline constexpr std::pair<const char*, Measure> kGpuMeasures[] = {{"matched", Measure::matched},
                                                                   {"inner", Measure::inner}};
inline constexpr std::pair<const char*, FieldUse> kFieldUses[] = {
    {"automatic", FieldUse::automatic}, {"never", FieldUse::never}, {"always", FieldUse::always}};

/// Penetrations as columns.
struct Penetrations {
  Shape rows;
  Column<double> volume{rows}, volume_min{rows}, volume_max{rows};
  Column<double, 3> centroid{rows}, force{rows}, torque{rows};
  Column<double, 7> pose_gradient{rows}, pose_gradient_a{rows};
  Column<std::uint32_t> status{rows}, node_visits{rows}, sphere_pairs{rows};
  Column<double> scale_gradient{}, scale_gradient_a{};  ///< without an array where nobody asked

  /// What was answered for row i, and how it grows with both poses.
  void write(std::size_t i, const Row& row, const Penetration& answer) const;
};

/// A property that is a column.
template <class Class, class Part>
void add_column(py::class_<Class>& of, const char* name, Part part, const char* doc) {
  of.def_prop_ro(
      name, [part](const Class& self) { return (self.*part).handed_out(); }, doc);
}

}  // namespace ist::python
