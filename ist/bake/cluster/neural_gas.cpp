#include "bake/cluster/neural_gas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include <ist/asset_layout.h>

namespace ist {
namespace {

constexpr int kEpochs = 24;
constexpr int kSweeps = 20;
constexpr std::size_t kPart = 256;  // balls that one thread takes

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
    if (unit == kWidth) return;
    tbb::parallel_for(std::size_t{0}, (count + unit - 1) / unit, [&](std::size_t p) {
      split(begin + p * unit, std::min(begin + (p + 1) * unit, end));
    });
  }

  /// What the balls of one part of a range say to the prototypes.
  struct Pull {
    std::array<Point, kWidth> sum{};
    std::array<double, kWidth> total{};
  };

  Pull pull_of(std::span<const std::uint32_t> part, const std::vector<Point>& at,
               const std::array<double, kWidth>& kernel) const {
    Pull pull;
    const std::size_t count = std::min<std::size_t>(at.size(), kWidth);
    for (const std::uint32_t i : part) {
      const Ball& ball = balls_[i];
      std::array<double, kWidth> distance;
      distance.fill(std::numeric_limits<double>::infinity());
      for (std::size_t p = 0; p < count; ++p) distance[p] = squared_distance(ball, at[p]);
      for (std::size_t p = 0; p < count; ++p) {
        std::size_t rank = 0;  // counting beats sorting: no branch depends on the data
        for (std::size_t q = 0; q < kWidth; ++q)
          rank += q < p ? distance[q] <= distance[p] : distance[q] < distance[p];
        const double w = kernel[rank] * weight(ball);
        pull.sum[p].x += w * ball.x;
        pull.sum[p].y += w * ball.y;
        pull.sum[p].z += w * ball.z;
        pull.total[p] += w;
      }
    }
    return pull;
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
      // In parts of fixed size, added in their order: the same bits for any number of threads.
      std::vector<Pull> pulls((range.size() + kPart - 1) / kPart);
      const auto pull = [&](std::size_t k) {
        const std::size_t first = k * kPart;
        pulls[k] = pull_of(range.subspan(first, std::min(kPart, range.size() - first)), at, kernel);
      };
      if (pulls.size() > 1) {
        tbb::parallel_for(std::size_t{0}, pulls.size(), pull);
      } else {
        pull(0);
      }
      for (std::size_t p = 0; p < count; ++p) {
        Point sum;
        double total = 0;
        for (const Pull& part : pulls) {
          sum.x += part.sum[p].x;
          sum.y += part.sum[p].y;
          sum.z += part.sum[p].z;
          total += part.total[p];
        }
        if (total > 0) at[p] = {sum.x / total, sum.y / total, sum.z / total};
      }
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
    const auto all = range.first(range.size() - pinned);
    std::vector<int> changed(groups, 0);  // the sweep that last moved a ball of the group
    for (int sweep = 1; sweep <= kSweeps; ++sweep) {
      // Every two groups meet once a sweep, in turns in which each group has one partner: one stays
      // and the others go round.
      const std::size_t seats = groups + groups % 2;
      for (std::size_t turn = 0; turn + 1 < seats; ++turn) {
        const auto meet = [&](std::size_t k) {
          const std::size_t a = k == 0 ? seats - 1 : (turn + k) % (seats - 1);
          const std::size_t b = (turn + seats - 1 - k) % (seats - 1);
          const std::size_t p = std::min(a, b), q = std::max(a, b);
          if (q >= groups) return;
          // Two groups that are as they were when they last met have nothing to share.
          if (changed[p] < sweep - 1 && changed[q] < sweep - 1) return;
          if (share(all, at, unit, p, q)) changed[p] = changed[q] = sweep;
        };
        if (unit >= kPart) {
          tbb::parallel_for(std::size_t{0}, seats / 2, meet);
        } else {
          for (std::size_t k = 0; k < seats / 2; ++k) meet(k);
        }
      }
      if (*std::max_element(changed.begin(), changed.end()) < sweep) break;
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
    struct Near {
      double distance2;
      std::uint32_t ball;
    };
    std::vector<Near> rest(range.size());
    for (std::size_t p = 0; p + 1 < at.size(); ++p) {
      const std::size_t taken = p * unit;
      if (range.size() - taken <= unit) return;
      rest.resize(range.size() - taken);
      for (std::size_t i = 0; i < rest.size(); ++i)
        rest[i] = {squared_distance(balls_[range[taken + i]], at[p]), range[taken + i]};
      std::nth_element(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(unit), rest.end(),
                       [](const Near& a, const Near& b) {
                         return a.distance2 != b.distance2 ? a.distance2 < b.distance2
                                                           : a.ball < b.ball;
                       });
      for (std::size_t i = 0; i < rest.size(); ++i) range[taken + i] = rest[i].ball;
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
