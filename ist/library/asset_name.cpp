#include "library/asset_name.h"

#include <fmt/format.h>

#include <ist/error.h>

namespace ist {
namespace {

namespace fs = std::filesystem;

std::string folders_to(const fs::path& file, const fs::path& root) {
  std::string out;
  for (const fs::path& part : fs::absolute(file).parent_path().lexically_relative(
           fs::absolute(root / ".").lexically_normal().parent_path()))
    if (part != "." && part != ".." && !part.empty())
      out += fmt::format("{}{}", out.empty() ? "" : "-", part.string());
  return out;
}

}  // namespace

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
