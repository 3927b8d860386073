// A million random and a hundred thousand degenerate poses of exact queries: signs that agree, a
// surface that closes, bounds in order, A and B exchanged, nothing that is not a number; and a
// million steps of random motions, with and without what is kept from step to step; and a million
// random mates, whose volumes are known. `./dev soak exact` runs it and writes its report.

#include <ist/query.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/answer_bits.h"
#include "support/exact_pair.h"
#include "support/integer_meshes.h"
#include "support/mate_checks.h"
#include "support/test_meshes.h"
#include "support/turns.h"
#include "timing.h"

namespace {

using namespace ist;
using Point = Eigen::Vector3d;

constexpr std::size_t kChunk = 250;  // poses drawn from one stream of random numbers
/// Forbidden events, and their counts.
struct Tally {
  std::uint64_t poses = 0, crossing = 0, contained = 0, apart = 0, pairs = 0;
  std::uint64_t unfinished = 0;    ///< status other than ok
  std::uint64_t inconsistent = 0;  ///< signs that contradict each other
  std::uint64_t not_numbers = 0;
  std::uint64_t disordered = 0;   ///< a value outside its bounds, or more than the smaller solid
  std::uint64_t open = 0;         ///< gaps above their bound
  std::uint64_t unlike = 0;       ///< intervals of A in B and B in A that do not meet
  std::uint64_t untrue = 0;       ///< intervals that miss a volume which is known
  std::uint64_t wide = 0;         ///< intervals wider than 1e-9 of the volume
  std::uint64_t kept = 0;         ///< steps that were answered by what was kept
  std::uint64_t unlike_kept = 0;  ///< with other bits than from scratch
  double worst_gap = 0;

  void operator+=(const Tally& other) {
    poses += other.poses;
    crossing += other.crossing;
    contained += other.contained;
    apart += other.apart;
    pairs += other.pairs;
    unfinished += other.unfinished;
    inconsistent += other.inconsistent;
    not_numbers += other.not_numbers;
    disordered += other.disordered;
    open += other.open;
    unlike += other.unlike;
    untrue += other.untrue;
    wide += other.wide;
    kept += other.kept;
    unlike_kept += other.unlike_kept;
    worst_gap = std::max(worst_gap, other.worst_gap);
  }
};

struct TestSolid {
  Asset asset;
  std::vector<Point> vertices;
};

/// Random mates, and the costliest query of each chunk.
struct Mates {
  testing::MateTally tally;
  testing::MateWork work;
};

Mates ask_mates(std::size_t mates) {
  // Thread time, the least of three.
  const auto clocked = [](const std::function<Penetration()>& ask) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const double start = benchmark::thread_seconds();
      ask();
      least = std::min(least, benchmark::thread_seconds() - start);
    }
    return least;
  };
  constexpr std::size_t kMates = 1000;
  std::atomic<std::size_t> next = 0;
  std::vector<Mates> all(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::jthread> threads;
  for (Mates& mine : all)
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < mates / kMates; i = next++) {
        testing::MateChecks checks(i + 1000, clocked);
        for (std::size_t k = 0; k < kMates; ++k) checks.run(k % 8 == 0 ? 60 : 12);
        mine.tally += checks.tally();
        const testing::MateWork work = checks.work();
        if (work.worst > mine.work.worst) mine.work = work;
      }
    });
  threads.clear();
  Mates sum;
  for (const Mates& mine : all) {
    sum.tally += mine.tally;
    if (mine.work.worst > sum.work.worst) sum.work = mine.work;
  }
  return sum;
}

/// Small meshes of every kind: the fewer triangles the more of them cross at vertices and edges.
std::vector<TestSolid> make_solids() {
  std::vector<TriangleMesh> meshes = {
      testing::box_mesh(Point::Zero(), Point::Ones()),
      testing::box_mesh({-2, -2, -0.0625}, {2, 2, 0.0625}),
      testing::box_mesh({-0.001, -0.002, -1}, {0.001, 0.002, 1}),
      testing::icosphere_mesh(1),
      testing::icosphere_mesh(3),
      testing::torus_mesh(1, 0.4, 24, 12),
      make_sample("gear"),
  };
  testing::IntegerMeshes random(11);
  for (int kind = 0; kind < testing::IntegerMeshes::kKinds; ++kind)
    for (int i = 0; i < 2; ++i) meshes.push_back(random.make(kind));
  std::vector<TestSolid> solids;
  for (const TriangleMesh& mesh : meshes) solids.push_back({testing::surface(mesh), mesh.vertices});
  return solids;
}

class Chunk {
 public:
  Chunk(const std::vector<TestSolid>& solids, std::size_t index, Workspace& workspace, Tally& tally)
      : solids_(solids),
        random_(0x9e3779b97f4a7c15u * (index + 1)),
        workspace_(workspace),
        tally_(tally) {}

  /// Three pairs of solids in turn; each moves slowly, fast or by jumps for a while.
  void move() {
    struct Moving {
      const TestSolid *a, *b;
      PlacedAsset at_a, at_b;
      Point velocity = Point::Zero(), spin = Point::Zero();
      bool carried = false;
    };
    std::vector<Moving> all;
    for (int i = 0; i < 3; ++i) {
      const TestSolid &a = pick(), &b = pick();
      all.push_back({&a, &b, {a.asset.view(), {}, 1}, {b.asset.view(), {}, 1}});
      scatter(all.back().at_a, all.back().at_b);
    }
    for (std::size_t i = 0; i < kChunk; ++i) {
      Moving& m = all[i % all.size()];
      const double size = std::min(testing::size_of(m.at_a), testing::size_of(m.at_b));
      if (i < all.size() || one_in(30)) {
        const double step = std::pow(10, one_in(8) ? uniform(-1.5, 0) : uniform(-6, -1.5));
        const auto draw = [&] { return Point(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)); };
        m.velocity = step * size * draw();
        m.spin = one_in(3) ? Point(Point::Zero()) : Point(step * draw());
        m.carried = one_in(4);
      }
      if (one_in(60)) one_in(2) ? align(*m.a, *m.b, m.at_a, m.at_b) : scatter(m.at_a, m.at_b);
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(
          m.spin.norm(), m.spin.norm() > 0 ? Point(m.spin.normalized()) : Point(Point::UnitX())));
      const auto step = [&](PlacedAsset& placed, const Point& velocity) {
        const double *q = placed.pose.q, *t = placed.pose.t;
        set(placed.pose, turn * Eigen::Quaterniond(q[0], q[1], q[2], q[3]),
            Point(t[0], t[1], t[2]) + velocity);
      };
      if (m.carried) step(m.at_a, 2 * m.velocity);
      step(m.at_b, m.velocity);
      const auto id = static_cast<std::uint32_t>(1 + random_() % 2 * 1000 + i % all.size());
      compare(m.at_a, m.at_b, one_in(20) ? id : static_cast<std::uint32_t>(1 + i % all.size()));
    }
  }

  void run(bool degenerate) {
    for (std::size_t i = 0; i < kChunk; ++i) {
      const TestSolid &a = pick(), &b = degenerate && one_in(2) ? a : pick();
      PlacedAsset at_a{a.asset.view(), {}, 1}, at_b{b.asset.view(), {}, 1};
      degenerate ? align(a, b, at_a, at_b) : scatter(at_a, at_b);
      look_at(at_a, at_b);
      if (degenerate) look_at_known(a, at_a);
    }
  }

 private:
  bool one_in(unsigned n) { return random_() % n == 0; }
  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  const TestSolid& pick() { return solids_[random_() % solids_.size()]; }
  static void set(Pose& pose, const Eigen::Quaterniond& q, const Point& t) {
    pose = {{q.w(), q.x(), q.y(), q.z()}, {t[0], t[1], t[2]}};
  }

  /// Anywhere that they may meet, at any scale.
  void scatter(PlacedAsset& a, PlacedAsset& b) {
    b.scale = std::pow(10, one_in(4) ? uniform(-4, 1) : uniform(-0.3, 0.3)) * testing::size_of(a) /
              testing::size_of(b);
    const double reach = (testing::size_of(a) + testing::size_of(b)) / 2;
    const Point offset(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    set(a.pose, testing::random_turn(random_), {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    set(b.pose, testing::random_turn(random_),
        Point(a.pose.t[0], a.pose.t[1], a.pose.t[2]) + 0.6 * reach * offset);
  }

  /// Faces, edges and corners in common, or next to that: by turns of a cube, or by parts of a
  /// whole turn, and by differences of vertices and parts of them.
  void align(const TestSolid& a, const TestSolid& b, PlacedAsset& at_a, PlacedAsset& at_b) {
    const auto vertex = [&](const TestSolid& of) {
      return of.vertices[random_() % of.vertices.size()];
    };
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    if (!one_in(3)) {
      const double parts[] = {2, 4, 4, 8, 12, 24};
      const double angle = 2 * std::numbers::pi / parts[random_() % 6];
      turn = Eigen::AngleAxisd(angle * double(random_() % 24), Point::Unit(long(random_() % 3)));
      if (one_in(3)) turn = turn * Eigen::Quaterniond(0.5, 0.5, 0.5, one_in(2) ? 0.5 : -0.5);
    }
    if (one_in(6)) at_b.scale = one_in(2) ? 0.5 : 2;
    // A corner on a corner, the middle of an edge, or as they lie.
    const Point from = at_b.scale * (turn * vertex(b));
    Point t = one_in(8) ? Point(Point::Zero()) : vertex(a) - from;
    if (one_in(4)) t = (vertex(a) + vertex(a)) / 2 - from;
    if (one_in(4)) {
      const double step = std::pow(10, uniform(-16, -3));
      t[long(random_() % 3)] += one_in(2) ? step : -step;
    }
    set(at_b.pose, turn, t);
    if (one_in(4)) {  // the same seen from elsewhere
      const Eigen::Quaterniond all = testing::random_turn(random_);
      set(at_a.pose, all, Point::Zero());
      set(at_b.pose, all * turn, all * t);
    }
  }

  void look_at(const PlacedAsset& a, const PlacedAsset& b) {
    const Penetration p = testing::exactly(a, b, workspace_);
    const testing::ExactCheck check = testing::check_exactly(a, b, workspace_);
    const bool finished = p.status == QueryStatus::ok && check.complete;
    const double size = std::min(testing::size_of(a), testing::size_of(b));
    const double volume = size * size * size;
    const double gap = check.gap / testing::gap_bound(check);
    ++tally_.poses;
    tally_.pairs += check.crossings;
    ++(check.crossings > 0 ? tally_.crossing : p.volume > 0 ? tally_.contained : tally_.apart);
    tally_.unfinished += !finished;
    tally_.inconsistent += !check.consistent;
    tally_.not_numbers +=
        !(std::isfinite(p.volume_min) && std::isfinite(p.volume_max) && p.centroid.allFinite() &&
          p.force.allFinite() && p.torque.allFinite() && std::isfinite(gap));
    const auto whole = [](const PlacedAsset& placed) {
      return placed.asset.volume() * std::pow(placed.scale, 3);
    };
    tally_.disordered +=
        !(0 <= p.volume_min && p.volume_min <= p.volume && p.volume <= p.volume_max &&
          p.volume_min <= std::min(whole(a), whole(b)) * (1 + 1e-12));
    tally_.open += !(gap <= 1);
    tally_.worst_gap = std::max(tally_.worst_gap, gap);
    tally_.wide += p.volume_max - p.volume_min > 1e-9 * p.volume && p.volume > 1e-9 * volume;
    const Penetration q = testing::exactly(b, a, workspace_);
    tally_.unlike +=
        !(std::max(p.volume_min, q.volume_min) <= std::min(p.volume_max, q.volume_max));
    if (p.status != QueryStatus::ok || !check.complete || !check.consistent || gap > 1 ||
        std::max(p.volume_min, q.volume_min) > std::min(p.volume_max, q.volume_max))
      show(a, b, p, q, check);
  }

  void compare(const PlacedAsset& a, const PlacedAsset& b, std::uint32_t id) {
    PenetrationSettings settings;
    settings.measure = Measure::exact;
    std::uint64_t bits[2];
    Penetration whole[2];
    for (const std::uint32_t pair_id : {0u, id}) {
      testing::AnswerBits sum;
      settings.pair_id = pair_id;
      Penetration& p = whole[pair_id == 0 ? 0 : 1];
      p = penetration(a, b, settings, workspace_);
      if (pair_id != 0) tally_.kept += p.node_visits == 0 ? 1 : 0;
      p.node_visits = 0;
      sum.add(p);
      if (one_in_eight_ == 0) {
        ContactPatch patches[8];
        ContactPatches found = contact_patches(a, b, settings, workspace_, patches);
        found.penetration.node_visits = 0;
        sum.add(found.penetration);
        for (std::size_t k = 0; k < found.count; ++k) sum.add(patches[k]);
      }
      bits[pair_id == 0 ? 0 : 1] = sum.value();
    }
    one_in_eight_ = (one_in_eight_ + 1) % 8;
    ++tally_.poses;
    tally_.pairs += whole[0].sphere_pairs;
    ++(whole[0].sphere_pairs > 0 ? tally_.crossing
       : whole[0].volume > 0     ? tally_.contained
                                 : tally_.apart);
    if (bits[0] == bits[1]) return;
    ++tally_.unlike_kept;
    show(a, b, whole[0], whole[1], {});
  }

  /// A solid on itself, in any place and turn of both: its own volume.
  void look_at_known(const TestSolid& a, PlacedAsset at_a) {
    if (!one_in(4)) return;
    const Penetration p = testing::exactly(at_a, at_a, workspace_);
    const double truth = a.asset.view().volume();
    if (p.volume_min <= truth * (1 + 1e-13) && truth * (1 - 1e-13) <= p.volume_max) return;
    ++tally_.untrue;
    show(at_a, at_a, p, p, {});
  }

  void show(const PlacedAsset& a, const PlacedAsset& b, const Penetration& p, const Penetration& q,
            const testing::ExactCheck& check) {
    const auto number = [&](const PlacedAsset& placed) {
      const auto found = std::find_if(solids_.begin(), solids_.end(), [&](const TestSolid& solid) {
        return &solid.asset.view().header() == &placed.asset.header();
      });
      return static_cast<int>(found - solids_.begin());
    };
    std::fprintf(stderr, "solids %d, %d:", number(a), number(b));
    for (const PlacedAsset* placed : {&a, &b}) {
      for (const double x : placed->pose.q) std::fprintf(stderr, " %.17g", x);
      for (const double x : placed->pose.t) std::fprintf(stderr, " %.17g", x);
      std::fprintf(stderr, " %.17g;", placed->scale);
    }
    std::fprintf(
        stderr,
        " status %d, consistent %d, crossings %u, gap %.2g, volume %.17g in %.17g … %.17g, "
        "exchanged %.17g in %.17g … %.17g\n",
        static_cast<int>(p.status), check.consistent, check.crossings, check.gap, p.volume,
        p.volume_min, p.volume_max, q.volume, q.volume_min, q.volume_max);
  }

  const std::vector<TestSolid>& solids_;
  std::mt19937_64 random_;
  Workspace& workspace_;
  Tally& tally_;
  int one_in_eight_ = 0;
};

enum class Poses { random, degenerate, motions };

Tally ask(const std::vector<TestSolid>& solids, std::size_t poses, Poses kind) {
  const std::size_t first = static_cast<std::size_t>(kind) << 20;
  std::atomic<std::size_t> next = 0;
  std::vector<Tally> tallies(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::jthread> threads;
  for (Tally& tally : tallies)
    threads.emplace_back([&] {
      Workspace workspace;
      for (std::size_t i = next++; i < poses / kChunk; i = next++) {
        Chunk chunk(solids, first + i, workspace, tally);
        kind == Poses::motions ? chunk.move() : chunk.run(kind == Poses::degenerate);
      }
    });
  threads.clear();
  Tally sum;
  for (const Tally& tally : tallies) sum += tally;
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Report report("exact_soak", argc, argv);
  const std::vector<TestSolid> solids = make_solids();
  bool sound = true;
  for (const bool degenerate : {false, true}) {
    const std::size_t poses =
        (degenerate ? 100'000 : 1'000'000) / (report.quick() ? degenerate ? 20 : 50 : 1);
    const auto start = std::chrono::steady_clock::now();
    const Tally tally = ask(solids, poses, degenerate ? Poses::degenerate : Poses::random);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const std::string name = degenerate ? "degenerate" : "random";
    report.row("Poses", {{"poses", name},
                         {"count", tally.poses},
                         {"surfaces cross", tally.crossing},
                         {"one in the other", tally.contained},
                         {"apart", tally.apart},
                         {"crossing pairs of triangles", tally.pairs},
                         {"worst gap in units of its bound", tally.worst_gap},
                         {"interval wider than 1e-9 of the volume", tally.wide},
                         {"seconds", seconds}});
    const auto none = [&](const std::string& what, std::uint64_t value) {
      report.target(name + ": " + what, static_cast<double>(value), 0, true);
      sound = sound && value == 0;
    };
    none("queries that did not finish", tally.unfinished);
    none("signs that contradict each other", tally.inconsistent);
    none("answers that are not numbers", tally.not_numbers);
    none("values outside their bounds or their solids", tally.disordered);
    none("surfaces that do not close within rounding", tally.open);
    none("intervals that change when A and B are exchanged", tally.unlike);
    if (degenerate) none("intervals that miss a known volume", tally.untrue);
  }
  const Tally moved = ask(solids, report.quick() ? 20'000 : 1'000'000, Poses::motions);
  report.row("Motions", {{"steps", moved.poses},
                         {"surfaces cross", moved.crossing},
                         {"one in the other", moved.contained},
                         {"apart", moved.apart},
                         {"crossing pairs of triangles", moved.pairs},
                         {"answered by what is kept", moved.kept}});
  report.target("motions: answers with other bits than from scratch",
                static_cast<double>(moved.unlike_kept), 0, true);
  const double share = static_cast<double>(moved.kept) / static_cast<double>(moved.poses);
  report.target("motions: share that is answered by what is kept", share, 0.3);
  sound = sound && moved.unlike_kept == 0 && share > 0.3;
  const Mates mated = ask_mates(report.quick() ? 1000 : 1'000'000);
  report.row("Mates", {{"mates", mated.tally.mates},
                       {"queries", mated.tally.queries},
                       {"touching", mated.tally.touching},
                       {"costliest query", mated.work.what}});
  std::uint64_t wrong = 0;
  for (const auto& [what, count] : mated.tally.wrong) {
    report.target("mates: " + what, static_cast<double>(count), 0, true);
    wrong += count;
  }
  report.target("mates: answers that are wrong in any way", static_cast<double>(wrong), 0, true);
  report.target("mates: costliest query, in medians of like many triangles", mated.work.worst, 10,
                true);
  sound = sound && wrong == 0;
  report.remark(
      "25 small meshes: boxes, plates, needles, balls, a torus, a gear, and random ones of integer "
      "coordinates, some of several components and with cavities. Degenerate poses put corners on "
      "corners and edges, by turns that keep faces parallel or not, some of them next to that by "
      "1e-16 to 1e-3, some turned as a whole. The gap of the overlap's surface is bounded by 2e-17 "
      "of the product of the solids' sizes for each crossing pair of triangles and a hundred "
      "more.");
  report.remark(
      "Mates: extruded profiles face on face, coaxial, in place, in channels, at the mate and 1e-9 "
      "to "
      "0.1 to both sides, as they lie or turned as a whole; volumes and areas of contact follow "
      "from "
      "plane geometry.");
  return report.write() != 0 || !sound ? 1 : 0;
}
