#include "bake/cluster/bounding_ball.h"

#include <array>
#include <cmath>
#include <limits>

namespace ist {
namespace {

constexpr int kMaxSupport = 4;  // a smallest ball in space touches at most four from inside
constexpr double kSlack = 1e-10;

/// Balls that the current smallest ball touches.
struct Support {
  std::array<Ball, kMaxSupport> balls;
  int count = 0;
};

/// Solves the symmetric system g x = a, g x = b of size n ≤ 3. False if it is close to singular.
bool solve(double g[3][3], double a[3], double b[3], int n) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(g[i][k]) > std::abs(g[pivot][k])) pivot = i;
    if (!(std::abs(g[pivot][k]) > 1e-24)) return false;
    for (int j = 0; j < n; ++j) std::swap(g[k][j], g[pivot][j]);
    std::swap(a[k], a[pivot]);
    std::swap(b[k], b[pivot]);
    for (int i = k + 1; i < n; ++i) {
      const double f = g[i][k] / g[k][k];
      for (int j = k; j < n; ++j) g[i][j] -= f * g[k][j];
      a[i] -= f * a[k];
      b[i] -= f * b[k];
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    for (int j = k + 1; j < n; ++j) {
      a[k] -= g[k][j] * a[j];
      b[k] -= g[k][j] * b[j];
    }
    a[k] /= g[k][k];
    b[k] /= g[k][k];
  }
  return true;
}

/// The ball with centre in the affine hull of the support's centres that touches each of them from
/// inside: |c − p_i| = R − r_i. With p_0 as origin the centre is u + R v, both linear solutions,
/// and |u + R v| = R − r_0 gives R. False if there is none.
bool tangent_ball(const Support& support, Ball& out) {
  const Ball& first = support.balls[0];
  const int n = support.count - 1;
  double p[3][3] = {};
  double g[3][3] = {};
  double a[3] = {};
  double b[3] = {};
  for (int i = 0; i < n; ++i) {
    const Ball& ball = support.balls[static_cast<std::size_t>(i) + 1];
    p[i][0] = ball.x - first.x;
    p[i][1] = ball.y - first.y;
    p[i][2] = ball.z - first.z;
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) g[i][j] = p[i][0] * p[j][0] + p[i][1] * p[j][1] + p[i][2] * p[j][2];
    const double r = support.balls[static_cast<std::size_t>(i) + 1].r;
    a[i] = (g[i][i] + (first.r - r) * (first.r + r)) / 2;
    b[i] = r - first.r;
  }
  if (!solve(g, a, b, n)) return false;
  double u[3] = {};
  double v[3] = {};
  for (int i = 0; i < n; ++i)
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
  for (int i = 0; i < support.count; ++i)
    largest = std::fmax(largest, support.balls[static_cast<std::size_t>(i)].r);
  double radius = std::numeric_limits<double>::infinity();
  const auto offer = [&](double candidate) {
    if (candidate >= largest * (1 - kSlack) && candidate < radius) radius = candidate;
  };
  if (std::abs(qa) < 1e-14) {
    if (qb != 0) offer(-qc / (2 * qb));
  } else {
    const double root = std::sqrt(std::fmax(qb * qb - qa * qc, 0));
    const double q = -(qb + (qb >= 0 ? root : -root));
    offer(q / qa);
    if (q != 0) offer(qc / q);
  }
  if (!(radius < std::numeric_limits<double>::infinity())) return false;
  out = {first.x + u[0] + radius * v[0], first.y + u[1] + radius * v[1],
         first.z + u[2] + radius * v[2], radius};
  return true;
}

/// The smallest ball of `support` and `added`, which it does not hold: tries every subset that
/// contains `added`, the only ones that can touch the new ball.
bool grow(const Support& support, const Ball& added, Support& best_support, Ball& best) {
  best.r = std::numeric_limits<double>::infinity();
  for (unsigned subset = 0; subset < (1u << support.count); ++subset) {
    Support trial;
    trial.balls[0] = added;
    trial.count = 1;
    for (int i = 0; i < support.count && trial.count <= kMaxSupport; ++i) {
      if ((subset >> i & 1u) == 0) continue;
      if (trial.count < kMaxSupport)
        trial.balls[static_cast<std::size_t>(trial.count)] =
            support.balls[static_cast<std::size_t>(i)];
      ++trial.count;
    }
    if (trial.count > kMaxSupport) continue;
    Ball ball;
    if (!tangent_ball(trial, ball) || ball.r >= best.r) continue;
    bool holds = true;
    for (int i = 0; i < support.count && holds; ++i)
      holds = reach(ball.x, ball.y, ball.z, support.balls[static_cast<std::size_t>(i)]) <=
              ball.r * (1 + kSlack);
    if (!holds) continue;
    best = ball;
    best_support = trial;
  }
  return best.r < std::numeric_limits<double>::infinity();
}

}  // namespace

// The radius grows with every ball that joins the support, so the walk ends; the cap is for ties
// within rounding only.
Ball bounding_ball(std::span<const Ball> balls) {
  Support support;
  support.count = 1;
  for (const Ball& ball : balls)
    if (&ball == balls.data() || ball.r > support.balls[0].r) support.balls[0] = ball;
  Ball current = support.balls[0];
  for (int step = 0; step < 100; ++step) {
    const Ball* farthest = nullptr;
    double worst = current.r * (1 + kSlack);
    for (const Ball& ball : balls) {
      const double r = reach(current.x, current.y, current.z, ball);
      if (r > worst) {
        worst = r;
        farthest = &ball;
      }
    }
    if (farthest == nullptr) return current;
    Support next_support;
    Ball next;
    if (!grow(support, *farthest, next_support, next) || next.r <= current.r) {
      current.r = worst;  // degenerate to rounding: hold it from where we stand
      return current;
    }
    support = next_support;
    current = next;
  }
  for (const Ball& ball : balls)
    current.r = std::fmax(current.r, reach(current.x, current.y, current.z, ball));
  return current;
}

}  // namespace ist
