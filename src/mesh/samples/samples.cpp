#include "mesh/samples/samples.h"

#include <ist/types.h>
#include <array>

#include "mesh/samples/shapes.h"

namespace ist {
namespace {

constexpr std::array kSamples = {
    Sample{"gear", "spur gear of 16 teeth with a bore", shapes::gear},
    Sample{"bolt", "hexagon bolt with a helical thread; the nut fits it", shapes::bolt},
    Sample{"nut", "hexagon nut with the bolt's thread", shapes::nut},
    Sample{"torus_knot", "tube along a trefoil", shapes::torus_knot},
    Sample{"cube", "unit cube, 12 triangles",
           [] {
             return shapes::box({0.5, 0.5, 0.5});
           }},
    Sample{"slab", "flat box of 4 x 3 x 0.25",
           [] {
             return shapes::box({2, 1.5, 0.125});
           }},
    Sample{"sphere", "unit ball, 5,120 triangles", [] { return shapes::sphere(1, 4); }},
    Sample{"hollow_sphere", "shell between the radii 0.9 and 1: two surfaces, one cavity",
           [] { return shapes::hollow_sphere(1, 0.9, 4); }},
    Sample{"torus", "ring of radius 1, tube of 0.35", [] { return shapes::torus(1, 0.35); }},
    Sample{"cylinder", "radius 1, height 2", [] { return shapes::cylinder(1, 2); }},
    Sample{"capsule", "radius 0.5, 2 between the centres", [] { return shapes::capsule(0.5, 2); }},
};

}  // namespace

std::span<const Sample> samples() { return kSamples; }

TriangleMesh make_sample(std::string_view name) {
  std::string names;
  for (const Sample& sample : kSamples) {
    if (name == sample.name) return sample.make();
    names += std::string(names.empty() ? "" : ", ") + sample.name;
  }
  throw Error("no sample is called '" + std::string(name) + "'; there are " + names);
}

}  // namespace ist
