// A hundred million queries over random pairs of assets, poses, scales and limits, each asked twice
// by other threads in another order: the same bits both times, nothing that is not a number, bounds
// in order, and no memory that grows. `./dev soak queries` runs it and writes its report.

#include <ist/bake.h>
#include <ist/query.h>

#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "mesh/samples/samples.h"
#include "report.h"
#include "support/answer_bits.h"
#include "support/query_settings.h"
#include "support/random_assets.h"

namespace {

using namespace ist;

constexpr std::size_t kChunk = 1000;  // queries drawn from one stream of random numbers
constexpr std::size_t kRounds = 10;

/// Forbidden events, and their counts; summed over threads.
struct Tally {
  std::uint64_t not_numbers = 0;    ///< answers with NaN, or with Inf where that means nothing
  std::uint64_t disordered = 0;     ///< a value outside its own bounds, or a negative one
  std::uint64_t not_contained = 0;  ///< stopped answers whose bounds miss the finished one
  std::uint64_t patches_lost = 0;   ///< contact patches that do not sum to the whole
  std::uint64_t answered = 0;       ///< numbers of an invalid pose
  std::uint64_t finished = 0, stopped = 0, invalid = 0;

  void operator+=(const Tally& other) {
    not_numbers += other.not_numbers;
    disordered += other.disordered;
    not_contained += other.not_contained;
    patches_lost += other.patches_lost;
    finished += other.finished;
    stopped += other.stopped;
    invalid += other.invalid;
    answered += other.answered;
  }
};

constexpr std::size_t kMadeUp = 6;  // assets whose inner spheres overlap each other: no packings

/// Small assets, so that a hundred million answers take minutes: made-up ones with levels of
/// detail, far from their origin and of odd sizes, and bakes of samples.
std::vector<Asset> make_assets() {
  std::vector<Asset> assets;
  const testing::RandomAsset kinds[kMadeUp] = {
      {.spheres = 1},
      {.spheres = 17, .smallest = 0.5},
      {.spheres = 64, .smallest = 0.05, .details = 1},
      {.spheres = 300, .smallest = 0.2, .details = 2},
      {.spheres = 200, .smallest = 0.01, .centre = {3, -2, 1}, .exponent = 1},
      {.spheres = 100, .smallest = 0.3, .centre = {}, .exponent = -2},
  };
  for (const testing::RandomAsset& kind : kinds)
    assets.push_back(testing::make_random_asset(kind, static_cast<unsigned>(assets.size() + 1)));
  for (const char* const sample : {"cube", "gear", "torus_knot"}) {
    PackingSettings settings;
    settings.max_spheres = 200;
    settings.device = Device::cpu;
    assets.push_back(bake(close_mesh(make_sample(sample), sample), settings));
  }
  return assets;
}

/// One thread's scratch. The small workspace stops queries before they end.
struct Worker {
  Workspace large{1u << 12}, small{48};
  Tally tally;
};

/// The queries of one chunk: always the same ones.
class Chunk {
 public:
  Chunk(const std::vector<Asset>& assets, std::size_t index, Worker& worker)
      : assets_(assets), random_(0x9e3779b97f4a7c15u * (index + 1)), worker_(worker) {}

  std::uint64_t hash() {
    for (std::size_t i = 0; i < kChunk; ++i) ask();
    return bits_.value();
  }

 private:
  bool one_in(unsigned n) { return random_() % n == 0; }
  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  PlacedAsset placed(const Asset& asset) {
    PlacedAsset tree{asset.view(), {}, 1};
    if (one_in(16)) tree.scale = std::pow(10, uniform(-3, 3));
    if (!one_in(64)) tree.pose = testing::random_pose(random_, uniform(0, 3));  // else coincident
    if (one_in(512)) tree.pose.t[random_() % 3] = std::numeric_limits<double>::quiet_NaN();
    if (one_in(512)) tree.pose.q[random_() % 4] = std::numeric_limits<double>::infinity();
    if (one_in(512)) tree.pose.t[random_() % 3] = uniform(-1, 1) * 1e30;
    return tree;
  }

  PenetrationSettings limits() {
    PenetrationSettings settings;
    settings.measure = one_in(3) ? Measure::inner : Measure::matched;
    if (one_in(3)) return settings;
    if (one_in(2)) settings.max_visits = static_cast<std::uint32_t>(std::pow(10, uniform(0, 2)));
    if (one_in(4)) settings.relative_error = std::pow(10, uniform(-4, 0));
    if (one_in(4)) settings.pair_budget = static_cast<std::uint32_t>(1 + random_() % 2000);
    return settings;
  }

  void ask() {
    const std::size_t which_a = random_() % assets_.size();
    const std::size_t which_b = random_() % assets_.size();
    const PlacedAsset a = placed(assets_[which_a]);
    PlacedAsset b = placed(assets_[which_b]);
    if (one_in(64)) {  // a copy, all but at the same place
      b = a;
      b.pose.t[random_() % 3] += std::pow(10, uniform(-9, 0));
    }
    const PenetrationSettings settings = limits();
    Workspace& workspace = one_in(8) ? worker_.small : worker_.large;
    switch (random_() % 8) {
      case 0: {
        const Separation answer = separation(a, b, testing::for_separation(settings), workspace);
        look_at(answer);
        bits_.add(answer);
        break;
      }
      case 1: {
        const auto [volume, gap] = query(a, b, testing::for_both(settings), workspace);
        look_at(volume);
        look_at(gap);
        bits_.add(volume), bits_.add(gap);
        break;
      }
      case 2: {
        ContactPatch patches[8];
        const std::span<ContactPatch> found(patches, 1 + random_() % 8);
        const ContactPatches answer = contact_patches(a, b, settings, workspace, found);
        look_at(answer, found);
        bits_.add(answer.penetration), bits_.add(std::uint64_t{answer.count});
        break;
      }
      default: {
        const bool compare = one_in(8);
        const Penetration answer = penetration(a, b, settings, workspace);
        look_at(answer);
        bits_.add(answer);
        if (settings.measure == Measure::matched && settings.pair_budget == 0) {
          const Penetration hard = without_protrusion(answer, a, b);
          look_at(hard);
          bits_.add(hard);
        }
        // A level of detail is another sum: its bounds are on that one. Bounds on the inner measure
        // hold for spheres that do not overlap.
        const bool bounded = settings.pair_budget == 0 && (settings.measure == Measure::matched ||
                                                           std::min(which_a, which_b) >= kMadeUp);
        if (compare && bounded && answer.status == QueryStatus::budget_exhausted)
          look_at_finished(answer, a, b, settings);
      }
    }
  }

  void look_at(const Penetration& p) {
    Tally& tally = worker_.tally;
    if (p.status == QueryStatus::invalid_input) {
      ++tally.invalid;
      if (!std::isnan(p.volume) || !std::isnan(p.centroid.sum())) ++tally.answered;
      return;
    }
    if (!std::isfinite(p.volume) || !std::isfinite(p.volume_min) || !std::isfinite(p.volume_max) ||
        !p.centroid.allFinite() || !p.force.allFinite() || !p.torque.allFinite())
      ++tally.not_numbers;
    if (!(0 <= p.volume_min && p.volume_min <= p.volume && p.volume <= p.volume_max))
      ++tally.disordered;
    ++(p.status == QueryStatus::ok ? tally.finished : tally.stopped);
  }

  void look_at(const Separation& s) {
    Tally& tally = worker_.tally;
    if (s.status == QueryStatus::invalid_input) {
      ++tally.invalid;
      if (!std::isnan(s.distance) || !std::isnan(s.normal.sum())) ++tally.answered;
      return;
    }
    if (!std::isfinite(s.distance) || !std::isfinite(s.distance_min) ||
        !std::isfinite(s.distance_max) || !s.point_a.allFinite() || !s.point_b.allFinite() ||
        !s.normal.allFinite())
      ++tally.not_numbers;
    if (!(0 <= s.distance_min && s.distance_min <= s.distance_max)) ++tally.disordered;
    ++(s.status == QueryStatus::ok ? tally.finished : tally.stopped);
  }

  void look_at(const ContactPatches& answer, std::span<const ContactPatch> patches) {
    look_at(answer.penetration);
    double volume = 0;
    for (const ContactPatch& patch : patches.first(answer.count)) {
      volume += patch.volume;
      if (!std::isfinite(patch.depth) || !patch.force.allFinite() || !patch.torque.allFinite() ||
          !patch.centroid.allFinite() || !patch.normal.allFinite())
        ++worker_.tally.not_numbers;
    }
    const double whole = answer.penetration.volume;
    if (std::isnan(whole) ? answer.count != 0 : !(std::abs(volume - whole) <= 1e-12 * whole))
      ++worker_.tally.patches_lost;
  }

  void look_at_finished(const Penetration& stopped, const PlacedAsset& a, const PlacedAsset& b,
                        PenetrationSettings settings) {
    settings.max_visits = 0;
    const Penetration finished = penetration(a, b, settings, worker_.large);
    if (finished.status != QueryStatus::ok && finished.status != QueryStatus::error_exceeded)
      return;
    if (finished.volume_max < stopped.volume_min || finished.volume_min > stopped.volume_max)
      ++worker_.tally.not_contained;
  }

  const std::vector<Asset>& assets_;
  std::mt19937_64 random_;
  Worker& worker_;
  testing::AnswerBits bits_;
};

/// The hashes of chunks [first, first + hashes.size()), by as many threads as workers; backwards
/// the last chunks come first.
void ask_chunks(const std::vector<Asset>& assets, std::size_t first, bool backwards,
                std::span<Worker> workers, std::span<std::uint64_t> hashes) {
  std::atomic<std::size_t> next = 0;
  std::vector<std::jthread> threads;
  for (Worker& worker : workers)
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < hashes.size(); i = next++) {
        const std::size_t at = backwards ? hashes.size() - 1 - i : i;
        hashes[at] = Chunk(assets, first + at, worker).hash();
      }
    });
}

double resident_mib() {
  std::size_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) / 1048576;
}

struct Round {
  std::size_t threads = 0, threads_again = 0, different_chunks = 0;
  double seconds = 0, resident_mib = 0;
  std::size_t heap_bytes = 0;  ///< in use
  std::uint64_t hash = 0;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Report report("query_soak", argc, argv);
  const std::size_t queries = report.quick() ? 100'000 : 100'000'000;
  const std::size_t chunks = queries / kChunk / kRounds;
  const std::size_t cores = std::max(2u, std::thread::hardware_concurrency());
  const std::vector<Asset> assets = make_assets();
  std::vector<Worker> workers(2 * cores);
  std::vector<std::uint64_t> once(chunks), again(chunks);
  std::vector<Round> rounds(kRounds);

  for (std::size_t i = 0; i < kRounds; ++i) {
    Round& round = rounds[i];
    const auto start = std::chrono::steady_clock::now();
    round.threads = cores;
    round.threads_again = 1 + (i * 7) % workers.size();
    ask_chunks(assets, i * chunks, false, std::span(workers).first(round.threads), once);
    ask_chunks(assets, i * chunks, true, std::span(workers).last(round.threads_again), again);
    round.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (std::size_t c = 0; c < chunks; ++c) round.different_chunks += once[c] != again[c] ? 1 : 0;
    round.hash = XXH3_64bits(once.data(), chunks * sizeof once[0]);
    round.resident_mib = resident_mib();
    round.heap_bytes = mallinfo2().uordblks;
    std::fprintf(stderr, "round %zu of %zu: %.1f s\n", i + 1, kRounds, round.seconds);
  }

  std::size_t different = 0;
  for (const Round& round : rounds) {
    char hash[17];
    std::snprintf(hash, sizeof hash, "%016" PRIx64, round.hash);
    report.row("Rounds", {{"queries", 2 * chunks * kChunk},
                          {"threads", round.threads},
                          {"threads, asked again", round.threads_again},
                          {"hash", hash},
                          {"chunks that differ", round.different_chunks},
                          {"seconds", round.seconds},
                          {"resident [MiB]", round.resident_mib},
                          {"heap in use [bytes]", round.heap_bytes}});
    different += round.different_chunks;
  }
  Tally tally;
  for (const Worker& worker : workers) tally += worker.tally;
  report.row("Answers", {{"finished", tally.finished},
                         {"stopped by a limit", tally.stopped},
                         {"invalid pose", tally.invalid}});
  bool sound = true;
  const auto none = [&](const std::string& what, double value) {
    report.target(what, std::max(value, 0.0), 0, true);
    sound = sound && value <= 0;
  };
  none("chunks of 1,000 queries whose bits differ when asked again",
       static_cast<double>(different));
  none("answers that are not numbers", static_cast<double>(tally.not_numbers));
  none("numbers for an invalid pose", static_cast<double>(tally.answered));
  none("values outside their own bounds", static_cast<double>(tally.disordered));
  none("stopped answers whose bounds miss the finished one",
       static_cast<double>(tally.not_contained));
  none("contact patches that do not sum to the whole", static_cast<double>(tally.patches_lost));
  // Threads come and go with a few kilobytes of their own.
  none("growth of the heap from the first round to the last beyond 64 KiB [bytes]",
       static_cast<double>(rounds.back().heap_bytes) -
           static_cast<double>(rounds[0].heap_bytes + 65536));
  // Threads touch pages of their scratch memory and stacks for the first time, in any round of so
  // few queries: that is no growth.
  if (!report.quick())
    none("growth of resident memory in the second half beyond 1 MiB [MiB]",
         rounds.back().resident_mib - rounds[kRounds / 2].resident_mib - 1);
  report.remark(
      "Each query is asked twice, the second time by other threads in the opposite order. Assets "
      "of "
      "1 … 300 spheres, random and baked; random poses, scales 1e-3 … 1e3, measures, limits and "
      "workspaces, with poses that are coincident, NaN, Inf or 1e30 u away among them.");
  return report.write() != 0 || !sound ? 1 : 0;
}
