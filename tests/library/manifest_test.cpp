#include "library/library_folder.h"

// A manifest with every mistake that a person makes: each is reported with its line and the remedy,
// all at once, and nothing is written.

namespace ist::testing {
namespace {

class Mistakes : public LibraryFolder {
 protected:
  /// The manifest is refused with exactly these messages, "12: what" with the line before it.
  void expect_faults(const std::string& manifest, const std::vector<std::string>& faults) {
    write("bad.toml", manifest);
    const Outcome outcome = bake("out", {}, {}, "bad.toml");
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_FALSE(exists("out"));
    std::size_t told = 0;
    for (const std::string& line : lines_of(outcome.err))
      told +=
          line.find("bad.toml:") != std::string::npos && line.find("mistake") == std::string::npos
              ? 1
              : 0;
    EXPECT_EQ(told, faults.size()) << outcome.err;
    for (const std::string& fault : faults)
      EXPECT_NE(outcome.err.find("bad.toml:" + fault), std::string::npos) << fault << "\n--\n"
                                                                          << outcome.err;
  }
};

TEST_F(Mistakes, OfEveryKindAreToldAtOnce) {
  expect_faults(
      R"([defaults]
sphers = 300
mesh = "x"
target_error = "1%"

[thing]

[[asset]]
mesh = "meshes/*.obj"
spheres = "many"
coverage = 2
repair = "yes"
name = "one"

[[asset]]
mesh = "meshes/nix.obj"

[[asset]]
mesh = "meshes/nix*.obj"

[[asset]]
spheres = 3

[[asset]]
mesh = "meshes"
grid = "octree"

[[asset]]
mesh = "meshes/nut.obj"
at-overlap = "1%"
name = "a/b"

[[asset]]
mesh = "meshes/cube.obj"
world-up = "Y"
spheres = 2.5
scale = [1, 2]
up-axis = "W"
wall-thickness = 3
min-radius = [1]
)",
      {
          "2: unknown key 'sphers': did you mean 'spheres'?",
          "3: 'mesh' cannot be a default: set it under an [[asset]]",
          "4: unknown key 'target_error': did you mean 'target-error'?",
          "6: unknown 'thing': a manifest has [defaults] and",
          "10: spheres: 'many' is not a whole number from 0 to 2147483647",
          "11: coverage: 2 is not a number from 0 to 1, or from 0% to 100%",
          "12: repair: 'yes' is not true or false",
          "13: name: 'one' is one name for the 4 files of 'meshes/*.obj': include {stem}",
          "16: mesh: no file 'meshes/nix.obj' in .: paths are relative to the",
          "19: mesh: no file matches 'meshes/nix*.obj' in .: * matches any name",
          "21: an asset without a mesh: add mesh = ",
          "25: mesh: 'meshes' is a folder: use 'meshes/*.obj' for the files in it",
          "26: grid: 'octree' is not one of banded|uniform|explicit|implicit|hybrid",
          "30: at-overlap: has no effect without target-error",
          "31: name: 'a/b' is not a valid file name",
          "35: world-up: has no effect without up-axis",
          "36: spheres: 2.5 is not a whole number",
          "37: scale: a list is not a finite number other than 0, or three",
          "38: up-axis: 'W' is not one of X|Y|Z",
          "39: unknown key 'wall-thickness': known keys are mesh, name, exclude, spheres",
          "40: min-radius: a list is not a finite number, 0 or more",
      });
}

TEST_F(Mistakes, TwoAssetsOfOneNameNameBothLines) {
  expect_faults(
      "[[asset]]\nmesh = \"meshes/*.obj\"\n[[asset]]\nmesh = \"meshes/cube.obj\"\nspheres = 7\n",
      {"4: name: 'cube' (of meshes/cube.obj) is already used in line 2 (of meshes/cube.obj): give "
       "one of them another name"});
}

TEST_F(Mistakes, OtherShapesOfAManifest) {
  expect_faults("", {"1: no [[asset]]: add at least one"});
  expect_faults("[asset]\nmesh = \"meshes/cube.obj\"\n",
                {"1: asset: write [[asset]], with two brackets"});
  expect_faults("defaults = 3\nasset = [ 1 ]\n",
                {"1: defaults: write [defaults]", "2: asset: write [[asset]]"});
  expect_faults("[[asset]]\nmesh = 3\nname = ''\n",
                {"2: mesh: 3 is not a quoted string", "3: name: '' is not a quoted string"});
  write("meshes/notes.txt", "none");
  expect_faults(
      "[[asset]]\nmesh = \"meshes/*\"\n",
      {"2: mesh: 'meshes/notes.txt' does not have the extension of a mesh format: make the pattern "
       "narrower, e.g. *.obj"});
  // A setting of [defaults] that an asset has no use for.
  expect_faults("[defaults]\ngrid-start = 4\n[[asset]]\nmesh = \"meshes/cube.obj\"\n",
                {"2: grid-start: has no effect with grid banded, only with uniform, explicit, "
                 "implicit and hybrid (in the asset of line 3)"});
}

TEST_F(Mistakes, NoTomlAndNoFile) {
  expect_faults("[defaults]\nspheres = 3\nspheres = 4\n", {"3: not valid TOML: "});
  expect_faults("[defaults]\nspheres 3\n", {"2: not valid TOML: "});
  expect_faults("[[asset]]\nmesh = \"\xff\xfe\"\n", {"2: not valid TOML: "});
  const auto expect_error = [&](const std::string& manifest, const std::string& what) {
    const Outcome outcome = bake("out", {}, {}, manifest);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
    EXPECT_FALSE(exists("out"));
  };
  expect_error("nowhere.toml", "nowhere.toml: cannot be opened");
  expect_error("meshes", "meshes: is a folder");
}

TEST_F(Mistakes, InNamesAndExclusions) {
  expect_faults("[[asset]]\nmesh = \"meshes/cube.obj\"\nname = \"{stm}-x\"\n",
                {"3: name: '{stm}' stands for nothing; use {stem}, {ext}, {parent} or {dir}"});
  expect_faults("[[asset]]\nmesh = \"meshes/*.obj\"\nexclude = 3\n",
                {"3: exclude: 3 is not a quoted string"});
  expect_faults("[[assets]]\nmesh = \"meshes/*.obj\"\n",
                {"1: unknown 'assets': did you mean 'asset'?"});
  // Letters in each other's places.
  expect_faults("[[asset]]\nmesh = \"meshes/*.obj\"\nmehs = 3\n",
                {"3: unknown key 'mehs': did you mean 'mesh'?"});
}

TEST_F(Mistakes, AnExclusionOfNothingIsAWarning) {
  std::filesystem::create_directory(folder_ / "there");
  write("there/bad.obj", "");
  std::filesystem::create_directory_symlink("there", folder_ / "link");
  write("e.toml",
        "[[asset]]\nmesh = \"*/*.obj\"\nexclude = [\"**/bad.obj\", \"none*\"]\nspheres = 5\n");
  const Outcome outcome = bake("out", {"--list"}, {}, "e.toml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("e.toml:3: exclude: 'none*' excludes none of the files"),
            std::string::npos)
      << outcome.err;
  // Folders that are links are left out alike.
  EXPECT_EQ(outcome.out.find("bad"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("cube  meshes/cube.obj\n"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("nothing was baked"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(Mistakes, NamesAreMadeOfFoldersAndExtensions) {
  for (const std::string folder : {"meshes/a", "meshes/a/deep", "meshes/b"}) {
    std::filesystem::create_directories(folder_ / folder);
    write(folder + "/part.obj", read("meshes/cube.obj"));
  }
  write("names.toml",
        "[defaults]\nspheres = 5\n"
        "[[asset]]\nmesh = \"meshes/*/*.obj\"\nname = \"{parent}-{stem}\"\n"
        "[[asset]]\nmesh = \"meshes/**/part.obj\"\nexclude = \"meshes/b/*\"\n"
        "name = \"x-{dir}_{stem}.{ext}\"\n");
  const Outcome outcome = bake("out", {}, {}, "names.toml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::vector<std::string> made;
  for (const auto& [name, bytes] : files_in("out")) made.push_back(name);
  EXPECT_EQ(made,
            (std::vector<std::string>{"a-part.ist", "b-part.ist", "x-meshes-a-deep_part.obj.ist",
                                      "x-meshes-a_part.obj.ist"}));
}

TEST_F(Mistakes, ButDefaultsMayBeOfNoUseToSome) {
  write("fine.toml", R"([defaults]
at-overlap = "1%"
world-up = "Y"
keep-mesh = "yes"
spheres = 20

[[asset]]
mesh = "meshes/cube.obj"
keep-mesh = "no"
name = "{stem}-of-many"

[[asset]]
mesh = "./meshes/../meshes/[c]ub?.obj"
)");
  const Outcome outcome = bake("out", {}, {}, "fine.toml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(exists("out/cube-of-many.ist"));
  EXPECT_TRUE(exists("out/cube.ist"));
}

TEST_F(Mistakes, PathsAreRelativeToTheManifest) {
  std::filesystem::create_directories(folder_ / "a[b]" / "c" / "d");
  write("a[b]/c/d/tetra.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  write("a[b]/scene.toml", "[[asset]]\nmesh = \"**/*.obj\"\nspheres = 5\n");
  const Outcome outcome = bake("out", {}, {}, "a[b]/scene.toml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(exists("out/tetra.ist"));
}

TEST_F(Mistakes, AnOutputThatIsNoFolder) {
  write("out.txt", "");
  const Outcome outcome = bake("out.txt");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("out.txt: cannot create this folder for the assets"),
            std::string::npos)
      << outcome.err;
}

}  // namespace
}  // namespace ist::testing
