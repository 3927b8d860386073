#include <fcntl.h>
#include <ist/bake.h>
#include <ist/error.h>
#include <unistd.h>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>
#include <system_error>

#include "query/asset_layout.h"

namespace ist {
namespace {

constexpr std::align_val_t kAlignment{kAssetAlignment};

std::string reason(int error) { return std::generic_category().message(error); }

/// A file that vanishes unless it is renamed to its final name.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    static std::atomic<unsigned> counter = 0;  // two threads may save to one target
    do {
      name_ = target.string() + "." + std::to_string(getpid()) + "." + std::to_string(counter++);
      descriptor_ = open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) fail("cannot create a file in this folder");
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!renamed_) unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) fail("cannot write");
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }

  void rename_to_target() {
    if (fsync(descriptor_) != 0) fail("cannot write to disk");
    const int closed = close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) fail("cannot write to disk");
    if (std::rename(name_.c_str(), target_.c_str()) != 0) fail("cannot replace the file");
    renamed_ = true;
  }

 private:
  [[noreturn]] void fail(const char* what) {
    throw Error(target_.string() + ": " + what + ": " + reason(errno));
  }

  std::filesystem::path target_;
  std::string name_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

}  // namespace

void Asset::AlignedDelete::operator()(std::byte* p) const noexcept {
  ::operator delete[](p, kAlignment);
}

Asset::Asset(std::span<const std::byte> bytes, const std::string& name)
    : data_(static_cast<std::byte*>(::operator new[](bytes.size(), kAlignment))),
      size_(bytes.size()) {
  std::copy(bytes.begin(), bytes.end(), data_.get());
  const AssetStatus status = TreeView::from_bytes(this->bytes(), view_);
  if (status != AssetStatus::ok) throw Error(name + ": " + describe(status));
}

Asset Asset::load(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw Error(path.string() + ": cannot open: " + reason(errno));
  const std::streamoff size = file.tellg();
  if (size < 0) throw Error(path.string() + ": cannot read: not a regular file");
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), size))
    throw Error(path.string() + ": cannot read: " + reason(errno));
  return Asset(bytes, path.string());
}

void Asset::save(const std::filesystem::path& path) const {
  TemporaryFile file(path);
  file.write(bytes());
  file.rename_to_target();
}

}  // namespace ist
