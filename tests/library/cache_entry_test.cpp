#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "library/cache.h"

namespace ist {
namespace {

namespace fs = std::filesystem;

class CacheKeys : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "ist_keys_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  static CacheKey key(const std::string& mesh, const BakeSettings& settings = {}) {
    return cache_key({.name = "any", .mesh = mesh, .settings = settings, .demands = {}});
  }

  fs::path folder_;
};

TEST_F(CacheKeys, FollowBytesAndEndingNotNames) {
  const std::string text = "OFF\n0 0 0\n";
  const CacheKey first = key(write("a.off", text));
  EXPECT_EQ(first, key(write("b.OFF", text)));
  EXPECT_FALSE(first == key(write("a.obj", text)));
  EXPECT_FALSE(first == key(write("a.off", text + " ")));
  EXPECT_EQ(first.text().size(), 32u);
}

/// Every setting counts, but none that only says where the bake runs.
TEST_F(CacheKeys, FollowEverySetting) {
  const std::string mesh = write("a.off", "OFF\n");
  const CacheKey plain = key(mesh);
  for (const Setting& setting : all_settings()) {
    BakeSettings other;
    const std::string value = setting.name == "keep-mesh"          ? "no"
                              : setting.name == "world-up"         ? "Y"
                              : setting.kind == SettingKind::whole ? "7"
                              : setting.kind == SettingKind::real  ? "0.25"
                              : setting.name == "scale"            ? "1,1,-1"
                              : setting.kind == SettingKind::share ? "0.07"
                              : setting.kind == SettingKind::flag  ? "true"
                              : setting.name == "up-axis"          ? "X"
                                                                   : "hybrid";
    ASSERT_TRUE(setting.take(other, value)) << setting.name;
    EXPECT_FALSE(key(mesh, other) == plain) << setting.name;
  }
  BakeSettings elsewhere;
  elsewhere.packing.threads = 3;
  elsewhere.packing.device = Device::cpu;
  EXPECT_EQ(key(mesh, elsewhere), plain);
}

TEST_F(CacheKeys, FollowTheBuffersOfAGltf) {
  const std::string gltf = write("a.gltf",
                                 R"({"asset":{"version":"2.0"},
  "buffers":[{"uri":"a%20b.bin","byteLength":3}]})");
  write("a b.bin", "abc");
  const CacheKey first = key(gltf);
  write("a b.bin", "abd");
  EXPECT_FALSE(key(gltf) == first);
  write("a b.bin", "abc");
  EXPECT_EQ(key(gltf), first);
  write("other.bin", "xyz");
  EXPECT_EQ(key(gltf), first);
}

/// Files that assimp opens for its own formats are unknown, so the content is hashed.
TEST_F(CacheKeys, FollowTheMeshOfForeignFormats) {
  EXPECT_ANY_THROW(key(write("a.fbx", "no FBX")));
  EXPECT_ANY_THROW(key((folder_ / "nowhere.obj").string()));
  const auto raw = [&](const std::string& x, const std::string& after) {
    return key(write("a.raw", "0 0 0 " + x + " 0 0 0 1 0\n0 0 0 1 0 0 0 0 1\n" + after));
  };
  EXPECT_EQ(raw("1", ""), raw("1", "\n"));
  EXPECT_FALSE(raw("1", "") == raw("2", ""));
}

/// If hashes of assets change, old entries of a cache must not be found.
TEST(BakeRevision, IsRaisedWithTheHashesOfAssets) {
  std::ifstream file(IST_SOURCE_DIR "/tests/soak/bake_hashes.csv", std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  const std::string bytes = text.str();
  ASSERT_FALSE(bytes.empty());
  EXPECT_EQ(XXH3_64bits(bytes.data(), bytes.size()), kBakeHashesOfRevision)
      << "tests/soak/bake_hashes.csv changed: where hashes of assets did, raise kBakeRevision; "
         "then "
         "write this hash as kBakeHashesOfRevision";
}

}  // namespace
}  // namespace ist
