#include "library/library_folder.h"

namespace ist::testing {

const std::vector<std::string>& LibraryFolder::names() {
  static const std::vector<std::string> all = {"capsule", "cube", "gear", "nut", "upright"};
  return all;
}

void LibraryFolder::SetUp() {
  std::string pattern = (std::filesystem::temp_directory_path() / "ist_library_XXXXXX").string();
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  folder_ = pattern;
  std::filesystem::create_directory(folder_ / "meshes");
  for (const std::string name : {"cube", "capsule", "gear", "nut"})
    ASSERT_EQ(ist({"sample", name, "-o", "meshes/" + name + ".obj"}).exit_code, 0);
  write("library.toml", R"([defaults]
spheres = 40

[[asset]]
mesh = "meshes/*.obj"

[[asset]]
name = "upright"
mesh = "meshes/gear.obj"
spheres = 30
scale = [0.001, 0.001, -0.002]
up-axis = "Y"
)");
}

Outcome LibraryFolder::bake(const std::string& out, const std::vector<std::string>& more,
                            const RunOptions& options, const std::string& manifest) const {
  std::vector<std::string> arguments = {"bake", "--manifest", manifest, "-o",
                                        out,    "--device",   "cpu"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return ist(arguments, options);
}

nlohmann::json LibraryFolder::summary_of(const std::string& out,
                                         const std::vector<std::string>& more,
                                         int exit_code) const {
  std::vector<std::string> with_json = more;
  with_json.push_back("--json");
  const Outcome outcome = bake(out, with_json);
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  return nlohmann::json::parse(outcome.out);
}

std::map<std::string, std::string> LibraryFolder::files_in(const std::string& folder) const {
  std::map<std::string, std::string> files;
  if (!exists(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder))
    if (const std::string name = entry.path().filename().string(); !name.starts_with('.'))
      files[name] = read(folder + "/" + name);
  return files;
}

std::size_t LibraryFolder::entries_in(const std::string& cache) const {
  std::size_t count = 0;
  if (!exists(cache)) return count;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / cache))
    count += entry.path().extension() == ".entry" ? 1 : 0;
  return count;
}

}  // namespace ist::testing
