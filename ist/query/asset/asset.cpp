#include <ist/asset.h>
#include <ist/asset_layout.h>
#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <new>
#include <system_error>
#include <vector>

namespace ist {
namespace {

constexpr std::align_val_t kAlignment{kAssetAlignment};

std::string reason(int error) { return std::generic_category().message(error); }

}  // namespace

const char* describe(AssetStatus status) noexcept {
  constexpr const char* kSentences[] = {
      "sound",
      "the file is truncated; bake again",
      "the bytes do not start on a 64-byte boundary",
      "not an .ist asset; ist bake makes one of a mesh",
      "written in another format version; bake again",
      "the content does not match its checksum; bake again",
      "a field or offset is out of range; bake again",
  };
  const auto place = static_cast<std::size_t>(status);
  return place < std::size(kSentences) ? kSentences[place] : "unknown status";
}

void Asset::AlignedDelete::operator()(std::byte* p) const noexcept {
  ::operator delete[](p, kAlignment);
}

Asset::Asset(std::span<const std::byte> bytes, const std::string& name)
    : data_(static_cast<std::byte*>(::operator new[](bytes.size(), kAlignment))),
      size_(bytes.size()) {
  std::copy(bytes.begin(), bytes.end(), data_.get());
  const AssetStatus status = AssetView::from_bytes(this->bytes(), view_);
  if (status != AssetStatus::ok) throw Error(name + ": " + describe(status));
}

Asset Asset::load(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw Error(path.string() + ": is a folder, no asset");
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw Error(path.string() + ": cannot open: " + reason(errno));
  const std::streamoff size = file.tellg();
  if (size < 0) throw Error(path.string() + ": cannot read: not a regular file");
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw Error(path.string() + ": cannot read: " + reason(errno));
  return Asset(bytes, path.string());
}

}  // namespace ist
