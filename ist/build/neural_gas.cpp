#include "build/neural_gas.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "query/asset_layout.h"

namespace ist {
namespace {

constexpr int kEpochs = 24;

struct Point {
  double x = 0, y = 0, z = 0;
};

double squared_distance(const Ball& a, const Point& b) {
  const double dx = a.x - b.x;
  const double dy = a.y - b.y;
  const double dz = a.z - b.z;
  return dx * dx + dy * dy + dz * dz;
}

double weight(const Ball& ball) { return ball.r * ball.r * ball.r + 1e-30; }

class NeuralGas {
 public:
  NeuralGas(std::span<const Ball> balls, bool last_stays) : balls_(balls), last_stays_(last_stays) {
    order_.resize(balls.size());
    std::iota(order_.begin(), order_.end(), 0u);
    split(0, order_.size());
  }

  std::vector<std::uint32_t> take() { return std::move(order_); }

 private:
  void split(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    if (count <= kWidth) return;
    std::size_t unit = kWidth;
    while (unit * kWidth < count) unit *= kWidth;
    const auto range = std::span(order_).subspan(begin, count);
    assign(range, prototypes(range, (count + unit - 1) / unit), unit,
           last_stays_ && end == order_.size());
    for (std::size_t part = begin; part < end; part += unit)
      split(part, std::min(part + unit, end));
  }

  std::vector<Point> prototypes(std::span<const std::uint32_t> range, std::size_t count) const {
    std::vector<Point> at(count);  // start at balls spread over the range, which is in some order
    for (std::size_t p = 0; p < count; ++p) {
      const Ball& ball = balls_[range[(2 * p + 1) * range.size() / (2 * count)]];
      at[p] = {ball.x, ball.y, ball.z};
    }
    // Neighbourhood range λ from half the prototypes towards zero, where this is plain k-means. The
    // kernel q^rank with q = λ / (1 + λ) stands for exp(−rank / λ): five operations make it.
    double lambda = static_cast<double>(count) / 2;
    for (int epoch = 0; epoch < kEpochs; ++epoch, lambda *= 0.75) {
      std::array<double, kWidth> kernel{};
      kernel[0] = 1;
      for (std::size_t k = 1; k < count; ++k) kernel[k] = kernel[k - 1] * (lambda / (1 + lambda));
      std::vector<Point> sum(count);
      std::array<double, kWidth> total{};
      for (const std::uint32_t i : range) {
        const Ball& ball = balls_[i];
        std::array<std::pair<double, std::size_t>, kWidth> rank;
        for (std::size_t p = 0; p < count; ++p) rank[p] = {squared_distance(ball, at[p]), p};
        std::sort(rank.begin(), rank.begin() + static_cast<std::ptrdiff_t>(count));
        for (std::size_t k = 0; k < count && kernel[k] > 1e-6; ++k) {
          const std::size_t p = rank[k].second;
          const double w = kernel[k] * weight(ball);
          sum[p].x += w * ball.x;
          sum[p].y += w * ball.y;
          sum[p].z += w * ball.z;
          total[p] += w;
        }
      }
      for (std::size_t p = 0; p < count; ++p)
        if (total[p] > 0) at[p] = {sum[p].x / total[p], sum[p].y / total[p], sum[p].z / total[p]};
    }
    return at;
  }

  /// Sorts `range` into groups of `unit`, the last of what remains. Balls choose in the order of
  /// their distance to the prototypes. The last one stays last if `pinned`.
  void assign(std::span<std::uint32_t> range, std::vector<Point> at, std::size_t unit,
              bool pinned) const {
    const std::uint32_t last = range.back();
    std::size_t remainder = at.size() - 1;
    for (std::size_t p = 0; pinned && p < at.size(); ++p)
      if (squared_distance(balls_[last], at[p]) < squared_distance(balls_[last], at[remainder]))
        remainder = p;
    std::swap(at[remainder], at.back());
    struct Choice {
      double distance;
      std::uint32_t ball;
      std::uint32_t prototype;
    };
    std::vector<Choice> choices;
    choices.reserve(range.size() * at.size());
    for (std::uint32_t i = 0; i < range.size() - pinned; ++i)
      for (std::uint32_t p = 0; p < at.size(); ++p)
        choices.push_back({squared_distance(balls_[range[i]], at[p]), i, p});
    std::sort(choices.begin(), choices.end(), [](const Choice& a, const Choice& b) {
      if (a.distance != b.distance) return a.distance < b.distance;
      return a.ball != b.ball ? a.ball < b.ball : a.prototype < b.prototype;
    });
    std::vector<std::vector<std::uint32_t>> groups(at.size());
    std::vector<char> placed(range.size(), 0);
    const std::size_t rest = range.size() - unit * (at.size() - 1) - pinned;
    for (const Choice& choice : choices) {
      auto& group = groups[choice.prototype];
      const std::size_t room = choice.prototype + 1 < at.size() ? unit : rest;
      if (placed[choice.ball] != 0 || group.size() >= room) continue;
      placed[choice.ball] = 1;
      group.push_back(range[choice.ball]);
    }
    if (pinned) groups.back().push_back(last);
    auto out = range.begin();
    for (const auto& group : groups) out = std::copy(group.begin(), group.end(), out);
  }

  std::span<const Ball> balls_;
  bool last_stays_;
  std::vector<std::uint32_t> order_;
};

}  // namespace

std::vector<std::uint32_t> neural_gas_order(std::span<const Ball> balls, bool last_stays) {
  return NeuralGas(balls, last_stays).take();
}

}  // namespace ist
