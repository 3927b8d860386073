#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace ist::testing {

/// A file that lives as long as this object, in a folder of its own.
class TempFile {
 public:
  TempFile(const std::string& name, const std::string_view bytes)
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("ist_" + std::to_string(getpid()) + "_" + std::to_string(++count()))) {
    std::filesystem::create_directories(folder_);
    add(name, bytes);
    path_ = folder_ / name;
  }
  ~TempFile() { std::filesystem::remove_all(folder_); }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;

  /// Another file beside it.
  void add(const std::string& name, const std::string_view bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  std::string path() const { return path_.string(); }

 private:
  static int& count() {
    static int value = 0;
    return value;
  }
  std::filesystem::path folder_, path_;
};

}  // namespace ist::testing
