#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <ist/types.h>
#include "base/bits.h"

namespace ist {

struct BodyBlock;

/// A box along the axes; floats, rounded outward.
struct SceneBox {
  std::array<float, 3> low, high;

  SceneBox united(const SceneBox& other) const noexcept {
    SceneBox out;
    for (std::size_t k = 0; k < 3; ++k) {
      out.low[k] = std::min(low[k], other.low[k]);
      out.high[k] = std::max(high[k], other.high[k]);
    }
    return out;
  }
  bool operator==(const SceneBox&) const = default;
  /// Half its surface, for comparing finite boxes.
  double area() const noexcept {
    const double x = double{high[0]} - low[0], y = double{high[1]} - low[1],
                 z = double{high[2]} - low[2];
    return x * y + y * z + z * x;
  }
};

/// Eight boxes of a hierarchy, each of a body or of a node below.
struct alignas(64) BoxNode {
  static constexpr std::uint32_t kLanes = 8;
  static constexpr std::uint32_t kNone = ~0u;

  float low[3][kLanes], high[3][kLanes];    ///< an unused lane meets nothing
  std::uint32_t child[kLanes];              ///< a body's number, or a node's
  std::uint32_t used = 0, bodies = 0;       ///< a bit a lane
  std::uint32_t parent = kNone, place = 0;  ///< the lane there

  BoxNode() noexcept {
    for (std::uint32_t k = 0; k < kLanes; ++k) clear(k);
  }
  void clear(std::uint32_t k) noexcept {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    set(k, {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}});
    child[k] = kNone;
    used &= ~(1u << k);
    bodies &= ~(1u << k);
  }
  void set(std::uint32_t k, const SceneBox& box) noexcept {
    for (std::size_t c = 0; c < 3; ++c) {
      low[c][k] = box.low[c];
      high[c][k] = box.high[c];
    }
  }
  bool is_body(std::uint32_t k) const noexcept { return (bodies >> k & 1) != 0; }
  bool is_leaf() const noexcept { return bodies == used; }
  SceneBox box(std::uint32_t k) const noexcept {
    return {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}};
  }
  SceneBox whole() const noexcept {
    SceneBox all = box(0);
    for (std::uint32_t k = 1; k < kLanes; ++k) all = all.united(box(k));
    return all;
  }
  /// A bit a lane.
  std::uint32_t meeting(const SceneBox& box) const noexcept {
    const auto four = [](const float* from) { return *reinterpret_cast<const Four*>(from); };
    const auto meet = [&](std::uint32_t k) {
      const Four zero{};
      return (four(low[0] + k) <= box.high[0] + zero) & (four(high[0] + k) >= box.low[0] + zero) &
             (four(low[1] + k) <= box.high[1] + zero) & (four(high[1] + k) >= box.low[1] + zero) &
             (four(low[2] + k) <= box.high[2] + zero) & (four(high[2] + k) >= box.low[2] + zero);
    };
    using Bits = decltype(meet(0));
    const Bits bits = (meet(0) & Bits{1, 2, 4, 8}) | (meet(4) & Bits{16, 32, 64, 128});
    return static_cast<std::uint32_t>(bits[0] | bits[1] | bits[2] | bits[3]);
  }

 private:
  /// A vector of g++ and clang++, on every machine.
  using Four [[gnu::vector_size(4 * sizeof(float)), gnu::may_alias]] = float;
};
static_assert(sizeof(BoxNode) == 256);

/// Two nodes with the pairs of lanes that are still to be examined; at most one lane of a pair is a
/// body.
struct LanePairs {
  std::uint32_t a, b;
  std::uint64_t left;  ///< bit 8 · (A's lane) + (B's lane)
};
struct BodyPair {
  std::uint32_t a, b;
};
/// A search for pairs in two hierarchies, or in one: then within each of its nodes, and below the
/// pairs found there.
struct PairSearch {
  static constexpr std::size_t kMost = 1024;

  const BoxNode *a, *b;
  std::uint32_t root_a, root_b;
  LanePairs* stack;   ///< holds the depths of both hierarchies
  std::uint32_t end;  ///< nodes of one hierarchy; 1 for two
  std::uint32_t next = 0;
  std::size_t depth = 0;
};
/// Pairs of bodies whose boxes meet, once each: at most kMost of those that no call returned
/// before. Returns their number: 0 at the end.
std::size_t next_pairs(PairSearch& search, BodyPair* out) noexcept;

/// Sets the boxes of nodes in those of their parents, which stand before them. Returns the sum of
/// the nodes' areas.
double refit_nodes(std::span<BoxNode> nodes) noexcept;

/// Writes the poses of a block's bodies, and their boxes into the nodes that have them; false if
/// floats do not hold all of these. lane_of: as BoxTree has it.
bool put_poses(const Pose* poses, BodyBlock& block, const std::uint32_t* lane_of,
               BoxNode* nodes) noexcept;

/// A hierarchy of boxes, eight a node. Its shape changes no answer.
class BoxTree {
 public:
  static constexpr std::uint32_t kNone = BoxNode::kNone;
  static constexpr std::uint32_t kLanes = BoxNode::kLanes;

  /// Memory for `most` bodies, whose numbers are lower.
  explicit BoxTree(std::size_t most) { take_room(most); }
  void take_room(std::size_t most);

  std::uint32_t size() const noexcept { return leaves_; }
  /// settle() is cheaper than this for many bodies.
  void add(std::uint32_t body, const SceneBox& box) noexcept;
  void remove(std::uint32_t body) noexcept;
  /// Sets the box of a body and those above it.
  void move(std::uint32_t body, const SceneBox& box) noexcept {
    const std::uint32_t lane = lane_of_[body];
    nodes_[lane / kLanes].set(lane % kLanes, box);
    fit_above(lane / kLanes);
  }
  /// Sets the boxes of some of the bodies from `first` on; no queries until refit().
  void put(std::uint32_t first, std::uint32_t of, const float (&low)[3][kLanes],
           const float (&high)[3][kLanes]) noexcept {
    for (const std::uint32_t k : set_bits(of)) {
      const std::uint32_t lane = lane_of_[first + k];
      BoxNode& node = nodes_[lane / kLanes];
      for (std::size_t c = 0; c < 3; ++c) {
        node.low[c][lane % kLanes] = low[c][k];
        node.high[c][lane % kLanes] = high[c][k];
      }
    }
  }
  /// As put(), of all bodies of a block, which get these poses.
  bool put_poses(std::uint32_t first, BodyBlock& block, const Pose* poses) noexcept {
    return ist::put_poses(poses, block, lane_of_.data() + first, nodes_.data());
  }
  SceneBox box_of(std::uint32_t body) const noexcept {
    const std::uint32_t lane = lane_of_[body];
    return nodes_[lane / kLanes].box(lane % kLanes);
  }
  /// Refits all boxes above those of bodies, and rebuilds if they have grown too much.
  void refit() noexcept;
  /// Rebuilds if many were added.
  void settle() noexcept {
    if (2 * added_ > leaves_) build();
  }

  /// visit(body) of the leaves below the boxes that enter(box) lets in; it may be called again for
  /// a box.
  template <class Enter, class Visit>
  void each(const Enter& enter, const Visit& visit) const noexcept {
    visit_lanes(
        [&](const BoxNode& node) {
          std::uint32_t lanes = 0;
          for (std::uint32_t k = 0; k < kLanes; ++k)
            if ((node.used >> k & 1) != 0 && enter(node.box(k))) lanes |= 1u << k;
          return lanes;
        },
        visit);
  }
  /// visit(body) of the leaves whose boxes meet this one.
  template <class Visit>
  void each_meeting(const SceneBox& box, const Visit& visit) const noexcept {
    visit_lanes([&](const BoxNode& node) { return node.meeting(box); }, visit);
  }
  /// visit(k, body) of the leaves whose boxes meet the k-th. Nodes of one box are fetched while
  /// those of others are examined: a large hierarchy is not in the cache.
  template <class Visit>
  void each_meeting(std::span<const SceneBox> boxes, const Visit& visit) const noexcept {
    if (root_ == kNone) return;
    constexpr std::uint32_t kCapacity = 256;
    struct Waiting {
      std::uint32_t node, box;
    } waiting[kCapacity];
    std::uint32_t first = 0, end = 0, begun = 0;
    while (first != end || begun < boxes.size()) {
      while (begun < boxes.size() && end - first < kCapacity / 8)
        waiting[end++ % kCapacity] = {root_, begun++};
      const std::uint32_t at = waiting[first % kCapacity].node, k = waiting[first % kCapacity].box;
      ++first;
      const SceneBox& box = boxes[k];
      for (const std::uint32_t lane : set_bits(nodes_[at].meeting(box))) {
        const std::uint32_t child = nodes_[at].child[lane];
        if (nodes_[at].is_body(lane)) {
          visit(k, child);
        } else if (end - first < kCapacity) {
          for (std::size_t line = 0; line < sizeof(BoxNode); line += 64)
            __builtin_prefetch(reinterpret_cast<const char*>(&nodes_[child]) + line);
          waiting[end++ % kCapacity] = {child, k};
        } else {
          visit_lanes([&](const BoxNode& node) { return node.meeting(box); },
                      [&](std::uint32_t body) { visit(k, body); }, child);
        }
      }
    }
  }

  /// visit(pairs) of all pairs of bodies whose boxes meet, once each and some at a time: of this
  /// hierarchy, or one of each.
  template <class Visit>
  void pairs_with(const BoxTree& other, const Visit& visit) noexcept {
    if (root_ == kNone || other.root_ == kNone) return;
    const auto end = this == &other ? static_cast<std::uint32_t>(nodes_.size()) : 1;
    PairSearch search{nodes_.data(), other.nodes_.data(), root_, other.root_, stack_.data(), end};
    BodyPair some[PairSearch::kMost];
    while (const std::size_t count = next_pairs(search, some))
      visit(std::span<const BodyPair>(some, count));
  }

 private:
  template <class LanesOf, class Visit>
  void visit_lanes(const LanesOf& lanes_of, const Visit& visit) const noexcept {
    if (root_ != kNone) visit_lanes(lanes_of, visit, root_);
  }
  template <class LanesOf, class Visit>
  void visit_lanes(const LanesOf& lanes_of, const Visit& visit, std::uint32_t from) const noexcept {
    std::uint32_t at = from, lanes = lanes_of(nodes_[at]);
    // Depth first without a stack, by the parents' links.
    for (;;) {
      if (lanes == 0) {
        if (at == from) return;
        const BoxNode& done = nodes_[at];
        at = done.parent;
        lanes = lanes_of(nodes_[at]) & ~((2u << done.place) - 1);
        continue;
      }
      const auto lane = static_cast<std::uint32_t>(std::countr_zero(lanes));
      const std::uint32_t child = nodes_[at].child[lane];
      lanes &= lanes - 1;
      if (nodes_[at].is_body(lane)) {
        visit(child);
      } else {
        at = child;
        lanes = lanes_of(nodes_[at]);
      }
    }
  }

  struct Leaf {
    SceneBox box;
    std::uint32_t body;
  };
  std::uint32_t take_node() noexcept;
  void fit_above(std::uint32_t node) noexcept;
  void hang(std::uint32_t node, std::uint32_t lane, std::uint32_t child, bool is_body,
            const SceneBox& box) noexcept;
  void build() noexcept;
  static void part(Leaf* first, Leaf* at, Leaf* last) noexcept;
  std::uint32_t build(Leaf* first, Leaf* last) noexcept;

  std::vector<BoxNode> nodes_;
  std::vector<std::uint32_t> lane_of_;  ///< of a body: 8 · node + lane
  std::vector<std::uint32_t> free_;
  std::vector<Leaf> order_;
  std::vector<LanePairs> stack_;
  std::uint32_t root_ = kNone, leaves_ = 0;
  double built_area_ = 0;  ///< of all nodes, when they were built
  std::size_t added_ = 0;  ///< since
  bool in_order_ = true;   ///< no node was removed, and each precedes those below it
};

}  // namespace ist
