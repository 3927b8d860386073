#include "bake/cluster/neural_gas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "bake/cluster/gas_kernel.h"

namespace ist {
namespace {

constexpr int kEpochs = 24;
constexpr int kSweeps = 20;
constexpr std::size_t kPart = 256;  // balls that one thread takes

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

  Prototypes prototypes(std::span<const std::uint32_t> range, std::size_t count) const {
    Prototypes at;  // start at balls spread over the range, which is in some order
    at.count = count;
    for (std::size_t p = 0; p < count; ++p) {
      const Ball& ball = balls_[range[(2 * p + 1) * range.size() / (2 * count)]];
      at.x[p] = ball.x, at.y[p] = ball.y, at.z[p] = ball.z;
    }
    // In parts of fixed size, added in their order: the same bits for any number of threads.
    std::vector<GasPull> pulls((range.size() + kPart - 1) / kPart);
    // Neighbourhood range λ from half the prototypes towards zero, where this is plain k-means. The
    // kernel q^rank with q = λ / (1 + λ) stands for exp(−rank / λ): five operations make it.
    double lambda = static_cast<double>(count) / 2;
    for (int epoch = 0; epoch < kEpochs; ++epoch, lambda *= 0.75) {
      PrototypeValues kernel{};
      kernel[0] = 1;
      for (std::size_t k = 1; k < count; ++k) kernel[k] = kernel[k - 1] * (lambda / (1 + lambda));
      const auto pull = [&](std::size_t k) {
        const std::size_t first = k * kPart;
        pulls[k] = pull_of(balls_, range.subspan(first, std::min(kPart, range.size() - first)), at,
                           kernel);
      };
      if (pulls.size() > 1) {
        tbb::parallel_for(std::size_t{0}, pulls.size(), pull);
      } else {
        pull(0);
      }
      for (std::size_t p = 0; p < count; ++p) {
        double x = 0, y = 0, z = 0, total = 0;
        for (const GasPull& part : pulls) {
          x += part.x[p];
          y += part.y[p];
          z += part.z[p];
          total += part.total[p];
        }
        if (total > 0) at.x[p] = x / total, at.y[p] = y / total, at.z[p] = z / total;
      }
    }
    return at;
  }

  double squared_distance(std::uint32_t ball, const Prototypes& at, std::size_t p) const {
    const double dx = balls_[ball].x - at.x[p];
    const double dy = balls_[ball].y - at.y[p];
    const double dz = balls_[ball].z - at.z[p];
    return dx * dx + dy * dy + dz * dz;
  }

  /// Sorts `range` into groups of `unit`, the last of what remains; the last ball stays last if
  /// `pinned`. Starts in the order of the range; then two groups at a time share out their balls
  /// anew, each to the prototype it prefers, until nothing moves: Σ distance² falls every time.
  void assign(std::span<std::uint32_t> range, Prototypes at, std::size_t unit, bool pinned) const {
    const std::size_t groups = at.count;
    if (pinned) {
      std::size_t nearest = 0;
      for (std::size_t p = 1; p < groups; ++p)
        if (squared_distance(range.back(), at, p) < squared_distance(range.back(), at, nearest))
          nearest = p;
      for (PrototypeValues* const values : {&at.x, &at.y, &at.z})
        std::swap((*values)[nearest], (*values)[groups - 1]);
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
  void fill_in_turn(std::span<std::uint32_t> range, const Prototypes& at, std::size_t unit) const {
    struct Near {
      double distance2;
      std::uint32_t ball;
    };
    std::vector<Near> rest(range.size());
    for (std::size_t p = 0; p + 1 < at.count; ++p) {
      const std::size_t taken = p * unit;
      if (range.size() - taken <= unit) return;
      rest.resize(range.size() - taken);
      for (std::size_t i = 0; i < rest.size(); ++i)
        rest[i] = {squared_distance(range[taken + i], at, p), range[taken + i]};
      std::nth_element(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(unit), rest.end(),
                       [](const Near& a, const Near& b) {
                         return a.distance2 != b.distance2 ? a.distance2 < b.distance2
                                                           : a.ball < b.ball;
                       });
      for (std::size_t i = 0; i < rest.size(); ++i) range[taken + i] = rest[i].ball;
    }
  }

  /// Shares out the balls of groups p and q anew. False: they stay as they are.
  bool share(std::span<std::uint32_t> range, const Prototypes& at, std::size_t unit, std::size_t p,
             std::size_t q) const {
    struct Member {
      double preference;  // negative: nearer to p's prototype
      std::uint32_t ball;
      bool operator<(const Member& other) const {
        return preference != other.preference ? preference < other.preference : ball < other.ball;
      }
    };
    const auto group = [&](std::size_t g) {
      return range.subspan(g * unit, std::min(unit, range.size() - g * unit));
    };
    const auto first = group(p), second = group(q);
    const auto member = [&](std::uint32_t i) {
      return Member{squared_distance(i, at, p) - squared_distance(i, at, q), i};
    };
    Member last = member(first[0]), foremost = member(second[0]);
    for (const std::uint32_t i : first.subspan(1)) last = std::max(last, member(i));
    for (const std::uint32_t i : second.subspan(1)) foremost = std::min(foremost, member(i));
    if (last < foremost) return false;
    // Those beyond dispute stay: what is before all of the second, what is behind all of the first.
    std::vector<Member> pool;
    const auto in_first = std::partition(first.begin(), first.end(),
                                         [&](std::uint32_t i) { return member(i) < foremost; });
    const auto in_second = std::partition(second.begin(), second.end(),
                                          [&](std::uint32_t i) { return last < member(i); });
    for (auto i = in_first; i != first.end(); ++i) pool.push_back(member(*i));
    const auto middle = static_cast<std::ptrdiff_t>(pool.size());
    for (auto i = in_second; i != second.end(); ++i) pool.push_back(member(*i));
    std::nth_element(pool.begin(), pool.begin() + middle, pool.end());
    std::size_t k = 0;
    for (auto i = in_first; i != first.end(); ++i) *i = pool[k++].ball;
    for (auto i = in_second; i != second.end(); ++i) *i = pool[k++].ball;
    return true;
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
