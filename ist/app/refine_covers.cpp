#include "app/refine_covers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace ist::app {
namespace {

constexpr double kEnough = 0.1;           ///< of the free poses
constexpr std::size_t kMostOfALink = 32;  ///< on average
constexpr int kPatience = 3;  ///< rounds without gain: some gaps are too narrow for any spheres
constexpr double kWorthwhile = 0.95;  ///< of the share before: less gain is none
constexpr double kMore = 1.25;        ///< spheres of a link that is tightened
constexpr double kMuchMore = 1.5;     ///< of one that protrudes kFurther
constexpr double kFurther = 1.1;      ///< times as far as at first
constexpr double kOften = 0.1;        ///< of the most meetings: what has fewer can wait
constexpr double kAlike = 0.7;        ///< of the other's level: then both are to blame
constexpr double kTighter = 0.5;      ///< share of the level, at a time
constexpr double kTightest = 0.1;     ///< share of the level
constexpr double kCells = 3;          ///< to the first protrusion

/// Places where a link's spheres protrude too much, by cells.
class TightCells {
 public:
  explicit TightCells(double size) : size_(size) {}

  double share_at(const Eigen::Vector3d& place) const {
    const auto cell = cells_.find(key(place));
    return cell == cells_.end() ? 1 : cell->second.share;
  }

  void count(const Eigen::Vector3d& place) {
    Cell& cell = cells_[key(place)];
    cell.sum += place;
    ++cell.all;
    ++cell.now;
    ++counted_;
  }

  std::size_t counted() const { return counted_; }  ///< since forget()

  void forget() {
    for (auto& [key, cell] : cells_) cell.now = 0;
    counted_ = 0;
  }

  /// Where most was counted.
  void tighten() {
    std::size_t most = 0;
    for (const auto& [key, cell] : cells_) most = std::max(most, cell.now);
    for (auto& [key, cell] : cells_)
      if (static_cast<double>(cell.now) >= kOften * static_cast<double>(most))
        cell.share = std::max(kTightest, kTighter * cell.share);
  }

  std::vector<TightPlace> places() const {
    std::vector<TightPlace> out;
    for (const auto& [key, cell] : cells_)
      if (cell.share < 1)
        out.push_back({cell.sum / static_cast<double>(cell.all), size_, cell.share});
    return out;
  }

 private:
  using Key = std::array<std::int64_t, 3>;
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t all = 0, now = 0;
    double share = 1;
  };

  Key key(const Eigen::Vector3d& place) const {
    const auto at = [&](int k) { return static_cast<std::int64_t>(std::floor(place[k] / size_)); };
    return {at(0), at(1), at(2)};
  }

  double size_;
  std::size_t counted_ = 0;
  std::map<Key, Cell> cells_;
};

struct Refined {
  const ClosedMesh* mesh;  ///< null: its spheres stay as they are
  std::size_t count;
  double first;  ///< [u] protrusion before
  TightCells tight;
};

/// Of two links the one whose spheres may protrude more where they meet is to blame, or both.
void blame(const SphereRobot& robot, std::vector<Refined>& links) {
  for (Refined& link : links) link.tight.forget();
  for (const FalseMeeting& one : robot.self.meetings) {
    const auto level = [&](std::size_t i, const Eigen::Vector3d& place) {
      return links[i].mesh == nullptr
                 ? 0
                 : links[i].tight.share_at(place) * robot.links[i].cover.protrusion.largest;
    };
    const double a = level(one.a, one.in_a), b = level(one.b, one.in_b);
    if (a > kAlike * b) links[one.a].tight.count(one.in_a);
    if (b > kAlike * a) links[one.b].tight.count(one.in_b);
  }
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

void refine_covers(SphereRobot& robot, SelfCollisionStudy& study, const SphereCoverSettings& cover,
                   const std::map<std::string, std::size_t>& fixed,
                   const ProgressCallback& progress) {
  std::vector<Refined> refined;
  std::size_t count = 0, next = 0;
  for (const SphereLink& link : robot.links) {
    const std::size_t own = link.cover.spheres.size() - link.given.size();
    count += own;
    const double protrusion = link.cover.protrusion.largest;
    const ClosedMesh* mesh = link.has_mesh ? &robot.meshes[next++] : nullptr;
    if (fixed.contains(link.name) || !(protrusion > 0)) mesh = nullptr;
    refined.push_back({mesh, own, protrusion, TightCells(protrusion / kCells)});
  }
  const std::size_t most = std::max(count, kMostOfALink * robot.links.size());
  double least = robot.self.false_share();
  std::pair best(robot.links, robot.self);
  int idle = 0;
  for (int round = 0; idle < kPatience && robot.self.false_share() > kEnough; ++round) {
    blame(robot, refined);
    std::size_t often = 0;
    for (const Refined& one : refined) often = std::max(often, one.tight.counted());
    if (often == 0) break;
    std::vector<ClosedMesh> meshes;
    std::vector<std::size_t> links;
    SphereCoverSettings settings = cover;
    for (std::size_t i = 0; i < refined.size(); ++i) {
      Refined& one = refined[i];
      if (static_cast<double>(one.tight.counted()) < kOften * static_cast<double>(often)) continue;
      // Elsewhere it is to protrude no more than at first: then it is not tightened each time.
      const bool further = robot.links[i].cover.protrusion.largest > kFurther * one.first;
      if (!further || round % 2 == 0) one.tight.tighten();
      const double more = (further ? kMuchMore : kMore) * static_cast<double>(one.count);
      count -= one.count;
      one.count = std::min(static_cast<std::size_t>(std::ceil(more)), kMostCoverSpheres);
      count += one.count;
      settings.counts.push_back(one.count);
      settings.tight.push_back(one.tight.places());
      meshes.push_back(*one.mesh);
      links.push_back(i);
    }
    if (count > most) break;
    std::vector<SphereCover> covers = cover_with_spheres(meshes, settings, progress);
    for (std::size_t i = 0; i < links.size(); ++i) {
      SphereLink& link = robot.links[links[i]];
      covers[i].seconds += link.cover.seconds;
      covers[i].protrusion.largest += link.slack;
      link.proof = prove_cover(meshes[i], covers[i].spheres);
      link.cover = std::move(covers[i]);
      complete_cover(link, true);
    }
    robot.self = study.of(robot.covers(), true);
    ++idle;
    if (robot.self.false_share() > kWorthwhile * least) continue;
    idle = 0;
    least = robot.self.false_share();
    best = {robot.links, robot.self};
  }
  if (idle > 0) std::tie(robot.links, robot.self) = std::move(best);
}

}  // namespace ist::app
