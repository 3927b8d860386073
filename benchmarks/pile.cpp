// Fifty solids in a heap, pushed apart by gradient descent: along the gradient of the overlaps'
// volumes, and, in the same loop, along FCL's contacts. examples/python/pile.py is the first of
// these in Python.

#include <fcl/fcl.h>
#include <ist/bake.h>
#include <ist/query.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <ist/mass_properties.h>
#include "mesh/samples/samples.h"
#include "report.h"
#include "timing.h"

namespace {

using ist::benchmark::Report;
using Model = fcl::BVHModel<fcl::OBBRSSd>;

constexpr std::size_t kObjects = 50;
constexpr std::array kShapes = {"gear", "torus_knot", "nut", "torus", "capsule"};
constexpr double kMargin = 1.03;  // solids are asked this much larger in the end
constexpr int kSwelling = 100;    // steps until they are
constexpr int kMostSteps = 1000;

struct Shape {
  ist::TriangleMesh mesh;
  ist::Asset asset;
  double scale;  ///< to a ball of radius 1
};

using Poses = std::vector<ist::Pose>;
/// Of the energy by a translation and a rotation vector of each object.
struct Slopes {
  std::vector<Eigen::Vector3d> translation, rotation;
  double energy = 0;
};

std::vector<Shape> make_shapes() {
  std::vector<Shape> shapes;
  for (const char* name : kShapes) {
    ist::ClosedMesh closed = ist::close_mesh(ist::make_sample(name), name);
    ist::Asset asset = ist::bake(closed, {.max_spheres = 1000});
    const double scale = 1 / ist::bounds(asset.view()).radius;
    shapes.push_back({std::move(closed.mesh), std::move(asset), scale});
  }
  return shapes;
}

Poses heap(unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Poses poses(kObjects);
  for (ist::Pose& pose : poses) {
    Eigen::Map<Eigen::Vector4d> q(pose.q);
    for (double& x : q) x = normal(random);
    q.normalize();
    Eigen::Map<Eigen::Vector3d> t(pose.t);
    for (double& x : t) x = normal(random);
    t *= 0.7 * std::cbrt(kObjects * uniform(random)) / t.norm();
  }
  return poses;
}

/// The sum of all overlap volumes.
Slopes by_volumes(const std::vector<Shape>& shapes, const Poses& poses, double swollen,
                  ist::Workspace& workspace) {
  Slopes slopes{std::vector<Eigen::Vector3d>(kObjects, Eigen::Vector3d::Zero()), {}, 0};
  slopes.rotation = slopes.translation;
  const auto placed = [&](std::size_t i) {
    const Shape& shape = shapes[i % shapes.size()];
    return ist::PlacedAsset{shape.asset.view(), poses[i], shape.scale * swollen};
  };
  for (std::size_t i = 0; i < kObjects; ++i)
    for (std::size_t k = i + 1; k < kObjects; ++k) {
      const ist::Penetration p = penetration(placed(i), placed(k), {}, workspace);
      if (p.volume == 0) continue;
      slopes.energy += p.volume;
      slopes.translation[k] -= p.force;
      slopes.rotation[k] -= p.torque;
      slopes.translation[i] += p.force;
      const Eigen::Vector3d way = Eigen::Vector3d(poses[k].t) - Eigen::Vector3d(poses[i].t);
      slopes.rotation[i] += p.torque + way.cross(p.force);
    }
  return slopes;
}

std::vector<std::shared_ptr<Model>> models(const std::vector<Shape>& shapes, double swollen) {
  std::vector<std::shared_ptr<Model>> all;
  for (const Shape& shape : shapes) {
    const auto model = std::make_shared<Model>();
    model->beginModel();
    for (const auto& corners : shape.mesh.triangles) {
      const auto vertex = [&](int c) -> fcl::Vector3d {
        return shape.scale * swollen * shape.mesh.vertices[corners[static_cast<std::size_t>(c)]];
      };
      model->addTriangle(vertex(0), vertex(1), vertex(2));
    }
    model->endModel();
    all.push_back(model);
  }
  return all;
}

/// The sum of half the squared depths of FCL's contacts, each a spring along its normal.
Slopes by_contacts(const std::vector<std::shared_ptr<Model>>& of, const Poses& poses,
                   std::size_t most_contacts) {
  Slopes slopes{std::vector<Eigen::Vector3d>(kObjects, Eigen::Vector3d::Zero()), {}, 0};
  slopes.rotation = slopes.translation;
  const auto placed = [&](std::size_t i) {
    fcl::Transform3d pose = fcl::Transform3d::Identity();
    const double* const q = poses[i].q;
    pose.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(poses[i].t);
    return fcl::CollisionObjectd(of[i % of.size()], pose);
  };
  std::vector<fcl::CollisionObjectd> objects;
  for (std::size_t i = 0; i < kObjects; ++i) objects.push_back(placed(i));
  for (std::size_t i = 0; i < kObjects; ++i)
    for (std::size_t k = i + 1; k < kObjects; ++k) {
      if (!objects[i].getAABB().overlap(objects[k].getAABB())) continue;
      const fcl::CollisionRequestd request(most_contacts, true);
      fcl::CollisionResultd result;
      fcl::collide(&objects[i], &objects[k], request, result);
      for (std::size_t c = 0; c < result.numContacts(); ++c) {
        const fcl::Contactd& contact = result.getContact(c);
        // The normal leads from i to k.
        const Eigen::Vector3d push = std::abs(contact.penetration_depth) * contact.normal;
        slopes.energy += 0.5 * contact.penetration_depth * contact.penetration_depth;
        slopes.translation[k] -= push;
        slopes.translation[i] += push;
        slopes.rotation[k] -= (contact.pos - Eigen::Vector3d(poses[k].t)).cross(push);
        slopes.rotation[i] += (contact.pos - Eigen::Vector3d(poses[i].t)).cross(push);
      }
    }
  return slopes;
}

/// Adam over six numbers an object; rotation vectors turn the poses.
class Adam {
 public:
  void step(const Slopes& slopes, Poses& poses) {
    ++count_;
    for (std::size_t i = 0; i < kObjects; ++i) {
      Eigen::Matrix<double, 6, 1> slope;
      slope << slopes.translation[i], slopes.rotation[i];
      mean_[i] = kMean * mean_[i] + (1 - kMean) * slope;
      square_[i] = kSquare * square_[i] + (1 - kSquare) * slope.cwiseAbs2();
      const Eigen::Matrix<double, 6, 1> way =
          -kRate * (mean_[i] / (1 - std::pow(kMean, count_)))
                       .cwiseQuotient(((square_[i] / (1 - std::pow(kSquare, count_))).cwiseSqrt() +
                                       Eigen::Matrix<double, 6, 1>::Constant(1e-8)));
      Eigen::Map<Eigen::Vector3d>(poses[i].t) += way.head<3>();
      const Eigen::Vector3d turn = way.tail<3>();
      if (turn.norm() < 1e-15) continue;
      double* const q = poses[i].q;
      const Eigen::Quaterniond turned = (Eigen::AngleAxisd(turn.norm(), turn.normalized()) *
                                         Eigen::Quaterniond(q[0], q[1], q[2], q[3]))
                                            .normalized();
      q[0] = turned.w(), q[1] = turned.x(), q[2] = turned.y(), q[3] = turned.z();
    }
  }

 private:
  static constexpr double kRate = 0.03, kMean = 0.8, kSquare = 0.9;

  int count_ = 0;
  std::vector<Eigen::Matrix<double, 6, 1>> mean_ = zeros(), square_ = zeros();

  static std::vector<Eigen::Matrix<double, 6, 1>> zeros() {
    return std::vector<Eigen::Matrix<double, 6, 1>>(kObjects, Eigen::Matrix<double, 6, 1>::Zero());
  }
};

struct Run {
  int steps = 0;
  double seconds = 0;  ///< of queries and steps
  double energy = 0;   ///< left at the end
};

/// `ask(poses, swollen, seconds)` gives slopes and adds what it took.
template <class Ask>
Run run(Poses& poses, const Ask& ask) {
  Run run;
  Adam adam;
  while (run.steps < kMostSteps) {
    const double swollen = std::min(1.0, 0.3 + 0.7 * run.steps / kSwelling);
    const Slopes slopes = ask(poses, swollen * kMargin, run.seconds);
    ++run.steps;
    run.energy = slopes.energy;
    if (slopes.energy == 0 && swollen == 1) break;
    const double start = ist::benchmark::thread_seconds();
    if (slopes.energy > 0) adam.step(slopes, poses);
    run.seconds += ist::benchmark::thread_seconds() - start;
  }
  return run;
}

}  // namespace

int main(int argc, char** argv) {
  Report report("pile", argc, argv);
  report.remark(
      "Fifty solids of five samples, 1,000 spheres each, from a heap of which a seventh of all "
      "pairs overlap; one thread, thread time. Both loops are the same: all pairs are asked, Adam "
      "steps along the slopes, solids swell from 30 to 103 % over 100 steps and go on until "
      "nothing is found, 1,000 steps at most. Slopes are the volumes' gradients, or springs at "
      "FCL's contacts along their normals (as many as said); making FCL's models anew for each "
      "size is not counted. What is left is told by this library's volumes at the real size, and "
      "by FCL, which does not see a solid wholly in another.");
  const std::vector<Shape> shapes = make_shapes();
  const auto real_size = models(shapes, 1);
  ist::Workspace workspace;
  const unsigned seeds = report.quick() ? 1 : 3;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const auto note = [&](const std::string& by, const Poses& poses, const Run& run) {
      const Slopes left = by_volumes(shapes, poses, 1, workspace);
      report.row("A heap pushed apart",
                 {{"heap", seed},
                  {"by", by},
                  {"steps", run.steps},
                  {"s", run.seconds},
                  {"ms a step", 1e3 * run.seconds / run.steps},
                  {"u³ left", left.energy},
                  {"FCL sees contact", by_contacts(real_size, poses, 1).energy > 0}});
    };
    const auto timed = [](double& seconds, const auto& work) {
      const double start = ist::benchmark::thread_seconds();
      Slopes slopes = work();
      seconds += ist::benchmark::thread_seconds() - start;
      return slopes;
    };
    Poses poses = heap(seed);
    const Run ours = run(poses, [&](const Poses& now, double swollen, double& seconds) {
      return timed(seconds, [&] { return by_volumes(shapes, now, swollen, workspace); });
    });
    note("volumes", poses, ours);
    for (const std::size_t contacts : {16u, 1000u}) {
      poses = heap(seed);
      const Run theirs = run(poses, [&](const Poses& now, double swollen, double& seconds) {
        const auto swollen_models = models(shapes, swollen);
        return timed(seconds, [&] { return by_contacts(swollen_models, now, contacts); });
      });
      note("FCL, " + std::to_string(contacts) + " contacts", poses, theirs);
    }
  }
  return report.write();
}
