#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "mesh/samples/samples.h"
#include "support/asset_bytes.h"
#include "support/query_settings.h"

// Assets that were cut, damaged or made to harm.

namespace ist {
namespace {

using testing::AlignedBytes;
using testing::small_asset;

/// The status of an asset whose byte `at` was changed, with the old hash.
AssetStatus status_after_damage(std::size_t at, std::uint64_t file_bytes_before,
                                const AlignedBytes& bytes) {
  if (at < offsetof(AssetHeader, format_major)) return AssetStatus::not_an_asset;
  if (at < offsetof(AssetHeader, file_bytes)) return AssetStatus::other_version;
  if (at < offsetof(AssetHeader, content_hash)) {
    std::uint64_t now = 0;
    std::memcpy(&now, bytes.span().data() + offsetof(AssetHeader, file_bytes), sizeof(now));
    return now > file_bytes_before ? AssetStatus::too_short : AssetStatus::corrupt_layout;
  }
  return AssetStatus::corrupt_hash;
}

TEST(AssetBytes, EveryFlippedBitIsNamed) {
  AlignedBytes bytes(small_asset(18));
  const std::size_t size = bytes.span().size();
  ASSERT_EQ(bytes.status(), AssetStatus::ok);
  for (std::size_t bit = 0; bit < 8 * size; ++bit) {
    const auto mask = static_cast<std::byte>(1u << (bit % 8));
    bytes[bit / 8] ^= mask;
    ASSERT_EQ(bytes.status(), status_after_damage(bit / 8, size, bytes)) << "bit " << bit;
    bytes[bit / 8] ^= mask;
  }
}

TEST(AssetBytes, EveryTruncationIsNamed) {
  const auto bytes = small_asset(18);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ASSERT_EQ(AlignedBytes(std::span(bytes).first(length)).status(), AssetStatus::too_short)
        << length;
    try {
      Asset(std::span(bytes).first(length), "cut.ist");
      FAIL() << length;
    } catch (const Error& error) {
      ASSERT_STREQ(error.what(), "cut.ist: the file is truncated; bake again") << length;
    }
  }
  for (const std::size_t more : {1u, 64u, 5000u}) {
    auto longer = bytes;
    longer.resize(bytes.size() + more);
    EXPECT_EQ(AlignedBytes(longer).status(), AssetStatus::corrupt_layout) << more;
  }
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
  AssetView view;
  EXPECT_EQ(AssetView::from_bytes(block.span().subspan(1), view), AssetStatus::misaligned);
  EXPECT_THROW(Asset(std::span(bytes).first(100), "cut.ist"), Error);
}

/// A query of accepted bytes must end and stay inside them; the values
/// may be any.
void use(const AlignedBytes& bytes, const AssetView& sound) {
  static Workspace workspace(1u << 16);
  AssetView view;
  ASSERT_EQ(AssetView::from_bytes(bytes.span(), view), AssetStatus::ok);
  Pose pose;
  pose.t[0] = 0.2;
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    PenetrationSettings settings;
    settings.measure = measure;
    for (const auto& [penetration, separation] :
         {query({view, {}, 1}, {sound, pose, 1}, testing::for_both(settings), workspace),
          query({sound, {}, 1}, {view, pose, 1}, testing::for_both(settings), workspace)}) {
      EXPECT_GE(penetration.volume, 0);
      EXPECT_TRUE(std::isfinite(penetration.volume_max));
      EXPECT_TRUE(penetration.force.allFinite());
      EXPECT_TRUE(penetration.torque.allFinite());
      EXPECT_GE(separation.distance, 0);
      EXPECT_LE(separation.distance_min, separation.distance_max);
    }
  }
}

// A hostile writer knows the hash. Fields of the header and values anywhere are replaced by small,
// huge, special and random ones: refused, or harmless.
TEST(AssetBytes, HostileFieldsAreRefusedOrHarmless) {
  const auto bytes = small_asset(40);
  const AlignedBytes original(bytes);
  AssetView sound;
  ASSERT_EQ(AssetView::from_bytes(original.span(), sound), AssetStatus::ok);
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

// The same word by word: nothing of the header or of any section escapes.
TEST(AssetBytes, EveryHostileWordIsRefusedOrHarmless) {
  const auto bytes = small_asset(18);
  const AlignedBytes original(bytes);
  AssetView sound;
  ASSERT_EQ(AssetView::from_bytes(original.span(), sound), AssetStatus::ok);
  // Integers at their ends, floats: NaN, ±inf, −1, 1e30, the mark of an empty lane, a denormal, −0.
  const std::uint32_t values[] = {0u,          1u,          0xffffffffu, 0x7fffffffu,
                                  0x7fc00000u, 0x7f800000u, 0xff800000u, 0xbf800000u,
                                  0x7149f2cau, 0xf149f2cau, 0x00000001u, 0x80000000u};
  for (std::size_t at = 0; at < bytes.size(); at += 4)
    for (const std::uint32_t value : values) {
      AlignedBytes changed(bytes);
      std::memcpy(&changed[at], &value, sizeof(value));
      changed.seal();
      if (changed.status() != AssetStatus::ok) continue;
      SCOPED_TRACE("byte " + std::to_string(at) + " = " + std::to_string(value));
      use(changed, sound);
      if (HasFailure()) return;
    }
}

// `check` reads all that a query does not. It must end, and in a verdict.
TEST(AssetBytes, CheckEndsOnHostileAssets) {
  const ClosedMesh mesh = close_mesh(make_sample("cube"), "cube");
  PackingSettings settings;
  settings.max_spheres = 18;
  const Asset asset = bake(mesh, settings);
  std::mt19937_64 random(9);
  int accepted = 0;
  while (accepted < 150) {
    AlignedBytes changed(asset.bytes());
    const std::size_t at = random() % (asset.bytes().size() / 4) * 4;
    const float values[] = {0, 1e-30f, 0.5f, 1, 15, -0.25f, 1e-7f};
    const float value = values[random() % std::size(values)];
    std::memcpy(&changed[at], &value, sizeof(value));
    changed.seal();
    if (changed.status() != AssetStatus::ok) continue;
    ++accepted;
    try {
      check(Asset(changed.span(), "hostile.ist"), mesh, 1);
    } catch (const Error&) {  // of another mesh
    }
  }
}

// Each field that the query relies on is damaged by name too: random changes may miss one.
TEST(AssetBytes, EveryOffsetAndCountIsLookedAt) {
  const auto bytes = small_asset(40, 1);
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
      offsetof(AssetHeader, matched_spheres)};
  for (const std::size_t tree :
       {offsetof(AssetHeader, inner_tree), offsetof(AssetHeader, matched_tree)})
    for (const std::size_t field : tree_fields(tree)) fields.push_back(field);
  fields.push_back(offsetof(AssetHeader, details));
  fields.push_back(offsetof(AssetHeader, detail_count));
  AssetHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  const std::size_t first_detail = header.details;
  fields.push_back(first_detail + offsetof(DetailLevel, matched_spheres));
  for (const std::size_t field : tree_fields(first_detail + offsetof(DetailLevel, matched_tree)))
    fields.push_back(field);
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
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const double value : {kNan, kInf, -kInf, 1e300, -1e300}) {
    for (std::size_t k = 0; k < 3; ++k) {
      refused(offsetof(AssetHeader, centre_of_mass) + 8 * k, value);
      refused(offsetof(AssetHeader, box_lower) + 8 * k, value);
      refused(offsetof(AssetHeader, box_upper) + 8 * k, value);
      refused(offsetof(AssetHeader, ball_centre) + 8 * k, value);
    }
    for (std::size_t k = 0; k < 6; ++k) refused(offsetof(AssetHeader, inertia) + 8 * k, value);
    for (const std::size_t field :
         {offsetof(AssetHeader, centre_of_mass_error), offsetof(AssetHeader, inertia_error),
          offsetof(AssetHeader, ball_radius)})
      refused(field, value);
  }
  refused(offsetof(AssetHeader, box_lower), 2.0);   // above the upper corner
  refused(offsetof(AssetHeader, box_upper), -0.3);  // the ball's centre is outside
  refused(offsetof(AssetHeader, centre_of_mass), 1.0);
  refused(offsetof(AssetHeader, ball_radius), 0.2);
  refused(offsetof(AssetHeader, ball_radius), 5.0);
  // No body has these: a negative moment, one larger than the other two together, a product of
  // inertia larger than moments allow.
  refused(offsetof(AssetHeader, inertia), -1e-9);
  refused(offsetof(AssetHeader, inertia), header.inertia[1] + header.inertia[2] + 1e-6);
  refused(offsetof(AssetHeader, inertia) + 8 * 3, header.inertia[0]);
  for (const std::uint64_t spheres : {header.inner_spheres, header.matched_spheres}) {
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

TEST(AssetBytes, DetailsAreLookedAt) {
  const auto bytes = small_asset(200, 2);
  const AlignedBytes sound(bytes);
  ASSERT_EQ(sound.status(), AssetStatus::ok);
  const auto& header = *reinterpret_cast<const AssetHeader*>(sound.span().data());
  const auto refused = [&](std::uint64_t offset, auto value) {
    AlignedBytes changed(bytes);
    std::memcpy(&changed[offset], &value, sizeof(value));
    changed.seal();
    EXPECT_EQ(changed.status(), AssetStatus::corrupt_layout) << offset << " " << value;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  refused(offsetof(AssetHeader, detail_count), kMaxDetails + 1);
  refused(offsetof(AssetHeader, predicted_error), kNan);
  refused(offsetof(AssetHeader, measured_error), kNan);
  refused(offsetof(AssetHeader, worst_partner), kTrialPartners);
  for (std::uint32_t i = 0; i < 2; ++i) {
    const std::uint64_t detail = header.details + i * sizeof(DetailLevel);
    refused(detail + offsetof(DetailLevel, protrusion), -1.0);
    refused(detail + offsetof(DetailLevel, matched_tree) + offsetof(TreeHeader, mean_radius), kNan);
    refused(at<DetailLevel>(header, header.details)[i].matched_spheres, kNan);
    const TreeHeader& tree = matched_tree(header, i + 1);
    refused(tree.sphere_index, tree.sphere_count);  // no such sphere
    refused(tree.level[0].blocks + 12, 1e30f);
  }
}

}  // namespace
}  // namespace ist
