#include <ist/mesh.h>
#include <ist/types.h>
#include <utility>

#include "base/message_text.h"

namespace ist {

void scale_mesh(TriangleMesh& mesh, const Eigen::Vector3d& factors) {
  if (!factors.allFinite() || (factors.array() == 0).any())
    throw Error("scale: " + position_text(factors) + " makes no solid; factors are finite, not 0");
  if (factors == Eigen::Vector3d::Ones()) return;
  for (Eigen::Vector3d& v : mesh.vertices) v = v.cwiseProduct(factors);
  if ((factors.array() < 0).count() % 2 != 0)  // a mirror shows triangles from behind
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace ist
