#include <ist/asset.h>

#include "bake/asset/atomic_file.h"

namespace ist {

void Asset::save(const std::filesystem::path& path) const {
  if (view_.empty()) throw Error(path.string() + ": nothing to save: the asset was moved from");
  write_atomically(path, bytes());
}

}  // namespace ist
