#include "scene/box_tree.h"

#include <cmath>

namespace ist {
namespace {

// Boxes that grew to this many times the area of a fresh hierarchy are built anew.
constexpr double kWorn = 1.5;

}  // namespace

BoxTree::BoxTree(std::size_t most) {
  nodes_.reserve(2 * most);
  free_.reserve(2 * most);
  order_.reserve(2 * most);
  // Two nodes of depth d leave no more than 3 d waiting; hierarchies are built anew before they are
  // deep, but in the worst case they are a chain.
  stack_.reserve(6 * most + 64);
}

std::uint32_t BoxTree::take_node() noexcept {
  if (free_.empty()) {
    nodes_.emplace_back();
    return static_cast<std::uint32_t>(nodes_.size() - 1);
  }
  const std::uint32_t node = free_.back();
  free_.pop_back();
  nodes_[node] = {};
  return node;
}

void BoxTree::fit_above(std::uint32_t node) noexcept {
  for (std::uint32_t at = nodes_[node].parent; at != kNone; at = nodes_[at].parent) {
    const SceneBox box = nodes_[nodes_[at].child[0]].box.united(nodes_[nodes_[at].child[1]].box);
    if (box == nodes_[at].box) return;
    nodes_[at].box = box;
  }
}

std::uint32_t BoxTree::add(std::uint32_t body, const SceneBox& box) noexcept {
  const std::uint32_t leaf = take_node();
  nodes_[leaf].box = box;
  nodes_[leaf].body = body;
  ++leaves_;
  ++added_;
  if (root_ == kNone) return root_ = leaf;
  // Down to where the least area is added.
  std::uint32_t at = root_;
  while (!nodes_[at].is_leaf()) {
    const double here = nodes_[at].box.united(box).area(), grown = here - nodes_[at].box.area();
    double cost[2];
    for (int k = 0; k < 2; ++k) {
      const Node& child = nodes_[nodes_[at].child[k]];
      cost[k] = grown + child.box.united(box).area() - (child.is_leaf() ? 0 : child.box.area());
    }
    if (here < cost[0] && here < cost[1]) break;
    at = nodes_[at].child[cost[1] < cost[0] ? 1 : 0];
  }
  const std::uint32_t above = take_node(), parent = nodes_[at].parent;
  nodes_[above].box = nodes_[at].box.united(box);
  nodes_[above].parent = parent;
  nodes_[above].child[0] = at;
  nodes_[above].child[1] = leaf;
  nodes_[at].parent = nodes_[leaf].parent = above;
  if (parent == kNone)
    root_ = above;
  else
    nodes_[parent].child[nodes_[parent].child[0] == at ? 0 : 1] = above;
  fit_above(above);
  return leaf;
}

void BoxTree::remove(std::uint32_t leaf) noexcept {
  --leaves_;
  free_.push_back(leaf);
  const std::uint32_t above = nodes_[leaf].parent;
  if (above == kNone) {
    root_ = kNone;
    return;
  }
  const std::uint32_t other = nodes_[above].child[nodes_[above].child[0] == leaf ? 1 : 0];
  const std::uint32_t parent = nodes_[above].parent;
  nodes_[other].parent = parent;
  free_.push_back(above);
  if (parent == kNone) {
    root_ = other;
    return;
  }
  nodes_[parent].child[nodes_[parent].child[0] == above ? 0 : 1] = other;
  fit_above(other);
}

void BoxTree::move(std::uint32_t leaf, const SceneBox& box) noexcept {
  nodes_[leaf].box = box;
  fit_above(leaf);
}

void BoxTree::refit() noexcept {
  if (root_ == kNone || nodes_[root_].is_leaf()) return;
  double area = 0;
  // Children before their parents, by the parents' links.
  std::uint32_t at = root_;
  while (!nodes_[at].is_leaf()) at = nodes_[at].child[0];
  while (nodes_[at].parent != kNone) {
    const std::uint32_t up = nodes_[at].parent;
    if (nodes_[up].child[0] == at) {
      at = nodes_[up].child[1];
      while (!nodes_[at].is_leaf()) at = nodes_[at].child[0];
      continue;
    }
    Node& node = nodes_[up];
    node.box = nodes_[node.child[0]].box.united(nodes_[node.child[1]].box);
    area += node.box.area();
    at = up;
  }
  // (also where it is NaN, of boxes without an end)
  if (area > kWorn * built_area_) build();
}

void BoxTree::build() noexcept {
  added_ = 0;
  built_area_ = 0;
  if (root_ == kNone || nodes_[root_].is_leaf()) return;
  order_.clear();
  for (std::uint32_t at = root_; at != kNone;) {
    while (!nodes_[at].is_leaf()) at = nodes_[at].child[0];
    for (;;) {
      const std::uint32_t up = nodes_[at].parent;
      if (nodes_[at].is_leaf()) order_.push_back(at);
      if (up == kNone) {
        at = kNone;
        break;
      }
      if (nodes_[up].child[0] == at) {
        at = nodes_[up].child[1];
        break;
      }
      free_.push_back(up);
      at = up;
    }
  }
  root_ = build(order_.data(), order_.data() + order_.size());
  nodes_[root_].parent = kNone;
}

std::uint32_t BoxTree::build(std::uint32_t* first, std::uint32_t* last) noexcept {
  if (last - first == 1) return *first;
  const auto middle_of = [&](std::uint32_t leaf, std::size_t k) {
    // Boxes without an end have none.
    const double m = double{nodes_[leaf].box.low[k]} + nodes_[leaf].box.high[k];
    return std::isfinite(m) ? m : 0.0;
  };
  double low[3], high[3];
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = high[k] = middle_of(*first, k);
    for (const std::uint32_t* leaf = first; leaf != last; ++leaf) {
      low[k] = std::min(low[k], middle_of(*leaf, k));
      high[k] = std::max(high[k], middle_of(*leaf, k));
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  std::uint32_t* const half = first + (last - first) / 2;
  std::nth_element(first, half, last, [&](std::uint32_t x, std::uint32_t y) {
    const double mx = middle_of(x, axis), my = middle_of(y, axis);
    return mx != my ? mx < my : x < y;
  });
  const std::uint32_t node = take_node();
  const std::uint32_t children[2] = {build(first, half), build(half, last)};
  Node& made = nodes_[node];
  for (int k = 0; k < 2; ++k) {
    made.child[k] = children[k];
    nodes_[children[k]].parent = node;
  }
  made.box = nodes_[children[0]].box.united(nodes_[children[1]].box);
  built_area_ += made.box.area();
  return node;
}

}  // namespace ist
