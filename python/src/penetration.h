#pragma once

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/unique_ptr.h>

#include <ist/query.h>

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "arrays.h"
#include "module.h"
#include "rows.h"

namespace ist::python {

inline constexpr std::pair<const char*, Measure> kMeasures[] = {
    {"matched", Measure::matched}, {"inner", Measure::inner}, {"exact", Measure::exact}};
inline constexpr std::pair<const char*, Measure> kSphereMeasures[] = {{"matched", Measure::matched},
                                                                      {"inner", Measure::inner}};

/// The keywords common to penetrations and contact patches.
ContactSettings contact_settings(const std::string& measure, bool spheres_only,
                                 std::uint32_t pair_budget, std::uint32_t max_visits,
                                 double relative_error, std::uint32_t pair_id);

struct Penetrations {
  Shape rows;
  Column<double> volume{rows}, volume_min{rows}, volume_max{rows};
  Column<double, 3> centroid{rows}, force{rows}, torque{rows};
  Column<double, 7> pose_gradient{rows}, pose_gradient_a{rows};
  Column<double> contact_area{rows};
  Column<double, 3> contact_normal{rows};
  Column<std::uint32_t> status{rows}, node_visits{rows}, sphere_pairs{rows};
  Column<bool> touching{rows};
  Column<double> scale_gradient{}, scale_gradient_a{};  ///< without an array unless requested

  /// Stores the answer of row i and its derivatives by both poses.
  void write(std::size_t i, const Row& row, const Penetration& answer) const;
};

struct Separations {
  Shape rows;
  Column<double> distance{rows}, distance_min{rows}, distance_max{rows};
  Column<double, 3> point_a{rows}, point_b{rows}, normal{rows};
  Column<std::uint32_t> status{rows}, node_visits{rows}, sphere_pairs{rows};
};

struct Impacts {
  Shape rows;
  Column<double> time{rows}, distance_min{rows}, distance_max{rows};
  Column<double, 3> point_a{rows}, point_b{rows}, normal{rows};
  Column<std::uint32_t> kind{rows}, status{rows}, node_visits{rows}, surface_pairs{rows};
};

/// The parts of answers of a class that a pickle contains.
template <class Class>
struct Pickled {
  struct Part {
    const char *name, *doc;
    std::function<const void*(const Class&)> where;  ///< the column
    std::function<py::object(const Class&)> get;
    std::function<void(Class&, const py::handle&)> set;
  };
  static inline std::vector<Part> parts;
};

/// A property that is a column.
template <class Class, class Part>
void add_column(py::class_<Class>& of, const char* name, Part part, const char* doc) {
  const auto get = [part](const Class& self) { return (self.*part).handed_out(); };
  of.def_prop_ro(name, get, doc);
  Pickled<Class>::parts.push_back(
      {name, doc, [part](const Class& self) { return static_cast<const void*>(&(self.*part)); },
       get,
       [part](Class& self, const py::handle& given) {
         using Taken = std::remove_reference_t<decltype(self.*part)>;
         self.*part = Taken::taken(given);
       }});
}

/// A property that is an answer of another class.
template <class Class, class Inner>
void add_inner(py::class_<Class>& of, const char* name, std::shared_ptr<Inner> Class::*part,
               const char* doc) {
  of.def_ro(name, part, doc);
  Pickled<Class>::parts.push_back({name, doc, [](const Class&) { return nullptr; },
                                   [part](const Class& self) { return py::cast(self.*part); },
                                   [part](Class& self, const py::handle& given) {
                                     self.*part = py::cast<std::shared_ptr<Inner>>(given);
                                   }});
}

/// Answers can be pickled if all their columns are present.
template <class Class>
void add_pickling(py::class_<Class>& of) {
  of.def("__getstate__", [](const Class& self) {
    py::list state;
    for (const auto& part : Pickled<Class>::parts) state.append(part.get(self));
    return py::make_tuple(py::tuple(state));  // never empty
  });
  of.def("__setstate__", [](Class& self, const py::tuple& state) {
    new (&self) Class{};
    const py::object columns = state[0];
    for (std::size_t i = 0; i < Pickled<Class>::parts.size(); ++i)
      Pickled<Class>::parts[i].set(self, columns[i]);
  });
}

}  // namespace ist::python
