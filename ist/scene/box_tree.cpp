#include "scene/box_tree.h"

#include <utility>

namespace ist {
namespace {

// Boxes that grew to this many times the area of a fresh hierarchy are built anew.
constexpr double kWorn = 1.5;

}  // namespace

void BoxTree::take_room(std::size_t most) {
  // Each node but a root alone has two children.
  free_.reserve(most + 1);
  nodes_.reserve(most + 1);
  order_.reserve(most);
  if (lane_of_.size() < most) lane_of_.resize(most, kNone);
  // One pair is pending for each level of both; in the worst case a hierarchy is a chain.
  if (stack_.size() < 2 * most + 64) stack_.resize(2 * most + 64);
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

void BoxTree::fit_above(std::uint32_t at) noexcept {
  while (nodes_[at].parent != kNone) {
    const SceneBox box = nodes_[at].whole();
    const std::uint32_t lane = nodes_[at].place;
    at = nodes_[at].parent;
    if (nodes_[at].box(lane) == box) return;
    nodes_[at].set(lane, box);
  }
}

void BoxTree::hang(std::uint32_t node, std::uint32_t lane, std::uint32_t child, bool is_body,
                   const SceneBox& box) noexcept {
  BoxNode& above = nodes_[node];
  above.set(lane, box);
  above.child[lane] = child;
  above.used |= 1u << lane;
  above.bodies = (above.bodies & ~(1u << lane)) | (is_body ? 1u << lane : 0);
  if (is_body) {
    lane_of_[child] = kLanes * node + lane;
  } else {
    nodes_[child].parent = node;
    nodes_[child].place = lane;
  }
}

void BoxTree::add(std::uint32_t body, const SceneBox& box) noexcept {
  ++leaves_;
  ++added_;
  if (root_ == kNone) root_ = take_node();
  // Descends to where the least area is added.
  std::uint32_t at = root_;
  for (;;) {
    const std::uint32_t used = nodes_[at].used;
    const auto free = static_cast<std::uint32_t>(std::countr_one(used));
    std::uint32_t best = kNone;
    double least = 0;
    for (std::uint32_t k = 0; k < kLanes; ++k) {
      if ((used >> k & 1) == 0) continue;
      const SceneBox own = nodes_[at].box(k);
      const double grown = own.united(box).area() - own.area();
      if (best != kNone && grown >= least) continue;
      best = k;
      least = grown;
    }
    if (best != kNone && !nodes_[at].is_body(best)) {
      at = nodes_[at].child[best];
      continue;
    }
    if (free < kLanes) {
      hang(at, free, body, true, box);
    } else {
      const SceneBox own = nodes_[at].box(best);
      const std::uint32_t made = take_node();
      hang(made, 0, nodes_[at].child[best], true, own);
      hang(made, 1, body, true, box);
      hang(at, best, made, false, own.united(box));
    }
    fit_above(at);
    return;
  }
}

void BoxTree::remove(std::uint32_t body) noexcept {
  const std::uint32_t lane = std::exchange(lane_of_[body], kNone);
  std::uint32_t at = lane / kLanes;
  --leaves_;
  nodes_[at].clear(lane % kLanes);
  const std::uint32_t used = nodes_[at].used;
  if (at == root_) {
    if (used != 0) return;
    in_order_ = false;
    free_.push_back(std::exchange(root_, kNone));
    return;
  }
  if ((used & (used - 1)) == 0) {  // the last one takes the node's place
    in_order_ = false;
    const auto last = static_cast<std::uint32_t>(std::countr_zero(used));
    const std::uint32_t parent = nodes_[at].parent;
    hang(parent, nodes_[at].place, nodes_[at].child[last], nodes_[at].is_body(last),
         nodes_[at].box(last));
    free_.push_back(at);
    at = parent;
  }
  fit_above(at);
}

void BoxTree::refit() noexcept {
  if (root_ == kNone) return;
  // A broken order costs as much as building it anew.
  if (!in_order_) return build();
  if (refit_nodes(nodes_) > kWorn * built_area_) build();
}

void BoxTree::build() noexcept {
  added_ = 0;
  built_area_ = 0;
  in_order_ = true;
  order_.clear();
  for (std::uint32_t body = 0; body < lane_of_.size(); ++body)
    if (const std::uint32_t lane = lane_of_[body]; lane != kNone)
      order_.push_back({nodes_[lane / kLanes].box(lane % kLanes), body});
  free_.clear();
  nodes_.clear();
  root_ = order_.empty() ? kNone : build(order_.data(), order_.data() + order_.size());
}

/// Puts the bodies whose middles are lower along the longest axis in front of `at`.
void BoxTree::part(Leaf* first, Leaf* at, Leaf* last) noexcept {
  const auto middle_of = [](const Leaf& leaf, std::size_t k) {
    return leaf.box.low[k] + leaf.box.high[k];
  };
  float low[3], high[3];
  for (std::size_t k = 0; k < 3; ++k) low[k] = high[k] = middle_of(*first, k);
  for (const Leaf* leaf = first; leaf != last; ++leaf)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], middle_of(*leaf, k));
      high[k] = std::max(high[k], middle_of(*leaf, k));
    }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  std::nth_element(first, at, last, [&](const Leaf& x, const Leaf& y) {
    const float mx = middle_of(x, axis), my = middle_of(y, axis);
    return mx != my ? mx < my : x.body < y.body;
  });
}

/// A node over bodies.
std::uint32_t BoxTree::build(Leaf* first, Leaf* last) noexcept {
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  // Full nodes below, as many as possible.
  std::ptrdiff_t full = 1;
  while (full * kLanes < last - first) full *= kLanes;
  std::uint32_t lane = 0;
  const auto divide = [&](const auto& again, Leaf* from, Leaf* to) -> void {
    const std::ptrdiff_t parts = (to - from + full - 1) / full;
    if (full == 1) {
      for (; from != to; ++from) hang(node, lane++, from->body, true, from->box);
    } else if (parts > 1) {
      Leaf* const at = from + (parts + 1) / 2 * full;
      part(from, at, to);
      again(again, from, at);
      again(again, at, to);
    } else if (to - from == 1) {
      hang(node, lane++, from->body, true, from->box);
    } else {
      const std::uint32_t child = build(from, to);
      hang(node, lane++, child, false, nodes_[child].whole());
    }
  };
  divide(divide, first, last);
  built_area_ += nodes_[node].whole().area();
  return node;
}

}  // namespace ist
