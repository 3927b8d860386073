#include <ist/solid.h>

namespace ist {

bool vdb_available() noexcept { return false; }

LevelSetMesh load_vdb(const std::string& path, const ProgressCallback&) {
  throw Error(path +
              ": this library was built without OpenVDB. Install libopenvdb-dev "
              "and build it again, or export a mesh");
}

}  // namespace ist
