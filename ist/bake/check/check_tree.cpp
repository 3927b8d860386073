
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "bake/check/check_spheres.h"

namespace ist {
namespace {

struct Node {
  Eigen::Vector3d centre;
  double radius = 0;
  double cover = 0;
  double volume = 0;
  double overlap = 0;
};

class TreeCheck {
 public:
  TreeCheck(const AssetHeader& asset, const TreeHeader& tree, const Sphere* spheres,
            const float* covers)
      : asset_(asset), tree_(tree), spheres_(spheres), covers_(covers) {}

  std::size_t count() const { return tree_.sphere_count; }
  std::size_t levels() const { return tree_.level_count; }

  /// Insertion index of the sphere in lane i.
  std::uint32_t index(std::size_t lane) const {
    return at<std::uint32_t>(asset_, tree_.sphere_index)[lane];
  }
  const Sphere& sphere(std::size_t lane) const { return spheres_[index(lane)]; }

  /// Worst difference of a leaf lane and the table.
  double leaf_difference(std::size_t lane) const {
    const BallBlock& block = at<BallBlock>(asset_, tree_.level[0].blocks)[lane / kWidth];
    const Origin& origin = at<Origin>(asset_, tree_.level[0].origins)[lane / kWidth];
    const std::size_t l = lane % kWidth;
    const Sphere& s = sphere(lane);
    double worst =
        std::max({std::fabs(origin.x + block.x[l] - s.x), std::fabs(origin.y + block.y[l] - s.y),
                  std::fabs(origin.z + block.z[l] - s.z), std::fabs(double{block.r[l]} - s.r)});
    if (covers_ != nullptr)
      worst = std::max(worst, std::fabs(double{at<float>(asset_, tree_.sphere_cover)[lane]} -
                                        covers_[index(lane)]));
    return worst;
  }

  /// Nodes of level k ≥ 1, each above 16^k spheres; the root counts as one more level.
  std::size_t nodes(std::size_t k) const { return k == levels() ? 1 : tree_.level[k - 1].count; }

  std::size_t node_of(std::size_t lane, std::size_t k) const {
    return k == levels() ? 0 : lane >> (4 * k);
  }

  Node node(std::size_t k, std::size_t i) const {
    if (k == levels())
      return {{tree_.root[0], tree_.root[1], tree_.root[2]},
              tree_.root[3],
              tree_.root_cover,
              tree_.volume_sum,
              tree_.overlap};
    const BallBlock& block = at<BallBlock>(asset_, tree_.level[k].blocks)[i / kWidth];
    const Origin& origin = at<Origin>(asset_, tree_.level[k].origins)[i / kWidth];
    const NodeBlock& node = at<NodeBlock>(asset_, tree_.level[k].nodes)[i / kWidth];
    const std::size_t l = i % kWidth;
    return {{origin.x + block.x[l], origin.y + block.y[l], origin.z + block.z[l]},
            block.r[l],
            node.cover[l],
            node.volume[l],
            node.overlap[l]};
  }

  /// Runs visit(node, its level, its number in the file's order, first lane, last lane) on all.
  template <class Visit>
  Tally for_nodes(const Visit& visit) const {
    Tally sum;
    std::size_t number = 0;
    for (std::size_t k = 1; k <= levels(); ++k) {
      sum.add(tally_all(nodes(k), [&](std::size_t i, Tally& tally) {
        const std::size_t begin = k == levels() ? 0 : i << (4 * k);
        const std::size_t end = k == levels() ? count() : std::min(count(), (i + 1) << (4 * k));
        visit(node(k, i), k, number + i, begin, end, tally);
      }));
      number += nodes(k);
    }
    return sum;
  }

  /// Finds the maximum number of spheres that cover one point. The deepest region is an
  /// intersection of balls, so one of its corners (where three spheres meet), or a point of a rim
  /// (where two do), or the centre of a sphere that lies in all others, is as deep. Counts these
  /// points in the smallest sphere of the region, node by node. This proof is independent of the
  /// subdivision that computed κ.
  void overlap_at(std::size_t lane, const std::vector<std::uint32_t>& near, Tally& tally) const;

 private:
  void count_cover(const Eigen::Vector3d& p, std::span<const std::size_t> generators,
                   std::span<const std::size_t> candidates, Tally& tally) const;

  const AssetHeader& asset_;
  const TreeHeader& tree_;
  const Sphere* spheres_;
  const float* covers_;
};

void TreeCheck::count_cover(const Eigen::Vector3d& p, std::span<const std::size_t> generators,
                            std::span<const std::size_t> candidates, Tally& tally) const {
  std::vector<std::size_t> holds(generators.begin(), generators.end());
  for (const std::size_t lane : candidates) {
    const Sphere& s = sphere(lane);
    if (std::find(generators.begin(), generators.end(), lane) == generators.end() &&
        (centre(s) - p).norm() < s.r * (1 - 1e-7))
      holds.push_back(lane);
  }
  for (std::size_t k = 1; k <= levels(); ++k)
    for (const std::size_t lane : holds) {
      const std::size_t mine = node_of(lane, k);
      const auto together = std::count_if(
          holds.begin(), holds.end(), [&](std::size_t other) { return node_of(other, k) == mine; });
      tally.add(static_cast<double>(together) - node(k, mine).overlap, index(lane));
    }
}

void TreeCheck::overlap_at(std::size_t lane, const std::vector<std::uint32_t>& near,
                           Tally& tally) const {
  const Sphere& home = sphere(lane);
  std::vector<std::size_t> larger;
  for (const std::uint32_t other : near)
    if (sphere(other).r > home.r || (sphere(other).r == home.r && other < lane))
      larger.push_back(other);
  const Eigen::Vector3d c = centre(home);
  count_cover(c, std::array{lane}, larger, tally);
  for (std::size_t a = 0; a < larger.size(); ++a) {
    // The circle of home's sphere and a's: centre m, axis, radius ρ.
    const Sphere& sa = sphere(larger[a]);
    const Eigen::Vector3d to_a = centre(sa) - c;
    const double da = to_a.norm();
    if (da == 0) continue;
    const double ra = home.r;
    const double along = (da * da + (ra - sa.r) * (double{ra} + sa.r)) / (2 * da);
    const double rho = std::sqrt(std::max(ra * ra - along * along, 0.0));
    if (rho == 0) continue;  // one contains the other
    const Eigen::Vector3d axis = to_a / da;
    const Eigen::Vector3d m = c + along * axis;
    const Eigen::Vector3d u = axis.unitOrthogonal();
    const Eigen::Vector3d v = axis.cross(u);
    count_cover(m + rho * u, std::array{lane, larger[a]}, larger, tally);
    for (std::size_t b = a + 1; b < larger.size(); ++b) {
      // Points m + ρ (u cos + v sin) of the circle at distance r_b from b.
      const Sphere& sb = sphere(larger[b]);
      const Eigen::Vector3d to_b = centre(sb) - m;
      const double pu = to_b.dot(u);
      const double pv = to_b.dot(v);
      const double flat = std::sqrt(pu * pu + pv * pv);
      const double needed =
          (to_b.squaredNorm() + rho * rho - double{sb.r} * sb.r) / (2 * rho);  // pu cos + pv sin
      if (flat == 0 || std::fabs(needed) >= flat) continue;
      const double across = std::sqrt(flat * flat - needed * needed);
      for (const double side : {across, -across}) {
        const double cosine = (needed * pu - side * pv) / (flat * flat);
        const double sine = (needed * pv + side * pu) / (flat * flat);
        count_cover(m + rho * (cosine * u + sine * v), std::array{lane, larger[a], larger[b]},
                    larger, tally);
      }
    }
  }
}

}  // namespace

std::vector<Invariant> check_tree(const AssetHeader& asset, const TreeHeader& tree,
                                  const Sphere* spheres, const float* covers,
                                  const std::string& name) {
  const TreeCheck check(asset, tree, spheres, covers);
  const std::size_t n = check.count();
  std::vector<Invariant> out;

  std::vector<std::size_t> seen(n, 0);
  for (std::size_t lane = 0; lane < n; ++lane) ++seen[check.index(lane)];
  Tally once;
  for (std::size_t i = 0; i < n; ++i) once.add(std::fabs(static_cast<double>(seen[i]) - 1), i);
  out.push_back(once.named(name + ": each sphere once", "lanes with this insertion index − 1"));

  out.push_back(
      tally_all(n, [&](std::size_t lane,
                       Tally& tally) { tally.add(check.leaf_difference(lane), check.index(lane)); })
          .named(name + ": leaves are the table",
                 "difference of a lane and its sphere in the table, unit frame"));

  out.push_back(check
                    .for_nodes([&](const Node& node, std::size_t, std::size_t number,
                                   std::size_t begin, std::size_t end, Tally& tally) {
                      for (std::size_t lane = begin; lane < end; ++lane) {
                        const Sphere& s = check.sphere(lane);
                        tally.add((node.centre - centre(s)).norm() + s.r - node.radius, number);
                      }
                    })
                    .named(name + ": balls hold spheres",
                           "largest distance of a sphere below from the node's centre − radius of "
                           "the node's ball, unit frame"));
  if (covers != nullptr)
    out.push_back(check
                      .for_nodes([&](const Node& node, std::size_t, std::size_t number,
                                     std::size_t begin, std::size_t end, Tally& tally) {
                        for (std::size_t lane = begin; lane < end; ++lane)
                          tally.add((node.centre - centre(check.sphere(lane))).norm() +
                                        covers[check.index(lane)] - node.cover,
                                    number);
                      })
                      .named(name + ": cover balls hold covers",
                             "largest distance of a cover ball below from the node's centre − the "
                             "node's cover radius, unit frame"));

  out.push_back(
      check
          .for_nodes([&](const Node& node, std::size_t k, std::size_t number, std::size_t begin,
                         std::size_t end, Tally& tally) {
            double sum = 0;
            for (std::size_t lane = begin; lane < end; ++lane) {
              const double r = check.sphere(lane).r;
              sum += 4 * std::numbers::pi / 3 * (r * r * r);
            }
            // Nodes round up to float; the total is a double.
            const bool root = k == check.levels();
            tally.add((sum - node.volume) / sum - (root ? 1e-12 : 0), number);
            tally.add((node.volume - sum) / sum - (root ? 1e-12 : 2e-7), number);
          })
          .named(name + ": volume sums",
                 "relative difference of a node's volume and the sum below, above its rounding"));

  Tally mean;
  const double mean_volume = tree.volume_sum / static_cast<double>(n);
  mean.add(
      std::fabs(4 * std::numbers::pi / 3 * std::pow(tree.mean_radius, 3) / mean_volume - 1) - 1e-12,
      0);
  out.push_back(mean.named(name + ": mean radius",
                           "relative difference of its ball and the mean sphere volume, above "
                           "1e-12"));

  // Overlaps are found between lanes.
  std::vector<Sphere> lanes(n);
  for (std::size_t lane = 0; lane < n; ++lane) lanes[lane] = check.sphere(lane);
  const auto near = overlapping_pairs(lanes.data(), n);
  out.push_back(
      tally_all(n, [&](std::size_t lane, Tally& tally) {
        check.overlap_at(lane, near[lane], tally);
      }).named(name + ": overlap bounds", "spheres of one node over one point − the node's κ"));
  return out;
}

}  // namespace ist
