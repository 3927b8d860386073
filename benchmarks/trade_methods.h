#pragma once

// Ways to ask for an overlap and how they are timed, for benchmarks/trade.cpp.

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#ifdef IST_HAVE_MANIFOLD
#include "manifold_mesh.h"
#endif
#include "sdf_voxel_sum.h"
#include "support/bullet_mesh.h"
#include "support/fcl_mesh.h"
#include "timing.h"
#include "trade_rows.h"

namespace ist::benchmark {

/// One way to ask, at one setting of it.
struct Method {
  std::string curve;
  std::string setting;
  std::function<double(const Row&)> volume;  ///< [u³]; NaN where it answers no volume
};

struct Measured {
  std::vector<double> us;      ///< a row each, least of all rounds
  std::vector<double> volume;  ///< a row each
};

inline Measured measure(const Method& method, const std::vector<Row>& rows, int rounds) {
  static const double clock = clock_cost();
  Measured result;
  result.us.assign(rows.size(), std::numeric_limits<double>::infinity());
  result.volume.resize(rows.size());
  for (int round = 0; round < rounds; ++round)
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double start = thread_seconds();
      result.volume[i] = method.volume(rows[i]);
      const double seconds = std::max(0.0, thread_seconds() - start - clock);
      result.us[i] = std::min(result.us[i], 1e6 * seconds);
    }
  return result;
}

/// The peers, which know no spheres.
class Peers {
 public:
  Peers(const PairOfBodies& pair, double small_scale, const std::vector<double>& voxels)
      : fcl_a_(pair.a->closed.mesh),
        fcl_b_(pair.b->closed.mesh),
        fcl_small_(pair.b->closed.mesh, small_scale),
        bullet_a_(pair.a->closed.mesh),
        bullet_b_(pair.b->closed.mesh),
        bullet_small_(pair.b->closed.mesh, small_scale)
#ifdef IST_HAVE_MANIFOLD
        ,
        manifold_a_(pair.a->closed.mesh),
        manifold_b_(pair.b->closed.mesh)
#endif
  {
    const double size_a = pair.a->solid.bounds().diagonal().norm();
    for (const double part : voxels) {
      // One spacing for both, a part of A's diagonal.
      sdf_.emplace_back(part, SdfVoxels(pair.a->solid, part * size_a),
                        SdfVoxels(pair.b->solid, part * size_a));
    }
  }

  void add_to(std::vector<Method>& methods) {
    methods.push_back({"FCL collide, all contacts", "", [this](const Row& row) {
                         testing::fcl_contacts(fcl_a_, {}, row.scale_b == 1 ? fcl_b_ : fcl_small_,
                                               row.pose);
                         return std::numeric_limits<double>::quiet_NaN();
                       }});
    methods.push_back({"Bullet GImpact, all contacts", "", [this](const Row& row) {
                         narrow_.contacts(bullet_a_, {},
                                          row.scale_b == 1 ? bullet_b_ : bullet_small_, row.pose);
                         return std::numeric_limits<double>::quiet_NaN();
                       }});
#ifdef IST_HAVE_MANIFOLD
    methods.push_back({"Manifold boolean", "", [this](const Row& row) {
                         return manifold_a_.overlap(manifold_b_, row.pose, row.scale_b);
                       }});
#endif
    for (const auto& [part, a, b] : sdf_) {
      char text[32];
      std::snprintf(text, sizeof text, "h = %g D", part);
      methods.push_back({"SDF voxel sum", text, [&a = a, &b = b](const Row& row) {
                           return a.overlap(b, to_isometry(row.pose), row.scale_b);
                         }});
    }
  }

 private:
  testing::FclMesh fcl_a_, fcl_b_, fcl_small_;
  testing::BulletMesh bullet_a_, bullet_b_, bullet_small_;
  testing::BulletNarrowPhase narrow_;
#ifdef IST_HAVE_MANIFOLD
  ManifoldMesh manifold_a_, manifold_b_;
#endif
  std::vector<std::tuple<double, SdfVoxels, SdfVoxels>> sdf_;
};

}  // namespace ist::benchmark
