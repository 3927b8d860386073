#include "app/output_file.h"

#include <unistd.h>
#include <filesystem>

#include <ist/error.h>

namespace ist::app {

void require_output(const std::string& path, const std::string& input, const std::string& what) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (fs::equivalent(input, path, none))
    throw Error(path + ": this is the mesh itself; name another file for " + what);
  if (fs::is_directory(path, none))
    throw Error(path + ": this is a folder; name a file in it for " + what);
  const fs::path parent = fs::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  if (!fs::is_directory(folder, none))
    throw Error(path + ": there is no folder " + folder + "; make it, or name another file");
  if (!fs::exists(path, none) && access(folder.c_str(), W_OK | X_OK) != 0)
    throw Error(path + ": the folder " + folder + " cannot be written to; name another file");
}

}  // namespace ist::app
