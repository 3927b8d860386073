// The grid functions of a build without the paper's grids: all of them throw.
#include <ist/types.h>

#include "packing/grids/pack_grids.h"

namespace ist::packing {

SpherePacking pack_grids(const MeshSolid&, const PackingSettings&, Stage&) {
  throw Error(
      "packing: this build has the banded mode alone; set grid to banded, or configure ist with "
      "-DIST_GRIDS=ON");
}

std::vector<MedialNode> medial_nodes_on_host(const MeshSolid&, const MedialSettings&) {
  throw Error("medial axis: this build has no grids; configure ist with -DIST_GRIDS=ON");
}

}  // namespace ist::packing
