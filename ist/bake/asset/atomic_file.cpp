#include "bake/asset/atomic_file.h"

#include <fcntl.h>
#include <ist/asset.h>
#include <unistd.h>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>

namespace ist {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw Error(path.string() + ": " + what + ": " + std::generic_category().message(errno));
}

class Descriptor {
 public:
  Descriptor() = default;
  Descriptor(const std::string& name, int flags) { open(name, flags); }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  bool open(const std::string& name, int flags) {
    fd_ = ::open(name.c_str(), flags, 0666);
    return fd_ >= 0;
  }
  bool is_open() const { return fd_ >= 0; }

  bool write_all(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return true;
  }

  /// A full disk may be reported only here, or on closing.
  bool sync() { return fsync(fd_) == 0; }
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

  /// Gives a file opened with O_TMPFILE a name; false if the name is taken.
  bool link(const std::string& name) const {
    const std::string self = "/proc/self/fd/" + std::to_string(fd_);
    return linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
  }

 private:
  int fd_ = -1;
};

/// A name beside the target for a file that is removed unless it is renamed to the target.
class TemporaryName {
 public:
  explicit TemporaryName(std::string target) : target_(std::move(target)) {}
  ~TemporaryName() {
    if (exists_) unlink(name_.c_str());
  }
  TemporaryName(const TemporaryName&) = delete;
  TemporaryName& operator=(const TemporaryName&) = delete;

  /// Tries names until create(name) made a file. A killed program may have left a file, and in a
  /// container the next program has its process id.
  template <class Create>
  bool take(const Create& create) {
    constexpr int kTries = 1000;
    static std::atomic<unsigned> counter = 0;  // two threads may write to one target
    for (int i = 0; i < kTries && !exists_; ++i) {
      name_ = target_ + "." + std::to_string(getpid()) + "." + std::to_string(counter++);
      exists_ = create(name_);
      if (!exists_ && errno != EEXIST) return false;
    }
    return exists_;
  }

  void move_to(const std::filesystem::path& path) {
    if (std::rename(name_.c_str(), path.c_str()) != 0) fail(path, "cannot replace the file");
    exists_ = false;
  }

 private:
  std::string target_, name_;
  bool exists_ = false;
};

}  // namespace

void write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) {
    errno = EISDIR;
    fail(path, "cannot write");
  }
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    Descriptor device(path.string(), O_WRONLY | O_CLOEXEC);
    if (!device.is_open() || !device.write_all(bytes)) fail(path, "cannot write");
    return;
  }

  // An unnamed file vanishes with the program, however that ends. If the file system has none (or
  // /proc, which gives it a name, is missing), the file has a temporary name from the start.
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  Descriptor nameless(folder, O_WRONLY | O_TMPFILE | O_CLOEXEC);
  if (nameless.is_open()) {
    if (!nameless.write_all(bytes) || !nameless.sync()) fail(path, "cannot write");
    if (nameless.link(path.string())) return;
    TemporaryName temporary(path.string());
    if (temporary.take([&](const std::string& name) { return nameless.link(name); }))
      return temporary.move_to(path);
  }
  TemporaryName temporary(path.string());
  Descriptor file;
  if (!temporary.take([&](const std::string& name) {
        return file.open(name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC);
      }))
    fail(path, "cannot create a file in this folder");
  if (!file.write_all(bytes) || !file.sync() || !file.close()) fail(path, "cannot write");
  temporary.move_to(path);
}

void write_atomically(const std::filesystem::path& path, std::string_view text) {
  write_atomically(path, std::as_bytes(std::span(text)));
}

void Asset::save(const std::filesystem::path& path) const {
  if (view_.empty()) throw Error(path.string() + ": nothing to save: the asset was moved from");
  write_atomically(path, bytes());
}

}  // namespace ist
