#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/program.h"

// Every JSON that the program prints contains exactly the fields of docs/json.md.

namespace {

using ist::testing::CommandLine;
using ist::testing::Outcome;
using Paths = std::set<std::string>;

/// "a.b", "list[].c": what docs/json.md calls the leaves. A list of plain values is a leaf.
void add_paths(const nlohmann::json& json, const std::string& prefix, Paths& paths) {
  if (json.is_object()) {
    for (const auto& [key, value] : json.items())
      add_paths(value, prefix.empty() ? key : prefix + "." + key, paths);
  } else if (json.is_array() && !json.empty() && json[0].is_object()) {
    for (const auto& entry : json) add_paths(entry, prefix + "[]", paths);
  } else if (!json.is_array() || !json.empty() || prefix == "notes" || prefix == "left_out" ||
             prefix == "taken_as_fixed" || prefix == "warnings" ||
             prefix.starts_with("default_pose.")) {
    paths.insert(prefix);
  }
}

/// The first cells of the table below the heading that begins so.
Paths documented(const std::string& heading) {
  std::ifstream page(IST_SOURCE_DIR "/docs/json.md");
  Paths paths;
  bool within = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) within = line.starts_with("## " + heading);
    if (!within || !line.starts_with("| `")) continue;
    const std::string field = line.substr(3, line.find('`', 3) - 3);
    EXPECT_TRUE(paths.insert(field).second) << field << " is described twice";
  }
  EXPECT_FALSE(paths.empty()) << heading;
  return paths;
}

class JsonSchema : public CommandLine {
 protected:
  /// Adds the command's output, and checks that every key is ASCII.
  void add(const std::vector<std::string>& arguments, Paths& paths) {
    const Outcome outcome = ist(arguments);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    add_paths(nlohmann::json::parse(outcome.out), "", paths);
    for (const std::string& path : paths)
      for (const char c : path) EXPECT_TRUE(c > ' ' && c <= '~') << path;
  }
};

TEST_F(JsonSchema, InfoAndBake) {
  Paths info, bake;
  // One has levels of detail, the other a prediction.
  add({"bake", "cube.obj", "-o", "fine.ist", "--spheres", "1000", "--json"}, bake);
  add({"bake", "cube.obj", "-o", "error.ist", "--target-error", "20%", "--at-overlap", "1%",
       "--json"},
      bake);
  add({"info", "fine.ist", "--json"}, info);
  add({"info", "error.ist", "--json"}, info);
  Paths expected = documented("An asset");
  EXPECT_EQ(info, expected);
  expected.merge(documented("What `ist bake --json` adds"));
  EXPECT_EQ(bake, expected);
}

TEST_F(JsonSchema, LibraryAndCache) {
  Paths library, summary, cache;
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
  write("library.toml",
        "[[asset]]\nmesh = 'open.obj'\nspheres = 9\nrepair = true\n"
        "[[asset]]\nmesh = 'cube.obj'\nspheres = 9\n");
  std::filesystem::create_directory(folder_ / "out");
  write("out/stale.ist", "");
  const std::vector<std::string> bake = {"bake", "--manifest", "library.toml", "-o",
                                         "out",  "--cache",    "cache",        "--json"};
  add(bake, library);
  EXPECT_EQ(library, documented("A library"));
  write("summary.json", ist(bake).out);
  add({"summary", "summary.json", "--json"}, summary);
  EXPECT_EQ(summary, library);
  add({"cache", "cache", "--json"}, cache);
  EXPECT_EQ(cache, documented("`ist cache --json`"));
}

TEST_F(JsonSchema, Robots) {
  write("r.urdf",
        "<robot name='r'><link name='NAME'>"
        "<collision><geometry><mesh filename='cube.obj'/></geometry></collision>"
        "<collision><geometry><sphere radius='1'/></geometry></collision></link>"
        "<link name='b'><collision><geometry><sphere radius='1'/></geometry></collision></link>"
        "<link name='c'><collision><geometry><mesh filename='cube.obj'/></geometry></collision>"
        "</link><joint name='j' type='fixed'><parent link='NAME'/><child link='b'/></joint>"
        "<joint name='NAME' type='prismatic'><parent link='b'/><child link='c'/>"
        "<limit lower='0.5' upper='2'/></joint></robot>");
  Paths report, file, bake;
  add({"spheres", "r.urdf", "-o", "s.json", "--count", "8", "--json"}, report);
  const auto without_b = [](Paths& paths) {
    std::erase_if(paths, [](const std::string& path) {
      return path.starts_with("links.b") || path.starts_with("links.c");
    });
  };
  without_b(report);
  Paths expected = documented("`ist spheres --json`");
  EXPECT_EQ(report, expected);
  ASSERT_EQ(ist({"spheres", "r.urdf", "-o", "c.json", "--capsules"}).exit_code, 0);
  for (const char* const written : {"s.json", "c.json"})
    add_paths(nlohmann::json::parse(read(written)), "", file);
  without_b(file);
  for (const char* field : {"output", "input", "seconds", "links.NAME.seconds"})
    expected.erase(field);
  EXPECT_EQ(file, expected);
  add({"bake", "r.urdf", "-o", "out", "--spheres", "9", "--json"}, bake);
  // The first shape is a mesh, the second a sphere.
  for (const auto& shape : nlohmann::json::parse(read("out/r.json"))["links"]["NAME"])
    for (const auto& [key, value] : shape.items()) bake.insert("links.NAME[]." + key);
  without_b(bake);
  EXPECT_EQ(bake, documented("`ist bake ROBOT.urdf --json`"));
}

TEST_F(JsonSchema, CheckQueryAndExport) {
  Paths check, query, exported;
  add({"check", "cube.ist", "--mesh", "cube.obj", "--json"}, check);
  EXPECT_EQ(check, documented("`ist check --json`"));
  add({"query", "cube.ist", "cube.ist", "--pose", "1,0,0,0,0.5,0,0", "--json"}, query);
  EXPECT_EQ(query, documented("`ist query --json`"));
  ASSERT_EQ(ist({"export", "cube.ist", "-o", "s.json"}).exit_code, 0);
  add_paths(nlohmann::json::parse(read("s.json")), "", exported);
  EXPECT_EQ(exported, documented("`ist export -o F.json`"));
}

TEST_F(JsonSchema, Clash) {
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
  write("two.toml",
        "[[part]]\nname = 'a'\nmesh = 'cube.obj'\n[[part]]\nname = 'b'\nmesh = 'cube.obj'\n"
        "[[part]]\nname = 'open'\nmesh = 'open.obj'\n[[ignore]]\na = 'c'\n");
  write("poses.csv", "id,part,qw,qx,qy,qz,tx,ty,tz\n0,b,1,0,0,0,0.1,0,0\n1,b,1,0,0,0,0.2,0,0\n");
  write("old.json",
        R"({"schema": "ist.clash/1", "pairs": [{"a": "x", "b": "y", "kind": "overlapping"}]})");
  const Outcome outcome = ist({"clash", "two.toml", "--json", "--tolerance", "0", "--poses",
                               "poses.csv", "--baseline", "old.json"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  Paths clash;
  add_paths(nlohmann::json::parse(outcome.out), "", clash);
  EXPECT_EQ(clash, documented("`ist clash --json`"));
}

}  // namespace
