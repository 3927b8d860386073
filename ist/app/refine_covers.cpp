#include "app/sphere_output.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include "robots/covers/triangles.h"

namespace ist::app {
namespace {

constexpr double kEnough = 0.1;           ///< of the free poses
constexpr std::size_t kMostOfALink = 60;  ///< on average
constexpr double kGivenUp = 0.05;         ///< share of the free poses, at least
constexpr double kHopeless = 0.8;    ///< share that is given up where it takes too many spheres
constexpr double kElsewhere = 0.6;   ///< of the first protrusion, where no link is near
constexpr double kHalf = 0.5;        ///< of a gap, where both links' spheres change
constexpr double kLess = 0.4;        ///< of a gap, where half of it was not enough
constexpr double kWhole = 0.95;      ///< of a gap, where the other link's spheres stay
constexpr int kBisections = 3;       ///< of the free distance in a direction
constexpr double kSmallCell = 0.03;  ///< of the link
constexpr int kRounds = 2;
constexpr std::size_t kFewest = 50;  ///< free poses, of fewer a share tells nothing
constexpr std::size_t kTold = 3;     ///< pairs that are named as obstacles

/// A position in which spheres of two links overlap falsely, and how far apart the links are there.
struct Meeting {
  FalseMeeting at;
  double gap;  ///< [u]
};

std::vector<Meeting> with_gaps(const std::vector<FalseMeeting>& meetings,
                               const LinkSolids& solids) {
  std::vector<Meeting> all(meetings.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    const FalseMeeting& one = meetings[i];
    all[i] = {one, solids.gap(one.a, one.b, one.b_in_a)};
  });
  return all;
}

/// The `count` positions that cost most. Where a pair is to be free from a gap t on, spheres go
/// with 1 / t and positions that are lost with t and how often the pair meets; so the best t goes
/// with the root of that.
std::set<std::size_t> dearest(const std::vector<Meeting>& all, std::size_t count) {
  std::map<std::pair<std::size_t, std::size_t>, double> often;
  for (const Meeting& one : all) ++often[{one.at.a, one.at.b}];
  std::map<std::size_t, double> nearest;
  for (const Meeting& one : all) {
    const double cost = one.gap * std::sqrt(often[{one.at.a, one.at.b}]);
    const auto [at, is_new] = nearest.try_emplace(one.at.sample, cost);
    at->second = std::min(at->second, cost);
  }
  std::vector<std::pair<double, std::size_t>> order;
  for (const auto& [sample, cost] : nearest) order.emplace_back(cost, sample);
  std::sort(order.begin(), order.end());
  order.resize(std::min(count, order.size()));
  std::set<std::size_t> samples;
  for (const auto& [cost, sample] : order) samples.insert(sample);
  return samples;
}

/// How far a link's spheres may protrude, so that they meet no others falsely.
class LinkRoom {
 public:
  struct Near {
    std::size_t other;
    Eigen::Isometry3d in_other;               ///< of the link's frame
    double share;                             ///< of the distance
    const std::vector<CoverSphere>* spheres;  ///< that contain the other

    /// The distance to the other link, over that to this one, below which a point belongs to the
    /// other.
    double ratio() const { return (1 - share) / share; }
  };

  explicit LinkRoom(double most) : most_(most) {}

  bool is_free() const { return near_.empty(); }
  void add(const Near& near) { near_.push_back(near); }

  /// Sorts all that were added by places of the link, which is inside `box`.
  void sort(const Eigen::AlignedBox3d& box) {
    root_ = {box.center(), box.sizes().maxCoeff() / 2, {}, {}};
    for (std::uint32_t i = 0; i < near_.size(); ++i) root_.near.push_back(i);
    divide();
  }

  /// Points between two links belong to that of which they are nearer, by shares.
  double operator()(const LinkSolids& solids, const Eigen::Vector3d& place,
                    const Eigen::Vector3d& outward) const {
    double room = most_;
    for (const std::uint32_t i : cell_of(place).near) {
      const Near& one = near_[i];
      const double other = one.ratio();
      const Eigen::Vector3d from = one.in_other * place, out = one.in_other.linear() * outward;
      const auto is_ours = [&](double t) {
        const Eigen::Vector3d at = from + t * out;
        // Its spheres contain it.
        return !reaches(one, at, other * t) ||
               solids.distance(one.other, at, other * t) >= other * t;
      };
      if (outward.isZero()) {
        room = one.share * solids.distance(one.other, from, room / one.share);
        continue;
      }
      if (is_ours(room)) continue;
      double low = one.share * solids.distance(one.other, from, room / one.share);
      for (int step = 0; step < kBisections; ++step)
        (is_ours(0.5 * (low + room)) ? low : room) = 0.5 * (low + room);
      room = low;
    }
    return room;
  }

 private:
  /// A cube, and the entries that may matter for places in it.
  struct Cell {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double half = 0;
    std::vector<std::uint32_t> near;
    std::vector<Cell> parts;
  };

  static bool reaches(const Near& one, const Eigen::Vector3d& at, double by) {
    return std::any_of(one.spheres->begin(), one.spheres->end(), [&](const CoverSphere& s) {
      const double reach = s.radius + by;
      return (at - s.centre).squaredNorm() < reach * reach;
    });
  }

  /// The largest cells first, until the lists of all take 64 MB.
  void divide() {
    constexpr std::size_t kFew = 8, kMostListed = 1 << 24;
    std::vector<Cell*> cells = {&root_};
    std::size_t listed = near_.size();
    for (std::size_t next = 0; next < cells.size() && listed < kMostListed; ++next) {
      Cell& cell = *cells[next];
      if (cell.near.size() <= kFew || cell.half < kSmallCell * root_.half) continue;
      cell.parts.reserve(8);
      for (int k = 0; k < 8; ++k) {
        Cell part{middle_of_part(cell.middle, cell.half, k), cell.half / 2, {}, {}};
        for (const std::uint32_t i : cell.near)
          if (reaches(near_[i], near_[i].in_other * part.middle,
                      (1 + near_[i].ratio()) * most_ + std::sqrt(3.0) * part.half))
            part.near.push_back(i);
        listed += part.near.size();
        cells.push_back(&cell.parts.emplace_back(std::move(part)));
      }
      listed -= cell.near.size();
      cell.near = {};
    }
  }

  const Cell& cell_of(const Eigen::Vector3d& place) const {
    const Cell* cell = &root_;
    while (!cell->parts.empty()) {
      const Eigen::Array<bool, 3, 1> above = place.array() > cell->middle.array();
      cell = &cell->parts[(above[0] ? 1u : 0u) + (above[1] ? 2u : 0u) + (above[2] ? 4u : 0u)];
    }
    return *cell;
  }

  double most_;  ///< [u]
  std::vector<Near> near_;
  Cell root_;
};

struct Refined {
  const ClosedMesh* mesh;  ///< null: its spheres stay as they are
  std::size_t own;         ///< spheres that cover the mesh
  double first;            ///< [u] protrusion before
};

using Two = std::pair<std::size_t, std::size_t>;

/// By link; of those that stay as they are none is near. `narrow`: pairs that need a margin.
std::vector<LinkRoom> rooms_of(const std::vector<Refined>& links,
                               const std::vector<LinkSpheres>& covers,
                               const std::vector<Meeting>& meetings,
                               const std::set<std::size_t>& given_up,
                               const std::set<Two>& narrow = {}) {
  std::vector<LinkRoom> rooms;
  for (const Refined& link : links) rooms.emplace_back(kElsewhere * link.first);
  // The tightest first: then the others are soon told to be far.
  std::vector<const Meeting*> order;
  for (const Meeting& one : meetings)
    if (!given_up.contains(one.at.sample)) order.push_back(&one);
  std::stable_sort(order.begin(), order.end(),
                   [](const Meeting* x, const Meeting* y) { return x->gap < y->gap; });
  for (const Meeting* one : order) {
    const auto add = [&](std::size_t link, std::size_t other, const Eigen::Isometry3d& in_other) {
      const double share = links[other].mesh == nullptr              ? kWhole
                           : narrow.contains({one->at.a, one->at.b}) ? kLess
                                                                     : kHalf;
      if (links[link].mesh != nullptr)
        rooms[link].add({other, in_other, share, &covers[other].spheres});
    };
    add(one->at.a, one->at.b, one->at.b_in_a.inverse());
    add(one->at.b, one->at.a, one->at.b_in_a);
  }
  tbb::parallel_for(std::size_t{0}, links.size(), [&](std::size_t i) {
    if (links[i].mesh == nullptr) return;
    Eigen::AlignedBox3d box;
    const TriangleMesh& mesh = links[i].mesh->mesh;
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle) box.extend(mesh.vertices[v]);
    rooms[i].sort(box);
  });
  return rooms;
}

}  // namespace

void complete_cover(SphereLink& link, bool read) {
  std::vector<CoverSphere>& spheres = link.cover.spheres;
  spheres.insert(spheres.begin(), link.given.begin(), link.given.end());
  if (!read) return;
  extend_cover(link.read, link.cover);
  if (!link.bounding_capsule) return;
  SphereProtrusion& p = link.cover.protrusion;  // known of the capsule alone
  p.largest = p.mean = p.p95 = p.volume_ratio = std::numeric_limits<double>::quiet_NaN();
}

void refine_covers(SphereRobot& robot, SelfCollisionStudy& study, const LinkSolids& solids,
                   const SphereCoverSettings& cover,
                   const std::map<std::string, std::size_t>& fixed, bool is_open,
                   const ProgressCallback& progress) {
  if (robot.self.false_share() <= kEnough) return;
  std::vector<Refined> links;
  std::size_t next = 0, before = 0;
  SphereCoverSettings settings = cover;
  for (const SphereLink& link : robot.links) {
    const double protrusion = link.cover.protrusion.largest;
    const ClosedMesh* mesh = link.has_mesh ? &robot.meshes[next++] : nullptr;
    if (fixed.contains(link.name) || !(protrusion > 0)) mesh = nullptr;
    links.push_back({mesh, link.cover.spheres.size() - link.given.size(), protrusion});
    before += links.back().own;
    if (mesh != nullptr)
      settings.max_protrusion = std::max(settings.max_protrusion, kElsewhere * protrusion);
  }
  settings.count = kMostCoverSpheres;
  const std::size_t budget = std::max(before, kMostOfALink * robot.links.size());
  const std::vector<LinkSpheres> first = robot.covers();
  std::vector<LinkRoom> rooms;
  const auto room_of = [&](std::size_t i) {
    return [&, i](const Eigen::Vector3d& place, const Eigen::Vector3d& outward) {
      return rooms[i](solids, place, outward);
    };
  };
  /// Sphere counts of the links for these distances; 0 for links that stay unchanged.
  const auto needed = [&](std::size_t enough) {
    std::vector<std::size_t> counts(links.size());
    tbb::parallel_for(std::size_t{0}, links.size(), [&](std::size_t i) {
      if (!rooms[i].is_free())
        counts[i] = estimated_count(*links[i].mesh, settings.max_protrusion, room_of(i), enough);
    });
    return counts;
  };
  const std::vector<Meeting> meetings = with_gaps(robot.self.meetings, solids);
  const auto given_up = [&, free = static_cast<double>(robot.self.free)](double share) {
    return static_cast<std::size_t>(share * free);
  };
  std::pair best(robot.links, robot.self);
  std::set<Two> narrow;
  double share = kGivenUp;
  is_open = is_open && robot.self.free >= kFewest;
  for (int round = 0; round < kRounds && is_open && best.second.false_share() > kEnough; ++round) {
    std::set<std::size_t> lost;
    std::size_t total = SIZE_MAX;
    while (true) {
      lost = dearest(meetings, given_up(share));
      rooms = rooms_of(links, first, meetings, lost, narrow);
      const std::vector<std::size_t> counts = needed(budget);
      total = 0;
      for (std::size_t i = 0; i < links.size(); ++i)
        total += counts[i] > 0 ? counts[i] : links[i].own;
      const double too_many = static_cast<double>(total) / static_cast<double>(budget);
      const double next = share * std::clamp(std::pow(too_many, 1.5), 1.1, 2.0);
      if (total <= budget || next > kHopeless) break;
      share = next;
    }
    if (total > budget) break;
    std::vector<ClosedMesh> meshes;
    std::vector<std::size_t> changed;
    settings.room.clear();
    for (std::size_t i = 0; i < links.size(); ++i) {
      if (rooms[i].is_free()) continue;
      changed.push_back(i);
      meshes.push_back(*links[i].mesh);
      settings.room.push_back(room_of(i));
    }
    if (changed.empty()) break;
    std::vector<SphereCover> covers = cover_with_spheres(meshes, settings, progress);
    for (std::size_t i = 0; i < changed.size(); ++i) {
      SphereLink& link = robot.links[changed[i]];
      const SphereCoverProof proof = prove_cover(meshes[i], covers[i].spheres);
      if (!proof.covered) continue;
      covers[i].reached = true;  // a wish
      covers[i].seconds += link.cover.seconds;
      covers[i].protrusion.largest += link.slack;
      link.proof = proof;
      link.cover = std::move(covers[i]);
      complete_cover(link, true);
    }
    robot.self = study.of(robot.covers(), true);
    if (robot.self.false_share() < best.second.false_share()) best = {robot.links, robot.self};
    for (const FalseMeeting& one : robot.self.meetings)
      if (!lost.contains(one.sample)) narrow.insert({one.a, one.b});
    if (narrow.empty()) break;  // the next round would be the same
  }
  std::tie(robot.links, robot.self) = std::move(best);
  if (robot.self.false_share() <= kEnough) return;

  // Pairs that remain in collision even if no more than a tenth is given up.
  const std::set<std::size_t> lost = dearest(meetings, given_up(kEnough));
  std::vector<const LinkPair*> worst;
  for (const LinkPair& pair : robot.self.pairs)
    if (pair.falsely > 0) worst.push_back(&pair);
  std::stable_sort(worst.begin(), worst.end(),
                   [](const LinkPair* x, const LinkPair* y) { return x->falsely > y->falsely; });
  worst.resize(std::min(worst.size(), kTold));
  for (const LinkPair* pair : worst) {
    std::vector<Meeting> own;
    double gap = std::numeric_limits<double>::infinity();
    for (const Meeting& one : meetings)
      if (!lost.contains(one.at.sample) && robot.links[one.at.a].name == pair->a &&
          robot.links[one.at.b].name == pair->b) {
        own.push_back(one);
        gap = std::min(gap, one.gap);
      }
    if (own.empty()) continue;
    rooms = rooms_of(links, first, own, {});
    std::size_t spheres = 0;
    for (const std::size_t count : needed(kMostCoverSpheres)) spheres += count;
    robot.too_close.push_back({pair->a, pair->b, gap, spheres});
  }
}

}  // namespace ist::app
