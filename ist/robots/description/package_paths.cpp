#include "robots/description/package_paths.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <ist/types.h>

#include "mesh/import/source_file.h"

namespace ist {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code none;
  return fs::exists(path, none) && !fs::is_directory(path, none);
}

}  // namespace

PackagePaths::PackagePaths(const fs::path& urdf, std::map<std::string, std::string> named,
                           const std::string& ros_path)
    : named_(std::move(named)) {
  std::error_code none;
  folder_ = fs::absolute(urdf, none).lexically_normal().parent_path();
  std::size_t begin = 0;
  while (begin < ros_path.size()) {
    const std::size_t end = std::min(ros_path.find(':', begin), ros_path.size());
    if (end > begin) ros_path_.emplace_back(ros_path.substr(begin, end - begin));
    begin = end + 1;
  }
}

std::string PackagePaths::find(const std::string& name) const {
  const std::string meant = percent_decoded(name);
  if (meant == name) return find_as_written(name);
  try {
    return find_as_written(name);
  } catch (const Error&) {
    return find_as_written(meant);
  }
}

std::string PackagePaths::find_as_written(const std::string& name) const {
  const auto begins = [&](const std::string& with) {
    return name.compare(0, with.size(), with) == 0;
  };
  const bool model = begins("model://");
  if (!begins("package://") && !model) {
    fs::path path = begins("file://") ? name.substr(7) : name;
    if (path.is_relative()) path = folder_ / path;
    if (!is_file(path)) throw Error(in_quotes(name) + ": no such file: " + path.string());
    return path.string();
  }
  std::string rest = name.substr(model ? 8 : 10);
  rest.erase(0, rest.find_first_not_of('/'));
  const std::size_t slash = rest.find('/');
  const std::string package = rest.substr(0, slash);
  if (package.empty() || slash == std::string::npos)
    throw Error(in_quotes(name) + ": is not a file of a package; write package://NAME/PATH");
  const fs::path inside = rest.substr(slash + 1);
  if (const auto given = named_.find(package); given != named_.end()) {
    const fs::path path = fs::path(given->second) / inside;
    if (!is_file(path)) throw Error(in_quotes(name) + ": no such file: " + path.string());
    return path.string();
  }
  std::vector<fs::path> folders = ros_path_;
  for (fs::path up = folder_;; up = up.parent_path()) {
    folders.push_back(up);
    if (up == up.parent_path()) break;
  }
  for (const fs::path& folder : folders) {
    if (is_file(folder / package / inside)) return (folder / package / inside).string();
    // A package's folder may have another name than the package: then its manifest or the existing
    // file identifies it.
    if ((folder.filename() == package || is_file(folder / "package.xml")) &&
        is_file(folder / inside))
      return (folder / inside).string();
  }
  // Without any manifest, a folder above the URDF that contains the file.
  for (fs::path up = folder_;; up = up.parent_path()) {
    if (is_file(up / inside)) return (up / inside).string();
    if (up == up.parent_path()) break;
  }
  throw Error(in_quotes(name) + ": package " + in_quotes(package) +
              " with that file was not found. Pass its folder: --package " + package + "=DIR");
}

}  // namespace ist
