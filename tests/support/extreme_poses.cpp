#include "mesh/samples/samples.h"
#include "support/extreme_boxes.h"

// Extremes of where solids are placed.

namespace ist::testing {
namespace {

/// How far answers lie from the double sum over all pairs of spheres.
class SumErrors {
 public:
  void add(const PlacedAsset& a, const PlacedAsset& b) {
    const ReferenceSum sum = reference_sum(a, b, Measure::matched);
    const Penetration got = penetration(a, b, {.spheres_only = true}, workspace_);
    if (got.status != QueryStatus::ok) volume_.add(kNoPromise);
    volume_.add(sum.volume > 0 ? std::abs(got.volume / sum.volume - 1) : got.volume);
    if (sum.force_scale > 0) force_.add((got.force - sum.force).norm() / sum.force_scale);
  }
  void append_to(std::vector<Claim>& claims) const {
    claims.push_back({"volume error against the double sum over all pairs", volume_.value(), 1e-5});
    claims.push_back({"force error, share of the forces summed", force_.value(), 1e-4});
  }

 private:
  Workspace workspace_;
  Worst volume_, force_;
};

}  // namespace

/// A tiny box B at random places in A and across its surface.
std::vector<Claim> of_size_ratio() {
  const Boxes boxes(1, 0, 1e-6);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  SumErrors sums;
  Workspace workspace;
  Worst interval;
  double mean = 0;
  int missed = 0;
  constexpr int kPlaces = 300;
  for (int i = 0; i < kPlaces; ++i) {
    Vector3d shift =
        kHalfA.cwiseProduct(Vector3d(uniform(random), uniform(random), uniform(random)));
    const Pose inside = boxes.pose(random_turn(random), 0.999 * shift);
    sums.add(boxes.a(), boxes.b(inside));
    const double share =
        penetration(boxes.a(), boxes.b(inside), {}, workspace).volume / boxes.volume_b();
    mean += share / kPlaces;
    missed += share == 0;
    interval.add(separation(boxes.a(), boxes.b(inside), {}, workspace).distance_min);
    // Across A's matched spheres, where the sum is a part of B's.
    const auto spheres = world_spheres(boxes.a(), Measure::matched);
    const WorldSphere& sphere = spheres[static_cast<std::size_t>(i) % spheres.size()];
    const Vector3d on = sphere.centre + sphere.r * shift.normalized();
    sums.add(boxes.a(), boxes.b(boxes.pose(Eigen::Quaterniond::Identity(), on)));
  }
  std::vector<Claim> claims;
  sums.append_to(claims);
  claims.push_back(
      {"mean of contained B's overlap / its volume, off 1 by", std::abs(mean - 1), 0.05});
  claims.push_back({"share of places inside A where B reads 0 (it lies between A's spheres)",
                    static_cast<double>(missed) / kPlaces, kNoPromise});
  claims.push_back({"distance_min of a contained B [u]", interval.value(), 0});
  claims.push_back(boxes.soundness());
  return claims;
}

/// Two cubes face to face, at gap 0, aligned, half shifted and turned about the normal.
std::vector<Claim> of_touching_faces() {
  const ClosedMesh mesh = close_mesh(cube_mesh(), "cube");
  const Asset cube = baked(mesh);
  Workspace workspace;
  Worst inner, low, high, matched;
  for (const double shift : {0.0, 0.5})
    for (const double degrees : {0.0, 37.0, 45.0, 90.0}) {
      const Eigen::Quaterniond q(
          Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3d::UnitX()));
      const Pose pose{{q.w(), q.x(), q.y(), q.z()}, {1, shift, 0}};
      const PlacedAsset a{cube.view(), {}, 1}, b{cube.view(), pose, 1};
      inner.add(penetration(a, b, {.measure = Measure::inner}, workspace).volume);
      matched.add(penetration(a, b, {}, workspace).volume);
      const Separation gap = separation(a, b, {}, workspace);
      low.add(gap.distance_min);
      high.add(gap.distance_max);
    }
  return {{"inner volume [u³]", inner.value(), 0},
          {"distance_min [u]", low.value(), 0},
          {"distance_max [u]", high.value(), 0.05},
          {"matched volume of the protrusion [u³]", matched.value(), 0.01}};
}

std::vector<Claim> of_coincident_copies() {
  Workspace workspace;
  Worst high, force, distance;
  for (const char* const name : {"cube", "gear", "bolt"}) {
    const Asset asset = baked(close_mesh(make_sample(name), name), 4000);
    const PlacedAsset a{asset.view(), {}, 1};
    const Penetration got = penetration(a, a, {}, workspace);
    const double area = std::pow(asset.view().volume(), 2.0 / 3);
    if (got.status != QueryStatus::ok || !got.centroid.allFinite()) high.add(kNoPromise);
    high.add(std::abs(got.volume / asset.view().volume() - 1));
    force.add(got.force.norm() / area);
    distance.add(separation(a, a, {}, workspace).distance_max);
  }
  return {{"volume against the solid's own (cube, gear, bolt; 4,000 spheres)", high.value(), 0.1},
          {"force that should be none [volume^⅔]", force.value(), 1e-3},
          {"distance_max [u]", distance.value(), 0}};
}

std::vector<Claim> of_half_turns() {
  const Boxes boxes(1);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  SumErrors sums;
  Workspace workspace;
  std::vector<double> errors;
  const double s = std::sqrt(0.5);
  for (int i = 0; i < 8; ++i)
    for (const Eigen::Quaterniond& q :
         {Eigen::Quaterniond(0, 1, 0, 0), Eigen::Quaterniond(0, 0, 1, 0),
          Eigen::Quaterniond(0, 0, 0, -1), Eigen::Quaterniond(0, s, s, 0),
          Eigen::Quaterniond(-0.0, s, 0, -s)}) {
      const Vector3d shift(uniform(random), uniform(random), uniform(random));
      const PlacedAsset b = boxes.b(boxes.pose(q, shift));
      sums.add(boxes.a(), b);
      errors.push_back(
          std::abs(penetration(boxes.a(), b, {}, workspace).volume / boxes.exact(q, shift) - 1));
    }
  std::vector<Claim> claims{{"median volume error of 40 poses", quantile(errors, 0.5), 3e-3}};
  sums.append_to(claims);
  return claims;
}

std::vector<Claim> of_loose_quaternions() {
  const Boxes boxes(1);
  Workspace workspace;
  Worst difference, force;
  std::mt19937_64 random(10);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Quaterniond q = random_turn(random);
    const Pose sound = boxes.pose(q, {0.3, 0.2, -0.1});
    Pose loose = sound;
    for (double& k : loose.q) k *= i % 2 == 0 ? 1 + 1e-7 : 1 - 1e-7;
    const Penetration want = penetration(boxes.a(), boxes.b(sound), {}, workspace);
    const Penetration got = penetration(boxes.a(), boxes.b(loose), {}, workspace);
    difference.add(std::abs(got.volume / want.volume - 1));
    force.add((got.force - want.force).norm() / want.force.norm());
  }
  return {{"change of volume", difference.value(), 1e-6}, {"change of force", force.value(), 1e-5}};
}

std::vector<Claim> of_uniform_scales() {
  const Boxes boxes(1);
  Workspace workspace;
  Worst volume, force, distance;
  std::mt19937_64 random(11);
  for (int i = 0; i < 12; ++i) {
    const Eigen::Quaterniond q = random_turn(random);
    for (const double apart : {0.4, 2.0}) {
      const Pose pose = boxes.pose(q, {apart, 0.2, -0.1});
      const Penetration want = penetration(boxes.a(), boxes.b(pose), {}, workspace);
      const Separation far = separation(boxes.a(), boxes.b(pose), {}, workspace);
      for (const double s : {1e-6, 1e-3, 0.3, 7.0, 1e3, 1e6}) {
        Pose scaled = pose;
        for (double& t : scaled.t) t *= s;
        const PlacedAsset a{boxes.a_.view(), {}, s}, b{boxes.b_.view(), scaled, s};
        const Penetration got = penetration(a, b, {}, workspace);
        if (want.volume > 0) {
          volume.add(std::abs(got.volume / (want.volume * s * s * s) - 1));
          force.add((got.force / (s * s) - want.force).norm() / want.force.norm());
        } else {
          volume.add(got.volume);
        }
        distance.add(std::abs(separation(a, b, {}, workspace).distance / s - far.distance));
      }
    }
  }
  return {{"volume / s³ against s = 1", volume.value(), 1e-5},
          {"force / s² against s = 1", force.value(), 1e-4},
          {"distance / s against s = 1 [u]", distance.value(), 2e-6}};
}

}  // namespace ist::testing
