#pragma once

#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "support/exact_pair.h"
#include "support/random_mates.h"
#include "support/turns.h"

namespace ist::testing {

/// Failures that may not happen, with their counts.
struct MateTally {
  std::uint64_t mates = 0, queries = 0, touching = 0;
  std::map<std::string, std::uint64_t> wrong;

  void operator+=(const MateTally& other) {
    mates += other.mates;
    queries += other.queries;
    touching += other.touching;
    for (const auto& [what, count] : other.wrong) wrong[what] += count;
  }
};

/// The costliest query, in medians of those of like many triangles.
struct MateWork {
  double worst = 0;
  std::string what;
};

/// Asks random mates in a few poses each, and checks known properties of the answers.
class MateChecks {
 public:
  /// `cost` of the query that `ask` makes; by default node pairs and crossing triangles.
  using Cost = std::function<double(const std::function<Penetration()>& ask)>;

  explicit MateChecks(std::uint64_t seed, Cost cost = by_counts) : mates_(seed), cost_(cost) {}

  const MateTally& tally() const { return tally_; }

  /// One mate: at it, next to it to both sides, and apart from it by units in the last place.
  void run(std::uint32_t most_corners) {
    mate_ = mates_.next(most_corners);
    a_.emplace(surface(mate_.a.mesh(), mate_.kind));
    if (!mate_.copy) b_.emplace(surface(mate_.b.mesh(), mate_.kind));
    smaller_ = std::min(a_->view().volume(), b().view().volume());
    ++tally_.mates;
    choose_world();
    look_at(0);
    for (const double aside : {1e-9, 1e-6, 1e-3, 0.1})
      for (const double side : {aside, -aside}) look_at(side);
    step();
  }

  /// Costs for those numbers of triangles that have at least a hundred queries.
  MateWork work() const {
    MateWork out;
    for (const auto& [triangles, costs] : costs_) {
      if (costs.all.size() < 100) continue;
      std::vector<double> all = costs.all;
      const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
      std::nth_element(all.begin(), middle, all.end());
      if (costs.most > out.worst * *middle) out = {costs.most / *middle, costs.what};
    }
    return out;
  }

  static double by_counts(const std::function<Penetration()>& ask) {
    const Penetration p = ask();
    return p.node_visits + p.sphere_pairs;
  }

 private:
  using Point = Eigen::Vector3d;

  const Asset& b() const { return mate_.copy ? *a_ : *b_; }

  /// Whether neither turn rounds a coordinate.
  bool turns_exactly() const {
    const Eigen::Vector4d q = mate_.q.coeffs().cwiseAbs();
    return exact_ && (q.array() == 0 || q.array() == 0.5 || q.array() == 1).all();
  }

  /// Turns the world not at all, by right angles, by multiples of 15°, or by any angle.
  void choose_world() {
    static const std::vector<Eigen::Quaterniond> right = right_angled_turns();
    world_ = {};
    exact_ = mates_.one_in(3);
    if (exact_) return;
    Eigen::Quaterniond q = random_turn(mates_.random());
    if (mates_.one_in(2))
      q = right[static_cast<std::size_t>(mates_.whole(0, 23))];
    else if (mates_.one_in(2))
      q = Eigen::AngleAxisd(mates_.whole(1, 23) * std::numbers::pi / 12,
                            Point::Unit(mates_.whole(0, 2)));
    world_ = {{q.w(), q.x(), q.y(), q.z()}, {0, 0, 0}};
  }

  Penetration ask(const Point& t, bool exchanged = false) {
    const Pose pose = {{mate_.q.w(), mate_.q.x(), mate_.q.y(), mate_.q.z()}, {t.x(), t.y(), t.z()}};
    const Eigen::Quaterniond world(world_.q[0], world_.q[1], world_.q[2], world_.q[3]);
    placed_a_ = {a_->view(), world_, 1};
    placed_b_ = {b().view(), exact_ ? pose : turned(world, pose), 1};
    ++tally_.queries;
    return exchanged ? exactly(placed_b_, placed_a_, workspace_)
                     : exactly(placed_a_, placed_b_, workspace_);
  }

  void look_at(double aside) {
    const Point t = mate_.t + aside * mate_.direction;
    Penetration p;
    const double cost = cost_([&] { return p = ask(t); });
    const std::size_t triangles =
        2 * (mate_.a.mesh().vertices.size() + mate_.b.mesh().vertices.size());
    Costs& like = costs_[static_cast<int>(std::log2(double(triangles)))];
    like.all.push_back(cost);
    if (cost > like.most) like.most = cost, like.what = name(aside);
    const ExactCheck check = check_exactly(placed_a_, placed_b_, workspace_);
    const Penetration q = ask(t, true);
    const InCommon truth = in_common(mate_.a, mate_.b_turned.moved(t));
    const double size = std::min(size_of(placed_a_), size_of(placed_b_));
    const double larger = std::max(size_of(placed_a_), size_of(placed_b_));
    const double faces = mate_.a.surface() + mate_.b.surface();
    // Covers the roundings of the truth and of the pose after the world's turn.
    const double tolerance = 1e-14 * faces * larger;
    const auto need = [&](bool right, const char* what) {
      if (right) return;
      if (++tally_.wrong[what] <= 3) show(what, aside, p, q, check, truth);
    };
    need(p.status == QueryStatus::ok && check.complete, "queries that did not finish");
    need(check.consistent, "signs that contradict each other");
    need(check.gap <= gap_bound(check), "surfaces that do not close within rounding");
    need(p.volume_min <= p.volume && p.volume <= p.volume_max, "values outside their bounds");
    need(p.volume_max - p.volume_min <= 1e-12 * faces * larger, "wide intervals");
    need(p.volume_max <= smaller_ * (1 + 1e-11), "more than the smaller solid");
    need(std::abs(p.volume - truth.volume) <= tolerance, "wrong volumes");
    need(p.volume_min <= truth.volume + tolerance && truth.volume - tolerance <= p.volume_max,
         "intervals that miss the volume");
    need(std::abs(p.volume - q.volume) <= tolerance,
         "volumes that change when A and B are exchanged");
    // Rotations round the positions of faces, so that a face along the chosen side may lie on
    // either side of it.
    if (apart_everywhere(t) && turns_exactly())
      need((p.force + q.force).norm() <= 1e-11 * faces,
           "gradients that change when A and B are exchanged");
    need(p.touching == q.touching, "touching that changes when A and B are exchanged");
    if (truth.volume > tolerance)
      need(!p.touching && p.contact_area == 0, "touching inside each other");
    if (truth.area > 1e-9 * size * size) need(p.touching, "faces on each other that do not touch");
    if (truth.area > 0 && p.touching)
      need(std::abs(p.contact_area - truth.area) <= 1e-9 * size * size, "wrong areas of contact");
    if (mate_.parts && aside >= 1e-9)
      need(!p.touching && p.volume_max <= 1e-12 * faces * larger, "touching apart from each other");
    tally_.touching += p.touching;
    ContactPatch patches[8];
    const ContactPatches found =
        contact_patches(placed_a_, placed_b_, {.measure = Measure::exact}, workspace_, patches);
    double volume = 0;
    Point force = Point::Zero();
    for (const ContactPatch& patch : std::span(patches).first(found.count)) {
      volume += patch.volume;
      force += patch.force;
    }
    if (p.volume > 0)
      need(std::abs(volume - p.volume) <= tolerance && (force - p.force).norm() <= 1e-11 * faces,
           "patches that do not sum to the whole");
  }

  /// Else the side of a kink that an answer takes may be another if A and B are exchanged.
  bool apart_everywhere(const Point& t) const {
    const auto middle = [](const Extrusion& of) -> Point {
      Eigen::AlignedBox3d box;
      for (const auto& p : of.points) {
        box.extend(Point(p.x(), p.y(), of.low));
        box.extend(Point(p.x(), p.y(), of.high));
      }
      return box.center();
    };
    // B's box in its own frame.
    const Point offset = mate_.q * middle(mate_.b) + t - middle(mate_.a);
    return offset.cwiseAbs().minCoeff() > 1e-12;
  }

  /// One unit in the last place towards A, none and one away: the volume falls.
  void step() {
    if (!mate_.parts) return;
    const int axis = mate_.direction.x() > 0 ? 0 : 2;
    constexpr double kFar = std::numeric_limits<double>::infinity();
    double above = kFar;
    for (const int side : {-1, 0, 1}) {
      Point t = mate_.t;
      if (side != 0) t[axis] = std::nextafter(t[axis], side * kFar);
      const Penetration p = ask(t);
      if (p.status != QueryStatus::ok || p.volume_min > above)
        ++tally_.wrong["volumes that grow with the distance"];
      above = p.volume_max;
      if (in_common(mate_.a, mate_.b_turned.moved(t)).area > 1e-9 && !p.touching &&
          ++tally_.wrong["faces a unit in the last place apart that do not touch"] <= 3)
        show("one unit in the last place apart", side, p, p, {}, {});
    }
  }
  std::string name(double aside) const {
    const TriangleMesh a = mate_.a.mesh(), b = mate_.b.mesh();
    char text[200];
    std::snprintf(text, sizeof text, "mate %llu, %s, %zu and %zu triangles, %g aside",
                  static_cast<unsigned long long>(tally_.mates), mate_.kind, a.triangles.size(),
                  b.triangles.size(), aside);
    return text;
  }

  void show(const char* what, double aside, const Penetration& p, const Penetration& q,
            const ExactCheck& check, const InCommon& truth) const {
    std::fprintf(stderr, "%s: %s\n ", what, name(aside).c_str());
    for (const PlacedAsset* placed : {&placed_b_, &placed_a_}) {
      for (const double x : placed->pose.q) std::fprintf(stderr, " %.17g", x);
      for (const double x : placed->pose.t) std::fprintf(stderr, " %.17g", x);
      std::fprintf(stderr, ";");
    }
    std::fprintf(stderr,
                 " status %d consistent %d crossings %u gap %.2g\n  volume %.17g (%.17g … %.17g), "
                 "exchanged %.17g, truth %.17g\n  touching %d %d, area %.17g %.17g, truth %.17g; "
                 "gradients %g %g %g; %g %g %g\n",
                 static_cast<int>(p.status), check.consistent, check.crossings, check.gap, p.volume,
                 p.volume_min, p.volume_max, q.volume, truth.volume, p.touching, q.touching,
                 p.contact_area, q.contact_area, truth.area, p.force[0], p.force[1], p.force[2],
                 q.force[0], q.force[1], q.force[2]);
  }

  RandomMates mates_;
  Cost cost_;
  MateTally tally_;
  struct Costs {
    std::vector<double> all;
    double most = 0;
    std::string what;
  };
  std::map<int, Costs> costs_;  ///< by log2 of triangles
  Mate mate_;
  std::optional<Asset> a_, b_;
  double smaller_ = 0;
  Pose world_;
  bool exact_ = true;  ///< A lies at the origin, and B as the mate says
  PlacedAsset placed_a_, placed_b_;
  Workspace workspace_;
};

}  // namespace ist::testing
