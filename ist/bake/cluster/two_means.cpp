#include "bake/cluster/two_means.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <ist/asset_layout.h>

namespace ist {
namespace {

constexpr int kLloydSteps = 12;

struct Mean {
  double x = 0, y = 0, z = 0, weight = 0;

  void add(const Ball& ball) {
    const double w = ball.r * ball.r * ball.r + 1e-30;  // points count too, however little
    x += w * ball.x;
    y += w * ball.y;
    z += w * ball.z;
    weight += w;
  }
  void finish() {
    x /= weight;
    y /= weight;
    z /= weight;
  }
};

double squared_distance(const Ball& a, const Mean& b) {
  const double dx = a.x - b.x;
  const double dy = a.y - b.y;
  const double dz = a.z - b.z;
  return dx * dx + dy * dy + dz * dz;
}

class TwoMeans {
 public:
  TwoMeans(std::span<const Ball> balls, bool last_stays)
      : balls_(balls),
        pinned_(last_stays ? static_cast<std::uint32_t>(balls.size() - 1) : kNobody),
        order_(balls.size()),
        key_(balls.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    split(0, order_.size());
  }

  std::vector<std::uint32_t> take() { return std::move(order_); }

 private:
  static constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

  void split(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    if (count <= kWidth) return;
    std::size_t unit = kWidth;
    while (unit * kWidth < count) unit *= kWidth;

    std::pair<Mean, Mean> means = two_means(begin, end);
    const auto range = std::span(order_).subspan(begin, count);
    const bool holds_pinned = std::find(range.begin(), range.end(), pinned_) != range.end();
    const auto side = [&](std::uint32_t i) {
      return squared_distance(balls_[i], means.first) - squared_distance(balls_[i], means.second);
    };
    // The group that is not full is the last one: what stays last decides which side that is.
    if (holds_pinned && side(pinned_) < 0) std::swap(means.first, means.second);
    std::size_t natural = 0;
    for (const std::uint32_t i : range) {
      key_[i] = i == pinned_ ? std::numeric_limits<double>::infinity() : side(i);
      natural += key_[i] < 0;
    }
    std::sort(range.begin(), range.end(), [&](std::uint32_t a, std::uint32_t b) {
      return key_[a] != key_[b] ? key_[a] < key_[b] : a < b;
    });
    const std::size_t units = (count + unit - 1) / unit;
    const std::size_t cut = std::clamp<std::size_t>((natural + unit / 2) / unit, 1, units - 1);
    split(begin, begin + cut * unit);
    split(begin + cut * unit, end);
  }

  std::pair<Mean, Mean> two_means(std::size_t begin, std::size_t end) const {
    const auto range = std::span(order_).subspan(begin, end - begin);
    Mean centre;
    for (const std::uint32_t i : range) centre.add(balls_[i]);
    centre.finish();
    const auto farthest_from = [&](const Mean& from) {
      std::uint32_t farthest = range.front();
      for (const std::uint32_t i : range)
        if (squared_distance(balls_[i], from) > squared_distance(balls_[farthest], from))
          farthest = i;
      return Mean{balls_[farthest].x, balls_[farthest].y, balls_[farthest].z, 1};
    };
    Mean left = farthest_from(centre);
    Mean right = farthest_from(left);
    for (int step = 0; step < kLloydSteps; ++step) {
      Mean next_left;
      Mean next_right;
      for (const std::uint32_t i : range) {
        const bool is_left = squared_distance(balls_[i], left) < squared_distance(balls_[i], right);
        (is_left ? next_left : next_right).add(balls_[i]);
      }
      if (next_left.weight <= 0 || next_right.weight <= 0) break;
      next_left.finish();
      next_right.finish();
      left = next_left;
      right = next_right;
    }
    return {left, right};
  }

  std::span<const Ball> balls_;
  std::uint32_t pinned_;
  std::vector<std::uint32_t> order_;
  std::vector<double> key_;
};

}  // namespace

std::vector<std::uint32_t> two_means_order(std::span<const Ball> balls, bool last_stays) {
  return TwoMeans(balls, last_stays).take();
}

}  // namespace ist
