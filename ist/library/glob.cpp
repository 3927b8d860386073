#include "library/glob.h"

#include <fnmatch.h>

#include <algorithm>
#include <system_error>

namespace ist {
namespace {

namespace fs = std::filesystem;

class Search {
 public:
  explicit Search(const fs::path& pattern) {
    for (const fs::path& part : pattern.relative_path()) parts_.push_back(part.string());
  }

  std::vector<fs::path> run(const fs::path& root) {
    enter(root, 0);
    for (fs::path& path : found_) path = path.lexically_normal();
    // ** before a name may lead to a file on several ways.
    std::sort(found_.begin(), found_.end());
    found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
    return std::move(found_);
  }

 private:
  static fs::path in(const fs::path& folder, const std::string& name) {
    return folder.empty() ? fs::path(name) : folder / name;
  }

  template <class Visit>
  static void for_entries(const fs::path& folder, const Visit& visit) {
    std::error_code error;
    fs::directory_iterator entry(folder.empty() ? "." : folder, error), end;
    for (; !error && entry != end; entry.increment(error)) visit(*entry);
  }

  void enter(const fs::path& folder, std::size_t at) {
    const bool last = at + 1 == parts_.size();
    const std::string& part = parts_[at];
    if (part == "**") {
      if (!last) enter(folder, at + 1);
      for_entries(folder, [&](const fs::directory_entry& entry) {
        const std::string name = entry.path().filename().string();
        std::error_code none;
        if (name.starts_with('.')) return;
        if (entry.is_directory(none) && !entry.is_symlink(none)) enter(in(folder, name), at);
        if (last && entry.is_regular_file(none)) found_.push_back(in(folder, name));
      });
    } else if (!is_pattern(part)) {
      take(in(folder, part), at);
    } else {
      for_entries(folder, [&](const fs::directory_entry& entry) {
        const std::string name = entry.path().filename().string();
        if (fnmatch(part.c_str(), name.c_str(), FNM_PERIOD) == 0) take(in(folder, name), at);
      });
    }
  }

  void take(const fs::path& path, std::size_t at) {
    std::error_code none;
    if (at + 1 == parts_.size()) {
      if (fs::is_regular_file(path, none)) found_.push_back(path);
    } else if (fs::is_directory(path, none)) {
      enter(path, at + 1);
    }
  }

  std::vector<std::string> parts_;
  std::vector<fs::path> found_;
};

}  // namespace

bool is_pattern(const std::string& path) { return path.find_first_of("*?[") != std::string::npos; }

std::vector<fs::path> matching_files(const fs::path& folder, const fs::path& pattern) {
  if (pattern.relative_path().empty()) return {};
  return Search(pattern).run(pattern.is_absolute() ? pattern.root_path() : folder);
}

}  // namespace ist
