#include "asset/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include <ist/error.h>

namespace ist {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw Error(path.string() + ": " + what + ": " + std::generic_category().message(errno));
}

class Descriptor {
 public:
  Descriptor(const std::string& name, int flags) : fd_(open(name.c_str(), flags, 0666)) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

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

  /// A full disk may show only here.
  bool sync_and_close() {
    const bool synced = fsync(fd_) == 0;
    const bool closed = close(std::exchange(fd_, -1)) == 0;
    return synced && closed;
  }

 private:
  int fd_;
};

/// The name of a file that is removed unless it was renamed.
struct TemporaryName {
  std::string name;
  bool exists = false;
  ~TemporaryName() {
    if (exists) unlink(name.c_str());
  }
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

  static std::atomic<unsigned> counter = 0;  // two threads may write to one target
  TemporaryName temporary{path.string() + "." + std::to_string(getpid()) + "." +
                          std::to_string(counter++)};
  Descriptor file(temporary.name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC);
  if (!file.is_open()) fail(path, "cannot create a file in this folder");
  temporary.exists = true;
  if (!file.write_all(bytes) || !file.sync_and_close()) fail(path, "cannot write");
  if (std::rename(temporary.name.c_str(), path.c_str()) != 0) fail(path, "cannot replace the file");
  temporary.exists = false;
}

void write_atomically(const std::filesystem::path& path, std::string_view text) {
  write_atomically(path, std::as_bytes(std::span(text)));
}

}  // namespace ist
