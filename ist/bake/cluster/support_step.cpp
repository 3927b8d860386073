#include "bake/cluster/ball_lanes.h"

#include <cmath>
#include <limits>
#include <utility>

namespace ist {
namespace {

/// Solves the symmetric g x = a, g x = b of size N ≤ 3. False if close to singular. `pivots`: their
/// product.
template <int N>
bool solve(double (&g)[3][3], double (&a)[3], double (&b)[3], double& pivots) {
  pivots = 1;
  for (int k = 0; k < N; ++k) {
    int pivot = k;
    for (int i = k + 1; i < N; ++i)
      if (std::abs(g[i][k]) > std::abs(g[pivot][k])) pivot = i;
    if (!(std::abs(g[pivot][k]) > 1e-24)) return false;
    if (pivot != k) {
      for (int j = k; j < N; ++j) std::swap(g[k][j], g[pivot][j]);
      std::swap(a[k], a[pivot]);
      std::swap(b[k], b[pivot]);
    }
    pivots *= std::abs(g[k][k]);
    for (int i = k + 1; i < N; ++i) {
      const double f = g[i][k] / g[k][k];
      for (int j = k; j < N; ++j) g[i][j] -= f * g[k][j];
      a[i] -= f * a[k];
      b[i] -= f * b[k];
    }
  }
  for (int k = N - 1; k >= 0; --k) {
    for (int j = k + 1; j < N; ++j) {
      a[k] -= g[k][j] * a[j];
      b[k] -= g[k][j] * b[j];
    }
    a[k] /= g[k][k];
    b[k] /= g[k][k];
  }
  return true;
}

/// A ball that touches some balls from inside, with its centre in the affine hull of theirs.
struct TangentBall {
  Ball ball;
  /// The centre is Σ share · centre; the shares' sum is 1.
  std::array<double, kMaxSupport> shares{};
  /// Lower bound of the squared distance of any centre from the affine hull of the others.
  double height2 = std::numeric_limits<double>::infinity();
};

/// Solves |c − p_i| = R − r_i for all i ≤ N. With p_0 as origin the centre is u + R v, both linear
/// solutions, and |u + R v| = R − r_0 gives R. False if there is none.
template <int N>
bool tangent_ball(const std::array<Ball, kMaxSupport>& balls, TangentBall& out) {
  const Ball& first = balls[0];
  double p[3][3] = {};
  double g[3][3] = {};
  double a[3] = {};
  double b[3] = {};
  for (int i = 0; i < N; ++i) {
    const Ball& ball = balls[static_cast<std::size_t>(i) + 1];
    p[i][0] = ball.x - first.x;
    p[i][1] = ball.y - first.y;
    p[i][2] = ball.z - first.z;
  }
  double lengths2 = 1, least2 = std::numeric_limits<double>::infinity();
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) g[i][j] = p[i][0] * p[j][0] + p[i][1] * p[j][1] + p[i][2] * p[j][2];
    const double r = balls[static_cast<std::size_t>(i) + 1].r;
    a[i] = (g[i][i] + (first.r - r) * (first.r + r)) / 2;
    b[i] = r - first.r;
    lengths2 *= g[i][i];
    least2 = g[i][i] < least2 ? g[i][i] : least2;
  }
  double pivots = 1;
  if (!solve<N>(g, a, b, pivots)) return false;
  // A Gram determinant is a squared height times the determinant below it, which is at most the
  // product of lengths.
  if (N > 0) out.height2 = pivots * least2 / lengths2;
  double u[3] = {};
  double v[3] = {};
  for (int i = 0; i < N; ++i)
    for (int k = 0; k < 3; ++k) {
      u[k] += a[i] * p[i][k];
      v[k] += b[i] * p[i][k];
    }
  const double vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  const double uv = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const double uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
  const double qa = vv - 1;
  const double qb = uv + first.r;
  const double qc = uu - first.r * first.r;
  double largest = 0;
  for (std::size_t i = 0; i <= N; ++i) largest = balls[i].r > largest ? balls[i].r : largest;
  double radius = std::numeric_limits<double>::infinity();
  const auto offer = [&](double candidate) {
    if (candidate >= largest * (1 - kBallSlack) && candidate < radius) radius = candidate;
  };
  if (std::abs(qa) < 1e-14) {
    if (qb != 0) offer(-qc / (2 * qb));
  } else {
    const double square = qb * qb - qa * qc;
    const double root = std::sqrt(square > 0 ? square : 0);
    const double q = -(qb + (qb >= 0 ? root : -root));
    offer(q / qa);
    if (q != 0) offer(qc / q);
  }
  if (!(radius < std::numeric_limits<double>::infinity())) return false;
  out.ball = {first.x + u[0] + radius * v[0], first.y + u[1] + radius * v[1],
              first.z + u[2] + radius * v[2], radius};
  out.shares[0] = 1;
  for (std::size_t i = 0; i < N; ++i) {
    out.shares[i + 1] = a[i] + radius * b[i];
    out.shares[0] -= out.shares[i + 1];
  }
  return true;
}

bool tangent_ball(const Support& support, TangentBall& out) {
  switch (support.count) {
    case 1:
      return tangent_ball<0>(support.balls, out);
    case 2:
      return tangent_ball<1>(support.balls, out);
    case 3:
      return tangent_ball<2>(support.balls, out);
    default:
      return tangent_ball<3>(support.balls, out);
  }
}

/// A step from one smallest ball to the next, larger one.
class SupportStep {
 public:
  SupportStep(const Support& support, const Ball& added) : support_(support), added_(added) {}

  /// Finds the smallest ball of the support and `added`, outside it. False if there is none.
  bool run() { return guess() || try_all(); }

  const Support& support() const { return best_support_; }
  const Ball& ball() const { return best_; }

 private:
  /// `added` and the balls of the support whose bits are set.
  Support chosen(unsigned subset) const {
    Support trial;
    trial.balls[0] = added_;
    trial.count = 1;
    for (int i = 0; i < support_.count; ++i)
      if ((subset >> i & 1u) != 0)
        trial.balls[static_cast<std::size_t>(trial.count++)] =
            support_.balls[static_cast<std::size_t>(i)];
    return trial;
  }

  static bool holds(const Ball& ball, const Ball& other) {
    return reach(ball.x, ball.y, ball.z, other) <= ball.r * (1 + kBallSlack);
  }

  /// Tries every subset that contains `added`, the only ones that can touch the new ball.
  bool try_all() {
    best_.r = std::numeric_limits<double>::infinity();
    for (unsigned subset = 0; subset < (1u << support_.count); ++subset) {
      if (subset == (1u << kMaxSupport) - 1) continue;  // too many balls with `added`
      const Support trial = chosen(subset);
      TangentBall tangent;
      if (!tangent_ball(trial, tangent) || tangent.ball.r >= best_.r) continue;
      bool all = true;
      for (int i = 0; i < support_.count && all; ++i)
        all = holds(tangent.ball, support_.balls[static_cast<std::size_t>(i)]);
      if (!all) continue;
      best_ = tangent.ball;
      best_support_ = trial;
    }
    return best_.r < std::numeric_limits<double>::infinity();
  }

  /// A fast path of try_all(): finds its result unless that is ambiguous.
  bool guess() {
    const unsigned all = (1u << support_.count) - 1;
    if (support_.count < kMaxSupport) return follow(all);
    for (int i = 0; i < kMaxSupport; ++i)
      if (follow(all & ~(1u << i))) return true;
    return false;
  }

  /// Removes balls that pull the centre in the wrong direction, one after the other.
  bool follow(unsigned subset) {
    for (;;) {
      const Support trial = chosen(subset);
      TangentBall tangent;
      if (!tangent_ball(trial, tangent)) return false;
      int least = 0;
      for (int i = 1; i < trial.count; ++i)
        if (tangent.shares[static_cast<std::size_t>(i)] <
            tangent.shares[static_cast<std::size_t>(least)])
          least = i;
      if (tangent.shares[static_cast<std::size_t>(least)] >= kSureShare)
        return accept(trial, tangent, subset);
      if (least == 0 || tangent.shares[static_cast<std::size_t>(least)] > 0) return false;
      unsigned rest = subset;  // `least` is an index among the set bits
      for (int i = 1; i < least; ++i) rest &= rest - 1;
      subset &= ~(rest & (~rest + 1));
    }
  }

  /// A ball whose centre lies well within the balls that it touches is their smallest; if it also
  /// contains the others with a margin, it is the smallest of all. A subset without one of the
  /// former, or with one of the latter, has a centre so far away that its ball is larger or misses
  /// one.
  bool accept(const Support& trial, const TangentBall& tangent, unsigned subset) {
    const Ball& ball = tangent.ball;
    if (!(tangent.height2 >= kSureShare * kSureShare * ball.r * ball.r)) return false;
    for (int i = 0; i < trial.count; ++i) {
      const Ball& touched = trial.balls[static_cast<std::size_t>(i)];
      if (reach(ball.x, ball.y, ball.z, touched) < ball.r * (1 - kSureTouch)) return false;
    }
    for (int i = 0; i < support_.count; ++i) {
      const Ball& other = support_.balls[static_cast<std::size_t>(i)];
      const bool is_touched = (subset >> i & 1u) != 0;
      if (is_touched ? !holds(ball, other)
                     : !(reach(ball.x, ball.y, ball.z, other) < ball.r * (1 - kSureMargin)))
        return false;
    }
    best_ = ball;
    best_support_ = trial;
    return true;
  }

  static constexpr double kSureShare = 1e-2, kSureTouch = 1e-9, kSureMargin = 1e-3;

  const Support& support_;
  const Ball& added_;
  Support best_support_;
  Ball best_;
};

}  // namespace

bool grow(Support& support, const Ball& added, Ball& ball) {
  SupportStep step(support, added);
  if (!step.run()) return false;
  ball = step.ball();
  support = step.support();
  return true;
}

}  // namespace ist
