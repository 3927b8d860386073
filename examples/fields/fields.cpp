// A baked solid on a floor, on a terrain, at a wall and in a user function, none of them baked.
// Links ist::ist; a program that loads assets needs ist::query alone.
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>

#include <cmath>
#include <cstdio>
#include <vector>

namespace {

/// Prints what a penalty of 1 · volume does to the solid; false if there is no contact.
bool tell(const char* name, const ist::PlacedShape& field, const ist::PlacedAsset& solid,
          ist::Workspace& scratch) {
  const ist::Penetration p = ist::penetration(field, solid, {}, scratch);
  const Eigen::Vector3d force = p.force;
  std::printf("%-8s volume %8.5f u³, force (%8.5f, %8.5f, %8.5f) u²\n", name, p.volume, force.x(),
              force.y(), force.z());
  return p.status == ist::QueryStatus::ok && p.volume > 0;
}

/// Waves along x: [u] above the surface, and which way it goes. Divided by the steepest slope, so
/// that no distance is too large.
ist::ShapeSample waves(const void*, const Eigen::Vector3d& x) noexcept {
  constexpr double kHeight = 0.1, kLength = 2, kPi = 3.14159265358979;
  const double k = 2 * kPi / kLength, steepest = std::hypot(1, kHeight * k);
  const double above = x.z() - kHeight * std::sin(k * x.x());
  return {above / steepest, Eigen::Vector3d(-kHeight * k * std::cos(k * x.x()), 0, 1) / steepest};
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return std::fprintf(stderr, "usage: fields MESH\n"), 2;
  const ist::Asset solid =
      ist::bake(ist::close_mesh(ist::load_mesh(argv[1]), argv[1]), {.max_spheres = 1'000});
  const ist::AssetView& tree = solid.view();
  ist::Workspace scratch;  // one a thread

  const ist::HalfSpaceShape floor{.normal = Eigen::Vector3d::UnitZ(), .offset = 0};  // z ≤ 0

  // Hills over 16 × 16 u, heights[0] in the corner (−8, −8).
  constexpr std::uint32_t kPoints = 33;
  std::vector<float> heights(kPoints * kPoints);
  for (std::uint32_t j = 0; j < kPoints; ++j)
    for (std::uint32_t i = 0; i < kPoints; ++i)
      heights[j * kPoints + i] = 0.3f * std::sin(0.4f * static_cast<float>(i + j));
  const ist::HeightFieldShape terrain{.heights = heights.data(),
                                      .columns = kPoints,
                                      .rows = kPoints,
                                      .spacing = {0.5, 0.5},
                                      .lowest = -0.3,
                                      .highest = 0.3};

  const ist::BoxShape wall{{0.1, 4, 2}};
  const ist::FunctionShape water{.sample = waves};

  const ist::Pose at_floor{.t = {0, 0, 0.45}}, at_wall{.t = {-0.55, 0, 0}};
  bool met = tell("floor", {floor, {}}, {tree, at_floor}, scratch);
  met &= tell("terrain", {terrain, {.t = {-8, -8, 0}}}, {tree, {}}, scratch);
  met &= tell("wall", {wall, {}}, {tree, at_wall}, scratch);
  met &= tell("waves", {water, {}}, {tree, at_floor}, scratch);
  return met ? 0 : 1;
} catch (const ist::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
