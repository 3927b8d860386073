#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "query/scratch/workspace.h"

namespace ist {

struct NodePair {
  std::uint32_t a, b;
  int level_a, level_b;
};

/// A best-first queue of node pairs: a sorted run of children for each opened pair, so that the
/// best pair is the best of the runs' heads.
class OpenRuns {
 public:
  static constexpr std::uint32_t kMostVisits = 256;

  explicit OpenRuns(Workspace::Impl& scratch) noexcept
      : ranked_(scratch.ranked.get()),
        visits_left_(static_cast<std::uint32_t>(
            std::min<std::size_t>(kMostVisits, scratch.capacity / kWidth))) {}

  /// Opens pairs from `pair` on. open(pair) adds children; it returns true if the solids certainly
  /// overlap. `covers_touch`: touching covers were found. The answer is not `no` then, so pairs
  /// that touch only by their covers are skipped.
  template <class Open>
  YesNo search(NodePair pair, const bool& covers_touch, const Open& open) noexcept {
    do {
      if (visits_left_-- == 0) return YesNo::unknown;
      if (open(pair)) return YesNo::yes;
    } while (pop_best(covers_touch, pair));
    return covers_touch ? YesNo::unknown : YesNo::no;
  }

  /// Begins the children of `parent`'s node in A, or in B.
  void start(const NodePair& parent, bool of_a) noexcept {
    parent_ = parent;
    of_a_ = of_a;
    begin_ = size_;
  }

  /// `key` ≥ 0: the least is opened first, preferring deeper nodes. Nodes that touch only by their
  /// covers (`spheres_touch` false) come last.
  void add(std::uint32_t lane, double key, bool spheres_touch) noexcept {
    const std::uint32_t child = kWidth * (of_a_ ? parent_.a : parent_.b) + lane;
    const double bound =
        spheres_touch ? key + kPerLevel * (parent_.level_a + parent_.level_b) : kLast + key;
    std::uint32_t place = size_++;
    for (; place > begin_ && ranked_[place - 1].bound > bound; --place)
      ranked_[place] = ranked_[place - 1];
    ranked_[place] =
        of_a_ ? RankedPair{bound, child, parent_.b} : RankedPair{bound, parent_.a, child};
  }

  void finish() noexcept {
    if (size_ == begin_) return;
    heads_[runs_] = ranked_[begin_].bound;
    run_[runs_++] = {begin_, size_, static_cast<std::int16_t>(parent_.level_a - (of_a_ ? 1 : 0)),
                     static_cast<std::int16_t>(parent_.level_b - (of_a_ ? 0 : 1))};
  }

 private:
  /// Pops the best; false if there is none, or if `without_last` and only the last ones remain.
  bool pop_best(bool without_last, NodePair& best) noexcept {
    if (runs_ == 0) return false;
    std::uint32_t least = 0;
    for (std::uint32_t i = 1; i < runs_; ++i)
      if (heads_[i] < heads_[least]) least = i;
    if (without_last && heads_[least] >= kLast / 2) return false;
    Run& run = run_[least];
    const RankedPair& pair = ranked_[run.begin];
    best = {pair.a, pair.b, run.level_a, run.level_b};
    if (++run.begin < run.end) {
      heads_[least] = ranked_[run.begin].bound;
    } else {
      run = run_[--runs_];
      heads_[least] = heads_[runs_];
    }
    return true;
  }

  // Added to the distance over the sum of radii per level above the leaves (measured on the
  // oracle's poses).
  static constexpr double kPerLevel = 0.1;
  static constexpr double kLast = 1e6;

  struct Run {
    std::uint32_t begin, end;
    std::int16_t level_a, level_b;
  };

  RankedPair* const ranked_;
  std::uint32_t visits_left_;
  std::uint32_t size_ = 0, begin_ = 0, runs_ = 0;
  NodePair parent_ = {};
  bool of_a_ = true;
  std::array<double, kMostVisits> heads_;
  std::array<Run, kMostVisits> run_;
};

}  // namespace ist
