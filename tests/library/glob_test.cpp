#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "library/glob.h"

namespace ist {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class Glob : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "ist_glob_[x]_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    for (const std::string name :
         {"a.obj", "b.obj", "b.OBJ", ".hidden.obj", "sub/a.obj", "sub/deep/c.obj", "sub/.git/x.obj",
          "sub2/d.stl", "we[ird].obj"}) {
      fs::create_directories((folder_ / name).parent_path());
      std::ofstream(folder_ / name) << "x";
    }
    fs::create_directory_symlink(folder_ / "sub", folder_ / "link");
    fs::create_directory(folder_ / "folder.obj");
  }
  void TearDown() override { fs::remove_all(folder_); }

  Names found(const std::string& pattern) const {
    Names names;
    for (const fs::path& path : matching_files(folder_, pattern))
      names.push_back(path.lexically_relative(folder_).string());
    return names;
  }

  fs::path folder_;
};

TEST_F(Glob, StandsForNamesAndFolders) {
  EXPECT_EQ(found("*.obj"), (Names{"a.obj", "b.obj", "we[ird].obj"}));
  EXPECT_EQ(found("?.obj"), (Names{"a.obj", "b.obj"}));
  EXPECT_EQ(found("[!b].obj"), (Names{"a.obj"}));
  EXPECT_EQ(found("**/*.obj"),
            (Names{"a.obj", "b.obj", "sub/a.obj", "sub/deep/c.obj", "we[ird].obj"}));
  EXPECT_EQ(found("**/deep/**/*.obj"), (Names{"sub/deep/c.obj"}));
  EXPECT_EQ(found("sub/**"), (Names{"sub/a.obj", "sub/deep/c.obj"}));
  EXPECT_EQ(found("s*/*"), (Names{"sub/a.obj", "sub2/d.stl"}));
  EXPECT_EQ(found("l*/a.obj"), (Names{"link/a.obj"}));
  EXPECT_EQ(found("./sub/../a.obj"), (Names{"a.obj"}));
  EXPECT_EQ(found(".h*.obj"), (Names{".hidden.obj"}));
  EXPECT_EQ(found("nowhere/*.obj"), Names{});
  EXPECT_EQ(found(""), Names{});
  EXPECT_EQ(found("*.obj/"), Names{});
}

TEST_F(Glob, AnAbsolutePatternIsItself) {
  EXPECT_TRUE(is_pattern("a*"));
  EXPECT_FALSE(is_pattern("a.obj"));
  EXPECT_EQ(matching_files("elsewhere", "/et?/passw?"), std::vector<fs::path>{"/etc/passwd"});
}

TEST(GlobMatch, FollowsAPathFolderByFolder) {
  for (const char* const pattern : {"a/b.obj", "a/*.obj", "**/b.obj", "**/*.obj", "a/**", "**"})
    EXPECT_TRUE(matches("a/b.obj", pattern)) << pattern;
  for (const char* const pattern : {"b.obj", "*.obj", "a/*.stl", "a", "a/b.obj/**/c", "**/a"})
    EXPECT_FALSE(matches("a/b.obj", pattern)) << pattern;
  EXPECT_TRUE(matches("b.obj", "**/b.obj"));
  EXPECT_FALSE(matches("a/.b.obj", "a/*"));
}

}  // namespace
}  // namespace ist
