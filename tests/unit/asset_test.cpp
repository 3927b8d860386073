#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/error.h>
#include <ist/query.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include "asset/asset_writer.h"
#include "build/tree_builder.h"
#include "query/content_hash.h"

namespace ist {
namespace {

/// Spheres on a grid: an asset without a mesh.
std::vector<std::byte> small_asset(std::size_t n) {
  AssetArrays arrays;
  for (std::size_t i = 0; i < n; ++i) {
    const float x = static_cast<float>(i % 4) / 4 - 0.5f;
    const float y = static_cast<float>(i / 4 % 4) / 4 - 0.5f;
    const float z = static_cast<float>(i / 16) / 4 - 0.5f;
    arrays.inner_spheres.push_back({x, y, z, 0.1f});
    arrays.effective_spheres.push_back({x, y, z, 0.12f});
    arrays.cover_radii.push_back(0.3f);
  }
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.effective_spheres, {});
  arrays.header.volume = 1;
  return asset_bytes(arrays);
}

/// Bytes on a 64-byte boundary, as a mapped file has them, that end where the span ends: reading
/// further is seen by the address sanitizer.
class AlignedBytes {
 public:
  explicit AlignedBytes(std::span<const std::byte> bytes)
      : size_(bytes.size()),
        data_(static_cast<std::byte*>(
            ::operator new[](bytes.size(), std::align_val_t{kAssetAlignment}))) {
    std::copy(bytes.begin(), bytes.end(), data_);
  }
  ~AlignedBytes() { ::operator delete[](data_, std::align_val_t{kAssetAlignment}); }
  AlignedBytes(const AlignedBytes&) = delete;
  AlignedBytes& operator=(const AlignedBytes&) = delete;

  std::byte& operator[](std::size_t i) { return data_[i]; }
  std::span<const std::byte> span() const { return {data_, size_}; }
  AssetStatus status() const {
    TreeView view;
    const AssetStatus status = TreeView::from_bytes(span(), view);
    EXPECT_EQ(view.empty(), status != AssetStatus::ok);
    return status;
  }
  void seal() {
    const std::uint64_t hash = content_hash(span());
    std::memcpy(data_ + offsetof(AssetHeader, content_hash), &hash, sizeof(hash));
  }

 private:
  std::size_t size_;
  std::byte* data_;
};

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
  EXPECT_EQ(folder.files(), 1u);
}

TEST(Asset, SectionsAreAlignedAndInOrder) {
  for (const std::uint64_t n :
       {std::uint64_t{1}, std::uint64_t{17}, std::uint64_t{70'000}, kMaxSpheres}) {
    AssetHeader header;
    header.sphere_count = n;
    place_sections(header);
    std::vector<std::uint64_t> offsets = {header.inner_spheres, header.cover_radii,
                                          header.effective_spheres};
    for (const TreeHeader* tree : {&header.inner_tree, &header.matched_tree}) {
      offsets.push_back(tree->sphere_index);
      if (tree->sphere_cover != 0) offsets.push_back(tree->sphere_cover);
      ASSERT_LE(tree->level_count, kMaxLevels);
      EXPECT_EQ(tree->level[tree->level_count - 1].count, 1u);
      for (std::uint32_t k = 0; k < tree->level_count; ++k) {
        offsets.push_back(tree->level[k].blocks);
        offsets.push_back(tree->level[k].origins);
        if (k > 0) offsets.push_back(tree->level[k].nodes);
      }
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

TEST(AssetBytes, EveryFlippedBitIsSeen) {
  AlignedBytes bytes(small_asset(18));
  ASSERT_EQ(bytes.status(), AssetStatus::ok);
  for (std::size_t bit = 0; bit < 8 * bytes.span().size(); ++bit) {
    const auto mask = static_cast<std::byte>(1u << (bit % 8));
    bytes[bit / 8] ^= mask;
    ASSERT_NE(bytes.status(), AssetStatus::ok) << "bit " << bit;
    bytes[bit / 8] ^= mask;
  }
}

TEST(AssetBytes, EveryTruncationAndExtensionIsSeen) {
  const auto bytes = small_asset(18);
  for (std::size_t length = 0; length < bytes.size(); ++length)
    ASSERT_NE(AlignedBytes(std::span(bytes).first(length)).status(), AssetStatus::ok) << length;
  auto longer = bytes;
  longer.resize(bytes.size() + 64);
  EXPECT_EQ(AlignedBytes(longer).status(), AssetStatus::corrupt_layout);
}

TEST(AssetBytes, SaysWhatIsWrong) {
  const auto bytes = small_asset(18);
  const auto with = [&](std::size_t offset, unsigned value) {
    AlignedBytes changed(bytes);
    changed[offset] = static_cast<std::byte>(value);
    return changed.status();
  };
  EXPECT_EQ(with(0, 'X'), AssetStatus::not_an_asset);
  EXPECT_EQ(with(offsetof(AssetHeader, format_major), 9), AssetStatus::other_version);
  EXPECT_EQ(with(bytes.size() - 1, 9), AssetStatus::corrupt_hash);
  EXPECT_EQ(AlignedBytes(std::span(bytes).first(bytes.size() - 1)).status(),
            AssetStatus::too_short);
  std::vector<std::byte> shifted(bytes.size() + 1);
  std::copy(bytes.begin(), bytes.end(), shifted.begin() + 1);
  const AlignedBytes block(shifted);
  TreeView view;
  EXPECT_EQ(TreeView::from_bytes(block.span().subspan(1), view), AssetStatus::misaligned);
  EXPECT_THROW(Asset(std::span(bytes).first(100), "cut.ist"), Error);
}

/// What a query does with accepted bytes must be finite in time and stay inside them; the values
/// may be any.
void use(const AlignedBytes& bytes, const TreeView& sound) {
  static Workspace workspace(1u << 16);
  TreeView view;
  ASSERT_EQ(TreeView::from_bytes(bytes.span(), view), AssetStatus::ok);
  Pose pose;
  pose.t[0] = 0.2;
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    QuerySettings settings;
    settings.measure = measure;
    query({view, {}, 1}, {sound, pose, 1}, settings, workspace);
    query({sound, {}, 1}, {view, pose, 1}, settings, workspace);
  }
}

// A hostile writer knows the hash. Fields of the header and values anywhere are replaced by small,
// huge, special and random ones: refused, or harmless.
TEST(AssetBytes, HostileFieldsAreRefusedOrHarmless) {
  const auto bytes = small_asset(40);
  const AlignedBytes original(bytes);
  TreeView sound;
  ASSERT_EQ(TreeView::from_bytes(original.span(), sound), AssetStatus::ok);
  std::mt19937_64 bits(5);
  const std::uint64_t values[] = {0,
                                  1,
                                  15,
                                  16,
                                  17,
                                  63,
                                  64,
                                  65,
                                  832,
                                  1u << 28,
                                  0xffffffffu,
                                  ~std::uint64_t{0},
                                  std::uint64_t{1} << 63,
                                  bytes.size(),
                                  0x7f800000u,
                                  0x7fc00000u,
                                  0xff800000u,
                                  0x7ff0000000000000u,
                                  0x7ff8000000000000u,
                                  0x3f8000003f800000u};
  std::size_t accepted = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    AlignedBytes changed(bytes);
    const int changes = 1 + static_cast<int>(bits() % 3);
    for (int i = 0; i < changes; ++i) {
      const std::size_t width = bits() % 2 == 0 ? 4 : 8;
      const std::size_t end = bits() % 4 == 0 ? bytes.size() : sizeof(AssetHeader);
      const std::size_t at = bits() % (end / width) * width;
      std::uint64_t value = values[bits() % std::size(values)];
      if (bits() % 3 == 0) value = bits();
      if (bits() % 4 == 0) {  // a neighbour of what is there
        std::memcpy(&value, &changed[at], width);
        value += bits() % 2 == 0 ? 1 : ~std::uint64_t{0};
      }
      std::memcpy(&changed[at], &value, width);
    }
    changed.seal();
    if (changed.status() != AssetStatus::ok) continue;
    ++accepted;
    use(changed, sound);
  }
  EXPECT_GT(accepted, 100u);  // free fields such as the seed
  EXPECT_LT(accepted, 12'000u);
}

// Each field the query stands on is looked at by name too: chance may miss one.
TEST(AssetBytes, EveryOffsetAndCountIsLookedAt) {
  const auto bytes = small_asset(40);
  const auto tree_fields = [](std::size_t tree) {
    std::vector<std::size_t> fields = {
        tree + offsetof(TreeHeader, sphere_index), tree + offsetof(TreeHeader, sphere_cover),
        tree + offsetof(TreeHeader, sphere_count), tree + offsetof(TreeHeader, level_count)};
    for (std::size_t k = 0; k < kMaxLevels; ++k) {
      const std::size_t level = tree + offsetof(TreeHeader, level) + k * sizeof(LevelHeader);
      for (const std::size_t field : {offsetof(LevelHeader, blocks), offsetof(LevelHeader, origins),
                                      offsetof(LevelHeader, nodes), offsetof(LevelHeader, count)})
        fields.push_back(level + field);
    }
    return fields;
  };
  std::vector<std::size_t> fields = {
      offsetof(AssetHeader, file_bytes), offsetof(AssetHeader, sphere_count),
      offsetof(AssetHeader, inner_spheres), offsetof(AssetHeader, cover_radii),
      offsetof(AssetHeader, effective_spheres)};
  for (const std::size_t tree :
       {offsetof(AssetHeader, inner_tree), offsetof(AssetHeader, matched_tree)})
    for (const std::size_t field : tree_fields(tree)) fields.push_back(field);
  for (const std::size_t field : fields)
    for (const int change : {-64, -16, -1, 1, 16, 64}) {
      AlignedBytes changed(bytes);
      std::uint32_t value;
      std::memcpy(&value, &changed[field], sizeof(value));
      value += static_cast<std::uint32_t>(change);
      std::memcpy(&changed[field], &value, sizeof(value));
      changed.seal();
      EXPECT_NE(changed.status(), AssetStatus::ok) << field << " " << change;
    }
}

TEST(AssetBytes, ValuesOutOfRangeAreRefused) {
  const auto bytes = small_asset(40);
  AssetHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  const auto refused = [&](std::uint64_t offset, auto value) {
    AlignedBytes changed(bytes);
    std::memcpy(&changed[offset], &value, sizeof(value));
    changed.seal();
    EXPECT_EQ(changed.status(), AssetStatus::corrupt_layout) << offset << " " << value;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kNanf = std::numeric_limits<float>::quiet_NaN();
  refused(offsetof(AssetHeader, centre), kNan);
  refused(offsetof(AssetHeader, exponent), 4000);
  refused(offsetof(AssetHeader, volume), -1.0);
  for (const std::uint64_t spheres : {header.inner_spheres, header.effective_spheres}) {
    refused(spheres, kNanf);
    refused(spheres + 12, -1.0f);
    refused(spheres + 12, kEmptyRadius);
  }
  refused(header.cover_radii, kNanf);
  for (const TreeHeader& tree : {header.inner_tree, header.matched_tree}) {
    refused(tree.sphere_index, 40u);  // no such sphere
    refused(tree.level[0].origins, kNan);
    refused(tree.level[0].blocks + 12, 1e30f);
    const std::uint64_t last = tree.level[0].blocks + 2 * sizeof(BallBlock);
    refused(last + offsetof(BallBlock, r) + 4 * 7, kEmptyRadius);  // a used lane that is empty
    refused(last + offsetof(BallBlock, r) + 4 * 8, 0.0f);          // an unused lane that is not
    refused(tree.level[1].nodes, kNanf);
    refused(tree.level[1].nodes + offsetof(NodeBlock, overlap), 0.5f);
  }
  refused(header.inner_tree.sphere_cover, -0.5f);
}

// A write that fails leaves the old file whole and nothing else.
TEST(AssetSave, KeepsTheOldFileIfTheDiskIsFull) {
  const TemporaryFolder folder;
  const Asset old_asset(small_asset(17), "old");
  const Asset large(small_asset(900), "new");
  old_asset.save(folder / "a.ist");
  // The largest file that this process may write stands in for a full disk.
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
