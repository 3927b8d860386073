#include "library/glob.h"

#include <fmt/format.h>
#include <fnmatch.h>
#include <ist/types.h>
#include <algorithm>
#include <iterator>
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
    // With ** before a name, a file may be found more than once.
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

std::string folders_to(const fs::path& file, const fs::path& root) {
  std::string out;
  for (const fs::path& part : fs::absolute(file).parent_path().lexically_relative(
           fs::absolute(root / ".").lexically_normal().parent_path()))
    if (part != "." && part != ".." && !part.empty())
      out += fmt::format("{}{}", out.empty() ? "" : "-", part.string());
  return out;
}

}  // namespace

bool is_pattern(const std::string& path) { return path.find_first_of("*?[") != std::string::npos; }

std::vector<fs::path> matching_files(const fs::path& folder, const fs::path& pattern) {
  if (pattern.relative_path().empty()) return {};
  return Search(pattern).run(pattern.is_absolute() ? pattern.root_path() : folder);
}

bool matches(const fs::path& path, const fs::path& pattern) {
  const fs::path names = path.lexically_normal(), parts = pattern.lexically_normal();
  const std::function<bool(fs::path::iterator, fs::path::iterator)> from =
      [&](fs::path::iterator name, fs::path::iterator part) {
        if (part == parts.end() || name == names.end())
          return part == parts.end() && name == names.end();
        if (*part == "**")
          return from(std::next(name), part) || from(name, std::next(part)) ||
                 (std::next(name) == names.end() && std::next(part) == parts.end());
        return fnmatch(part->c_str(), name->c_str(), FNM_PERIOD) == 0 &&
               from(std::next(name), std::next(part));
      };
  return from(names.begin(), parts.begin());
}

std::string name_for(const std::string& pattern, const fs::path& file, const fs::path& root) {
  std::string out;
  for (std::size_t at = 0; at < pattern.size();) {
    const std::size_t close = pattern.find('}', at);
    if (pattern[at] != '{' || close == std::string::npos) {
      out += pattern[at++];
      continue;
    }
    const std::string word = pattern.substr(at, close + 1 - at);
    if (word == "{stem}") {
      out += file.stem().string();
    } else if (word == "{ext}") {
      const std::string ending = file.extension().string();
      out.append(ending, ending.empty() ? 0 : 1);
    } else if (word == "{parent}") {
      out += fs::absolute(file).lexically_normal().parent_path().filename().string();
    } else if (word == "{dir}") {
      out += folders_to(file.lexically_normal(), root);
    } else {
      throw Error(fmt::format(
          "'{}' stands for nothing; use {{stem}}, {{ext}}, {{parent}} or {{dir}}", word));
    }
    at = close + 1;
  }
  return out;
}

}  // namespace ist
