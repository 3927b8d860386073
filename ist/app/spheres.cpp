#include <fmt/format.h>
#include <ist/bake.h>
#include <ist/cover_spheres.h>
#include <spdlog/spdlog.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/mesh_notes.h"
#include "app/options.h"
#include "app/progress_line.h"
#include "app/sphere_output.h"
#include "library/exported_spheres.h"
#include "library/link_solids.h"
#include "library/settings/spelling.h"
#include "mesh/import/text_scanner.h"
#include "robots/description/kinematics.h"
#include "robots/description/link_mesh.h"

namespace ist::app {
namespace {

enum class Kind { cover, inner, matched, capsules };

struct SpheresOptions {
  std::string input, output;
  SphereCoverSettings cover;
  std::size_t count = 0;                      ///< of each link; 0: not given
  std::map<std::string, std::size_t> counts;  ///< of links by name
  Kind kind = Kind::cover;
  RobotOptions robot;
  std::map<std::string, double> pose;  ///< positions of joints by name
  std::string srdf;
  SettingOptions closing;
  bool json = false, quiet = false;

  /// True if the number of spheres was left open: then links get more if planners need them.
  bool refined() const {
    return kind == Kind::cover && count == 0 && cover.total == 0 && cover.max_protrusion == 0;
  }
};

SphereRobot read_mesh_input(const SpheresOptions& options) {
  SphereRobot out;
  out.input = options.input;
  out.name = std::filesystem::path(options.input).stem().string();
  if (!options.counts.empty())
    throw Error(options.input + ": is a mesh, without links; give --count a number alone");
  out.links.emplace_back().name = out.name;
  out.links[0].has_mesh = true;
  out.robot.name = out.name;
  out.robot.links.emplace_back().name = out.name;
  out.robot.joint_of = {kNone};
  out.robot.order = {0};
  out.meshes.push_back(read_mesh_aloud(options.input, options.closing.settings.mesh).closed);
  if (out.meshes[0].report.judged) {
    out.links[0].closing = out.meshes[0].report;
    out.links[0].read = load_mesh(options.input);
  }
  return out;
}

/// Warns if a link is so large compared with the robot that its unit is probably different.
void warn_of_size(const RobotModel& robot, const std::string& link, const TriangleMesh& mesh) {
  constexpr double kLarge = 10, kBeside = 50;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  double apart = 0;
  for (const RobotJoint& joint : robot.joints)
    apart = std::max(apart, joint.origin.translation().norm());
  if (box.isEmpty() || !(box.diagonal().norm() > std::max(kLarge, kBeside * apart))) return;
  spdlog::warn(
      "{}: link {} is {:.4g} m large, its joints at most {:.4g} m apart: if its mesh is in "
      "millimetres, write scale=\"0.001 0.001 0.001\" in the URDF",
      robot.file.path, link, box.diagonal().norm(), apart);
}

/// Joints that move in the file, but not here; one that carries the whole robot does not matter.
std::vector<std::string> taken_as_fixed(const RobotModel& robot) {
  const RobotLink& root = robot.links[robot.order.front()];
  const auto is_first = [&](const RobotJoint& j) { return j.parent == robot.order.front(); };
  const bool is_bare = root.collision.empty() && root.visual.empty() &&
                       std::count_if(robot.joints.begin(), robot.joints.end(), is_first) == 1;
  std::vector<std::string> names;
  for (const RobotJoint& joint : robot.joints)
    if (joint.taken_as_fixed && !(is_bare && is_first(joint))) names.push_back(joint.name);
  return names;
}

SphereRobot read_robot_input(const SpheresOptions& options) {
  SphereRobot out;
  out.input = options.input;
  out.robot = read_robot_for(options.robot, options.input);
  out.name = out.robot.name;
  if (!options.srdf.empty()) {
    const DisabledCollisions disabled = disabled_collisions(out.robot, options.srdf);
    for (const auto& pair : disabled.pairs) out.robot.excluded.push_back(pair);
    if (!disabled.lacking.empty())
      spdlog::warn("{}: disable_collisions names links that {} lacks: {}; these pairs are left out",
                   options.srdf, out.name, fmt::join(disabled.lacking, ", "));
  }
  for (const auto& [name, count] : options.counts) require_link(out.robot, name);
  const PackagePaths paths = package_paths(options.input, options.robot);
  LinkMeshes meshes(options.input, options.closing.settings.mesh, options.robot.repaired);
  out.left_out = links_seen_only(out.robot, options.robot);
  warn_of_left_out(out.left_out, options.input);
  out.taken_as_fixed = taken_as_fixed(out.robot);
  if (!out.taken_as_fixed.empty())
    spdlog::warn(
        "{}: taken as fixed, because they have several axes, or slide without limits, or carry a "
        "free body: {}; "
        "collisions are found only as their links stand in the file",
        options.input, fmt::join(out.taken_as_fixed, ", "));
  for (const RobotLink& link : out.robot.links) {
    const auto& shapes = link.shapes(options.robot.shapes());
    if (shapes.empty()) continue;
    SphereLink& one = out.links.emplace_back();
    one.name = link.name;
    one.has_mesh = std::any_of(shapes.begin(), shapes.end(), [](const PlacedLinkShape& placed) {
      return !std::holds_alternative<LinkBall>(placed.shape);
    });
    const auto geometry = [&] {
      LinkGeometry all = geometry_of(shapes, paths, options.input);
      one.given = std::move(all.spheres);
      one.slack = all.slack;
      one.read = all.mesh;
      warn_of_size(out.robot, link.name, all.mesh);
      return std::move(all.mesh);
    };
    if (!one.has_mesh) {
      geometry();
      continue;
    }
    // If requested, encloses a mesh that cannot be closed.
    const auto otherwise = [&](const std::string& why) -> std::optional<ClosedMesh> {
      if (!meshes.repairs({link.name})) return std::nullopt;
      spdlog::warn("{}; a bounding capsule stands for link {}", why, link.name);
      one.bounding_capsule = true;
      const ClosedMesh open = {one.read, {}, link.name, {}};
      return close_mesh(capsule_mesh(cover_with_capsules(open).front()).mesh, link.name);
    };
    if (std::optional<ClosedMesh> closed = meshes.close({link.name}, geometry, otherwise)) {
      if (closed->report.judged)
        one.closing = closed->report;
      else if (!one.bounding_capsule)
        one.read = {};
      out.meshes.push_back(std::move(*closed));
    }
  }
  meshes.finish();
  return out;
}

/// The first spheres of a packing, or the matched ones of a bake.
std::vector<CoverSphere> baked_spheres(const ClosedMesh& mesh, std::size_t count,
                                       const SpheresOptions& options,
                                       const ProgressCallback& progress) {
  PackingSettings settings;
  settings.max_spheres = count;
  settings.seed = options.cover.seed;
  settings.threads = options.cover.threads;
  settings.device = Device::cpu;
  settings.keep_mesh = false;
  const Asset asset = bake(mesh, settings, progress);
  std::vector<CoverSphere> spheres;
  for (const ExportedSphere& s : exported_spheres(asset.view(), 0))
    spheres.push_back(options.kind == Kind::inner
                          ? CoverSphere{s.centre, s.radius}
                          : CoverSphere{s.matched_centre, s.matched_radius});
  return spheres;
}

/// Counts and total as requested. By default a robot has some 8 spheres a link, as planners prefer,
/// distributed by need, and a mesh 64.
SphereCoverSettings cover_settings(const SphereRobot& input, const SpheresOptions& options) {
  constexpr std::size_t kOfALink = 8;
  SphereCoverSettings cover = options.cover;
  const bool shared = cover.total > 0 || (options.refined() && input.is_robot());
  if (options.count > 0) cover.count = options.count;
  if (cover.max_protrusion > 0 && options.count == 0) cover.count = 1024;
  for (const SphereLink& link : input.links) {
    if (!link.has_mesh) continue;
    const auto own = options.counts.find(link.name);
    cover.counts.push_back(own == options.counts.end() ? 0 : own->second);
  }
  if (!shared || cover.counts.empty()) {
    cover.total = 0;
  } else if (cover.total == 0) {
    for (const std::size_t own : cover.counts) cover.total += own > 0 ? own : kOfALink;
  } else {
    std::size_t given = 0;
    for (const SphereLink& link : input.links) given += link.given.size();
    if (cover.total <= given)
      throw Error(
          fmt::format("{}: has {} spheres of its own, so a total of {} leaves none for the "
                      "other links. Increase it",
                      input.input, given, cover.total));
    cover.total -= given;
  }
  return cover;
}

/// Spheres on the capsules' axes that together contain them, and are hardly wider.
std::vector<CoverSphere> spheres_around(const std::vector<CoverCapsule>& capsules) {
  constexpr int kSpheres = 64;
  std::vector<CoverSphere> spheres;
  for (const CoverCapsule& capsule : capsules) {
    const Eigen::Vector3d step = (capsule.end - capsule.begin) / kSpheres;
    spheres.push_back({capsule.begin, capsule.radius});
    spheres.push_back({capsule.end, capsule.radius});
    for (int i = 0; i < kSpheres; ++i)
      spheres.push_back({capsule.begin + (i + 0.5) * step,
                         std::hypot(capsule.radius, step.norm() / 2) * (1 + 1e-12)});
  }
  return spheres;
}

/// `capsules`: of each mesh, if requested.
std::vector<SphereCover> make_spheres(const SphereRobot& input, const SpheresOptions& options,
                                      const ProgressCallback& progress,
                                      std::vector<std::vector<CoverCapsule>>& capsules) {
  const SphereCoverSettings settings = cover_settings(input, options);
  if (options.kind == Kind::cover) return cover_with_spheres(input.meshes, settings, progress);
  std::vector<SphereCover> covers;
  for (const SphereLink& link : input.links) {
    if (!link.has_mesh) continue;
    const ClosedMesh& mesh = input.meshes[covers.size()];
    const auto start = std::chrono::steady_clock::now();
    const std::size_t own = settings.counts[covers.size()];
    SphereCover cover;
    if (options.kind == Kind::capsules) {
      ClosedMesh all = mesh;
      append_mesh(all.mesh, link.read);
      cover.spheres = spheres_around(capsules.emplace_back(cover_with_capsules(
          all, own > 0 ? own : std::max<std::size_t>(options.count, 1), settings.threads)));
    } else
      cover.spheres = baked_spheres(mesh, own > 0 ? own : settings.count, options, progress);
    cover.protrusion = sphere_protrusion(mesh, cover.spheres);
    cover.seconds = seconds_since(start);
    covers.push_back(std::move(cover));
  }
  return covers;
}

/// The joint of that name, which must be free and allow this position.
std::size_t joint_at(const RobotModel& robot, const std::string& name, double position) {
  std::vector<std::string> names;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    const RobotJoint& joint = robot.joints[j];
    if (!joint.is_free()) continue;
    names.push_back(joint.name);
    if (joint.name != name) continue;
    if (position >= joint.lower && position <= joint.upper) return j;
    throw Error(fmt::format("{}: --pose {}={:g}: the joint's limits are {:g} to {:g}",
                            robot.file.path, name, position, joint.lower, joint.upper));
  }
  const std::string nearest = nearest_word(name, names);
  throw Error(fmt::format("{}: --pose: no joint that moves freely is called '{}'{}",
                          robot.file.path, name,
                          nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

WantedPose wanted_pose(const RobotModel& robot, const SpheresOptions& options) {
  WantedPose wanted;
  for (const auto& [name, position] : options.pose)
    wanted.positions[joint_at(robot, name, position)] = position;
  if (options.srdf.empty()) return wanted;
  GroupStates states = group_states(robot, options.srdf);
  wanted.states = std::move(states.poses);
  if (!states.unfit.empty())
    spdlog::warn("{}: left out, because they name no joint of {}, or exceed its limits: {}",
                 options.srdf, robot.name, fmt::join(states.unfit, ", "));
  return wanted;
}

void compare_links(SphereRobot& input, const WantedPose& wanted, const SpheresOptions& options,
                   const ProgressCallback& progress) {
  LinkSolids solids;
  std::vector<std::string> names;
  std::set<std::size_t> larger;
  std::size_t next = 0;
  for (const SphereLink& link : input.links) {
    const std::string why =
        solids.add(link.has_mesh ? &input.meshes[next++] : nullptr, link.given, link.read);
    if (!why.empty() || link.bounding_capsule) larger.insert(names.size());
    names.push_back(link.name);
    if (!why.empty())
      spdlog::warn(
          "{}: link {}: collisions with other links are judged by its spheres, because "
          "its mesh bounds no exact solid: {}",
          options.input, link.name, why);
  }
  SelfCollisionStudy study(
      input.robot, names,
      [&](std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a) {
        return solids.overlap(a, b, b_in_a);
      },
      wanted, std::move(larger));
  input.self =
      study.of(input.covers(), options.kind == Kind::cover || options.kind == Kind::capsules);
  if (options.kind == Kind::cover)
    refine_covers(input, study, solids, options.cover, options.counts, options.refined(), progress);
  if (constexpr double kMany = 0.1; input.self.false_share() > kMany)
    spdlog::warn(
        "{}: the spheres call {:.0f} % of the free poses colliding: they are too coarse for "
        "the gaps between some links (the report names the pairs and their gaps); use more spheres "
        "(--total, --count LINK=N)",
        options.input, 100 * input.self.false_share());
  for (const LinkPair& pair : input.self.pairs)
    if (input.self.is_mostly_colliding(pair))
      spdlog::warn(
          "{}: {} and {} overlap in {:.0f} % of the sampled poses, so few poses are free: their "
          "shapes reach into each other; if the robot's parts do not, exclude the pair (--srdf "
          "FILE, with <disable_collisions link1=\"{}\" link2=\"{}\"/>)",
          options.input, pair.a, pair.b,
          100.0 * static_cast<double>(pair.colliding) / static_cast<double>(input.self.samples),
          pair.a, pair.b);
  const DefaultPose& pose = input.self.pose;
  if (pose.overlapping.empty()) return;
  std::string pairs;
  for (const auto& [a, b] : pose.overlapping)
    pairs += fmt::format("{}{} and {}", pairs.empty() ? "" : ", ", a, b);
  if (pose.solids_free)
    spdlog::warn(
        "{}: no default pose was found in which no spheres of different links overlap, "
        "though the links do not: {}; use more spheres (--total), or give a pose "
        "(--pose JOINT=POSITION)",
        options.input, pairs);
  else
    spdlog::warn(
        "{}: no default pose was found in which no links overlap: {}; give one (--pose "
        "JOINT=POSITION, --srdf FILE)",
        options.input, pairs);
}

void fill_links(SphereRobot& input, const WantedPose& wanted, const SpheresOptions& options) {
  constexpr double kPatience = 0.5;  // [s]
  std::vector<std::vector<CoverCapsule>> capsules;
  std::vector<SphereCover> covers =
      interruptibly(kPatience, options.quiet, false, [&](const ProgressCallback& progress) {
        return make_spheres(input, options, progress, capsules);
      });
  std::size_t next = 0;
  for (SphereLink& link : input.links) {
    link.proof.covered = true;
    if (link.has_mesh) {
      link.cover = std::move(covers[next]);
      const auto& spheres = link.cover.spheres;
      if (options.kind == Kind::capsules) {
        link.capsules = std::move(capsules[next]);
        link.proof.covered = true;  // as cover_with_capsules() proves
      } else {
        link.proof = prove_cover(input.meshes[next], spheres);
      }
      link.cover.protrusion.largest += link.slack;
      ++next;
    }
    complete_cover(link, options.kind == Kind::cover);
    if (options.kind == Kind::cover && !link.proof.covered)
      throw Error(
          fmt::format("{}: link {}: cannot prove that the spheres contain it near ({:g}, {:g}, "
                      "{:g}); change --count",
                      options.input, link.name, link.proof.where.x(), link.proof.where.y(),
                      link.proof.where.z()));
    if (!link.cover.reached)
      throw Error(fmt::format(
          "{}: link {}: {} spheres protrude by {:g}, more than --max-protrusion; {}", options.input,
          link.name, link.cover.spheres.size(), link.cover.protrusion.largest,
          link.cover.spheres.size() < kMostCoverSpheres ? "increase --count" : "increase it"));
  }
  if (input.is_robot())
    interruptibly(kPatience, options.quiet, false, [&](const ProgressCallback& progress) {
      compare_links(input, wanted, options, progress);
      return 0;
    });
}

void run_spheres(const SpheresOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::err);
  const SphereWriter writer = sphere_writer(options.output);
  if (const std::string ending = ending_of(options.output);
      options.kind == Kind::capsules && ending != ".urdf" && ending != ".json")
    throw Error(options.output + ": this format has no capsules; use .urdf or .json");
  require_output(options.output, options.input, "the spheres");
  const auto start = std::chrono::steady_clock::now();
  SphereRobot input =
      is_robot_file(options.input) ? read_robot_input(options) : read_mesh_input(options);
  input.output = options.output;
  if (const std::string ending = ending_of(options.output);
      !input.robot.is_urdf && (ending == ".urdf" || ending == ".yml" || ending == ".yaml"))
    throw Error(options.output + ": this format needs the robot as a URDF; " + options.input +
                " can become .json, .xrdf, .srdf or .glb");
  fill_links(input, wanted_pose(input.robot, options), options);
  const std::string text = writer(input);
  {
    const InterruptGuard guard;
    write_text(options.output, text);
  }
  exit_if_interrupted();
  const double seconds = seconds_since(start);
  if (options.json)
    fmt::print("{}", spheres_report_json(input, options.output, seconds));
  else if (!options.quiet)
    fmt::print("{}", spheres_table(input, options.output, seconds));
}

/// "64" or "LINK=64".
bool take_count(SpheresOptions& options, const std::string& text) {
  const std::size_t equals = text.rfind('=');
  const auto count =
      parse_whole<std::size_t>(text.substr(equals == std::string::npos ? 0 : equals + 1));
  if (!count || *count < 1 || *count > kMostCoverSpheres || equals == 0) return false;
  (equals == std::string::npos ? options.count : options.counts[text.substr(0, equals)]) = *count;
  return true;
}

}  // namespace

void add_spheres(CLI::App& app) {
  const auto options = std::make_shared<SpheresOptions>();
  CLI::App* const command = app.add_subcommand(
      "spheres", "Write few spheres that provably contain each link of a robot, or a mesh");
  add_input(command, "INPUT", options->input,
            "A robot (.urdf, .sdf, or .xml of MuJoCo) or a mesh (OBJ, STL, PLY, …)");
  add_output(command, options->output,
             "The file to write: .urdf (spheres as collisions), .yml (cuRobo), .xrdf, .srdf "
             "(MoveIt), .glb (links and spheres, for viewers) or .json",
             Dash::refused);
  const std::string meaning =
      fmt::format("N or LINK=N, with a whole number N from 1 to {}", kMostCoverSpheres);
  add_repeated(
      command, "--count", "[LINK=]N", meaning,
      [options](const std::string& one) { return take_count(*options, one); },
      "Number of spheres of each link, or with LINK=N of that link. Repeatable. With "
      "--max-protrusion the maximum (default 1024)");
  CLI::Option* const total =
      add_whole<std::size_t>(command, "--total", options->cover.total,
                             "Number of spheres of the whole robot, shared to keep the largest "
                             "protrusion small. Default: 8 per link; 64 for a mesh",
                             1, 1'000'000);
  total->default_str("");
  CLI::Option* const most =
      add_number(command, "--max-protrusion", options->cover.max_protrusion,
                 {.least = 0, .without_least = true},
                 "[u] Use few spheres that stick out of the link by at most this");
  most->default_str("");
  CLI::Option* const cover = command->add_flag_callback(
      "--cover", [options] { options->kind = Kind::cover; },
      "Spheres that provably contain the link (the default)");
  CLI::Option* const inner = command->add_flag_callback(
      "--inner", [options] { options->kind = Kind::inner; },
      "Spheres inside the link, certified: the first of its packing");
  CLI::Option* const matched = command->add_flag_callback(
      "--matched", [options] { options->kind = Kind::matched; },
      "Spheres with the link's volume; they neither contain it nor lie inside it");
  CLI::Option* const capsules = command->add_flag_callback(
      "--capsules", [options] { options->kind = Kind::capsules; },
      fmt::format("Capsules that together provably contain the link, with about the least volume: "
                  "one, or at most --count, up to {} (.urdf, .json)",
                  kMostCoverCapsules));
  capsules->excludes(cover)->excludes(inner)->excludes(matched)->excludes(most)->excludes(total);
  inner->excludes(cover)->excludes(most)->excludes(total);
  matched->excludes(cover)->excludes(inner)->excludes(most)->excludes(total);
  most->excludes(total);
  add_robot_options(command, options->robot);
  add_repeated(
      command, "--pose", "JOINT=NUMBER", "JOINT=NUMBER",
      [options](const std::string& one) {
        const std::size_t equals = one.rfind('=');
        const auto position =
            equals == std::string::npos ? std::nullopt : parse_real(one.substr(equals + 1));
        if (equals == 0 || !position || !std::isfinite(*position)) return false;
        options->pose[one.substr(0, equals)] = *position;
        return true;
      },
      "Robots: position of a joint in the default pose [rad or u]. Repeatable. Default: 0 or "
      "the middle of its limits, or searched, so that no links overlap");
  add_file(command, "--srdf", options->srdf,
           "Robots: an SRDF: its group_states are tried first as the default pose, and the pairs "
           "of its disable_collisions are ignored");
  add_whole(command, "--seed", options->cover.seed,
            "Random seed of the search; any value works equally well");
  add_whole(command, "--threads", options->cover.threads,
            "Number of threads; 0 = all cores. The result does not depend on it");
  add_setting_options(command, options->closing, closing_settings());
  command->add_flag("--json", options->json, "Print the report as JSON");
  command->add_flag("--quiet", options->quiet, "Print errors only");
  command->footer(
      "Spheres are in the link's frame, lengths in the robot's unit (URDF: metres). The largest\n"
      "protrusion is proven: no point of a sphere is farther from the link. Mean and 95th\n"
      "percentile are over the surface of the spheres' union.\n"
      "Example: ist spheres ur5.urdf -o ur5.yml --total 74");
  command->callback([options] {
    if (options->count > 0 && options->cover.total > 0)
      throw CLI::ValidationError("--count", "a number for every link excludes --total; use LINK=N");
    std::size_t most = options->count;
    for (const auto& [link, count] : options->counts) most = std::max(most, count);
    if (options->kind == Kind::capsules && most > kMostCoverCapsules)
      throw CLI::ValidationError(
          "--count", fmt::format("{} with --capsules; at most {}", most, kMostCoverCapsules));
    refuse_idle_options(options->robot, options->input);
    if (!options->pose.empty() || !options->srdf.empty())
      refuse_without_robot(options->pose.empty() ? "--srdf" : "--pose", options->input);
    run_spheres(*options);
  });
}

}  // namespace ist::app
