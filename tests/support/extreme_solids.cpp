#include <ist/types.h>

#include "support/extreme_boxes.h"

// Extreme inputs of bakes.

namespace ist::testing {

/// A flat or thin box, turned, and what a cube makes of one end of it.
std::vector<Claim> of_thin_box(const Vector3d& half, bool turned) {
  TriangleMesh mesh = box_mesh(-half, half);
  const Eigen::Quaterniond q = turned ? Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized()
                                      : Eigen::Quaterniond::Identity();
  for (Vector3d& v : mesh.vertices) v = q * v;
  const ClosedMesh closed_mesh = close_mesh(mesh, "thin");
  const Asset thin = baked(closed_mesh), cube = baked(close_mesh(cube_mesh(), "cube"));
  Workspace workspace;
  // One end of it (its longest edge is x, turned) reaches 0.2 into the cube.
  const Eigen::Quaterniond back = q.inverse();
  const Vector3d t(0.5 - 0.2 + half.x(), 0.013, -0.021);
  const Pose pose{{back.w(), back.x(), back.y(), back.z()}, {t.x(), t.y(), t.z()}};
  const double exact = 8 * half.prod() * (0.2 / (2 * half.x()));
  const Penetration got = penetration({cube.view(), {}, 1}, {thin.view(), pose, 1}, {}, workspace);
  const Penetration inner = penetration({cube.view(), {}, 1}, {thin.view(), pose, 1},
                                        {.measure = Measure::inner}, workspace);
  return {{"matched volumes against the solid's", calibration_error(thin), 1e-6},
          {"volume error, a fifth of its length in a cube", std::abs(got.volume / exact - 1), 0.1},
          {"inner measure beyond the exact volume", std::max(0.0, inner.volume_min / exact - 1), 0},
          {"violations that `ist check` finds", violations(thin, closed_mesh), 0}};
}

/// One corner of the cube's top face lies 1e-7 beside the others' meeting point.
std::vector<Claim> of_crack() {
  TriangleMesh mesh = cube_mesh();
  const auto corner = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(mesh.vertices[7] + Vector3d(1e-7, -1e-7, 1e-7));
  std::size_t changed = 0;
  for (auto& t : mesh.triangles)
    for (std::uint32_t& v : t)
      if (v == 7 && changed == 0) v = corner, ++changed;
  bool is_refused = false;
  try {
    close_mesh(mesh, "cracked");
  } catch (const Error& error) {
    is_refused = std::string(error.what()).find("cracked: ") == 0;
  }
  const ClosedMesh repaired = close_mesh(mesh, "cracked", OpenMeshPolicy::repair);
  const Asset asset = baked(repaired);
  return {{"baked without a word", is_refused ? 0.0 : 1.0, 0},
          {"volume of the repaired cube, off 1 by", std::abs(asset.view().volume() - 1), 1e-6},
          {"violations that `ist check` finds", violations(asset, repaired), 0}};
}

/// Two cubes of one mesh that share a face, and half of one.
std::vector<Claim> of_touching_shells() {
  std::vector<Claim> claims;
  for (const double shift : {0.0, 0.5}) {
    const Vector3d low(0.5, -0.5 + shift, -0.5);
    const ClosedMesh mesh =
        close_mesh(joined(cube_mesh(), box_mesh(low, low + Vector3d::Ones())), "two cubes");
    const Asset asset = baked(mesh);
    const std::string which = shift == 0 ? "whole face: " : "half a face: ";
    claims.push_back({which + "volume, off 2 by", std::abs(asset.view().volume() - 2), 1e-6});
    claims.push_back({which + "violations that `ist check` finds", violations(asset, mesh), 0});
  }
  return claims;
}

}  // namespace ist::testing
