#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bake/asset/asset_writer.h"
#include "cli/program.h"

namespace {

using ist::testing::CommandLine;
using ist::testing::lines_of;
using ist::testing::numbers_of;
using ist::testing::Outcome;

class AssetCommands : public CommandLine {
 protected:
  void expect_exit(int code, const std::vector<std::string>& arguments,
                   const std::string& message) {
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
    EXPECT_TRUE(new_files().empty()) << new_files().front();
  }
};

TEST_F(AssetCommands, InfoShowsTheHeader) {
  const Outcome text = ist({"info", "cube.ist"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("100, "), std::string::npos) << text.out;
  const nlohmann::json json = nlohmann::json::parse(ist({"info", "cube.ist", "--json"}).out);
  EXPECT_EQ(json.at("spheres"), 100);
  EXPECT_EQ(json.at("asked").at("spheres"), 100);
  EXPECT_EQ(json.at("asked").at("grid"), "banded");
  EXPECT_EQ(json.at("bytes"), read("cube.ist").size());
  EXPECT_NEAR(json.at("volume"), 1, 1e-12);
  expect_exit(1, {"info", "none.ist"}, "none.ist");
  expect_exit(1, {"info", "cube.obj"}, "not an .ist asset; ist bake makes one");
}

TEST_F(AssetCommands, LevelsOfDetailAreListedAndExported) {
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", "fine.ist", "--spheres", "1000"}).exit_code, 0);
  const nlohmann::json json = nlohmann::json::parse(ist({"info", "fine.ist", "--json"}).out);
  ASSERT_EQ(json.at("details").size(), 1u);
  EXPECT_EQ(json.at("details")[0].at("matched_tree").at("spheres"), 250);
  ASSERT_EQ(ist({"export", "fine.ist", "-o", "d.csv", "--detail", "1"}).exit_code, 0);
  EXPECT_EQ(lines_of(read("d.csv")).size(), 251u);
  const Outcome none = ist({"export", "fine.ist", "-o", "e.csv", "--detail", "2"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("1 coarser level"), std::string::npos) << none.err;
}

TEST_F(AssetCommands, CheckPassesASoundAsset) {
  const Outcome text = ist({"check", "cube.ist", "--mesh", "cube.obj"});
  EXPECT_EQ(text.exit_code, 0) << text.out;
  EXPECT_NE(text.out.find("no violations"), std::string::npos);
  const nlohmann::json json =
      nlohmann::json::parse(ist({"check", "cube.ist", "--mesh", "cube.obj", "--json"}).out);
  EXPECT_EQ(json.at("sound"), true);
  EXPECT_GE(json.at("invariants").size(), 10u);
  for (const auto& invariant : json.at("invariants")) EXPECT_EQ(invariant.at("violations"), 0);
}

TEST_F(AssetCommands, CheckExitsWith3WhereASphereHasGrown) {
  const std::string file = read("cube.ist");
  std::vector<std::byte> bytes(file.size());
  std::memcpy(bytes.data(), file.data(), file.size());
  ist::AssetHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  ist::Sphere sphere;
  std::memcpy(&sphere, bytes.data() + header.inner_spheres, sizeof(sphere));
  sphere.r *= 1.001f;
  std::memcpy(bytes.data() + header.inner_spheres, &sphere, sizeof(sphere));
  ist::seal(bytes);
  write("grown.ist", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));

  const Outcome outcome = ist({"check", "grown.ist", "--mesh", "cube.obj"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_NE(outcome.out.find("FAIL sphere clear of surface"), std::string::npos) << outcome.out;
}

TEST_F(AssetCommands, CheckRefusesTheWrongMesh) {
  expect_exit(1, {"check", "cube.ist", "--mesh", "capsule.obj"}, "another mesh");
  expect_exit(1, {"check", "cube.ist", "--mesh", "none.obj"}, "none.obj");
  expect_exit(2, {"check", "cube.ist"}, "mesh");
}

/// Every format contains the same spheres; they lie in the cube and are disjoint.
TEST_F(AssetCommands, ExportsTheSameSpheresInEveryFormat) {
  for (const char* name : {"s.csv", "s.ply", "s.json"})
    ASSERT_EQ(ist({"export", "cube.ist", "-o", name}).exit_code, 0) << name;
  std::vector<std::string> csv = lines_of(read("s.csv"));
  ASSERT_EQ(csv.size(), 101u);
  EXPECT_EQ(csv.front(), "x,y,z,r,ex,ey,ez,er,c");
  csv.erase(csv.begin());

  const nlohmann::json json = nlohmann::json::parse(read("s.json"));
  EXPECT_EQ(json.at("columns").size(), 9u);
  const std::vector<std::string> ply = lines_of(read("s.ply"));
  ASSERT_EQ(ply.size(), 13u + 100u);
  EXPECT_EQ(ply[2], "element vertex 100");

  double matched_volume = 0;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    const std::vector<double> row = numbers_of(csv[i]);
    ASSERT_EQ(row.size(), 9u);
    EXPECT_EQ(json.at("spheres")[i].get<std::vector<double>>(), row);
    std::string spaced = csv[i];
    std::replace(spaced.begin(), spaced.end(), ',', ' ');
    EXPECT_EQ(ply[13 + i], spaced);
    for (int k = 0; k < 3; ++k) EXPECT_LE(std::abs(row[static_cast<std::size_t>(k)]) + row[3], 0.5);
    EXPECT_GE(row[8], row[3]);
    matched_volume += 4 * M_PI / 3 * std::pow(row[7], 3);
  }
  EXPECT_NEAR(matched_volume, 1, 1e-6);
}

/// Far from the origin the centres are rounded on export; the radii make up for it.
TEST_F(AssetCommands, ExportedSpheresStayInsideAnOffsetMesh) {
  std::string far;
  for (const std::string& line : lines_of(read("cube.obj"))) {
    double x, y, z;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3)
      far += "v " + std::to_string(x + 3000000) + " " + std::to_string(y) + " " +
             std::to_string(z) + "\n";
    else
      far += line + "\n";
  }
  write("far.obj", far);
  ASSERT_EQ(ist({"bake", "far.obj", "-o", "far.ist", "--spheres", "100"}).exit_code, 0);
  ASSERT_EQ(ist({"export", "far.ist", "-o", "far.csv"}).exit_code, 0);
  const std::vector<std::string> csv = lines_of(read("far.csv"));
  ASSERT_EQ(csv.size(), 101u);
  for (std::size_t i = 1; i < csv.size(); ++i) {
    const std::vector<double> row = numbers_of(csv[i]);
    const long double reach = std::abs(static_cast<long double>(row[0]) - 3000000) + row[3];
    EXPECT_LE(reach, 0.5L) << i;
  }
}

TEST_F(AssetCommands, ExportErrorsLeaveNothingBehind) {
  expect_exit(1, {"export", "cube.ist", "-o", "s.txt"}, ".csv");
  expect_exit(1, {"export", "none.ist", "-o", "s.csv"}, "none.ist");
  expect_exit(1, {"export", "cube.ist", "-o", "none/s.csv"}, "none/s.csv");
  expect_exit(2, {"export", "cube.ist"}, "output");
}

}  // namespace
