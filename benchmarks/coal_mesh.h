#pragma once

// Coal on triangle meshes (cmake/peers.cmake: ist_peer_coal). Like FCL it knows surfaces only, and
// no scale.

#include <coal/BVH/BVH_model.h>
#include <coal/distance.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include <ist/mesh.h>
#include <ist/pose_eigen.h>

namespace ist::benchmark {

class CoalMesh {
 public:
  explicit CoalMesh(const TriangleMesh& mesh, double scale = 1) {
    std::vector<coal::Vec3s> vertices;
    for (const Eigen::Vector3d& v : mesh.vertices) vertices.push_back(scale * v);
    std::vector<coal::Triangle> triangles;
    for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    if (model_.beginModel() != coal::BVH_OK ||
        model_.addSubModel(vertices, triangles) != coal::BVH_OK ||
        model_.endModel() != coal::BVH_OK)
      throw std::runtime_error("Coal refuses the mesh");
  }

  /// [u] distance of the surfaces; 0 where they cross.
  static double distance(const CoalMesh& a, const CoalMesh& b, const Pose& pose_b) {
    const Eigen::Isometry3d place = to_isometry(pose_b);
    coal::DistanceRequest request;
    request.enable_signed_distance = false;
    coal::DistanceResult result;
    coal::distance(&a.model_, coal::Transform3s(), &b.model_,
                   coal::Transform3s(place.linear(), place.translation()), request, result);
    return std::max(0.0, double{result.min_distance});
  }

 private:
  coal::BVHModel<coal::OBBRSS> model_;
};

}  // namespace ist::benchmark
