#pragma once

#include <Eigen/Core>
#include <cmath>

namespace ist {

/// Planes that touch a surface near a place, and the point that lies on them best: on the edge or
/// the corner where they meet, in their middle where they are about one.
class PlaneFit {
 public:
  /// `normal`: of unit length, or zero where the surface has none.
  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    ++count_;
    points_ += point;
    const double offset = dot(normal, point);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) square_[i][j] += normal[i] * normal[j];
      moment_[i] += normal[i] * offset;
    }
  }

  Eigen::Vector3d best() const {
    // Tikhonov's regularisation, repeated from where it led: what the planes determine well is
    // found to many digits, along the rest the middle of the points stays.
    constexpr double kRegularisation = 0.01;  // squared sine of an angle of 6 degrees
    Eigen::Vector3d x = points_ / count_;
    const double weight = kRegularisation * count_;
    for (int pass = 0; pass < 4; ++pass) x = solved(weight, x);
    return x;
  }

 private:
  static double dot(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }

  /// Minimum of Σ (n·x − n·p)² + weight |x − from|², by Cholesky's factors.
  Eigen::Vector3d solved(double weight, const Eigen::Vector3d& from) const {
    double l[3][3] = {};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) {
        double sum = square_[i][j] + (i == j ? weight : 0.0);
        for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
        l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
      }
    Eigen::Vector3d x;
    for (int i = 0; i < 3; ++i) {
      double sum = moment_[i] + weight * from[i];
      for (int k = 0; k < i; ++k) sum -= l[i][k] * x[k];
      x[i] = sum / l[i][i];
    }
    for (int i = 2; i >= 0; --i) {
      for (int k = i + 1; k < 3; ++k) x[i] -= l[k][i] * x[k];
      x[i] /= l[i][i];
    }
    return x;
  }

  double count_ = 0;
  Eigen::Vector3d points_ = Eigen::Vector3d::Zero();
  double square_[3][3] = {};
  Eigen::Vector3d moment_ = Eigen::Vector3d::Zero();
};

}  // namespace ist
