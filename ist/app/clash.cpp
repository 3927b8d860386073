#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <ist/mass_properties.h>
#include <ist/pose_eigen.h>
#include <ist/raycast.h>
#include <algorithm>
#include <cmath>
#include <ctime>

#include "app/commands.h"
#include "app/glb_scene.h"
#include "app/options.h"
#include "clash/assembly.h"
#include "clash/clash.h"
#include "library/text.h"

namespace ist::app {
namespace {

using Eigen::Vector3d;

struct ClashOptions {
  std::string input, baseline, bcf, glb;
  AssemblyOptions assembly;
  ClashSettings settings;
  SettingOptions closing;
  double tolerance = -1;
  bool json = false, csv = false;
};

using Triangle = std::array<Vector3d, 3>;

std::vector<Triangle> triangles_of(const PlacedAsset& solid) {
  const AssetHeader& asset = solid.asset.header();
  const auto& mesh = *at<MeshHeader>(asset, asset.mesh);
  const double* const vertices = at<double>(asset, mesh.vertices);
  const Eigen::Isometry3d place = to_isometry(solid.pose);
  const double size = std::ldexp(1.0, asset.exponent);
  std::vector<Triangle> out;
  for (std::uint32_t b = 0; b < mesh.level[0].count; ++b) {
    const MeshBlock& block = at<MeshBlock>(asset, mesh.level[0].blocks)[b];
    const auto corner = [&](int k, std::uint32_t t) -> Vector3d {
      const Vector3d unit(vertices + 3 * std::size_t{block.vertex[block.corner[k][t]]});
      return place * (solid.scale * (size * unit + Vector3d(asset.centre)));
    };
    for (std::uint32_t t = 0; t < block.triangles; ++t)
      out.push_back({corner(0, t), corner(1, t), corner(2, t)});
  }
  return out;
}

/// Adds the pieces of a triangle that lie in a solid, down to size `finest`.
void add_inside(const Triangle& t, const PlacedAsset& solid, const Eigen::AlignedBox3d& near,
                double finest, std::vector<Triangle>& out) {
  Eigen::AlignedBox3d box(t[0]);
  box.extend(t[1]).extend(t[2]);
  if (!box.intersects(near)) return;
  const Vector3d middle = (t[0] + t[1] + t[2]) / 3;
  double radius = 0, longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    radius = std::max(radius, (t[k] - middle).norm());
    longest = std::max(longest, (t[k] - t[(k + 1) % 3]).norm());
  }
  const double distance = closest_point(solid, middle).distance;
  if (distance > radius) return;
  if (distance < -radius || longest < finest) {
    if (distance <= 0) out.push_back(t);
    return;
  }
  const Vector3d ab = (t[0] + t[1]) / 2, bc = (t[1] + t[2]) / 2, ca = (t[2] + t[0]) / 2;
  for (const Triangle& piece : {Triangle{t[0], ab, ca}, Triangle{ab, t[1], bc},
                                Triangle{ca, bc, t[2]}, Triangle{ab, bc, ca}})
    add_inside(piece, solid, near, finest, out);
}

void add_mesh(GlbScene& scene, const std::string& name, const std::array<double, 4>& colour,
              const std::vector<Triangle>& triangles) {
  if (triangles.empty()) return;
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> corners;
  for (const Triangle& t : triangles) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), t.begin(), t.end());
    corners.push_back({first, first + 1, first + 2});
  }
  scene.add_node(0, {{"name", name}, {"mesh", scene.add_mesh(name, colour, vertices, corners)}});
}

/// Draws parts in grey, and those parts of their surfaces that lie in others in red.
std::string drawn(const Assembly& assembly, const ClashReport& report) {
  constexpr std::array<double, 4> kGrey = {0.6, 0.6, 0.6, 0.35}, kRed = {0.9, 0.1, 0.1, 1};
  constexpr double kPieces = 48;
  GlbScene scene(GlbScene::Json::object({{"name", "clashes"}}));
  for (const ClashPart& part : assembly.parts)
    add_mesh(scene, part.name, kGrey, triangles_of(part.solid));
  for (const Clash& clash : report.pairs) {
    if (!report.is_clash(clash)) continue;
    const PlacedAsset &a = assembly.parts[clash.a].solid, &b = assembly.parts[clash.b].solid;
    const Bounds in_a = bounds(a), in_b = bounds(b);
    const Eigen::AlignedBox3d both = Eigen::AlignedBox3d(in_a.lower, in_a.upper)
                                         .intersection(Eigen::AlignedBox3d(in_b.lower, in_b.upper));
    const double finest = both.diagonal().norm() / kPieces;
    std::vector<Triangle> inside;
    for (const auto& [of, in] : {std::pair(&a, &b), std::pair(&b, &a)})
      for (const Triangle& t : triangles_of(*of)) add_inside(t, *in, both, finest, inside);
    add_mesh(scene, assembly.parts[clash.a].name + " and " + assembly.parts[clash.b].name, kRed,
             inside);
  }
  return scene.bytes();
}

std::string now() {
  const std::time_t seconds = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&seconds));
  return text;
}

void check_options(const ClashOptions& options) {
  refuse_idle_options(options.assembly.robot, options.input);
  if (!options.assembly.joints.empty()) refuse_without_robot("--pose", options.input);
  for (const auto& [path, what] : {std::pair(&options.bcf, "the BCF"), {&options.glb, "the scene"}})
    if (!path->empty()) require_output(*path, options.input, what);
}

void clash(const ClashOptions& options) {
  check_options(options);
  ClashReport report;
  report.compared = !options.baseline.empty();
  if (report.compared) report.earlier = read_clashes(options.baseline);
  const Assembly assembly = read_assembly(options.input, options.assembly);
  if (!options.glb.empty() && assembly.rows.size() > 1)
    throw CLI::ValidationError(
        "--glb", "draws one pose, and there are " + std::to_string(assembly.rows.size()));
  const std::vector<Clash> pairs = find_clashes(assembly, options.settings);
  report.parts = assembly.count;
  for (const ClashPart& part : assembly.parts) report.names.push_back(part.name);
  report.pairs = pairs;
  report.tolerance = options.tolerance;
  report.swept = assembly.rows.size() > 1;
  for (const auto& [part, what] : assembly.faults) report.faults.emplace_back(part, what);
  report.notes = assembly.notes;
  note_rounding(assembly.parts, options.settings, report.notes);
  if (!options.bcf.empty()) write_text(options.bcf, clashes_bcf(report, now()));
  if (!options.glb.empty()) write_text(options.glb, drawn(assembly, report));
  fmt::print("{}", options.json  ? json_text(clashes_json(report)) + "\n"
                   : options.csv ? clashes_csv(report)
                                 : clashes_text(report));
  if (options.csv)  // the other formats contain them
    for (const auto& [part, what] : report.faults)
      fmt::print(stderr, "not answered: {}: {}\n", part, what);
  if (report.new_clashes() > 0) throw ExitCode{kExitViolation};
  if (!report.faults.empty()) throw ExitCode{kExitError};
}

/// JOINT=NUMBER or JOINT=FIRST:LAST:COUNT; false for anything else.
bool take_joint(const std::string& text, std::vector<JointRange>& joints) {
  constexpr std::size_t kMost = 1'000'000;
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos || equals == 0) return false;
  JointRange& range = joints.emplace_back();
  range.joint = text.substr(0, equals);
  std::vector<std::string> words;
  for (std::size_t at = equals; at != std::string::npos;) {
    const std::size_t next = text.find(':', at + 1);
    words.push_back(text.substr(at + 1, next == std::string::npos ? next : next - at - 1));
    at = next;
  }
  const auto take = [&](const std::string& word, double& value) {
    const std::optional<double> parsed = parse_number(word);
    value = parsed.value_or(0);
    return parsed && std::isfinite(*parsed);
  };
  if (words.size() == 1) return take(words[0], range.first);
  return words.size() == 3 && take(words[0], range.first) && take(words[1], range.last) &&
         take_whole<std::size_t>(words[2], 2, kMost, range.count);
}

}  // namespace

void add_clash(CLI::App& app) {
  const auto options = std::make_shared<ClashOptions>();
  CLI::App* const command = app.add_subcommand(
      "clash", "All pairs of an assembly's parts that overlap, by the exact measure");
  add_input(command, "FILE", options->input,
            "Parts in a .toml, a scene (.glb, .gltf: nodes are parts) or a robot (.urdf, .xml, "
            ".sdf: links are)");
  add_number(command, "--clearance", options->settings.clearance, {.least = 0},
             "Also list pairs that are nearer than this, in u");
  add_number(
      command, "--tolerance", options->tolerance, {.least = 0},
      "Accepted volume of an overlap, in u³: each pair is certainly above it, certainly below, or "
      "undecided. What is certainly below is no clash")
      ->default_str("");
  add_number(
      command, "--touch-within", options->settings.touch_within, {.least = 0},
      "Parts that reach no further into each other than this, in u, or are no further apart, "
      "touch. Default: what rounding to the file's float32 or float64 comes to")
      ->default_str("");
  add_file(command, "--rules", options->assembly.rules,
           "A TOML with [[ignore]] and [[group]], for scenes and robots");
  add_file(command, "--baseline", options->baseline,
           "An earlier --json: pairs are added, persistent or resolved, and only added ones end "
           "with exit code 3");
  CLI::Option* const poses =
      add_file(command, "--poses", options->assembly.poses,
               "CSV of poses to sweep: id,part,qw,qx,qy,qz,tx,ty,tz, or of a robot a column a "
               "joint. The worst of each pair is listed, with its id");
  add_repeated(
      command, "--pose", "JOINT=NUMBER", "JOINT=NUMBER or JOINT=FIRST:LAST:COUNT",
      [options](const std::string& one) { return take_joint(one, options->assembly.joints); },
      "Robots: position of a joint [rad or u]; FIRST:LAST:COUNT sweeps. Repeatable. Default: 0 "
      "or the middle of its limits")
      ->excludes(poses);
  add_robot_options(command, options->assembly.robot);
  add_setting_options(command, options->closing, closing_settings());
  add_whole(command, "--threads", options->settings.threads,
            "Number of threads; 0 = all cores. The result does not depend on it", 0u, 1024u);
  add_file(command, "--bcf", options->bcf, "Write the clashes as a BCF 2.1 archive, a topic each");
  add_file(command, "--glb", options->glb, "Write a scene: parts in grey, overlaps in red");
  CLI::Option* const json = command->add_flag("--json", options->json, "Print JSON");
  command->add_flag("--csv", options->csv, "Print CSV")->excludes(json);
  command->footer(
      "Exit codes: 0 no clash, 3 clashes, 1 where there is none but a part could not be answered.\n"
      "Touching pairs and those within the clearance are no clashes.\n"
      "Example: ist clash gearbox.toml\n"
      "         ist clash gearbox.toml --json --baseline accepted.json\n"
      "         ist clash arm.urdf --pose elbow=0:1.5:16");
  command->callback([options] {
    complete_settings(options->closing);
    options->assembly.closing = options->closing.settings.mesh;
    options->assembly.threads = options->settings.threads;
    clash(*options);
  });
}

}  // namespace ist::app
