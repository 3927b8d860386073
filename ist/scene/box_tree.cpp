#include "scene/box_tree.h"

#include <utility>

namespace ist {
namespace {

// Boxes that grew to this many times the area of a fresh hierarchy are built anew.
constexpr double kWorn = 1.5;

}  // namespace

void BoxTree::take_room(std::size_t most) {
  for (auto* const list : {&nodes_, &other_nodes_}) list->reserve(2 * most);
  for (auto* const list : {&free_, &order_}) list->reserve(2 * most);
  if (node_of_.size() < most) node_of_.resize(most, kNone);
  // Two nodes leave at most three of a level waiting; in the worst case the hierarchy is a chain.
  stack_.reserve(6 * most + 64);
}

std::uint32_t BoxTree::take_node() noexcept {
  in_order_ = false;
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
    const SceneBox before = nodes_[at].box;
    fit(nodes_[at]);
    if (nodes_[at].box == before) return;
  }
}

void BoxTree::add(std::uint32_t body, const SceneBox& box) noexcept {
  const std::uint32_t leaf = take_node();
  node_of_[body] = leaf;
  nodes_[leaf].box = box;
  nodes_[leaf].body = body;
  ++leaves_;
  ++added_;
  if (root_ == kNone) {
    root_ = leaf;
    return;
  }
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
}

void BoxTree::remove(std::uint32_t body) noexcept {
  const std::uint32_t leaf = std::exchange(node_of_[body], kNone);
  --leaves_;
  in_order_ = false;
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

void BoxTree::move(std::uint32_t body, const SceneBox& box) noexcept {
  nodes_[node_of_[body]].box = box;
  fit_above(node_of_[body]);
}

void BoxTree::refit() noexcept {
  // As dear as to build it: an order that is broken.
  if (!in_order_) return build();
  double area = 0;
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    if (nodes_[i].is_leaf()) continue;
    fit(nodes_[i]);
    area += nodes_[i].box.area();
  }
  if (area > kWorn * built_area_) build();
}

void BoxTree::build() noexcept {
  added_ = 0;
  built_area_ = 0;
  in_order_ = true;
  if (root_ == kNone) return;
  order_.clear();
  for (const std::uint32_t leaf : node_of_)
    if (leaf != kNone) order_.push_back(leaf);
  free_.clear();
  other_nodes_.clear();
  root_ = build(order_.data(), order_.data() + order_.size());
  other_nodes_[root_].parent = kNone;
  std::swap(nodes_, other_nodes_);
}

/// In `other_nodes_`, of leaves of `nodes_`.
std::uint32_t BoxTree::build(std::uint32_t* first, std::uint32_t* last) noexcept {
  const auto node = static_cast<std::uint32_t>(other_nodes_.size());
  if (last - first == 1) {
    other_nodes_.push_back(nodes_[*first]);
    node_of_[nodes_[*first].body] = node;
    return node;
  }
  other_nodes_.emplace_back();
  const auto middle_of = [&](std::uint32_t leaf, std::size_t k) {
    return nodes_[leaf].box.low[k] + nodes_[leaf].box.high[k];
  };
  float low[3], high[3];
  for (std::size_t k = 0; k < 3; ++k) low[k] = high[k] = middle_of(*first, k);
  for (const std::uint32_t* leaf = first; leaf != last; ++leaf)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], middle_of(*leaf, k));
      high[k] = std::max(high[k], middle_of(*leaf, k));
    }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  std::uint32_t* const half = first + (last - first) / 2;
  std::nth_element(first, half, last, [&](std::uint32_t x, std::uint32_t y) {
    const float mx = middle_of(x, axis), my = middle_of(y, axis);
    return mx != my ? mx < my : x < y;
  });
  const std::uint32_t children[2] = {build(first, half), build(half, last)};
  Node& made = other_nodes_[node];
  for (int k = 0; k < 2; ++k) {
    made.child[k] = children[k];
    other_nodes_[children[k]].parent = node;
  }
  made.box = other_nodes_[children[0]].box.united(other_nodes_[children[1]].box);
  built_area_ += made.box.area();
  return node;
}

}  // namespace ist
