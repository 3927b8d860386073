#include <ist/asset.h>

namespace ist {

const char* describe(AssetStatus status) noexcept {
  switch (status) {
    case AssetStatus::ok:
      return "sound";
    case AssetStatus::too_short:
      return "the file is truncated; bake again";
    case AssetStatus::misaligned:
      return "the bytes do not start on a 64-byte boundary";
    case AssetStatus::not_an_asset:
      return "not an .ist asset";
    case AssetStatus::other_version:
      return "written in another format version; bake again";
    case AssetStatus::corrupt_hash:
      return "the content does not match its checksum; bake again";
    case AssetStatus::corrupt_layout:
      return "a field or offset is out of range; bake again";
  }
  return "unknown status";
}

}  // namespace ist
