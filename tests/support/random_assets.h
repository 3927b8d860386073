#pragma once

#include <Eigen/Core>
#include <cmath>
#include <random>
#include <vector>

#include <ist/bake.h>
#include <ist/types.h>

#include "bake/asset/asset_writer.h"
#include "bake/cluster/tree_builder.h"
#include "support/mass_of_spheres.h"

namespace ist::testing {

/// Settings of a random asset.
struct RandomAsset {
  std::size_t spheres = 500;
  double smallest = 0.2;  ///< smallest radius over largest
  double centre[3] = {};  ///< [u] of the mesh frame
  int exponent = 0;
  std::uint32_t details = 0;  ///< coarser levels: the first spheres, each as large as four
};

/// Three draws in an order of their own: that of arguments is each compiler's choice.
template <class Draw>
Eigen::Vector3d random_vector(const Draw& draw) {
  Eigen::Vector3d v;
  for (int k = 2; k >= 0; --k) v[k] = draw();
  return v;
}

/// An asset of random spheres in the unit ball: inner ones with covers, and matched ones that
/// overlap each other a little, as calibrated ones do. It represents no solid.
inline Asset make_random_asset(const RandomAsset& like, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&] { return uniform(random); };
  const double n = static_cast<double>(like.spheres);
  const double largest = 0.8 * std::cbrt(1 / n);
  AssetArrays arrays;
  while (arrays.inner_spheres.size() < like.spheres) {
    const Eigen::Vector3d x = random_vector(draw);
    if (x.norm() > 1) continue;
    const double r = largest * std::pow(like.smallest, std::abs(uniform(random)));
    const Eigen::Vector3d e = x + 0.3 * r * random_vector(draw);
    arrays.inner_spheres.push_back({static_cast<float>(x.x()), static_cast<float>(x.y()),
                                    static_cast<float>(x.z()), static_cast<float>(0.8 * r)});
    arrays.matched_spheres.push_back({static_cast<float>(e.x()), static_cast<float>(e.y()),
                                      static_cast<float>(e.z()), static_cast<float>(r)});
    arrays.cover_radii.push_back(static_cast<float>(2 * r));
  }
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.matched_spheres, {});
  for (std::uint32_t i = 1; i <= like.details; ++i) {
    DetailArrays& detail = arrays.details.emplace_back();
    const auto count = static_cast<std::ptrdiff_t>(detail_spheres(like.spheres, i));
    detail.matched_spheres.assign(arrays.matched_spheres.begin(),
                                  arrays.matched_spheres.begin() + count);
    for (Sphere& s : detail.matched_spheres) s.r *= static_cast<float>(std::cbrt(std::pow(4, i)));
    detail.matched_tree = build_tree(detail.matched_spheres, {});
  }
  for (int k = 0; k < 3; ++k) arrays.header.centre[k] = like.centre[k];
  arrays.header.exponent = like.exponent;
  arrays.header.volume = arrays.matched_tree.volume_sum;
  describe_spheres(arrays);
  return Asset(asset_bytes(arrays), "random asset");
}

/// A pose with a random rotation and a shift of length `distance` in a random direction.
inline Pose random_pose(std::mt19937_64& random, double distance) {
  std::normal_distribution<double> normal;
  Pose pose;
  double norm = 0;
  for (double& q : pose.q) {
    q = normal(random);
    norm += q * q;
  }
  for (double& q : pose.q) q /= std::sqrt(norm);
  const Eigen::Vector3d direction = random_vector([&] { return normal(random); }).normalized();
  for (int k = 0; k < 3; ++k) pose.t[k] = distance * direction[k];
  return pose;
}

}  // namespace ist::testing
