#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace ist {

/// A box along the axes; floats, rounded outward.
struct SceneBox {
  std::array<float, 3> low, high;

  bool meets(const SceneBox& other) const noexcept {
    // Without a branch for each: most boxes that are asked are near.
    return ((low[0] <= other.high[0]) & (other.low[0] <= high[0]) & (low[1] <= other.high[1]) &
            (other.low[1] <= high[1]) & (low[2] <= other.high[2]) & (other.low[2] <= high[2])) != 0;
  }
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

/// A binary hierarchy of boxes. Its shape changes no answer: which boxes meet depends on them
/// alone.
class BoxTree {
 public:
  static constexpr std::uint32_t kNone = ~0u;

  /// Memory for `most` bodies, whose numbers are lower.
  explicit BoxTree(std::size_t most) { take_room(most); }
  void take_room(std::size_t most);

  std::uint32_t size() const noexcept { return leaves_; }
  /// Many that are added in a row are cheaper to settle() at once.
  void add(std::uint32_t body, const SceneBox& box) noexcept;
  void remove(std::uint32_t body) noexcept;
  /// Sets the box of a body and those above it.
  void move(std::uint32_t body, const SceneBox& box) noexcept;
  /// Sets the box of a body alone: until refit() nothing may be asked.
  void put(std::uint32_t body, const SceneBox& box) noexcept { nodes_[node_of_[body]].box = box; }
  /// Sets all boxes above those of bodies, and builds anew where they have grown too much.
  void refit() noexcept;
  /// Builds anew where many were added.
  void settle() noexcept {
    if (2 * added_ > leaves_) build();
  }

  /// visit(body) of the leaves below the nodes for which enter(box) holds.
  template <class Enter, class Visit>
  void each(const Enter& enter, const Visit& visit) const noexcept {
    if (root_ == kNone) return;
    std::uint32_t at = root_;
    // Depth first without a stack, by the parents' links.
    for (;;) {
      const Node& node = nodes_[at];
      if (enter(node.box)) {
        if (!node.is_leaf()) {
          at = node.child[0];
          continue;
        }
        visit(node.body);
      }
      for (;;) {
        const std::uint32_t up = nodes_[at].parent;
        if (up == kNone) return;
        if (nodes_[up].child[0] == at) {
          at = nodes_[up].child[1];
          break;
        }
        at = up;
      }
    }
  }

  /// visit(body, body) of all pairs of leaves whose boxes meet, once each.
  template <class Visit>
  void pairs_within(const Visit& visit) noexcept {
    if (root_ == kNone) return;
    stack_.clear();
    stack_.push_back({root_, root_});
    go_on(*this, visit);
  }
  /// The same of one leaf of this and one of another tree.
  template <class Visit>
  void pairs_with(const BoxTree& other, const Visit& visit) noexcept {
    if (root_ == kNone || other.root_ == kNone) return;
    stack_.clear();
    if (nodes_[root_].box.meets(other.nodes_[other.root_].box))
      stack_.push_back({root_, other.root_});
    go_on(other, visit);
  }

 private:
  struct Node {
    SceneBox box;
    std::uint32_t parent = kNone;
    std::uint32_t child[2] = {kNone, kNone};
    std::uint32_t body = kNone;

    bool is_leaf() const noexcept { return child[0] == kNone; }
  };
  struct Two {
    std::uint32_t a, b;
  };

  template <class Visit>
  void go_on(const BoxTree& other, const Visit& visit) noexcept {
    while (!stack_.empty()) {
      const Two two = stack_.back();
      stack_.pop_back();
      const Node &a = nodes_[two.a], &b = other.nodes_[two.b];
      const auto wait = [&](std::uint32_t x, std::uint32_t y) {
        if (nodes_[x].box.meets(other.nodes_[y].box)) stack_.push_back({x, y});
      };
      if (this == &other && two.a == two.b) {
        if (a.is_leaf()) continue;
        wait(a.child[0], a.child[1]);
        stack_.push_back({a.child[1], a.child[1]});
        stack_.push_back({a.child[0], a.child[0]});
      } else if (a.is_leaf() && b.is_leaf()) {
        visit(a.body, b.body);
      } else if (b.is_leaf()) {
        for (const std::uint32_t x : a.child) wait(x, two.b);
      } else if (a.is_leaf()) {
        for (const std::uint32_t y : b.child) wait(two.a, y);
      } else {
        for (const std::uint32_t x : a.child)
          for (const std::uint32_t y : b.child) wait(x, y);
      }
    }
  }
  std::uint32_t take_node() noexcept;
  void fit_above(std::uint32_t node) noexcept;
  void build() noexcept;
  std::uint32_t build(std::uint32_t* first, std::uint32_t* last) noexcept;
  void fit(Node& node) noexcept {
    node.box = nodes_[node.child[0]].box.united(nodes_[node.child[1]].box);
  }

  std::vector<Node> nodes_, other_nodes_;
  std::vector<std::uint32_t> node_of_;  ///< of a body
  std::vector<std::uint32_t> free_, order_;
  std::vector<Two> stack_;
  std::uint32_t root_ = kNone, leaves_ = 0;
  double built_area_ = 0;  ///< of all nodes above leaves, when they were built
  std::size_t added_ = 0;  ///< since
  bool in_order_ = true;   ///< no node is taken out, and each stands before those below it
};

}  // namespace ist
