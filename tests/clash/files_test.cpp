#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "cli/program.h"
#include "support/shared_data.h"

// `ist clash` as a user runs it: files of parts, scenes and robots, rules, reports, and bad input.

namespace ist::testing {
namespace {

using Json = nlohmann::json;

class ClashFiles : public CommandLine {
 protected:
  /// A cube of edge 1 around x.
  static std::string part(const std::string& name, double x) {
    return "[[part]]\nname = \"" + name +
           "\"\nmesh = \"cube.obj\"\nscale = " + std::to_string(1 / edge_) + "\npose = [1,0,0,0, " +
           std::to_string(x) + ",0,0]\n";
  }
  void SetUp() override {
    // No bakes: most of these tests need none.
    std::string pattern = (std::filesystem::temp_directory_path() / "ist_clash_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    ASSERT_EQ(ist({"sample", "cube", "-o", "cube.obj"}).exit_code, 0);
    double low = 1e9, high = -1e9;  // of the cube in x
    for (const std::string& line : lines_of(read("cube.obj")))
      if (line.starts_with("v ")) {
        const double x = std::stod(line.substr(2));
        low = std::min(low, x);
        high = std::max(high, x);
      }
    edge_ = high - low;
  }
  Outcome clash(const std::string& file, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"clash", file});
    return ist(more);
  }
  Json json(const std::string& file, std::vector<std::string> more = {}, int exit_code = -1) {
    more.push_back("--json");
    const Outcome outcome = clash(file, more);
    EXPECT_NE(outcome.exit_code, 2) << outcome.err;
    if (exit_code >= 0) {
      EXPECT_EQ(outcome.exit_code, exit_code) << outcome.out << outcome.err;
    }
    return Json::parse(outcome.out.empty() ? "{}" : outcome.out);
  }
  /// "a b kind" of each pair.
  static std::vector<std::string> pairs(const Json& report) {
    std::vector<std::string> out;
    for (const Json& pair : report.at("pairs"))
      out.push_back(pair.at("a").get<std::string>() + " " + pair.at("b").get<std::string>() + " " +
                    pair.at("kind").get<std::string>());
    return out;
  }
  using Words = std::vector<std::string>;

  static inline double edge_ = 1;
};

TEST_F(ClashFiles, KindsNumbersAndExitCodes) {
  write("row.toml", part("a", 0) + part("b", 0.75) + part("c", 1.75) + part("d", 3) + part("e", 9));
  const Json report = json("row.toml", {"--clearance", "0.3"}, 3);
  EXPECT_EQ(report.at("schema"), "ist.clash/1");
  EXPECT_EQ(report.at("parts"), 5);
  EXPECT_EQ(pairs(report), (Words{"a b overlapping", "b c touching", "c d apart"}));
  const Json &over = report["pairs"][0], &touch = report["pairs"][1], &apart = report["pairs"][2];
  EXPECT_NEAR(over["volume"].get<double>(), 0.25, 1e-12);
  EXPECT_LE(over["volume_min"].get<double>(), over["volume"].get<double>());
  EXPECT_NEAR(over["depth"].get<double>(), 0.25, 1e-7);
  EXPECT_NEAR(over["centroid"][0].get<double>(), 0.375, 1e-9);
  EXPECT_NEAR(over["direction"][0].get<double>(), 1, 1e-12);  // the flush sides have no say
  EXPECT_EQ(over["status"], "ok");
  EXPECT_NEAR(touch["contact_area"].get<double>(), 1, 1e-9);
  EXPECT_NEAR(touch["centroid"][0].get<double>(), 1.25, 1e-5);
  EXPECT_EQ(touch["volume"], 0);
  EXPECT_NEAR(apart["distance_min"].get<double>(), 0.25, 1e-9);
  EXPECT_NEAR(apart["distance_max"].get<double>(), 0.25, 1e-9);
  for (const Json& pair : report["pairs"])
    for (const char* const key :
         {"a", "b", "kind", "volume", "volume_min", "volume_max", "contact_area", "centroid",
          "direction", "depth", "distance_min", "distance_max", "status"})
      EXPECT_TRUE(pair.contains(key)) << key;
  write("clean.toml", part("a", 0) + part("b", 1) + part("c", 3));
  EXPECT_EQ(pairs(json("clean.toml", {}, 0)), Words{"a b touching"});
  EXPECT_EQ(clash("row.toml", {"--threads", "1"}).out, clash("row.toml", {"--threads", "7"}).out);
  EXPECT_NE(clash("row.toml").out.find("5 parts: 1 overlapping, 1 touching, 0 apart"),
            std::string::npos);
}

TEST_F(ClashFiles, APartInAnotherAndFlushWithItIsAsDeepAsItIsLong) {
  const std::string twice =
      "scale = " + std::to_string(2 / edge_) + "\npose = [1,0,0,0, 0.5,0.25,0]\n";
  write("flush.toml", part("a", 0) + "[[part]]\nname = \"b\"\nmesh = \"cube.obj\"\n" + twice);
  const Json pair = json("flush.toml", {}, 3)["pairs"][0];
  EXPECT_NEAR(pair["volume"].get<double>(), 1, 1e-12);
  EXPECT_NEAR(pair["depth"].get<double>(), 1, 1e-7);
  EXPECT_NEAR(pair["direction"][0].get<double>(), 1, 1e-7);
}

TEST_F(ClashFiles, ToleranceDecidesWhatIsAClash) {
  write("two.toml", part("a", 0) + part("b", 0.75));
  const auto verdict = [&](const char* tolerance, int exit_code) {
    return json("two.toml", {"--tolerance", tolerance}, exit_code)["pairs"][0]["verdict"];
  };
  EXPECT_EQ(verdict("0.2", 3), "certainly above");
  EXPECT_EQ(verdict("0.3", 0), "certainly below");
  EXPECT_EQ(verdict("0.25", 3), "undecided");
  EXPECT_EQ(pairs(json("two.toml", {"--touch-within", "0.3"}, 0)), Words{"a b touching"});
  for (const auto& [tolerance, text] :
       {std::pair("0.2", "tolerance: certainly above"), {"0.25", "tolerance: undecided"}})
    EXPECT_NE(clash("two.toml", {"--tolerance", tolerance}).out.find(text), std::string::npos);
}

TEST_F(ClashFiles, WhatTouchesWithinATolerance) {
  // a reaches 0.25 into b, and c is 0.25 away from b: the contacts are halfway.
  write("row.toml", part("a", 0) + part("b", 0.75) + part("c", 2) + part("d", 2.1));
  const Json report = json("row.toml", {"--touch-within", "0.3"}, 3);
  EXPECT_EQ(pairs(report), (Words{"a b touching", "b c touching", "c d overlapping"}));
  EXPECT_NEAR(report["pairs"][0]["centroid"][0].get<double>(), 0.375, 1e-6);
  EXPECT_NEAR(report["pairs"][0]["direction"][0].get<double>(), 1, 1e-6);
  EXPECT_NEAR(report["pairs"][0]["contact_area"].get<double>(), 1, 1e-6);
  EXPECT_NEAR(report["pairs"][1]["centroid"][0].get<double>(), 1.375, 1e-6);
  EXPECT_NEAR(report["pairs"][1]["contact_area"].get<double>(), 1, 1e-6);
  EXPECT_EQ(report["pairs"][2]["duplicate"], false);  // however much counts as touching
}

TEST_F(ClashFiles, RulesLeavePairsOut) {
  const std::string all = part("a1", 0) + part("a2", 0.5) + part("b1", 0.75) + part("b2", 0.9);
  const auto with = [&](const std::string& rules) {
    write("rules.toml", all + rules);
    return pairs(json("rules.toml"));
  };
  EXPECT_EQ(with("").size(), 6u);
  EXPECT_EQ(with("[[ignore]]\na = \"a1\"\n"),  // one-sided
            (Words{"a2 b1 overlapping", "a2 b2 overlapping", "b1 b2 overlapping"}));
  EXPECT_EQ(with("[[ignore]]\na = \"b*\"\nb = [\"a?\"]\n"),
            (Words{"a1 a2 overlapping", "b1 b2 overlapping"}));
  EXPECT_EQ(with("[[group]]\nname = \"g\"\nparts = [\"a*\", \"b1\"]\n"),
            (Words{"a1 b2 overlapping", "a2 b2 overlapping", "b1 b2 overlapping"}));
  EXPECT_EQ(with("[[group]]\nname = \"g\"\nparts = [\"a*\", \"b1\"]\n"
                 "[[ignore]]\na = \"g\"\nb = \"b2\"\n"),
            Words{});
  // Brackets are letters as others, and a letter may have several bytes.
  const std::string named =
      part("p[1]a", 0) + part("p1a", 0.5) + part("q\u00e4", 5) + part("r", 5.5);
  for (const auto& [rule, left] :
       {std::pair("p[1]*", Words{"q\u00e4 r overlapping"}),
        std::pair("*[?]a", Words{"q\u00e4 r overlapping"}),
        std::pair("q?", Words{"p[1]a p1a overlapping"}),
        std::pair("q??", Words{"p[1]a p1a overlapping", "q\u00e4 r overlapping"}),
        std::pair("p1*", Words{"q\u00e4 r overlapping"}),
        std::pair("*1*b", Words{"p[1]a p1a overlapping", "q\u00e4 r overlapping"})}) {
    write("named.toml", named + "[[ignore]]\na = '" + rule + "'\n");
    EXPECT_EQ(pairs(json("named.toml")), left) << rule;
  }
  write("all.toml", all);
  write("apart.toml", "[[ignore]]\na = \"a1\"\nb = \"*\"\n");
  EXPECT_EQ(pairs(json("all.toml", {"--rules", "apart.toml"})).size(), 3u);
  const Json none = json("all.toml", {"--rules", "apart.toml"});
  EXPECT_EQ(none.at("parts"), 4);
  write("idle.toml", all + "[[ignore]]\na = \"zzz\"\n");
  EXPECT_NE(clash("idle.toml").out.find("'zzz' names no part"), std::string::npos);
}

TEST_F(ClashFiles, PartsThatAreNoSolidsAreReportedAndTheRestIsAnswered) {
  write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
  std::string twice = read("cube.obj");  // two cubes that reach into each other
  std::string second;
  int count = 0;
  for (const std::string& line : lines_of(twice)) {
    std::istringstream words(line);
    std::string kind;
    double x = 0, y = 0, z = 0;
    words >> kind >> x >> y >> z;
    if (kind == "v") {
      ++count;
      std::ostringstream out;
      out << "v " << x + edge_ / 2 << " " << y << " " << z << "\n";
      second += out.str();
    }
  }
  for (const std::string& line : lines_of(twice))
    if (line.starts_with("f ")) {
      std::istringstream words(line.substr(2));
      second += "f";
      for (std::string word; words >> word;)
        second += " " + std::to_string(std::stoi(word) + count);
      second += "\n";
    }
  write("twice.obj", twice + second);
  const std::string open = "[[part]]\nname = \"open\"\nmesh = \"open.obj\"\n",
                    own = "[[part]]\nname = \"twice\"\nmesh = \"twice.obj\"\npose = [1,0,0,0, 0," +
                          std::to_string(0.9 * edge_) + ",0]\n",
                    cube = "[[part]]\nmesh = \"cube.obj\"\n";
  write("parts.toml", open + own + cube);
  const Json report = json("parts.toml", {}, 3);
  EXPECT_EQ(report.at("parts"), 3);
  ASSERT_EQ(report.at("faults").size(), 1u);
  EXPECT_EQ(report["faults"][0]["part"], "open");
  EXPECT_EQ(pairs(report), Words{"twice cube overlapping"});
  // Volume inside both copies counts once.
  EXPECT_NEAR(report["pairs"][0]["volume"].get<double>(), 0.1 * std::pow(edge_, 3), 1e-9);
  EXPECT_NE(report["notes"].dump().find("twice: "), std::string::npos);
  // Nobody may take silence for clean …
  write("alone.toml", open + cube);
  EXPECT_EQ(clash("alone.toml").exit_code, 1);
  EXPECT_NE(clash("alone.toml").out.find("not answered: open"), std::string::npos);
  EXPECT_NE(clash("alone.toml", {"--csv"}).err.find("not answered: open"), std::string::npos);
  // … unless it can be closed, or is ignored by name.
  EXPECT_EQ(clash("alone.toml", {"--repair"}).exit_code, 3);
  write("ignored.toml", open + cube + "[[ignore]]\na = \"open\"\n");
  EXPECT_EQ(clash("ignored.toml").exit_code, 0);
}

TEST_F(ClashFiles, CopiesInOnePlaceAndAssets) {
  ASSERT_EQ(ist({"bake", "cube.obj", "-o", "cube.ist", "--mesh-only"}).exit_code, 0);
  ASSERT_EQ(
      ist({"bake", "cube.obj", "-o", "bare.ist", "--spheres", "50", "--keep-mesh", "no"}).exit_code,
      0);
  write("copies.toml",
        "[[part]]\nname = \"one\"\nmesh = \"cube.obj\"\n"
        "[[part]]\nname = \"two\"\nasset = \"cube.ist\"\n"
        "[[part]]\nname = \"bare\"\nasset = \"bare.ist\"\n");
  const Json report = json("copies.toml", {}, 3);
  EXPECT_EQ(pairs(report), Words{"one two overlapping"});
  EXPECT_EQ(report["pairs"][0]["duplicate"], true);
  EXPECT_NEAR(report["pairs"][0]["volume"].get<double>(), std::pow(edge_, 3), 1e-9);
  EXPECT_EQ(report["faults"][0]["part"], "bare");
}

TEST_F(ClashFiles, BaselineTellsWhatIsNew) {
  write("old.toml", part("a", 0) + part("b", 0.75) + part("c", 5) + part("d", 5.5));
  write("new.toml", part("c", 5) + part("d", 6.5) + part("e", 6) + part("b", 0.7) + part("a", 0));
  write("old.json", clash("old.toml", {"--json"}).out);
  EXPECT_EQ(json("old.toml", {"--baseline", "old.json"}, 0)["pairs"][0]["change"], "persistent");
  const Json report = json("new.toml", {"--baseline", "old.json"}, 3);
  EXPECT_EQ(pairs(report), (Words{"c e touching", "d e overlapping", "b a overlapping"}));
  for (const Json& pair : report["pairs"]) {
    const std::string names = pair["a"].get<std::string>() + pair["b"].get<std::string>();
    if (names == "ba") {
      EXPECT_EQ(pair["change"], "persistent");
    } else if (names == "de") {
      EXPECT_EQ(pair["change"], "added");
    } else {
      EXPECT_TRUE(pair["change"].is_null()) << names;
    }
  }
  EXPECT_EQ(report["resolved"], Json::parse(R"([{"a": "c", "b": "d"}])"));
  // A part without an answer is unknown: its clashes are not resolved.
  std::string text = read("cube.obj");
  write("open.obj", text.erase(text.find("\nf ") + 1));
  text = part("b", 0.75);
  text.replace(text.find("cube.obj"), 8, "open.obj");
  write("unknown.toml", part("a", 0) + text + part("c", 5) + part("d", 7));
  EXPECT_EQ(json("unknown.toml", {"--baseline", "old.json"}, 1)["resolved"],
            Json::parse(R"([{"a": "c", "b": "d"}])"));
  write("not.json", "{\"schema\": \"other/1\"}");
  for (const char* const wrong : {"not.json", "none.json", "cube.obj"})
    EXPECT_EQ(clash("old.toml", {"--baseline", wrong}).exit_code, 1) << wrong;
}

TEST_F(ClashFiles, PosesAreSweptForTheWorst) {
  write("two.toml", part("still", 0) + part("moving", 5) + part("beside", -0.5));
  write("poses.csv",
        "id,part,qw,qx,qy,qz,tx,ty,tz\nfar,moving,1,0,0,0,4,0,0\nnear,moving,1,0,0,0,0.9,0,0\n"
        "deep,\"moving\",1,0,0,0,0.5,0,0\nout,moving,1,0,0,0,3,0,0\n");
  const Json report = json("two.toml", {"--poses", "poses.csv"}, 3);
  ASSERT_EQ(pairs(report), (Words{"still moving overlapping", "still beside overlapping",
                                  "moving beside touching"}));
  EXPECT_EQ(report["pairs"][0]["pose"], "deep");
  EXPECT_NEAR(report["pairs"][0]["volume"].get<double>(), 0.5, 1e-9);
  EXPECT_EQ(report["pairs"][1]["pose"], "far");
  for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
           {"id,part,qw\n", "poses.csv:1: write the columns"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,none,1,0,0,0,0,0,0\n", ":2: no part is called 'none'"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,still,1,0,0,0,nan,0,0\n", ":2: tx: 'nan'"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,still,1\n", ":2: 3 fields"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,\"still,1,0,0,0,0,0,0\n", ":2: a closing quote"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n", "holds no poses"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,still,0,0,0,0,0,0,0\n", ":2: qw, qx, qy, qz are no"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,still,1,0,0,0,0,0,0\n1,still,1,0,0,0,0,0,0\n"
            "0,moving,1,0,0,0,0,0,0\n",
            ":4: the id '0' was given before"},
           {"id,part,qw,qx,qy,qz,tx,ty,tz\n0,still,1,0,0,0,0,0,0\n0,still,1,0,0,0,1,0,0\n",
            ":3: 'still' is placed twice"}}) {
    write("poses.csv", text);
    const Outcome outcome = clash("two.toml", {"--poses", "poses.csv"});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  }
}

/// A .gltf of one box [0, 1] × [0, 1] × [0, 2] and the nodes given, and its .bin.
std::string scene(const std::string& nodes, const std::filesystem::path& folder) {
  const float v[24] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 2, 1, 0, 2, 0, 1, 2, 1, 1, 2};
  const std::uint16_t t[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                               2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  std::string bytes(sizeof(v) + sizeof(t), '\0');
  std::memcpy(bytes.data(), v, sizeof(v));
  std::memcpy(bytes.data() + sizeof(v), t, sizeof(t));
  std::ofstream(folder / "box.bin", std::ios::binary) << bytes;
  return R"({"asset": {"version": "2.0"}, "buffers": [{"uri": "box.bin", "byteLength": 168}],
    "bufferViews": [{"buffer": 0, "byteLength": 96},
                    {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
                   "min": [0, 0, 0], "max": [1, 1, 2]},
                  {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}], "nodes": )" +
         nodes + "}";
}

TEST_F(ClashFiles, NodesOfASceneAreParts) {
  // The second is mirrored onto [-1, 0] × …, the third hangs below a turned and scaled parent, the
  // fourth is stretched.
  write("scene.gltf", scene(R"([
    {"name": "box", "mesh": 0},
    {"name": "mirrored", "mesh": 0, "scale": [-1, 1, 1], "translation": [0.25, 0, 0]},
    {"name": "parent", "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476],
     "scale": [0.5, 0.5, 0.5], "translation": [0.75, 5, 0], "children": [3]},
    {"name": "child", "mesh": 0, "translation": [-8.5, -1, 0]},
    {"name": "stretched", "mesh": 0, "scale": [4, 0.25, 1], "translation": [10, 0, 0]},
    {"name": "box", "mesh": 0, "translation": [13.5, 0, 1]},
    {"name": "empty"}])",
                            folder_));
  const Json report = json("scene.gltf", {}, 3);
  EXPECT_EQ(report.at("parts"), 5);
  EXPECT_EQ(pairs(report), (Words{"box mirrored overlapping", "box child overlapping",
                                  "stretched box#2 overlapping"}));
  EXPECT_NEAR(report["pairs"][0]["volume"].get<double>(), 0.5, 1e-7);
  // The child is [0.25, 1.25] turned: x from 0.75 - 0.5 · (y + 1 - …), y from 5 + 0.5 · (x - 8.5).
  EXPECT_NEAR(report["pairs"][1]["volume"].get<double>(), 0.25 * 0.25 * 1, 1e-6);
  EXPECT_NEAR(report["pairs"][2]["volume"].get<double>(), 0.5 * 0.25 * 1, 1e-7);
  // Each has a name of its own, whatever the file calls them.
  write("alike.gltf", scene(R"([
    {"name": "bolt", "mesh": 0}, {"name": "bolt", "mesh": 0, "translation": [10, 0, 0]},
    {"name": "bolt#2", "mesh": 0, "translation": [20, 0, 0]},
    {"name": "", "mesh": 0, "translation": [20.5, 0, 0]}, {"mesh": 0, "translation": [10.5, 0, 0]}])",
                            folder_));
  EXPECT_EQ(pairs(json("alike.gltf", {}, 3)),
            (Words{"bolt#2 node 4 overlapping", "bolt#2#2 node 3 overlapping"}));
  for (const std::string bad :
       {"[{\"mesh\": 3}]", "[{\"mesh\": 0, \"scale\": [1, 0]}]", "[{}]", "7",
        "[{\"mesh\": 0, "
        "\"matrix\": [1]}]"}) {
    write("bad.gltf", scene(bad, folder_));
    const Outcome outcome = clash("bad.gltf");
    EXPECT_EQ(outcome.exit_code, 1) << bad;
    EXPECT_NE(outcome.err.find("bad.gltf"), std::string::npos) << outcome.err;
  }
}

TEST_F(ClashFiles, ANodeOfScaleZeroIsNoPart) {
  write("hidden.gltf", scene(R"([
    {"name": "a", "mesh": 0}, {"name": "hidden", "mesh": 0, "scale": [0, 0, 0]},
    {"name": "b", "mesh": 0, "translation": [3, 0, 0]}])",
                             folder_));
  const Json report = json("hidden.gltf", {}, 0);
  EXPECT_EQ(report.at("parts"), 2);
  EXPECT_NE(report.at("notes").dump().find("hidden has the scale 0"), std::string::npos);
}

TEST_F(ClashFiles, FarFromTheOriginRoundingIsTold) {
  const std::string far = R"([
    {"name": "a", "mesh": 0, "translation": [500000, 4000000, 0]},
    {"name": "b", "mesh": 0, "translation": [500000.5, 4000000, 0]}])";
  write("far.gltf", scene(far, folder_));
  const Json report = json("far.gltf", {}, 0);
  EXPECT_EQ(pairs(report), Words{"a b touching"});
  EXPECT_NE(report.at("notes").dump().find("a and 1 more: so far from the origin"),
            std::string::npos);
  const Json told = json("far.gltf", {"--touch-within", "1e-3"}, 3);
  EXPECT_EQ(pairs(told), Words{"a b overlapping"});
  EXPECT_EQ(told.at("notes"), Json::array());
  // Writers that keep doubles, as IfcOpenShell at a national grid's coordinates, show it somewhere.
  write("doubles.gltf", scene(std::regex_replace(far, std::regex("4000000, 0"),
                                                 "4000000.456, 6.123233995736766e-17"),
                              folder_));
  const Json doubles = json("doubles.gltf", {}, 3);
  EXPECT_EQ(pairs(doubles), Words{"a b overlapping"});
  EXPECT_EQ(doubles.at("notes"), Json::array());
  EXPECT_NE(clash("doubles.gltf").out.find("at (500000.75, 4000001, 1)"), std::string::npos);
  // A pose of a TOML is in doubles, whatever its mesh's precision.
  ASSERT_EQ(ist({"sample", "cube", "-o", "cube.stl"}).exit_code, 0);
  write("far.toml",
        "[[part]]\nname = \"a\"\nmesh = \"cube.stl\"\npose = [1,0,0,0, 500000,4000000,0]\n"
        "[[part]]\nname = \"b\"\nmesh = \"cube.stl\"\npose = [1,0,0,0, 500000.5,4000000,0]\n");
  EXPECT_EQ(pairs(json("far.toml", {}, 3)), Words{"a b overlapping"});
}

TEST_F(ClashFiles, CopiesOfANode) {
  write("flush.gltf", scene(R"([
    {"name": "a", "mesh": 0, "translation": [0.1, 0.2, 0.3]},
    {"name": "b", "mesh": 0, "translation": [1.1, 0.2, 0.3]},
    {"name": "b again", "mesh": 0, "translation": [1.1, 0.2, 0.3]}])",
                            folder_));
  const Json report = json("flush.gltf", {}, 3);
  EXPECT_EQ(pairs(report), (Words{"a b touching", "a b again touching", "b b again overlapping"}));
  EXPECT_EQ(report["pairs"][2]["duplicate"], true);
  EXPECT_NEAR(report["pairs"][0]["contact_area"].get<double>(), 2, 1e-3);
}

TEST_F(ClashFiles, RobotsStandWhereTheirJointsAre) {
  const auto link = [](const std::string& name, const std::string& x) {
    return "<link name='" + name + "'><collision><origin xyz='" + x +
           " 0 0'/><geometry>"
           "<box size='2 0.2 0.2'/></geometry></collision></link>";
  };
  write("arm.urdf",
        "<robot name='arm'>" + link("base", "0") + link("upper", "1.1") + link("fore", "1.1") +
            "<joint name='shoulder' type='revolute'><origin xyz='1 0 0'/><parent link='base'/>"
            "<child link='upper'/><axis xyz='0 0 1'/><limit lower='-3.2' upper='3.2'/></joint>"
            "<joint name='elbow' type='revolute'><origin xyz='2.2 0 0'/><parent link='upper'/>"
            "<child link='fore'/><axis xyz='0 0 1'/><limit lower='-3.2' upper='3.2'/></joint>"
            "</robot>");
  EXPECT_EQ(pairs(json("arm.urdf", {}, 0)), Words{});
  const double pi = std::acos(-1.0);
  const std::string over = "elbow=" + std::to_string(pi);
  const Json folded = json("arm.urdf", {"--pose", over}, 3);
  EXPECT_EQ(pairs(folded), Words{"upper fore overlapping"});
  const Json swept = json("arm.urdf", {"--pose", "elbow=0:3.14159265358979:5"}, 3);
  bool found = false;
  for (const Json& pair : swept["pairs"])
    if (pair["a"] == "upper" && pair["b"] == "fore") {
      found = true;
      EXPECT_EQ(pair["pose"], "elbow=3.14159");
      EXPECT_NEAR(pair["volume"].get<double>(), 2 * 0.2 * 0.2, 1e-9);
    }
  EXPECT_TRUE(found);
  write("joints.csv", "id,elbow,shoulder\nout,0,0\nin,3.14159265358979,0.1\n");
  EXPECT_EQ(json("arm.urdf", {"--poses", "joints.csv"}, 3)["pairs"].back()["pose"], "in");
  const auto error = [&](const std::string& pose, int code, const std::string& message) {
    const Outcome outcome = clash("arm.urdf", {"--pose", pose});
    EXPECT_EQ(outcome.exit_code, code) << pose;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  };
  error("elbo=1", 1, "did you mean 'elbow'?");
  error("elbow=9", 1, "limits are");
  error("elbow=0:1", 2, "is not JOINT=NUMBER");
  error("elbow", 2, "is not JOINT=NUMBER");
  const Outcome twice = clash("arm.urdf", {"--pose", "elbow=0:1:3", "--pose", "elbow=1"});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_NE(twice.err.find("'elbow=1': the same was given before"), std::string::npos) << twice.err;
  write("joints.csv", "wrist\n0\n");
  EXPECT_EQ(clash("arm.urdf", {"--poses", "joints.csv"}).exit_code, 1);

  write("arm.xml",
        "<mujoco><worldbody><geom type='box' size='1 .1 .1'/><body name='upper' pos='1 0 0'>"
        "<joint name='shoulder' axis='0 0 1' range='-180 180'/>"
        "<geom type='box' pos='1.1 0 0' size='1 .1 .1'/>"
        "<geom type='sphere' pos='1.1 0 0' size='.2'/></body></worldbody></mujoco>");
  EXPECT_EQ(pairs(json("arm.xml", {}, 0)), Words{});
  const Json turned = json("arm.xml", {"--pose", "shoulder=3.14"}, 3);
  EXPECT_EQ(pairs(turned), Words{"world upper overlapping"});
  EXPECT_NE(turned["notes"].dump().find("1 round shape is a"), std::string::npos);

  // What no part is, is told.
  write("floor.xml",
        "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/>"
        "<geom type='plane' size='1 1 1' contype='0' conaffinity='0'/>"
        "<body><geom type='box' size='1 1 1'/></body></worldbody></mujoco>");
  EXPECT_EQ(json("floor.xml", {}, 0)["notes"],
            Json({"left out, because planes, height fields and flexes are no solids: floor"}));
  write("egg.xml",
        "<mujoco><worldbody><geom type='box' pos='0 0 -5' size='5 5 5'/><body name='egg'>"
        "<freejoint/><geom type='ellipsoid' size='.1 .2 .3' euler='90 0 0'/></body></worldbody>"
        "</mujoco>");
  const Json egg = json("egg.xml", {}, 3);
  ASSERT_EQ(pairs(egg), Words{"world egg overlapping"});
  EXPECT_NEAR(egg["pairs"][0]["volume"].get<double>(), 2. / 3 * pi * .1 * .2 * .3, 2e-4);

  const auto box = [](const std::string& name, const std::string& x) {
    return "<link name='" + name + "'><pose>" + x +
           " 0 0 0 0 0</pose><collision name='c'><geometry><box><size>1 1 1</size></box></geometry>"
           "</collision></link>";
  };
  write("boxes.sdf", "<sdf version='1.9'><model name='m'>" + box("a", "0") + box("b", "0.5") +
                         "<joint name='j' type='fixed'><parent>a</parent><child>b</child></joint>"
                         "</model></sdf>");
  EXPECT_EQ(pairs(json("boxes.sdf", {}, 3)), Words{"a b overlapping"});
}

TEST_F(ClashFiles, TablesArchivesAndPictures) {
  write("row.toml",
        part("a,\"1\"", 0).replace(part("a,\"1\"", 0).find("\"a,\"1\"\""), 7, "'a,\"1\"'") +
            part("b & <c>", 0.75) + part("c", 1.75));
  const Outcome outcome = clash("row.toml", {"--csv", "--bcf", "row.bcfzip", "--glb", "row.glb"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  const Words lines = lines_of(outcome.out);
  ASSERT_GE(lines.size(), 3u);
  EXPECT_EQ(lines[0].substr(0, 29), "a,b,kind,volume,volume_min,vo");
  EXPECT_EQ(lines[1].substr(0, 34), "\"a,\"\"1\"\"\",b & <c>,overlapping,0.25");
  // The archive is one that others read: a topic with the names, and the same id each time.
  write("look.py",
        "import zipfile, re, sys, xml.etree.ElementTree as E\n"
        "z = zipfile.ZipFile('row.bcfzip')\n"
        "assert z.testzip() is None\n"
        "n = z.namelist()\n"
        "assert n[0] == 'bcf.version' and len(n) == 3, n\n"
        "m = E.fromstring(z.read(n[1]))\n"
        "g = m.find('Topic').get('Guid')\n"
        "assert re.fullmatch('[0-9a-f]{8}-[0-9a-f]{4}-8[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}',"
        " g), g\n"
        "assert n[1] == g + '/markup.bcf' and n[2] == g + '/viewpoint.bcfv'\n"
        "assert m.find('Topic/Title').text == 'a,\"1\" overlaps b & <c>'\n"
        "E.fromstring(z.read(n[2])).find('Components/Selection')[1].find('AuthoringToolId').text "
        "== 'b & <c>'\n"
        "print(g)\n");
  const auto look = [&] {
    const std::string command = "cd '" + folder_.string() + "' && python3 look.py > id";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return read("id");
  };
  const std::string id = look();
  clash("row.toml", {"--bcf", "row.bcfzip"});
  EXPECT_EQ(look(), id);
  // The scene has the parts and the overlap.
  const std::string glb = read("row.glb");
  for (const char* const name : {"a,\\\"1\\\"", "b & <c>", "\"c\"", " and b & <c>"})
    EXPECT_NE(glb.find(name), std::string::npos) << name;
  EXPECT_EQ(clash("row.toml", {"--bcf", "none/row.bcfzip"}).exit_code, 1);
}

TEST_F(ClashFiles, BadFilesSayWhereAndWhatToDo) {
  const std::string fine = part("a", 0);
  for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
           {"", "file.toml"},
           {"x", "file.toml:1: not valid TOML"},
           {"[[part]]\nname = \"a\"; mesh = \"cube.obj\"\n", "one key a line"},
           {"[part]\nmesh = \"cube.obj\"\n", ":1: part: write [[part]]"},
           {"[[parts]]\n", ":1: unknown 'parts': did you mean 'part'?"},
           {"[[ignore]]\na = \"x\"\n", "no [[part]]"},
           {"[[part]]\n", ":1: a part without a shape"},
           {"[[part]]\nmesh = \"none.obj\"\n", ":2: mesh: no file"},
           {"[[part]]\nmesh = \".\"\n", ":2: mesh: no file"},
           {"[[part]]\nmesh = \"file.toml\"\n", ":2: mesh: 'file.toml' has not the ending"},
           {"[[part]]\nmesh = 3\n", ":2: mesh: write a name in quotes"},
           {"[[part]]\nmesh = \"cube.obj\"\nasset = \"cube.obj\"\n", "not both"},
           {"[[part]]\nmesh = \"cube.obj\"\npose = [1,0,0,0]\n", ":3: pose: write 7 numbers"},
           {"[[part]]\nmesh = \"cube.obj\"\npose = [1,0,0,0,nan,0,0]\n", ":3: pose: write finite"},
           {"[[part]]\nmesh = \"cube.obj\"\npose = [0,0,0,0,1,0,0]\n", "a quaternion, w first"},
           {"[[part]]\nmesh = \"cube.obj\"\npose = [1,0,0,0,\"x\",0,0]\n",
            ":3: pose: write finite"},
           {"[[part]]\nmesh = \"cube.obj\"\nscale = 0\n", ":3: scale: write a number above 0"},
           {"[[part]]\nmesh = \"cube.obj\"\nscale = inf\n", ":3: scale: write finite"},
           {"[[part]]\nmesh = \"cube.obj\"\nposes = 1\n", ":3: unknown 'poses': did you mean"},
           {fine + fine, ":6: the part of line 1 is called 'a' too"},
           {fine + "[[ignore]]\n", ":6: add a ="},
           {fine + "[[ignore]]\na = 1\n", ":7: a: write a name in quotes"},
           {fine + "[[group]]\nname = \"g\"\n", ":6: add name ="},
           {fine + "[[group]]\nname = \"g\"\nparts = []\n", ":6: add name ="}}) {
    write("file.toml", text);
    const Outcome outcome = clash("file.toml", {"--json", "--bcf", "out.bcf"});
    EXPECT_EQ(outcome.exit_code, 1) << text;
    EXPECT_EQ(outcome.out, "") << text;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << text << outcome.err;
    EXPECT_FALSE(exists("out.bcf"));
  }
  write("file.toml", fine);
  EXPECT_EQ(clash("file.toml").exit_code, 0);  // one part alone
  EXPECT_EQ(clash("none.toml").exit_code, 1);
  EXPECT_NE(clash("cube.obj").err.find("is no assembly"), std::string::npos);
  write("rules.toml", fine);
  EXPECT_NE(clash("file.toml", {"--rules", "rules.toml"}).err.find("unknown 'part'"),
            std::string::npos);
  for (const Words& wrong : std::vector<Words>{{"--clearance", "-1"},
                                               {"--tolerance", "nan"},
                                               {"--touch-within", "-1"},
                                               {"--json", "--csv"},
                                               {"--pose", "a=1"},
                                               {"--visual"},
                                               {"--threads", "x"},
                                               {"--glb", ""}})
    EXPECT_EQ(clash("file.toml", wrong).exit_code, 2) << wrong[0];
  EXPECT_EQ(ist({"clash"}).exit_code, 2);
}

/// The page's files and commands, verbatim.
TEST_F(ClashFiles, ThePageOfTheDocumentation) {
  std::ifstream page(IST_SOURCE_DIR "/docs/clash.md");
  std::string line, block, kind;
  std::size_t checked = 0;
  for (const char* const name : {"gear", "bolt", "nut"})
    ASSERT_EQ(ist({"sample", name, "-o", std::string(name) + ".off"}).exit_code, 0);
  while (std::getline(page, line)) {
    if (kind.empty() && line.starts_with("```")) {
      kind = line;
      block.clear();
    } else if (line == "```") {
      if (kind == "```toml" && block.find("[[part]]") != std::string::npos)
        write("gearbox.toml", block);
      if (block.starts_with("$ ist clash")) {
        std::istringstream words(lines_of(block)[0].substr(6));
        Words arguments;
        for (std::string word; words >> word;) arguments.push_back(word);
        EXPECT_EQ(ist(arguments).out, block.substr(block.find('\n') + 1));
        ++checked;
      }
      kind.clear();
    } else {
      block += line + "\n";
    }
  }
  EXPECT_GE(checked, 1u);
}

}  // namespace
}  // namespace ist::testing
