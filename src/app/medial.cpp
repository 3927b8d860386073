#include <ist/medial.h>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <memory>

#include <ist/error.h>

#include "app/commands.h"
#include "app/number_checks.h"
#include "app/output_file.h"
#include "app/text.h"
#include "asset/atomic_file.h"

namespace ist::app {
namespace {

struct MedialOptions {
  std::string mesh, output, device = "auto";
  MedialSettings settings;
  bool repair = false, quiet = false;
};

std::string table_of(const std::vector<MedialNode>& nodes) {
  std::string text = "x,y,z,r\n";
  for (const MedialNode& n : nodes)
    fmt::format_to(std::back_inserter(text), "{:.17g},{:.17g},{:.17g},{:.17g}\n", n.point.x(),
                   n.point.y(), n.point.z(), n.radius);
  return text;
}

void run_medial(const MedialOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::err);
  require_output(options.output, options.mesh, "the nodes");
  MedialSettings settings = options.settings;
  settings.device = device_named(options.device);
  const ClosedMesh mesh =
      close_mesh(load_mesh(options.mesh), options.mesh,
                 options.repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
  for (const std::string& note : mesh.report.notes) spdlog::warn("{}: {}", options.mesh, note);
  const auto solid = make_solid(mesh);
  const auto start = std::chrono::steady_clock::now();
  const std::vector<MedialNode> nodes = medial_nodes(*solid, settings);
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start;
  write_atomically(options.output, table_of(nodes));
  if (!options.quiet)
    fmt::print("{}\n  nodes {}, {:.1f} ms\n", options.output, nodes.size(), elapsed.count());
}

}  // namespace

void add_medial(CLI::App& app) {
  const auto options = std::make_shared<MedialOptions>();
  CLI::App* const command = app.add_subcommand(
      "medial", "Write points of a closed mesh's medial axis with their distance to the surface");
  command->add_option("MESH", options->mesh, "OBJ, STL, PLY, OFF, GLB/glTF, DAE, …")->required();
  command
      ->add_option("-o,--output", options->output,
                   "The CSV file to write: x,y,z,r in the mesh's own unit and frame")
      ->required();
  command
      ->add_option("--resolution", options->settings.resolution,
                   "Grid cells on the longest side, a node each at most; 0 = automatic")
      ->check(is_count)
      ->capture_default_str();
  command->add_option("--seed", options->settings.seed, "Another seed, other points")
      ->check(is_count)
      ->capture_default_str();
  command->add_option("--device", options->device, "Where it runs")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
  command
      ->add_option("--threads", options->settings.threads,
                   "0 = all cores; never changes the result")
      ->check(is_count)
      ->capture_default_str();
  command->add_flag("--repair", options->repair, "Close an open mesh, and say what was done");
  command->add_flag("--quiet", options->quiet, "Only errors");
  command->footer("Example: ist medial bolt.obj -o nodes.csv");
  command->callback([options] { run_medial(*options); });
}

}  // namespace ist::app
