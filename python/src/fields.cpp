#include <cmath>
#include <initializer_list>
#include <memory>
#include <utility>

#include <ist/shapes.h>
#include <ist/types.h>

#include "arrays.h"
#include "module.h"
#include "query/shape/shapes.h"
#include "solids.h"

namespace ist::python {
namespace {

/// A Python class for a kind of shape, so that users see its kind.
template <class Kind>
struct OwnedKind : OwnedShape {
  OwnedKind(Kind kind, py::dict arguments, std::shared_ptr<const void> owner = nullptr)
      : OwnedShape{std::move(kind), std::move(arguments), std::move(owner)} {}
};

template <class Kind>
py::class_<OwnedKind<Kind>, OwnedShape> add_kind(py::module_& module, const char* name,
                                                 const char* doc) {
  return py::class_<OwnedKind<Kind>, OwnedShape>(module, name, doc);
}

/// The arguments except grids and assets, which are large.
std::string text_of_arguments(const py::dict& arguments) {
  std::string text;
  for (const auto& [key, value] : arguments) {
    const std::string name = text_of(key);
    if (name == "heights" || name == "distances") continue;
    if (!text.empty()) text += ", ";
    text += name;
    if (name != "asset") text.append("=").append(text_of(value));
  }
  return text;
}

using Arguments = std::initializer_list<std::pair<const char*, py::object>>;

/// Refuses numbers that queries reject.
template <class Kind>
OwnedKind<Kind> sound(Kind kind, const char* wanted, const Arguments& given,
                      std::shared_ptr<const void> owner = nullptr) {
  py::dict arguments;
  for (const auto& [name, value] : given) arguments[name] = value;
  if (!is_sound(kind)) throw value_error(text_of_arguments(arguments) + "; wanted " + wanted);
  return {std::move(kind), std::move(arguments), std::move(owner)};
}

/// Refuses values that are not finite or out of range, and grids that are too small.
void check_grid(const Floats& grid, const char* name, double lowest, double highest) {
  std::size_t count = 1;
  for (std::size_t k = 0; k < grid.ndim(); ++k) {
    if (grid.shape(k) < 2) refuse_shape(grid, name, "two points and more along each axis");
    count *= grid.shape(k);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double value = static_cast<double>(grid.data()[i]);
    if (!std::isfinite(value) || value < lowest || value > highest)
      throw value_error(std::string(name) + ": number " + std::to_string(i) + " is " +
                        text_of(py::float_(value)) +
                        (std::isfinite(value) ? ", not from lowest to highest" : ", not finite"));
  }
}

std::uint32_t points(std::size_t count) { return static_cast<std::uint32_t>(count); }

}  // namespace

Solid solid_of(const py::handle& object, const char* name) {
  if (py::isinstance<Asset>(object)) return py::cast<const Asset&>(object).view();
  if (py::isinstance<OwnedShape>(object)) return py::cast<const OwnedShape&>(object).shape;
  throw type_error(std::string(name) + ": a " + type_name_of(object) +
                   "; wanted an Asset or a Shape");
}

AssetView tree_of(const py::handle& object, const char* name) {
  const Solid solid = solid_of(object, name);
  if (const AssetView* const tree = std::get_if<AssetView>(&solid)) return *tree;
  throw type_error(std::string(name) + ": a Shape; wanted an Asset");
}

void add_fields(py::module_& module) {
  py::class_<OwnedShape>(module, "Shape",
                         "A shape that needs no asset: one of the two solids of a query; the other "
                         "is an Asset. Lengths are [u] in the shape's own frame.")
      .def("__repr__",
           [](const py::object& self) {
             return "ist." + type_name_of(self) + "(" +
                    text_of_arguments(py::cast<const OwnedShape&>(self).arguments) + ")";
           })
      .def("__reduce__", [](const py::object& self) {
        const py::dict& arguments = py::cast<const OwnedShape&>(self).arguments;
        const py::object partial = py::module_::import_("functools").attr("partial");
        return py::make_tuple(partial(self.type(), **arguments), py::make_tuple());
      });
  add_kind<HalfSpaceShape>(module, "HalfSpaceShape", "The solid normal · x ≤ offset. Exact.")
      .def(py::new_([](const py::object& normal, double offset) {
             return sound(HalfSpaceShape{take_vector(normal, "normal"), offset},
                          "finite numbers and a normal of any length but 0",
                          {{"normal", normal}, {"offset", py::float_(offset)}});
           }),
           py::arg("normal") = py::make_tuple(0.0, 0.0, 1.0), py::arg("offset") = 0.0,
           "normal: (3,) outward, of any length but 0, by which the offset is divided too. "
           "offset: [u].");
  add_kind<BoxShape>(module, "BoxShape", "A box around the origin. Exact.")
      .def(py::new_([](const py::object& half_extents) {
             return sound(BoxShape{take_vector(half_extents, "half_extents")}, "(3,) > 0",
                          {{"half_extents", half_extents}});
           }),
           py::arg("half_extents"), "half_extents: (3,) [u] > 0.");
  add_kind<BallShape>(module, "BallShape", "A ball around the origin. Exact.")
      .def(py::new_([](double radius) {
             return sound(BallShape{radius}, "> 0", {{"radius", py::float_(radius)}});
           }),
           py::arg("radius"), "radius: [u] > 0.");
  add_kind<CapsuleShape>(module, "CapsuleShape",
                         "All points within `radius` of the segment from −half_height to "
                         "+half_height on the z axis.")
      .def(py::new_([](double radius, double half_height) {
             return sound(
                 CapsuleShape{radius, half_height}, "a radius > 0 and a half_height ≥ 0",
                 {{"radius", py::float_(radius)}, {"half_height", py::float_(half_height)}});
           }),
           py::arg("radius"), py::arg("half_height"), "radius: [u] > 0. half_height: [u] ≥ 0.");
  add_kind<CylinderShape>(module, "CylinderShape", "A cylinder about the z axis.")
      .def(py::new_([](double radius, double half_height) {
             return sound(
                 CylinderShape{radius, half_height}, "both > 0",
                 {{"radius", py::float_(radius)}, {"half_height", py::float_(half_height)}});
           }),
           py::arg("radius"), py::arg("half_height"), "radius, half_height: [u] > 0.");
  add_kind<HeightFieldShape>(
      module, "HeightFieldShape",
      "Terrain: the solid under a grid of heights along z. It continues level "
      "beyond its border.")
      .def(
          py::new_([](const py::object& heights, const py::object& spacing, double lowest,
                      double highest) {
            const Floats grid = take_floats(heights, "heights", "(rows, columns)");
            if (grid.ndim() != 2) refuse_shape(grid, "heights", "(rows, columns)");
            const Doubles steps = take_doubles(spacing, "spacing", "(2,)");
            if (steps.ndim() != 1 || steps.shape(0) != 2) refuse_shape(steps, "spacing", "(2,)");
            check_grid(grid, "heights", lowest, highest);
            return sound(HeightFieldShape{grid.data(),
                                          points(grid.shape(1)),
                                          points(grid.shape(0)),
                                          {steps.data()[0], steps.data()[1]},
                                          lowest,
                                          highest},
                         "spacing > 0, lowest ≤ highest and at most 2**20 points along each axis",
                         {{"heights", heights},
                          {"spacing", spacing},
                          {"lowest", py::float_(lowest)},
                          {"highest", py::float_(highest)}},
                         std::make_shared<Floats>(grid));
          }),
          py::arg("heights"), py::kw_only(), py::arg("spacing") = py::make_tuple(1.0, 1.0),
          py::arg("lowest") = -1e300, py::arg("highest") = 1e300,
          "heights: (rows along y, columns along x) [u]; a float32 array in C order is not "
          "copied.\nspacing: (2,) [u] > 0 along x and y; heights[0, 0] is at the origin.\n"
          "lowest, highest: [u] bounds on all heights, by which far objects are rejected quickly.");
  add_kind<DistanceGridShape>(module, "DistanceGridShape",
                              "Distances at the points of a grid, negative inside, interpolated "
                              "linearly. Points outside the grid are outside the solid.")
      .def(py::new_([](const py::object& distances, const py::object& origin, double spacing,
                       double error) {
             const Floats grid = take_floats(distances, "distances", "(z, y, x)");
             if (grid.ndim() != 3) refuse_shape(grid, "distances", "(z, y, x)");
             check_grid(grid, "distances", -HUGE_VAL, HUGE_VAL);
             return sound(
                 DistanceGridShape{
                     grid.data(),
                     {points(grid.shape(2)), points(grid.shape(1)), points(grid.shape(0))},
                     take_vector(origin, "origin"),
                     spacing,
                     error},
                 "a finite origin, a spacing > 0, an error ≥ 0 and at most 2**20 points along "
                 "each axis",
                 {{"distances", distances},
                  {"origin", origin},
                  {"spacing", py::float_(spacing)},
                  {"error", py::float_(error)}},
                 std::make_shared<Floats>(grid));
           }),
           py::arg("distances"), py::kw_only(), py::arg("origin"), py::arg("spacing"),
           py::arg("error") = 0.0,
           "distances: (points along z, y, x) [u]; a float32 array in C order is not copied.\n"
           "origin: (3,) [u] of the first point. spacing: [u] > 0.\n"
           "error: [u] largest error of the interpolated distance.");
}

}  // namespace ist::python
