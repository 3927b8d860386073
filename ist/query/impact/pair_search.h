#pragma once

#include "query/impact/convex_pair.h"
#include "query/impact/hull_pair.h"
#include "query/impact/impact_loop.h"
#include "query/impact/impact_side.h"
#include "query/impact/node_key.h"

namespace ist {

/// A point, or a ball around it, of a body that turns.
struct TurningPoint {
  Eigen::Vector3d place;     ///< in the frame
  Eigen::Vector3d velocity;  ///< by turning alone
  double radius = 0;
};

TurningPoint turning_point(const MovingBody& body, const Eigen::Matrix3d& turned,
                           const Eigen::Vector3d& base, const Eigen::Vector3d& x,
                           double radius) noexcept;

/// For how long two convex parts stay clear whose gap along the unit vector `n`, from A to B, is
/// known.
///
/// `turning`: the speed at which they approach along n now by turning alone; no point that counts
/// turns faster than at speed_a, speed_b. Of balls only the centres count, for a ball that turns
/// stays where it is.
double clear_step(const MovingFrame& frame, const Eigen::Vector3d& n, double gap, double turning,
                  double speed_a, double speed_b) noexcept;

/// The search for the impact of two moving trees.
class PairSearch {
 public:
  PairSearch(const MovingFrame& frame, const ImpactSide& a, const ImpactSide& b,
             ImpactLoop& loop) noexcept
      : frame_(frame), a_(a), b_(b), loop_(loop) {}

  TimeOfImpact run() noexcept;

 private:
  struct Piece {
    ConvexPiece shape;            ///< in the frame
    Eigen::Vector3d velocity[3];  ///< of its corners, by turning
    double fastest = 0;           ///< of these
  };
  struct Approach {
    double gap, step;
  };

  TurningPoint ball_a(NodeKey node, const Placement& at) const noexcept;
  TurningPoint ball_b(NodeKey node, const Placement& at) const noexcept;
  Approach approach(const TurningPoint& a, const TurningPoint& b,
                    const Placement& at) const noexcept;
  void look(NodeKey a, NodeKey b, const Placement& at) noexcept;
  bool look_at_hulls(NodeKey a, NodeKey b, const TurningPoint& ball_of_a,
                     const TurningPoint& ball_of_b, const Placement& at) noexcept;
  void open(NodeKey a, NodeKey b, bool open_a, const TurningPoint& other,
            const Placement& at) noexcept;
  void offer(NodeKey a, NodeKey b, const Approach& approach) noexcept;
  Piece piece(const ImpactSide& side, const MovingBody& body, const Eigen::Matrix3d& turned,
              const Eigen::Vector3d& base, std::uint32_t number) const noexcept;
  void look_at_pieces(NodeKey a, NodeKey b, const Placement& at) noexcept;

  const MovingFrame& frame_;
  const ImpactSide& a_;
  const ImpactSide& b_;
  ImpactLoop& loop_;
};

}  // namespace ist
