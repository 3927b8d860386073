#include "build/neural_gas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "query/asset_layout.h"

namespace ist {
namespace {

constexpr int kEpochs = 24;
constexpr int kSweeps = 20;

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
        std::array<double, kWidth> distance;
        distance.fill(std::numeric_limits<double>::infinity());
        for (std::size_t p = 0; p < count; ++p) distance[p] = squared_distance(ball, at[p]);
        for (std::size_t p = 0; p < count; ++p) {
          std::size_t rank = 0;  // counting beats sorting: no branch depends on the data
          for (std::size_t q = 0; q < kWidth; ++q)
            rank += q < p ? distance[q] <= distance[p] : distance[q] < distance[p];
          const double w = kernel[rank] * weight(ball);
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

  /// Sorts `range` into groups of `unit`, the last of what remains; the last ball stays last if
  /// `pinned`. Starts in the order of the range; then two groups at a time share out their balls
  /// anew, each to the prototype it prefers, until nothing moves: Σ distance² falls every time.
  void assign(std::span<std::uint32_t> range, std::vector<Point> at, std::size_t unit,
              bool pinned) const {
    const std::size_t groups = at.size();
    if (pinned) {
      const Ball& last = balls_[range.back()];
      const auto nearest =
          std::min_element(at.begin(), at.end(), [&](const Point& a, const Point& b) {
            return squared_distance(last, a) < squared_distance(last, b);
          });
      std::iter_swap(nearest, at.end() - 1);
    }
    // First shares along the prototypes' order, nearest first, as far as there is room.
    fill_in_turn(range.first(range.size() - pinned), at, unit);
    bool moved = true;
    for (int sweep = 0; moved && sweep < kSweeps; ++sweep) {
      moved = false;
      for (std::size_t p = 0; p < groups; ++p)
        for (std::size_t q = p + 1; q < groups; ++q)
          moved |= share(range.first(range.size() - pinned), at, unit, p, q);
    }
    // Which balls are where is settled; their order within a group is not until now.
    for (std::size_t begin = 0; begin < range.size(); begin += unit) {
      const auto group = range.subspan(begin, std::min(unit, range.size() - begin));
      std::sort(group.begin(), group.end() - (pinned && begin + unit >= range.size()));
    }
  }

  /// Group by group, the balls that are nearest to its prototype among those that are left.
  void fill_in_turn(std::span<std::uint32_t> range, const std::vector<Point>& at,
                    std::size_t unit) const {
    for (std::size_t p = 0; p + 1 < at.size(); ++p) {
      const auto rest = range.subspan(p * unit);
      std::sort(rest.begin(), rest.end(), [&](std::uint32_t a, std::uint32_t b) {
        const double da = squared_distance(balls_[a], at[p]);
        const double db = squared_distance(balls_[b], at[p]);
        return da != db ? da < db : a < b;
      });
    }
  }

  bool share(std::span<std::uint32_t> range, const std::vector<Point>& at, std::size_t unit,
             std::size_t p, std::size_t q) const {
    const auto group = [&](std::size_t g) {
      return range.subspan(g * unit, std::min(unit, range.size() - g * unit));
    };
    const auto first = group(p);
    const auto second = group(q);
    struct Member {
      double preference;  // negative: nearer to p's prototype
      std::uint32_t ball;
      bool was_first;
    };
    std::vector<Member> pool;
    pool.reserve(first.size() + second.size());
    for (const auto part : {first, second})
      for (const std::uint32_t i : part)
        pool.push_back({squared_distance(balls_[i], at[p]) - squared_distance(balls_[i], at[q]), i,
                        part.data() == first.data()});
    std::nth_element(pool.begin(), pool.begin() + static_cast<std::ptrdiff_t>(first.size()),
                     pool.end(), [](const Member& a, const Member& b) {
                       return a.preference != b.preference ? a.preference < b.preference
                                                           : a.ball < b.ball;
                     });
    bool moved = false;
    for (std::size_t k = 0; k < pool.size(); ++k) {
      if (k < first.size()) {
        first[k] = pool[k].ball;
        moved |= !pool[k].was_first;
      } else {
        second[k - first.size()] = pool[k].ball;
      }
    }
    return moved;
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
