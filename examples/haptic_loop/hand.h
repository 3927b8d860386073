#pragma once

#include <ist/query.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

#include "options.h"

// Where the hand holds the device, as time goes by.

/// A pose with a rotation that is easily compared.
struct HandPose {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [u] of the probe's origin
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
};

inline ist::Pose pose_of(const HandPose& hand) {
  const Eigen::Quaterniond& q = hand.turn;
  return {{q.w(), q.x(), q.y(), q.z()}, {hand.place.x(), hand.place.y(), hand.place.z()}};
}

/// A hand that strokes the object with the probe: it goes round over the surface, presses more and
/// less, and now and then lifts off. All it knows is the last answer.
class Stroke {
 public:
  Stroke(double object_volume, double probe_volume)
      : speed_(0.3 * std::cbrt(object_volume)), press_(0.02 * std::cbrt(probe_volume)) {
    place_ = 10 * std::cbrt(object_volume) * Eigen::Vector3d(1, 0.2, 0.1).normalized();
  }

  HandPose pose() const {
    return {place_,
            Eigen::Quaterniond(Eigen::AngleAxisd(0.7 * time_, Eigen::Vector3d(0.6, 0, 0.8)))};
  }

  void move(const ist::PenetrationAndSeparation& contact, double seconds) {
    time_ += seconds;
    const ist::Penetration& p = contact.penetration;
    const double area = p.force.norm();
    const double depth = p.volume > 0 && area > 0 ? p.volume / area : -contact.separation.distance;
    if (p.volume > 0 && area > 0) {
      out_ = p.force / area;
    } else if (contact.separation.distance > 0) {
      out_ = contact.separation.normal;
    }
    const double wanted = press_ * (1 + 1.5 * std::sin(5 * time_));
    // No faster than a hand, but for the way to the object at the start.
    const double step = depth < -5 * press_ ? -depth : 5 * speed_ * seconds;
    place_ += std::clamp(depth - wanted, -step, step) * out_;
    const Eigen::Vector3d round =
        Eigen::Vector3d(std::sin(0.37 * time_), std::cos(0.23 * time_), 0.5).normalized();
    place_ += speed_ * seconds * round.cross(out_);
  }

 private:
  double speed_;  ///< [u/s]
  double press_;  ///< [u] depth
  double time_ = 0;
  Eigen::Vector3d place_;
  Eigen::Vector3d out_ = Eigen::Vector3d::UnitX();
};

/// A hand that inserts a part and withdraws it along a closed, smooth path, with a periodic tremor
/// of 1 to 9 Hz.
class Insert {
 public:
  explicit Insert(const Options& options) : options_(options) {}

  HandPose at(double time) const {
    const double cycle = options_.seconds / options_.cycles;
    const double phase = std::fmod(time, cycle) / cycle;  // of the whole way there and back
    const double way = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * phase);
    const Eigen::Map<const Eigen::Vector3d> from(options_.from), to(options_.to);
    HandPose hand;
    hand.place = from + way * (to - from);
    double turned = 2 * std::numbers::pi * options_.turns * way;
    for (int k = 0; k < 6; ++k) {
      // Whole numbers of waves a cycle, so that the tremor closes.
      const double waves = std::max(1.0, std::round(cycle * kTremor[k]));
      const double wave = std::sin(2 * std::numbers::pi * (waves * phase)) / 3;
      if (k < 3) hand.place[k] += options_.wiggle * wave;
      if (k == 3) turned += kTurn * wave;
    }
    hand.turn = Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitZ());
    return hand;
  }

 private:
  static constexpr double kTremor[6] = {1.3, 2.9, 4.3, 6.1, 7.7, 8.9};  ///< [Hz]
  static constexpr double kTurn = 0.01;                                 ///< [rad]
  const Options& options_;
};

/// A motion from a file: rows t,x,y,z,qw,qx,qy,qz after a header, t [s] rising. Straight between
/// rows.
class Recorded {
 public:
  explicit Recorded(const std::string& file) {
    std::FILE* const in = std::fopen(file.c_str(), "r");
    char line[512];
    bool sound = in != nullptr && std::fgets(line, sizeof line, in) != nullptr;
    while (sound && std::fgets(line, sizeof line, in) != nullptr) {
      Row row;
      double q[4];
      sound = std::sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &row.time, &row.hand.place[0],
                          &row.hand.place[1], &row.hand.place[2], q, q + 1, q + 2, q + 3) == 8 &&
              (rows_.empty() || row.time > rows_.back().time);
      row.hand.turn = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
      rows_.push_back(row);
    }
    if (in != nullptr) std::fclose(in);
    if (!sound || rows_.empty()) {
      std::fprintf(stderr, "%s: no motion: t,x,y,z,qw,qx,qy,qz wanted\n", file.c_str());
      std::exit(1);
    }
  }

  HandPose at(double time) const {
    const auto after = std::upper_bound(rows_.begin(), rows_.end(), time,
                                        [](double t, const Row& row) { return t < row.time; });
    if (after == rows_.begin()) return rows_.front().hand;
    if (after == rows_.end()) return rows_.back().hand;
    const Row& row = *(after - 1);
    const double part = (time - row.time) / (after->time - row.time);
    return {row.hand.place + part * (after->hand.place - row.hand.place),
            row.hand.turn.slerp(part, after->hand.turn)};
  }

 private:
  struct Row {
    double time = 0;
    HandPose hand;
  };
  std::vector<Row> rows_;
};
