#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace ist {

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
  /// Half its surface; finite boxes alone are compared by it.
  double area() const noexcept {
    const double x = double{high[0]} - low[0], y = double{high[1]} - low[1],
                 z = double{high[2]} - low[2];
    return x * y + y * z + z * x;
  }
};

/// A hierarchy of boxes, four a node. Its shape changes no answer.
class BoxTree {
 public:
  static constexpr std::uint32_t kNone = ~0u;
  static constexpr std::uint32_t kLanes = 4;

  /// Memory for `most` bodies, whose numbers are lower.
  explicit BoxTree(std::size_t most) { take_room(most); }
  void take_room(std::size_t most);

  std::uint32_t size() const noexcept { return leaves_; }
  /// Many that are added in a row are cheaper to settle() at once.
  void add(std::uint32_t body, const SceneBox& box) noexcept;
  void remove(std::uint32_t body) noexcept;
  /// Sets the box of a body and those above it.
  void move(std::uint32_t body, const SceneBox& box) noexcept {
    const std::uint32_t lane = lane_of_[body];
    nodes_[lane / kLanes].set(lane % kLanes, box);
    fit_above(lane / kLanes);
  }
  /// Sets the box of a body alone: until refit() nothing may be asked.
  void put(std::uint32_t body, const SceneBox& box) noexcept {
    const std::uint32_t lane = lane_of_[body];
    nodes_[lane / kLanes].set(lane % kLanes, box);
  }
  SceneBox box_of(std::uint32_t body) const noexcept {
    const std::uint32_t lane = lane_of_[body];
    return nodes_[lane / kLanes].box(lane % kLanes);
  }
  /// Sets all boxes above those of bodies, and builds anew where they have grown too much.
  void refit() noexcept;
  /// Builds anew where many were added.
  void settle() noexcept {
    if (2 * added_ > leaves_) build();
  }

  /// visit(body) of the leaves below the boxes that enter(box) lets in; it may be asked again of a
  /// box.
  template <class Enter, class Visit>
  void each(const Enter& enter, const Visit& visit) const noexcept {
    visit_lanes(
        [&](const Node& node) {
          std::uint32_t lanes = 0;
          for (std::uint32_t k = 0; k < kLanes; ++k)
            if (node.child[k] != kNone && enter(node.box(k))) lanes |= 1u << k;
          return lanes;
        },
        visit);
  }
  /// visit(body) of the leaves whose boxes meet this one.
  template <class Visit>
  void each_meeting(const SceneBox& box, const Visit& visit) const noexcept {
    visit_lanes([&](const Node& node) { return node.meeting(box); }, visit);
  }
  /// visit(k, body) of the leaves whose boxes meet the k-th. Nodes of one box are fetched while
  /// those of others are looked at: a large hierarchy is not in the cache.
  template <class Visit>
  void each_meeting(std::span<const SceneBox> boxes, const Visit& visit) const noexcept {
    if (root_ == kNone) return;
    constexpr std::uint32_t kRoom = 256;
    struct Waiting {
      std::uint32_t node, box;
    } waiting[kRoom];
    std::uint32_t first = 0, end = 0, begun = 0;
    while (first != end || begun < boxes.size()) {
      while (begun < boxes.size() && end - first < kRoom / 8)
        waiting[end++ % kRoom] = {root_, begun++};
      const std::uint32_t at = waiting[first % kRoom].node, k = waiting[first % kRoom].box;
      ++first;
      const SceneBox& box = boxes[k];
      for (std::uint32_t lanes = nodes_[at].meeting(box); lanes != 0; lanes &= lanes - 1) {
        const std::uint32_t child = nodes_[at].child[std::countr_zero(lanes)];
        if (is_leaf(child)) {
          visit(k, child & ~kLeaf);
        } else if (end - first < kRoom) {
          __builtin_prefetch(&nodes_[child]);
          __builtin_prefetch(reinterpret_cast<const char*>(&nodes_[child]) + 64);
          waiting[end++ % kRoom] = {child, k};
        } else {
          visit_lanes([&](const Node& node) { return node.meeting(box); },
                      [&](std::uint32_t body) { visit(k, body); }, child);
        }
      }
    }
  }

  /// visit(body, body) of all pairs of leaves whose boxes meet, once each.
  template <class Visit>
  void pairs_within(const Visit& visit) noexcept {
    if (root_ != kNone) go_on(*this, visit);
  }
  /// The same of one leaf of this and one of another tree.
  template <class Visit>
  void pairs_with(const BoxTree& other, const Visit& visit) noexcept {
    if (root_ != kNone && other.root_ != kNone) go_on(other, visit);
  }

 private:
  /// A child is a node's number, or a body's with this bit.
  static constexpr std::uint32_t kLeaf = 1u << 31;
  static bool is_leaf(std::uint32_t child) noexcept { return (child & kLeaf) != 0; }

  /// A vector of g++ and clang++, on every machine.
  using Four [[gnu::vector_size(4 * sizeof(float))]] = float;

  struct alignas(64) Node {
    Four low[3], high[3];  ///< of none: nothing meets it
    std::uint32_t child[kLanes];
    std::uint32_t parent, place;  ///< the lane there

    Node() noexcept : parent(kNone), place(0) {
      for (std::uint32_t k = 0; k < kLanes; ++k) clear(k);
    }
    void clear(std::uint32_t k) noexcept {
      constexpr float kFar = std::numeric_limits<float>::infinity();
      set(k, {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}});
      child[k] = kNone;
    }
    void set(std::uint32_t k, const SceneBox& box) noexcept {
      for (std::size_t c = 0; c < 3; ++c) {
        low[c][k] = box.low[c];
        high[c][k] = box.high[c];
      }
    }
    SceneBox box(std::uint32_t k) const noexcept {
      return {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}};
    }
    SceneBox whole() const noexcept { return box(0).united(box(1)).united(box(2).united(box(3))); }
    std::uint32_t used() const noexcept {
      return (child[0] != kNone ? 1u : 0u) | (child[1] != kNone ? 2u : 0u) |
             (child[2] != kNone ? 4u : 0u) | (child[3] != kNone ? 8u : 0u);
    }
    /// A bit a lane.
    std::uint32_t meeting(const SceneBox& box) const noexcept {
      const Four l0 = box.low[0] - Four{}, l1 = box.low[1] - Four{}, l2 = box.low[2] - Four{};
      const auto meet = (low[0] <= box.high[0] + Four{}) & (high[0] >= l0) &
                        (low[1] <= box.high[1] + Four{}) & (high[1] >= l1) &
                        (low[2] <= box.high[2] + Four{}) & (high[2] >= l2);
      const auto bits = meet & decltype(meet){1, 2, 4, 8};
      return static_cast<std::uint32_t>(bits[0] | bits[1] | bits[2] | bits[3]);
    }
  };
  /// Two nodes, or a node with itself, or a node and a leaf's lane; and of their lanes the pairs
  /// that are still to be looked at.
  struct Two {
    std::uint32_t a, b;
    bool leaf_a, leaf_b;
    std::uint16_t left;  ///< bit 4 · (A's lane) + (B's lane); of a leaf lane 0 alone
  };

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
        const Node& done = nodes_[at];
        at = done.parent;
        lanes = lanes_of(nodes_[at]) & ~((2u << done.place) - 1);
        continue;
      }
      const std::uint32_t child = nodes_[at].child[std::countr_zero(lanes)];
      lanes &= lanes - 1;
      if (is_leaf(child)) {
        visit(child & ~kLeaf);
      } else {
        at = child;
        lanes = lanes_of(nodes_[at]);
      }
    }
  }

  /// All pairs of lanes of two nodes that meet.
  static std::uint16_t meeting(const Node& a, const Node& b) noexcept {
    std::uint32_t out = 0;
    for (std::uint32_t i = 0; i < kLanes; ++i)
      if (a.child[i] != kNone) out |= b.meeting(a.box(i)) << kLanes * i;
    return static_cast<std::uint16_t>(out);
  }
  /// Of a node with itself: each pair once, and nodes with themselves.
  static std::uint16_t meeting(const Node& node) noexcept {
    std::uint32_t out = 0;
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      if (node.child[i] == kNone) continue;
      out |= (node.meeting(node.box(i)) & ~((2u << i) - 1)) << kLanes * i;
      if (!is_leaf(node.child[i])) out |= 1u << (kLanes + 1) * i;
    }
    return static_cast<std::uint16_t>(out);
  }

  template <class Visit>
  void go_on(const BoxTree& other, const Visit& visit) noexcept {
    const bool same = this == &other;
    const std::vector<Node>&of_a = nodes_, &of_b = other.nodes_;
    stack_.clear();
    stack_.push_back({root_, other.root_, false, false,
                      same ? meeting(of_a[root_]) : meeting(of_a[root_], of_b[other.root_])});
    while (!stack_.empty()) {
      Two& two = stack_.back();
      if (two.left == 0) {
        stack_.pop_back();
        continue;
      }
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(two.left));
      two.left = static_cast<std::uint16_t>(two.left & (two.left - 1));
      // Lanes of nodes; a leaf's is its own.
      const std::uint32_t a = two.leaf_a ? two.a : kLanes * two.a + bit / kLanes;
      const std::uint32_t b = two.leaf_b ? two.b : kLanes * two.b + bit % kLanes;
      const std::uint32_t child_a = of_a[a / kLanes].child[a % kLanes];
      const std::uint32_t child_b = of_b[b / kLanes].child[b % kLanes];
      if (is_leaf(child_a) && is_leaf(child_b)) {
        visit(child_a & ~kLeaf, child_b & ~kLeaf);
      } else if (is_leaf(child_a)) {
        const std::uint32_t lanes = of_b[child_b].meeting(of_a[a / kLanes].box(a % kLanes));
        stack_.push_back({a, child_b, true, false, static_cast<std::uint16_t>(lanes)});
      } else if (is_leaf(child_b)) {
        const std::uint32_t lanes = of_a[child_a].meeting(of_b[b / kLanes].box(b % kLanes));
        std::uint32_t spread = 0;
        for (std::uint32_t i = 0; i < kLanes; ++i) spread |= (lanes >> i & 1) << kLanes * i;
        stack_.push_back({child_a, b, false, true, static_cast<std::uint16_t>(spread)});
      } else {
        stack_.push_back({child_a, child_b, false, false,
                          same && child_a == child_b ? meeting(of_a[child_a])
                                                     : meeting(of_a[child_a], of_b[child_b])});
      }
    }
  }

  /// A body, or a node that is built.
  struct Leaf {
    SceneBox box;
    std::uint32_t body;
  };
  std::uint32_t take_node() noexcept;
  void fit_above(std::uint32_t node) noexcept;
  void hang(std::uint32_t node, std::uint32_t lane, std::uint32_t child,
            const SceneBox& box) noexcept;
  void build() noexcept;
  std::uint32_t build(Leaf* first, Leaf* last) noexcept;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> lane_of_;  ///< of a body: 4 · node + lane
  std::vector<std::uint32_t> free_;
  std::vector<Leaf> order_;
  std::vector<Two> stack_;
  std::uint32_t root_ = kNone, leaves_ = 0;
  double built_area_ = 0;  ///< of all nodes, when they were built
  std::size_t added_ = 0;  ///< since
  bool in_order_ = true;   ///< no node is taken out, and each stands before those below it
};

}  // namespace ist
