#include "bake/cluster/gas_kernel.h"
#include "base/bits.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/cluster/swap_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "bake/cluster/ball_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

using LaneValues = std::array<double, kWidth>;

void measure_group(SwapGroup& group) {
  const auto never = [](double) { return false; };
  const BallLanes& members = group.members;
  group.ball = smallest_ball(members, never);
  group.radius_without.fill(std::numeric_limits<double>::infinity());
  group.least_radius = group.ball.r;
  group.touching = 0;
  for (std::size_t i = 0; i < members.count; ++i) {
    Ball& without = group.without[i];
    without = group.ball;
    // Only a ball that touches the bounding ball from inside can contain it at its size.
    if (members.count == 1) {
      without.r = 0;
    } else if (reach(group.ball.x, group.ball.y, group.ball.z, members.ball(i)) >=
               group.ball.r * (1 - 1e-9)) {
      group.touching |= 1u << i;
      BallLanes rest = members;
      for (std::size_t k = i; k + 1 < members.count; ++k) rest.put(k, members.ball(k + 1));
      rest.close(members.count - 1);
      without = smallest_ball(rest, never);
    }
    group.radius_without[i] = without.r;
    group.least_radius = without.r < group.least_radius ? without.r : group.least_radius;
  }
}

/// Lower bounds of a group's radius after a ball replaces a member.
struct Fit {
  double farthest = 0;  ///< half of the chord across the ball and the member it is farthest from
  double next = 0;      ///< and the next farthest member
  std::size_t member = 0;

  Fit() = default;
  Fit(const BallLanes& members, const Ball& added) {
    const BallTag d;
    alignas(64) LaneValues radius;
    const BallVector half = hn::Set(d, 0.5), none = hn::Zero(d);
    BallVector most = none;
    for (std::size_t i = 0; i < kWidth; i += hn::Lanes(d)) {
      BallVector radii = (reaches_from(added, members, i) + hn::Set(d, added.r)) * half;
      if (i + hn::Lanes(d) > members.count)
        radii = i < members.count ? hn::IfThenElse(hn::FirstN(d, members.count - i), radii, none)
                                  : none;
      hn::Store(radii, d, radius.data() + i);
      most = hn::Max(most, radii);
    }
    farthest = hn::GetLane(hn::MaxOfLanes(d, most));
    while (radius[member] != farthest) ++member;
    radius[member] = 0;
    BallVector after = none;
    for (std::size_t i = 0; i < kWidth; i += hn::Lanes(d))
      after = hn::Max(after, hn::Load(d, radius.data() + i));
    next = hn::GetLane(hn::MaxOfLanes(d, after));
  }

  double least_radius(const SwapGroup& group, std::size_t left_out) const {
    const double across = left_out == member ? next : farthest;
    const double rest = group.radius_without[left_out];
    return across > rest ? across : rest;
  }
};

/// Lower bounds of a group's cost after a ball replaces a member, for the members of another group.
/// A ball of radius R that contains a set whose smallest ball has radius r has its centre within
/// √(R² − r²) of that one's. So R ≥ (D + r²/D) / 2 if it also contains a ball that reaches D from
/// there.
class JoinCosts {
 public:
  JoinCosts(const SwapGroup& group, const BallLanes& added, double reach) : group_(group) {
    if (group.members.count == 1) {  // there is no bound on the centre
      of_ball_.fill(0);
      return;
    }
    fill(group.ball, added, reach, of_ball_);
    for (const std::uint32_t i : set_bits(group.touching)) {
      fill(group.without[i], added, reach, of_touching_[i]);
    }
  }

  /// Costs by the ball that joins, for one replaced member.
  const LaneValues& row(std::size_t left_out) const {
    return (group_.touching >> left_out & 1u) != 0 ? of_touching_[left_out] : of_ball_;
  }

  /// Costs by the replaced member, for one ball that joins.
  LaneValues column(std::size_t joining) const {
    LaneValues costs;
    costs.fill(of_ball_[joining]);
    for (const std::uint32_t i : set_bits(group_.touching)) {
      costs[i] = of_touching_[i][joining];
    }
    return costs;
  }

 private:
  static void fill(const Ball& rest, const BallLanes& added, double reach, LaneValues& costs) {
    const BallTag d;
    // Balls are minimal to rounding, or slightly larger if they touch too many.
    constexpr double kSlack = 1 - 1e-4, kSmallest = 1e-150;
    const BallVector r = hn::Set(d, rest.r),
                     least = hn::Set(d, rest.r > kSmallest ? rest.r : kSmallest);
    for (std::size_t i = 0; i < kWidth; i += hn::Lanes(d)) {
      const BallVector far = hn::Max(reaches_from(rest, added, i), least);
      const BallVector radius = (far + r * (r / far)) * hn::Set(d, 0.5 * kSlack);
      const BallVector with_reach = radius + hn::Set(d, reach);
      hn::StoreU(with_reach * with_reach * with_reach, d, costs.data() + i);
    }
  }

  const SwapGroup& group_;
  LaneValues of_ball_;
  std::array<LaneValues, kWidth> of_touching_;
};

class SwapSearch {
 public:
  SwapSearch(const SwapGroup& a, const SwapGroup& b, double reach, double least_gain)
      : a_(a), b_(b), reach_(reach), now_(cost(a.ball.r) + cost(b.ball.r)) {
    best_.gain = least_gain * now_;
  }

  MemberSwap run(std::size_t pinned_a, std::size_t pinned_b) {
    const double least_cost_b = cost(b_.least_radius);
    if (!gains(cost(a_.least_radius), least_cost_b)) return {};
    const std::uint32_t free_b =
        ((1u << b_.members.count) - 1) & ~(pinned_b < kWidth ? 1u << pinned_b : 0);
    const std::uint32_t free_a =
        ((1u << a_.members.count) - 1) & ~(pinned_a < kWidth ? 1u << pinned_a : 0);
    const JoinCosts into_a_at_least(a_, b_.members, reach_),
        into_b_at_least(b_, a_.members, reach_);
    bool found = false;
    std::uint32_t fitted = 0;  // the members of b that have their fit into a
    std::array<Fit, kWidth> into_a;
    for (const std::uint32_t s : set_bits(free_a)) {
      const std::uint32_t hopeful =
          gaining(into_a_at_least.row(s), into_b_at_least.column(s)) & free_b;
      if (hopeful == 0) continue;
      const double without_a = cost(a_.radius_without[s]);
      if (!gains(without_a, least_cost_b)) continue;
      const Ball from_a = a_.members.ball(s);
      const Fit into_b(b_.members, from_a);
      for (const std::uint32_t t : set_bits(promising(without_a, into_b) & hopeful)) {
        const double least_b = cost(into_b.least_radius(b_, t));
        if (!gains(without_a, least_b)) continue;
        const Ball from_b = b_.members.ball(t);
        if ((fitted >> t & 1u) == 0) into_a[t] = Fit(a_.members, from_b);
        fitted |= 1u << t;
        if (!gains(cost(into_a[t].least_radius(a_, s)), least_b)) continue;
        const double cost_a =
            cost_with(a_, s, from_b, [&](double cost) { return gains(cost, least_b); });
        if (!gains(cost_a, least_b)) continue;
        const double cost_b =
            cost_with(b_, t, from_a, [&](double cost) { return gains(cost_a, cost); });
        if (!gains(cost_a, cost_b)) continue;
        best_ = {gain(cost_a, cost_b), s, t};
        found = true;
      }
    }
    return found ? best_ : MemberSwap{};
  }

 private:
  double cost(double radius) const {
    const double r = radius + reach_;
    return r * r * r;
  }

  /// Monotone in both costs, rounding included.
  double gain(double cost_a, double cost_b) const { return now_ - cost_a - cost_b; }
  bool gains(double cost_a, double cost_b) const { return gain(cost_a, cost_b) > best_.gain; }

  std::uint32_t gaining(const LaneValues& costs_a, const LaneValues& costs_b) const {
    const BallTag d;
    std::uint32_t bits = 0;
    for (std::size_t t = 0; t < kWidth; t += hn::Lanes(d))
      bits |= bits_of((hn::Set(d, now_) - hn::LoadU(d, costs_a.data() + t)) -
                          hn::LoadU(d, costs_b.data() + t) >
                      hn::Set(d, best_.gain))
              << t;
    return bits;
  }

  /// One bit a member of b: no bound shows that exchanging it is useless.
  std::uint32_t promising(double without_a, const Fit& into_b) const {
    const BallTag d;
    const std::size_t lanes = hn::Lanes(d);
    const BallVector left = hn::Set(d, now_ - without_a), reach = hn::Set(d, reach_),
                     least = hn::Set(d, best_.gain);
    alignas(64) LaneValues across;
    across.fill(into_b.farthest);
    across[into_b.member] = into_b.next;
    std::uint32_t bits = 0;
    for (std::size_t t = 0; t < kWidth; t += lanes) {
      // Unused lanes are excluded: cubes would overflow.
      const auto is_member = t + lanes <= b_.members.count
                                 ? hn::FirstN(d, lanes)
                                 : hn::FirstN(d, t < b_.members.count ? b_.members.count - t : 0);
      const BallVector radius = hn::IfThenElseZero(
          is_member,
          hn::Max(hn::Load(d, across.data() + t), hn::Load(d, b_.radius_without.data() + t)));
      const BallVector r = radius + reach;
      bits |= bits_of(hn::And(is_member, left - r * r * r > least)) << t;
    }
    return bits;
  }

  /// The cost of a group after a ball replaces a member, or a bound that is already too high.
  template <class Gains>
  double cost_with(const SwapGroup& group, std::size_t left_out, const Ball& added,
                   const Gains& gains) const {
    const Ball& rest = group.without[left_out];
    if (ist::reach(rest.x, rest.y, rest.z, added) <= rest.r) return cost(rest.r);
    BallLanes members = group.members;
    members.put(left_out, added);
    if (left_out == 0) members.close(members.count);
    return cost(smallest_ball(members, [&](double radius) { return !gains(cost(radius)); }).r);
  }

  const SwapGroup &a_, &b_;
  const double reach_, now_;
  MemberSwap best_;
};

MemberSwap best_swap(const SwapGroup& a, const SwapGroup& b, double reach, double least_gain,
                     std::size_t pinned_a, std::size_t pinned_b) {
  return SwapSearch(a, b, reach, least_gain).run(pinned_a, pinned_b);
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(measure_group);
HWY_EXPORT(best_swap);

void measure_group(SwapGroup& group) { HWY_DYNAMIC_DISPATCH(measure_group)(group); }

MemberSwap best_swap(const SwapGroup& a, const SwapGroup& b, double reach, double least_gain,
                     std::size_t pinned_a, std::size_t pinned_b) {
  return HWY_DYNAMIC_DISPATCH(best_swap)(a, b, reach, least_gain, pinned_a, pinned_b);
}

}  // namespace ist
#endif
