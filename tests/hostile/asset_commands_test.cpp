#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "bake/asset/asset_writer.h"
#include "cli/program.h"

// An asset whose header lies, with a hash that fits, in every command that reads assets.

namespace ist::testing {
namespace {

struct Lie {
  const char* name;
  std::size_t at;
  std::uint64_t value;
  std::size_t width;
  bool seen;  ///< other fields tell that it is one
};

template <class T>
Lie lie(const char* name, std::size_t at, T value, bool seen = false) {
  Lie result{name, at, 0, sizeof(value), seen};
  std::memcpy(&result.value, &value, sizeof(value));
  return result;
}

std::vector<Lie> lies() {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kLargest = std::numeric_limits<double>::max();
  return {
      lie("large scale", offsetof(AssetHeader, exponent), std::int32_t{300}),
      lie("small scale", offsetof(AssetHeader, exponent), std::int32_t{-300}, true),
      lie("centre far away", offsetof(AssetHeader, centre), -kLargest, true),
      lie("unknown flags", offsetof(AssetHeader, flags), ~std::uint32_t{0}),
      lie("huge volume", offsetof(AssetHeader, volume), 1e18),
      lie("unknown grid", offsetof(AssetHeader, asked_grid), ~std::uint32_t{0}),
      lie("unknown stop", offsetof(AssetHeader, stop_reason), std::uint32_t{1} << 31),
      lie("NaN coverage asked", offsetof(AssetHeader, asked_coverage), kNan),
      lie("infinite radius asked", offsetof(AssetHeader, asked_min_radius), -kInfinity),
      lie("NaN ratio kept", offsetof(AssetHeader, kept_ratio_worst), kNan),
      lie("another mesh", offsetof(AssetHeader, mesh_hash), std::uint64_t{1}),
  };
}

class HostileAsset : public CommandLine {
 protected:
  void write_with(const Lie& lie) const {
    const std::string content = read("cube.ist");
    std::vector<std::byte> bytes(content.size());
    std::memcpy(bytes.data(), content.data(), content.size());
    std::memcpy(bytes.data() + lie.at, &lie.value, lie.width);
    seal(bytes);
    write("lie.ist", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
};

TEST_F(HostileAsset, EveryCommandEndsOrderly) {
  for (const Lie& lie : lies()) {
    SCOPED_TRACE(lie.name);
    write_with(lie);
    const Outcome info = ist({"info", "lie.ist", "--json"});
    if (lie.seen) {
      EXPECT_EQ(info.exit_code, 1);
      EXPECT_NE(info.err.find("lie.ist: a field or offset is out of range"), std::string::npos);
      continue;
    }
    EXPECT_EQ(info.exit_code, 0) << info.err;
    EXPECT_TRUE(nlohmann::json::accept(info.out)) << info.out;
    EXPECT_EQ(ist({"info", "lie.ist"}).exit_code, 0);
    const Outcome exported = ist({"export", "lie.ist", "-o", "lie.json"});
    EXPECT_EQ(exported.exit_code, 0) << exported.err;
    EXPECT_TRUE(nlohmann::json::accept(read("lie.json")));
    const Outcome query =
        ist({"query", "lie.ist", "capsule.ist", "--pose", "1,0,0,0,0.1,0,0", "--json"});
    EXPECT_EQ(query.exit_code, 0) << query.err;
    EXPECT_TRUE(nlohmann::json::accept(query.out)) << query.out;
    const Outcome check = ist({"check", "lie.ist", "--mesh", "cube.obj"});
    EXPECT_TRUE(check.exit_code == 0 || check.exit_code == 1 || check.exit_code == 3) << check.err;
  }
}

TEST_F(HostileAsset, ACutOneIsNamed) {
  const std::string whole = read("cube.ist");
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{7}, std::size_t{100}, std::size_t{832}, whole.size() - 1}) {
    write("cut.ist", whole.substr(0, length));
    const Outcome info = ist({"info", "cut.ist"});
    EXPECT_EQ(info.exit_code, 1);
    EXPECT_EQ(info.err, "ist: error: cut.ist: the file is truncated; bake again\n");
  }
}

}  // namespace
}  // namespace ist::testing
