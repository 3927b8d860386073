#pragma once

#include <ist/mesh.h>
#include <ist/pose_eigen.h>
#include <manifold/manifold.h>

namespace ist::benchmark {

/// A mesh as Manifold has it, for the volume of exact booleans.
class ManifoldMesh {
 public:
  explicit ManifoldMesh(const TriangleMesh& mesh) : solid_(of(mesh)) {}

  /// [u³] With B scaled about its origin, then placed.
  double overlap(const ManifoldMesh& b, const Pose& pose, double scale_b = 1) const {
    const Eigen::Matrix3d turned = scale_b * to_isometry(pose).linear();
    manifold::mat3x4 map;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) map[column][row] = turned(row, column);
      map[3][row] = pose.t[row];
    }
    return (solid_ ^ b.solid_.Transform(map)).Volume();
  }

 private:
  static manifold::Manifold of(const TriangleMesh& mesh) {
    manifold::MeshGL64 out;
    out.numProp = 3;
    for (const Eigen::Vector3d& v : mesh.vertices)
      out.vertProperties.insert(out.vertProperties.end(), v.data(), v.data() + 3);
    for (const auto& t : mesh.triangles)
      out.triVerts.insert(out.triVerts.end(), t.begin(), t.end());
    return manifold::Manifold(out);
  }
  manifold::Manifold solid_;
};

}  // namespace ist::benchmark
