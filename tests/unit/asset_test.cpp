#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include "support/asset_bytes.h"

namespace ist {
namespace {

using testing::small_asset;

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = ::testing::TempDir() + "/ist_asset_XXXXXX";
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::filesystem::permissions(path_, std::filesystem::perms::owner_all);
    std::filesystem::remove_all(path_);
  }
  std::filesystem::path operator/(const char* name) const { return path_ / name; }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

TEST(Asset, RoundTrip) {
  const TemporaryFolder folder;
  for (const std::size_t n : {1u, 16u, 17u, 40u, 256u, 257u, 300u}) {
    const auto bytes = small_asset(n);
    const Asset asset(bytes, "memory");
    EXPECT_EQ(asset.view().sphere_count(), n);
    asset.save(folder / "a.ist");
    const Asset again = Asset::load(folder / "a.ist");
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), again.bytes().begin(), again.bytes().end()));
  }
  for (const std::uint32_t details : {1u, 3u, 4u}) {
    const Asset asset(small_asset(300, details), "memory");
    EXPECT_EQ(asset.view().header().detail_count, details);
  }
  EXPECT_THROW(small_asset(300, kMaxDetails + 1), Error);  // and the last would be empty
  EXPECT_THROW(Asset(small_asset(300, 5), "memory"), Error);
  EXPECT_EQ(folder.files(), 1u);
}

/// A moved-from asset is empty, and every function may be called.
TEST(Asset, MovedFromAssetsAndWorkspacesAreSafe) {
  Asset asset(small_asset(40), "memory");
  Asset taken = std::move(asset);
  EXPECT_TRUE(asset.view().empty());  // NOLINT(bugprone-use-after-move): what is tested
  EXPECT_TRUE(asset.bytes().empty());
  const TemporaryFolder folder;
  EXPECT_THROW(asset.save(folder / "a.ist"), Error);
  EXPECT_EQ(folder.files(), 0u);
  EXPECT_EQ(taken.view().sphere_count(), 40u);
  asset = std::move(taken);
  EXPECT_EQ(asset.view().sphere_count(), 40u);
  EXPECT_TRUE(taken.view().empty());  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(AssetView().header().sphere_count, 0u);
  EXPECT_EQ(AssetView().header().detail_count, 0u);

  const PlacedAsset placed{asset.view(), {}, 1};
  Workspace workspace;
  Workspace other = std::move(workspace);
  // NOLINTNEXTLINE(bugprone-use-after-move)
  const PenetrationAndSeparation none = query(placed, placed, {}, workspace);
  EXPECT_EQ(none.penetration.status, QueryStatus::invalid_input);
  EXPECT_EQ(none.separation.status, QueryStatus::invalid_input);
  ContactPatch patch;
  EXPECT_EQ(contact_patches(placed, placed, {}, workspace, {&patch, 1}).count, 0u);
  Penetration answer;
  const PlacedPair pair{placed, placed};
  penetration_batch({&pair, 1}, {}, {&workspace, 1}, {&answer, 1});
  EXPECT_EQ(answer.status, QueryStatus::invalid_input);
  EXPECT_EQ(penetration(placed, placed, {}, other).status, QueryStatus::ok);
  const PlacedAsset nothing{AssetView(), {}, 1};
  EXPECT_EQ(penetration(placed, nothing, {}, other).status, QueryStatus::invalid_input);
  EXPECT_EQ(without_protrusion({}, placed, nothing).volume, 0);
}

TEST(Asset, SectionsAreAlignedAndInOrder) {
  for (const std::uint64_t n :
       {std::uint64_t{1}, std::uint64_t{17}, std::uint64_t{70'000}, kMaxSpheres}) {
    AssetHeader header;
    DetailLevel details[kMaxDetails];
    header.sphere_count = n;
    while (header.detail_count < kMaxDetails && detail_spheres(n, header.detail_count + 1) > 0)
      ++header.detail_count;
    place_sections(header, details);
    std::vector<std::uint64_t> offsets;
    if (header.detail_count > 0) offsets.push_back(header.details);
    offsets.insert(offsets.end(),
                   {header.inner_spheres, header.cover_radii, header.matched_spheres});
    const auto add_tree = [&](const TreeHeader* tree) {
      offsets.push_back(tree->sphere_index);
      if (tree->sphere_cover != 0) offsets.push_back(tree->sphere_cover);
      ASSERT_LE(tree->level_count, kMaxLevels);
      EXPECT_EQ(tree->level[tree->level_count - 1].count, 1u);
      for (std::uint32_t k = 0; k < tree->level_count; ++k) {
        offsets.push_back(tree->level[k].blocks);
        offsets.push_back(tree->level[k].origins);
        if (k > 0) offsets.push_back(tree->level[k].nodes);
      }
    };
    add_tree(&header.inner_tree);
    add_tree(&header.matched_tree);
    for (std::uint32_t i = 0; i < header.detail_count; ++i) {
      offsets.push_back(details[i].matched_spheres);
      add_tree(&details[i].matched_tree);
    }
    offsets.push_back(header.file_bytes);
    EXPECT_EQ(offsets.front(), sizeof(AssetHeader));
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      EXPECT_EQ(offsets[i] % kAssetAlignment, 0u);
      if (i > 0) {
        EXPECT_GT(offsets[i], offsets[i - 1]);
      }
    }
  }
}

// A write that fails leaves the old file whole and nothing else.
TEST(AssetSave, KeepsTheOldFileIfTheDiskIsFull) {
  const TemporaryFolder folder;
  const Asset old_asset(small_asset(17), "old");
  const Asset large(small_asset(900), "new");
  old_asset.save(folder / "a.ist");
  // The largest file that this process may write replaces a full disk.
  rlimit before;
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small = {50'000, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(large.save(folder / "a.ist"), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(Asset::load(folder / "a.ist").view().sphere_count(), 17u);
  EXPECT_EQ(folder.files(), 1u);
}

// A program that was killed may leave a temporary file, and the next one may have its process id.
TEST(AssetSave, PassesOverNamesThatAreTaken) {
  const TemporaryFolder folder;
  const Asset asset(small_asset(3), "a");
  for (int i = 0; i < 50; ++i)
    std::ofstream(folder / ("a.ist." + std::to_string(getpid()) + "." + std::to_string(i)).c_str());
  asset.save(folder / "a.ist");
  asset.save(folder / "a.ist");  // over a file, too
  EXPECT_EQ(Asset::load(folder / "a.ist").view().sphere_count(), 3u);
  EXPECT_EQ(folder.files(), 51u);
}

// Without a folder in its name the file is written to the current folder.
TEST(AssetSave, TakesABareName) {
  const TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder / "");
  Asset(small_asset(3), "a").save("a.ist");
  std::filesystem::current_path(before);
  EXPECT_EQ(Asset::load(folder / "a.ist").view().sphere_count(), 3u);
  EXPECT_EQ(folder.files(), 1u);
}

/// Nobody in particular while it lives: root may write anywhere.
class WithoutPrivileges {
 public:
  WithoutPrivileges() : before_(geteuid()) { done_ = before_ != 0 || seteuid(65534) == 0; }
  ~WithoutPrivileges() {
    if (seteuid(before_) != 0) std::abort();
  }
  bool done() const { return done_; }

 private:
  uid_t before_;
  bool done_;
};

TEST(AssetSave, SaysWhyItCannotWrite) {
  const TemporaryFolder folder;
  const Asset asset(small_asset(3), "a");
  const auto message = [&](const std::filesystem::path& path) -> std::string {
    try {
      asset.save(path);
    } catch (const Error& error) {
      return error.what();
    }
    return "saved";
  };
  EXPECT_NE(message(folder / "missing/a.ist").find("missing/a.ist: "), std::string::npos);
  std::filesystem::permissions(folder / "", std::filesystem::perms(0555));
  {
    const WithoutPrivileges nobody;
    ASSERT_TRUE(nobody.done());
    EXPECT_NE(message(folder / "a.ist").find("a.ist: "), std::string::npos);
  }
  EXPECT_EQ(folder.files(), 0u);
}

TEST(AssetLoad, NamesTheFile) {
  const TemporaryFolder folder;
  EXPECT_THROW(Asset::load(folder / "none.ist"), Error);
  EXPECT_THROW(Asset::load(folder / ""), Error);
  std::ofstream(folder / "text.ist") << "solid cube";
  try {
    Asset::load(folder / "text.ist");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("text.ist: not an .ist asset"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace ist
