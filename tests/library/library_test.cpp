#include <sstream>

#include "library/library_folder.h"

// `ist bake --manifest` and `ist summary`, end to end.

namespace ist::testing {
namespace {

class Library : public LibraryFolder {};

TEST_F(Library, BakesWhatSingleBakesBake) {
  const Outcome outcome = bake("out");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto files = files_in("out");
  ASSERT_EQ(files.size(), names().size());
  for (const std::string& name : names()) {
    const bool upright = name == "upright";
    std::vector<std::string> single = {"bake",      "meshes/" + (upright ? "gear" : name) + ".obj",
                                       "-o",        "single.ist",
                                       "--spheres", upright ? "30" : "40",
                                       "--device",  "cpu"};
    if (upright) single.insert(single.end(), {"--scale", "1e-3,1e-3,-2e-3", "--up-axis", "y"});
    ASSERT_EQ(ist(single).exit_code, 0);
    EXPECT_TRUE(files.at(name + ".ist") == read("single.ist")) << name;
    EXPECT_NE(outcome.out.find("\n" + name + " "), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.err.find("] " + name + ": baked in "), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(ist({"check", "out/upright.ist", "--mesh", "meshes/gear.obj", "--scale",
                 "0.001,0.001,-0.002", "--up-axis", "Y"})
                .exit_code,
            0);
  EXPECT_EQ(ist({"check", "out/upright.ist", "--mesh", "meshes/gear.obj"}).exit_code, 1);
}

TEST_F(Library, BytesDoNotDependOnHowManyRunAtOnce) {
  ASSERT_EQ(bake("one", {"--jobs", "1", "--threads", "1"}).exit_code, 0);
  ASSERT_EQ(bake("many", {"--jobs", "5", "--threads", "3"}).exit_code, 0);
  // Less memory than any job is said to take: each runs alone.
  ASSERT_EQ(bake("alone", {"--jobs", "5", "--memory", "1K"}).exit_code, 0);
  EXPECT_TRUE(files_in("one") == files_in("many"));
  EXPECT_TRUE(files_in("one") == files_in("alone"));
}

TEST_F(Library, ShardsAreTheWholeAndTheirSummariesToo) {
  const nlohmann::json whole = summary_of("whole");
  const std::size_t shards = 3;
  std::size_t assets = 0;
  std::vector<std::string> merge = {"summary", "--json"};
  for (std::size_t i = 1; i <= shards; ++i) {
    const std::string part = std::to_string(i) + "/" + std::to_string(shards);
    const nlohmann::json summary = summary_of("parts", {"--shard", part});
    EXPECT_EQ(summary.at("shard").at("index"), i);
    assets += summary.at("assets").size();
    merge.push_back("shard-" + std::to_string(i) + ".json");
    write(merge.back(), summary.dump());
  }
  EXPECT_EQ(assets, names().size());
  EXPECT_TRUE(files_in("parts") == files_in("whole"));

  const Outcome merged = ist(merge);
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  const nlohmann::json together = nlohmann::json::parse(merged.out);
  EXPECT_EQ(together.at("library_hash"), whole.at("library_hash"));
  EXPECT_EQ(together.at("shard"), whole.at("shard"));
  EXPECT_EQ(together.at("counts"), whole.at("counts"));
  ASSERT_EQ(together.at("assets").size(), names().size());
  for (std::size_t i = 0; i < names().size(); ++i)
    for (const char* key : {"name", "content_hash", "spheres", "coverage"})
      EXPECT_EQ(together.at("assets")[i].at(key), whole.at("assets")[i].at(key));

  const auto expect_error = [&](const std::vector<std::string>& files, const std::string& what) {
    std::vector<std::string> arguments = {"summary"};
    arguments.insert(arguments.end(), files.begin(), files.end());
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
  };
  expect_error({"shard-1.json", "shard-3.json"}, "shard 2/3 of library.toml is missing");
  expect_error({"shard-1.json", "shard-2.json"}, "shard 3/3 of library.toml is missing");
  expect_error({"shard-1.json", "shard-2.json", "shard-1.json"}, "is given twice");
  write("cut.json", read("shard-2.json").substr(0, 100));
  expect_error({"shard-1.json", "cut.json", "shard-3.json"}, "cut.json: is not a complete summary");
  nlohmann::json other = nlohmann::json::parse(read("shard-2.json"));
  other["library_hash"] = "0000000000000001";
  write("other.json", other.dump());
  expect_error({"shard-1.json", "other.json", "shard-3.json"},
               "does not belong to the same library");
}

TEST_F(Library, AShardIsOneOfSome) {
  for (const std::string shard : {"0/2", "3/2", "1", "/", "1/", "-1/2", "a/b", "1/2/3", "1/0"}) {
    const Outcome outcome = bake("out", {"--shard", shard});
    EXPECT_EQ(outcome.exit_code, 2) << shard;
    EXPECT_NE(outcome.err.find("--shard: '" + shard + "' is not I/N"), std::string::npos)
        << outcome.err;
    EXPECT_FALSE(exists("out"));
  }
}

TEST_F(Library, OneThatFailsFailsAlone) {
  write("meshes/broken.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const nlohmann::json summary = summary_of("out", {}, 1);
  EXPECT_EQ(summary.at("complete"), false);
  EXPECT_EQ(summary.at("counts").at("failed"), 1);
  EXPECT_EQ(summary.at("counts").at("baked"), names().size());
  EXPECT_EQ(files_in("out").size(), names().size());
  for (const nlohmann::json& asset : summary.at("assets")) {
    const bool broken = asset.at("name") == "broken";
    EXPECT_EQ(asset.at("status"), broken ? "failed" : "baked") << asset;
    EXPECT_EQ(asset.at("message").is_null(), !broken) << asset;
  }
  EXPECT_NE(summary.at("assets")[0].at("message").get<std::string>().find(
                "meshes/broken.obj: 3 boundary edges"),
            std::string::npos)
      << summary.at("assets")[0];
  EXPECT_NE(bake("out").err.find("in a manifest repair = true"), std::string::npos);
}

/// Existing assets of the same mesh and settings are not baked again, even without a cache.
TEST_F(Library, WhatIsThereAndUnchangedIsNotBakedAgain) {
  const auto counts = [&] { return summary_of("out").at("counts"); };
  EXPECT_EQ(counts().at("baked"), 5);
  const auto files = files_in("out");
  EXPECT_EQ(counts().at("cached"), 5);
  EXPECT_TRUE(files_in("out") == files);
  write("meshes/cube.obj", read("meshes/cube.obj") + "#");
  EXPECT_EQ(counts().at("baked"), 1);
  // Assets that are gone, damaged or another's, and a record that was cut short.
  std::filesystem::remove(folder_ / "out/cube.ist");
  write("out/nut.ist", files.at("gear.ist"));
  write("out/gear.ist", files.at("gear.ist").substr(0, 5000));
  EXPECT_EQ(counts().at("baked"), 3);
  EXPECT_TRUE(files_in("out") == files);
  const std::string record = read("out/.ist-bakes");
  write("out/.ist-bakes", record.substr(0, record.find('\n', 1) - 20));
  EXPECT_EQ(counts().at("baked"), 5);
  EXPECT_EQ(counts().at("cached"), 5);
}

TEST_F(Library, StaleAssetsAreReportedAndRemovedOnRequest) {
  summary_of("out");
  std::filesystem::rename(folder_ / "meshes/cube.obj", folder_ / "meshes/dice.obj");
  write("meshes/nut.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Outcome told = bake("out", {"--json"});
  EXPECT_EQ(told.exit_code, 1);
  EXPECT_NE(told.err.find("out/cube.ist, out/nut.ist (2). --remove-stale"), std::string::npos)
      << told.err;
  EXPECT_EQ(nlohmann::json::parse(told.out).at("stale").size(), 2u);
  EXPECT_TRUE(exists("out/cube.ist"));
  bake("out", {"--remove-stale"});
  EXPECT_FALSE(exists("out/cube.ist"));
  EXPECT_FALSE(exists("out/nut.ist"));
  EXPECT_TRUE(exists("out/dice.ist"));
}

TEST_F(Library, ALineOfJsonAnAsset) {
  const Outcome outcome = bake("out", {"--json-lines", "--quiet"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::vector<nlohmann::json> all;
  for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(all.size(), names().size() + 1);
  for (std::size_t i = 0; i < names().size(); ++i) EXPECT_EQ(all[i].at("status"), "baked");
  EXPECT_EQ(all.back().at("assets").size(), names().size());
}

TEST_F(Library, FailuresAloneAndTheQualityOfAssets) {
  write("meshes/broken.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const nlohmann::json summary = summary_of("out", {}, 1);
  write("summary.json", summary.dump());
  const Outcome failed = ist({"summary", "summary.json", "--failed"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.out.find("broken"), std::string::npos) << failed.out;
  EXPECT_EQ(failed.out.find("gear"), std::string::npos) << failed.out;
  EXPECT_NE(failed.out.find(" 1 failed"), std::string::npos) << failed.out;
  EXPECT_EQ(failed.out.find(" 0 baked"), std::string::npos) << failed.out;
  // A page with a picture of each asset, failures first.
  EXPECT_EQ(ist({"summary", "summary.json", "--html", "page.html"}).exit_code, 1);
  const std::string page = read("page.html");
  std::size_t pictures = 0;
  for (std::size_t at = 0; (at = page.find("data:image/bmp;base64,Qk", at)) != std::string::npos;
       ++at)
    ++pictures;
  EXPECT_EQ(pictures, names().size());
  EXPECT_LT(page.find("<td>broken<td>failed"), page.find("<td>capsule<td>baked"));
  EXPECT_EQ(page.find("http"), std::string::npos);
  for (const nlohmann::json& asset : summary.at("assets")) {
    if (asset.at("status") == "failed") continue;
    const nlohmann::json info =
        nlohmann::json::parse(ist({"info", asset.at("asset"), "--json"}).out);
    for (const char* field : {"volume", "protrusion"})
      EXPECT_EQ(asset.at(field), info.at(field)) << field;
  }
}

TEST_F(Library, TargetsAndWarningsAreInTheSummary) {
  write("target.toml",
        "[[asset]]\nmesh = \"meshes/cube.obj\"\ntarget-error = \"30%\"\nat-overlap = 0.01\n"
        "[[asset]]\nname = 'few'\nmesh = \"meshes/cube.obj\"\ntarget-error = \"2%\"\nat-overlap = "
        "0.1\nspheres = 10\n");
  const Outcome outcome = bake("out", {"--json"}, {}, "target.toml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json assets = nlohmann::json::parse(outcome.out).at("assets");
  EXPECT_EQ(assets[0].at("target_error"), 0.3);
  EXPECT_EQ(assets[0].at("target_met"), true);
  EXPECT_LE(assets[0].at("measured_error"), 0.3);
  EXPECT_GT(assets[0].at("measured_error"), 0);
  EXPECT_EQ(assets[1].at("target_met"), false);
  EXPECT_EQ(assets[1].at("spheres"), 10);
  EXPECT_NE(assets[1].at("warnings").dump().find("missed"), std::string::npos) << assets[1];
}

TEST_F(Library, AnAssetThatIsNotWhatIsDemandedFails) {
  write("demands.toml",
        "[defaults]\nspheres = 40\nrequire-mesh = true\n"
        "[[asset]]\nmesh = \"meshes/cube.obj\"\n"
        "[[asset]]\nname = 'bare'\nmesh = \"meshes/cube.obj\"\nkeep-mesh = \"no\"\n"
        "[[asset]]\nname = 'bare_may_be'\nmesh = \"meshes/cube.obj\"\nkeep-mesh = \"no\"\n"
        "require-mesh = false\n"
        "[[asset]]\nname = 'full'\nmesh = \"meshes/cube.obj\"\nmin-coverage = \"99.9%\"\n");
  const Outcome outcome = bake("out", {"--json"}, {}, "demands.toml");
  ASSERT_EQ(outcome.exit_code, 1) << outcome.err;
  const nlohmann::json assets = nlohmann::json::parse(outcome.out).at("assets");
  ASSERT_EQ(assets.size(), 4u);
  const auto message = [&](int i) { return assets[i].at("message").dump(); };
  EXPECT_NE(message(0).find("require-mesh: the asset keeps no mesh"), std::string::npos);
  EXPECT_EQ(assets[1].at("mesh_state"), "none");
  EXPECT_EQ(assets[1].at("status"), "baked");
  EXPECT_EQ(assets[2].at("mesh_state"), "own");
  EXPECT_NE(message(3).find("min-coverage: spheres fill"), std::string::npos) << message(3);
  EXPECT_EQ(files_in("out").count("bare.ist"), 0u);
}

TEST_F(Library, InterruptedItKeepsWhatIsFinished) {
  std::string manifest = "[defaults]\nspheres = 1500\n";
  for (int i = 0; i < 30; ++i)
    manifest += "[[asset]]\nmesh = \"meshes/gear.obj\"\nname = \"gear-" + std::to_string(i) +
                "\"\nseed = " + std::to_string(i) + "\n";
  write("long.toml", manifest);
  RunOptions options;
  options.interrupt_after = ": baked in";
  const Outcome outcome = bake("out", {"--json", "--jobs", "2"}, options, "long.toml");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  const nlohmann::json summary = nlohmann::json::parse(outcome.out);
  const std::size_t baked = summary.at("counts").at("baked");
  EXPECT_GE(baked, 1u);
  EXPECT_LT(baked, 30u);
  EXPECT_EQ(summary.at("counts").at("not_baked"), 30 - baked);
  const auto files = files_in("out");
  EXPECT_EQ(files.size(), baked);
  for (const auto& [name, bytes] : files)
    EXPECT_EQ(ist({"info", "out/" + name}).exit_code, 0) << name;
}

TEST_F(Library, OnATerminalProgressIsOneLine) {
  RunOptions options;
  options.terminal = true;
  const Outcome outcome = bake("out", {"--jobs", "1"}, options);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find(" of 5 assets  0 cached  0 failed"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find(" a second  "), std::string::npos) << outcome.err;
  // Remarkable assets are listed above it.
  for (const std::string& line : lines_of(outcome.err))
    EXPECT_TRUE(line.ends_with("\r\033[K") || line.find("warning") != std::string::npos) << line;
  EXPECT_TRUE(outcome.err.ends_with("\r\033[K")) << outcome.err;
}

TEST_F(Library, OptionsThatBelongElsewhereAreRefused) {
  const auto expect_usage = [&](const std::vector<std::string>& arguments,
                                const std::string& what) {
    const Outcome outcome = ist(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
    EXPECT_FALSE(exists("out"));
  };
  expect_usage({"bake", "--manifest", "library.toml", "-o", "out", "--spheres", "5"},
               "--spheres: cannot be combined with --manifest");
  expect_usage({"bake", "meshes/cube.obj", "--manifest", "library.toml", "-o", "out"},
               "--manifest: excludes MESH");
  expect_usage({"bake", "-o", "out"}, "MESH");
  expect_usage({"bake", "meshes/cube.obj", "-o", "out", "--shard", "1/2"}, "--manifest");
  expect_usage({"bake", "--manifest", "library.toml", "-o", "out", "--cache-size", "1G"},
               "--cache-size: has no effect without --cache");
  expect_usage({"bake", "--manifest", "library.toml", "-o", "out", "--memory", "lots"},
               "--memory: 'lots' is not a number of bytes");
}

}  // namespace
}  // namespace ist::testing
