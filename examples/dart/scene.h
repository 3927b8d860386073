#pragma once

#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/Shape.hpp>
#include <dart/simulation/World.hpp>

#include <memory>
#include <string>
#include <vector>

#include "ist_shape.h"

/// What physics says: `measured` must lie in [low, high].
struct Truth {
  std::string what;
  double measured = 0, low = 0, high = 0;
  bool holds() const { return measured >= low && measured <= high; }
};

/// A body after a step.
struct Sample {
  double time = 0;                       ///< [s]
  Eigen::Vector3d position = {0, 0, 0};  ///< [m] of the centre of mass
  Eigen::Matrix3d rotation = {};         ///< body to world
  double speed = 0;                      ///< [m/s] of the centre of mass
  double spin = 0;                       ///< [rad/s]
  double energy = 0;                     ///< [J] kinetic and potential
  Eigen::Vector3d force = {0, 0, 0};     ///< [N] sum of the contact forces on the body
  Eigen::Vector3d torque = {0, 0, 0};    ///< [N m] about the centre of mass, likewise
  std::size_t contacts = 0;
  double depth = 0;  ///< [m] of the deepest contact
};

constexpr double kGravity = 9.81;   // [m/s²] along −z
constexpr double kTimeStep = 1e-3;  // [s] DART's own
constexpr double kDensity = 7800;   // [kg/m³]

/// One moving body on one fixed one under the detector "ist", and what is held against physics.
class Scene {
 public:
  /// `start`: of the shape's frame. Throws ist::Error if DART does not know the detector.
  Scene(std::string name, const dart::dynamics::ShapePtr& ground,
        const std::shared_ptr<ist_dart::IstShape>& solid, const Eigen::Isometry3d& start,
        double friction);

  /// Steps the world; keeps a sample a step and the wall time that it took.
  void run(double seconds);

  void expect(std::string what, double measured, double low, double high) {
    truths_.push_back({std::move(what), measured, low, high});
  }

  /// That the body lies still since `since`: in no step are the forces off the weight by 1 %, nor
  /// their moment off zero by 1 % of the weight times `arm` [m], and it does not creep.
  void expect_rest(double since, double arm);

  /// Of the samples since `since` the largest value(sample).
  template <class Value>
  double largest(double since, const Value& value) const {
    double most = -1e300;
    for (const Sample& one : samples_)
      if (one.time >= since) most = std::max(most, value(one));
    return most;
  }

  const std::string& name() const { return name_; }
  const dart::simulation::WorldPtr& world() const { return world_; }
  double weight() const { return body_->getMass() * kGravity; }  ///< [N]
  const std::vector<Sample>& samples() const { return samples_; }
  const std::vector<Truth>& truths() const { return truths_; }
  double steps_a_second() const { return static_cast<double>(samples_.size()) / wall_time_; }

 private:
  Sample look() const;

  std::string name_;
  dart::simulation::WorldPtr world_;
  dart::dynamics::BodyNode* body_ = nullptr;
  std::vector<Sample> samples_;
  std::vector<Truth> truths_;
  double wall_time_ = 0;
};

/// How the detector keeps DART's rules, one truth a rule: registration, signs, filters, limits,
/// distances. `cube`: of the sample of that name.
std::vector<Truth> check_interface(const ist::TreeView& cube);
