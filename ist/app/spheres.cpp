#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include <ist/bake.h>
#include <ist/cover_spheres.h>
#include <ist/error.h>

#include "app/commands.h"
#include "app/file_options.h"
#include "app/interrupt.h"
#include "app/mesh_notes.h"
#include "app/number_options.h"
#include "app/progress_line.h"
#include "app/robot_options.h"
#include "app/setting_options.h"
#include "library/exported_spheres.h"
#include "robot/link_mesh.h"
#include "robot/sphere_files.h"

namespace ist::app {
namespace {

enum class Kind { cover, inner, matched };

struct SpheresOptions {
  std::string input, output;
  SphereCoverSettings cover;
  Kind kind = Kind::cover;
  RobotOptions robot;
  SettingOptions closing;
  bool json = false, quiet = false;
};

/// A link, or the whole of a mesh, and what became of it.
struct Link {
  std::string name;
  std::vector<CoverSphere> given;  ///< spheres of the description itself
  bool has_mesh = false;
  double slack = 0;  ///< [u] by which the mesh may be wider than the shapes
  SphereCover cover;
  SphereCoverProof proof;
};

/// The input: links, and the meshes of those that have one, in the same order.
struct Input {
  std::string name;
  std::vector<Link> links;
  std::vector<ClosedMesh> meshes;
  RobotModel robot;  ///< no links where the input is a mesh
};

Input read_input(const SpheresOptions& options) {
  Input input;
  if (!is_robot_file(options.input)) {
    input.name = std::filesystem::path(options.input).stem().string();
    input.links.emplace_back();
    input.links[0].name = input.name;
    input.links[0].has_mesh = true;
    input.meshes.push_back(read_mesh_aloud(options.input, options.closing.settings.mesh).closed);
    return input;
  }
  input.robot = read_robot(options.input);
  input.name = input.robot.name;
  const PackagePaths paths = package_paths(options.input, options.robot);
  for (const RobotLink& link : input.robot.links) {
    const auto& shapes = link.shapes(options.robot.shapes());
    if (shapes.empty()) continue;
    LinkGeometry geometry = geometry_of(shapes, paths, options.input);
    Link& out = input.links.emplace_back();
    out.name = link.name;
    out.given = geometry.spheres;
    out.slack = geometry.slack;
    out.has_mesh = !geometry.mesh.triangles.empty();
    if (out.has_mesh)
      input.meshes.push_back(close_aloud(std::move(geometry.mesh),
                                         fmt::format("{}: link {}", options.input, link.name),
                                         options.closing.settings.mesh));
  }
  if (input.links.empty()) refuse_no_shapes(options.robot, options.input);
  return input;
}

/// The first spheres of a packing, or the matched ones of a bake.
std::vector<CoverSphere> baked_spheres(const ClosedMesh& mesh, const SpheresOptions& options,
                                       const ProgressCallback& progress) {
  PackingSettings settings;
  settings.max_spheres = options.cover.count;
  settings.seed = options.cover.seed;
  settings.threads = options.cover.threads;
  settings.device = Device::cpu;
  settings.surface.wanted = false;
  const Asset asset = bake(mesh, settings, progress);
  std::vector<CoverSphere> spheres;
  for (const ExportedSphere& s : exported_spheres(asset.view(), 0))
    spheres.push_back(options.kind == Kind::inner
                          ? CoverSphere{s.centre, s.radius}
                          : CoverSphere{s.matched_centre, s.matched_radius});
  return spheres;
}

std::vector<SphereCover> make_spheres(const Input& input, const SpheresOptions& options,
                                      const ProgressCallback& progress) {
  if (options.kind == Kind::cover) return cover_with_spheres(input.meshes, options.cover, progress);
  std::vector<SphereCover> covers;
  for (const ClosedMesh& mesh : input.meshes) {
    const auto start = std::chrono::steady_clock::now();
    SphereCover cover;
    cover.spheres = baked_spheres(mesh, options, progress);
    cover.protrusion = sphere_protrusion(mesh, cover.spheres);
    cover.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    covers.push_back(std::move(cover));
  }
  return covers;
}

void fill_links(Input& input, const SpheresOptions& options) {
  constexpr double kPatience = 0.5;  // [s]
  const InterruptGuard guard(kPatience);
  ProgressLine line(options.quiet);
  std::vector<SphereCover> covers;
  try {
    covers = make_spheres(input, options, [&](const Progress& progress) {
      line.show(progress);
      return !interrupted();
    });
  } catch (const Error&) {
    exit_if_interrupted();
    throw;
  }
  exit_if_interrupted();
  std::size_t next = 0;
  for (Link& link : input.links) {
    link.proof.covered = true;
    if (link.has_mesh) {
      link.cover = std::move(covers[next]);
      link.proof = prove_cover(input.meshes[next], link.cover.spheres);
      link.cover.protrusion.largest += link.slack;
      ++next;
    }
    link.cover.spheres.insert(link.cover.spheres.begin(), link.given.begin(), link.given.end());
    if (options.kind == Kind::cover && !link.proof.covered)
      throw Error(
          fmt::format("{}: link {}: cannot prove that the spheres contain it near ({:g}, {:g}, "
                      "{:g}); change --count",
                      options.input, link.name, link.proof.where.x(), link.proof.where.y(),
                      link.proof.where.z()));
    if (!link.cover.reached)
      throw Error(fmt::format(
          "{}: link {}: {} spheres protrude by {:g}, more than --max-protrusion; {}", options.input,
          link.name, options.cover.count, link.cover.protrusion.largest,
          options.cover.count < kMostCoverSpheres ? "increase --count" : "increase it"));
  }
}

nlohmann::ordered_json link_json(const Link& link) {
  const SphereProtrusion& p = link.cover.protrusion;
  nlohmann::ordered_json spheres = nlohmann::ordered_json::array();
  for (const CoverSphere& s : link.cover.spheres)
    spheres.push_back({s.centre.x(), s.centre.y(), s.centre.z(), s.radius});
  return {{"spheres", spheres},
          {"protrusion", p.largest},
          {"protrusion_mean", p.mean},
          {"protrusion_p95", p.p95},
          {"volume_ratio", link.has_mesh ? nlohmann::ordered_json(p.volume_ratio) : nullptr},
          {"covered", link.proof.covered}};
}

nlohmann::ordered_json links_json(const Input& input) {
  nlohmann::ordered_json links = nlohmann::ordered_json::object();
  for (const Link& link : input.links) links[link.name] = link_json(link);
  return {{"robot", input.name}, {"links", links}};
}

/// The file's text, by its ending. Throws Error.
using Writer = std::string (*)(const Input&);

std::vector<LinkSpheres> spheres_of(const Input& input) {
  std::vector<LinkSpheres> links;
  for (const Link& link : input.links) links.push_back({link.name, link.cover.spheres});
  return links;
}

Writer writer_for(const std::string& output) {
  const std::string ending = ending_of(output);
  if (ending == ".json") return [](const Input& in) { return links_json(in).dump(1) + "\n"; };
  if (ending == ".yml" || ending == ".yaml")
    return [](const Input& in) { return curobo_yaml(spheres_of(in)); };
  if (ending == ".xrdf") return [](const Input& in) { return xrdf(in.name, spheres_of(in)); };
  if (ending == ".srdf") return [](const Input& in) { return srdf(in.name, spheres_of(in)); };
  if (ending == ".urdf")
    return [](const Input& in) {
      return in.robot.links.empty() ? urdf_of_spheres(spheres_of(in)[0])
                                    : urdf_with_spheres(in.robot, spheres_of(in));
    };
  throw Error(output + ": unknown format '" + ending + "'; use .urdf, .yml, .xrdf, .srdf or .json");
}

void print_report(const Input& input, const SpheresOptions& options, double seconds) {
  if (options.json) {
    nlohmann::ordered_json result = {{"output", options.output}, {"input", options.input}};
    result.update(links_json(input));
    for (const Link& link : input.links) {
      auto& entry = result["links"][link.name];
      entry["spheres"] = link.cover.spheres.size();
      entry["seconds"] = link.cover.seconds;
    }
    result["seconds"] = seconds;
    fmt::print("{}\n", result.dump(2));
    return;
  }
  if (options.quiet) return;
  std::size_t width = 4;
  for (const Link& link : input.links) width = std::max(width, link.name.size());
  fmt::print("{}\n  {:<{}} {:>7} {:>8} {:>10} {:>10} {:>10} {:>7} {:>7}\n", options.output, "link",
             width, "spheres", "covered", "mean [u]", "p95 [u]", "max [u]", "volume", "time");
  for (const Link& link : input.links) {
    const SphereProtrusion& p = link.cover.protrusion;
    fmt::print("  {:<{}} {:>7} {:>8} {:>10.4g} {:>10.4g} {:>10.4g} {:>7.3f} {:>5.2f} s\n",
               link.name, width, link.cover.spheres.size(), link.proof.covered ? "proven" : "no",
               p.mean, p.p95, p.largest, link.has_mesh ? p.volume_ratio : 1.0, link.cover.seconds);
  }
  fmt::print("  time {:.2f} s\n", seconds);
}

void run_spheres(const SpheresOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::err);
  const Writer writer = writer_for(options.output);
  require_output(options.output, options.input, "the spheres");
  const auto start = std::chrono::steady_clock::now();
  Input input = read_input(options);
  fill_links(input, options);
  const std::string text = writer(input);
  {
    const InterruptGuard guard;
    write_text(options.output, text);
  }
  exit_if_interrupted();
  print_report(input, options,
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

void add_spheres(CLI::App& app) {
  const auto options = std::make_shared<SpheresOptions>();
  CLI::App* const command = app.add_subcommand(
      "spheres", "Write few spheres that provably contain each link of a robot, or a mesh");
  add_input(command, "INPUT", options->input, "A robot (.urdf) or a mesh (OBJ, STL, PLY, …)");
  add_output(command, options->output,
             "The file to write: .urdf (spheres as collisions), .yml (cuRobo), .xrdf, .srdf "
             "(MoveIt) or .json",
             Dash::refused);
  add_whole<std::size_t>(
      command, "--count", options->cover.count,
      "Number of spheres per link; with --max-protrusion the largest number (default then 1024)", 1,
      kMostCoverSpheres);
  CLI::Option* const most =
      add_real(command, "--max-protrusion", options->cover.max_protrusion,
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
  inner->excludes(cover)->excludes(most);
  matched->excludes(cover)->excludes(inner)->excludes(most);
  add_robot_options(command, options->robot);
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
      "Example: ist spheres ur5.urdf -o ur5.yml --count 64");
  command->callback([options, command] {
    if (options->cover.max_protrusion > 0 && command->count("--count") == 0)
      options->cover.count = 1024;
    refuse_idle_options(options->robot, options->input);
    run_spheres(*options);
  });
}

}  // namespace ist::app
