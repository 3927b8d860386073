#include <ist/solid.h>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <utility>

namespace ist {
namespace {

struct IntegratedVolume {
  double value = 0;  ///< [u³]
  double error = 0;  ///< [u³]
};

constexpr int kMaxLevel = 20;
constexpr std::uint64_t kMaxUndecided = 1'000'000;

/// The volume by levels of an octree, in units of the root cell.
struct Levels {
  int finest = 0;
  std::array<double, kMaxLevel + 1> volume{};  ///< if refinement ended at this level
  std::uint64_t undecided = 0;                 ///< cells at the finest level
};

void visit(const Solid& solid, const Eigen::Vector3d& centre, double half, int level,
           Levels& levels) {
  const double cell = std::ldexp(1.0, -3 * level);
  const double distance = solid.signed_distance(centre);
  const double half_diagonal = half * 1.7320508075688774;
  if (std::abs(distance) >= half_diagonal) {
    if (distance < 0)
      for (int finer = level; finer <= levels.finest; ++finer)
        levels.volume[std::size_t(finer)] += cell;
    return;
  }
  // Exact for planes along the axes, right on average for others.
  levels.volume[std::size_t(level)] += cell * std::clamp(0.5 - distance / (2 * half), 0.0, 1.0);
  if (level == levels.finest) {
    ++levels.undecided;
    return;
  }
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d side((i & 1) ? half : -half, (i & 2) ? half : -half,
                               (i & 4) ? half : -half);
    visit(solid, centre + side / 2, half / 2, level + 1, levels);
  }
}

/// The volume of a solid that provides only a signed distance. Octree cells that the distance
/// decides count fully or not at all, others by the depth of their centres. The error falls about
/// fourfold a level. The stated error is the larger of twice the last level's change and the change
/// of the level before, plus an allowance for chance: a generous estimate, not a proof.
IntegratedVolume integrate_volume(const Solid& solid) {
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const double half = (bounds.max() / 2 - bounds.min() / 2).maxCoeff();
  Levels levels;
  for (int finest = 6; finest <= kMaxLevel; ++finest) {
    levels = Levels();
    levels.finest = finest;
    visit(solid, bounds.min() / 2 + bounds.max() / 2, half, 0, levels);
    if (4 * levels.undecided > kMaxUndecided) break;
  }
  const double* last = &levels.volume[std::size_t(levels.finest)];
  const double change = std::max(2 * std::abs(last[0] - last[-1]), std::abs(last[-1] - last[-2]));
  const double chance = std::sqrt(double(levels.undecided)) * std::ldexp(0.2, -3 * levels.finest);
  const double root = 8 * half * half * half;
  return {root * last[0], root * (change + chance)};
}

constexpr double kPi = std::numbers::pi;

/// A solid whose volume has no closed form: integrated at the first call.
class IntegratedSolid : public Solid {
 public:
  double volume() const override { return integrated().value; }
  double volume_error() const override { return integrated().error; }

 private:
  const IntegratedVolume& integrated() const {
    std::call_once(once_, [this] { volume_ = integrate_volume(*this); });
    return volume_;
  }

  mutable std::once_flag once_;
  mutable IntegratedVolume volume_;
};

void require_length(double value, const char* what) {
  if (!(value > 0) || !std::isfinite(value))
    throw Error(std::string(what) + " must be finite and > 0");
}

void require_point(const Eigen::Vector3d& p) {
  if (!p.allFinite()) throw Error("the centre of a solid must be finite");
}

class Ball final : public Solid {
 public:
  Ball(const Eigen::Vector3d& centre, double radius) : centre_(centre), radius_(radius) {
    require_point(centre);
    require_length(radius, "the radius of a ball");
  }
  double signed_distance(const Eigen::Vector3d& x) const override {
    return (x - centre_).norm() - radius_;
  }
  Eigen::AlignedBox3d bounds() const override {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius_);
    return {centre_ - reach, centre_ + reach};
  }
  double volume() const override { return 4 * kPi / 3 * radius_ * radius_ * radius_; }

 private:
  Eigen::Vector3d centre_;
  double radius_;
};

class Box final : public Solid {
 public:
  Box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_extent)
      : centre_(centre), half_extent_(half_extent) {
    require_point(centre);
    for (int k = 0; k < 3; ++k) require_length(half_extent[k], "the half-extents of a box");
  }
  double signed_distance(const Eigen::Vector3d& x) const override {
    const Eigen::Vector3d beyond = (x - centre_).cwiseAbs() - half_extent_;
    const double deepest = beyond.maxCoeff();
    return deepest <= 0 ? deepest : beyond.cwiseMax(0.0).norm();
  }
  Eigen::AlignedBox3d bounds() const override {
    return {centre_ - half_extent_, centre_ + half_extent_};
  }
  double volume() const override { return 8 * half_extent_.prod(); }

 private:
  Eigen::Vector3d centre_, half_extent_;
};

class Torus final : public Solid {
 public:
  Torus(const Eigen::Vector3d& centre, double major, double minor)
      : centre_(centre), major_(major), minor_(minor) {
    require_point(centre);
    require_length(major, "the major radius of a torus");
    require_length(minor, "the minor radius of a torus");
    if (minor > major) throw Error("the minor radius of a torus must not exceed the major one");
  }
  double signed_distance(const Eigen::Vector3d& x) const override {
    const Eigen::Vector3d p = x - centre_;
    return Eigen::Vector2d(p.head<2>().norm() - major_, p.z()).norm() - minor_;
  }
  Eigen::AlignedBox3d bounds() const override {
    const Eigen::Vector3d reach(major_ + minor_, major_ + minor_, minor_);
    return {centre_ - reach, centre_ + reach};
  }
  double volume() const override { return 2 * kPi * kPi * major_ * minor_ * minor_; }

 private:
  Eigen::Vector3d centre_;
  double major_, minor_;
};

enum class Combination { join, meet, subtract };

class Combined final : public IntegratedSolid {
 public:
  Combined(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b, Combination combination)
      : a_(std::move(a)), b_(std::move(b)), combination_(combination) {
    if (a_ == nullptr || b_ == nullptr)
      throw Error("a combination of solids needs two solids; one is null");
    if (bounds().isEmpty())
      throw Error("the two solids do not overlap: their intersection is empty");
  }
  double signed_distance(const Eigen::Vector3d& x) const override {
    const double a = a_->signed_distance(x), b = b_->signed_distance(x);
    if (combination_ == Combination::join) return std::min(a, b);
    return std::max(a, combination_ == Combination::meet ? b : -b);
  }
  Eigen::AlignedBox3d bounds() const override {
    if (combination_ == Combination::join) return a_->bounds().merged(b_->bounds());
    if (combination_ == Combination::meet) return a_->bounds().intersection(b_->bounds());
    return a_->bounds();
  }

 private:
  std::unique_ptr<Solid> a_, b_;
  Combination combination_;
};

class FunctionSolid final : public IntegratedSolid {
 public:
  FunctionSolid(std::function<double(const Eigen::Vector3d&)> signed_distance,
                const Eigen::AlignedBox3d& bounds)
      : signed_distance_(std::move(signed_distance)), bounds_(bounds) {
    if (!signed_distance_) throw Error("the signed distance function of a solid is null");
    unit_frame(bounds);  // throws if there is no box
  }
  double signed_distance(const Eigen::Vector3d& x) const override { return signed_distance_(x); }
  Eigen::AlignedBox3d bounds() const override { return bounds_; }

 private:
  std::function<double(const Eigen::Vector3d&)> signed_distance_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace

std::unique_ptr<Solid> make_ball(const Eigen::Vector3d& centre, double radius) {
  return std::make_unique<Ball>(centre, radius);
}

std::unique_ptr<Solid> make_box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_extent) {
  return std::make_unique<Box>(centre, half_extent);
}

std::unique_ptr<Solid> make_torus(const Eigen::Vector3d& centre, double major, double minor) {
  return std::make_unique<Torus>(centre, major, minor);
}

std::unique_ptr<Solid> make_function_solid(
    std::function<double(const Eigen::Vector3d&)> signed_distance,
    const Eigen::AlignedBox3d& bounds) {
  return std::make_unique<FunctionSolid>(std::move(signed_distance), bounds);
}

std::unique_ptr<Solid> make_union(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b) {
  return std::make_unique<Combined>(std::move(a), std::move(b), Combination::join);
}

std::unique_ptr<Solid> make_intersection(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b) {
  return std::make_unique<Combined>(std::move(a), std::move(b), Combination::meet);
}

std::unique_ptr<Solid> make_difference(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b) {
  return std::make_unique<Combined>(std::move(a), std::move(b), Combination::subtract);
}

}  // namespace ist
