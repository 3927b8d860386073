#include <ist/asset.h>

#include <cstddef>
#include <iterator>

namespace ist {

const char* describe(AssetStatus status) noexcept {
  constexpr const char* kSentences[] = {
      "sound",
      "the file is truncated; bake again",
      "the bytes do not start on a 64-byte boundary",
      "not an .ist asset",
      "written in another format version; bake again",
      "the content does not match its checksum; bake again",
      "a field or offset is out of range; bake again",
  };
  const auto place = static_cast<std::size_t>(status);
  return place < std::size(kSentences) ? kSentences[place] : "unknown status";
}

}  // namespace ist
