#include <fmt/format.h>
#include <ist/bake.h>
#include <spdlog/spdlog.h>
#include <chrono>
#include <memory>

#include "app/commands.h"
#include "app/mesh_notes.h"
#include "app/options.h"

namespace ist::app {
namespace {

struct MedialOptions {
  std::string mesh, output, device = "auto";
  MedialSettings settings;
  SettingOptions closing;
  bool quiet = false;
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
  settings.device = usable_device(options.device);
  const auto solid =
      make_solid(read_mesh_aloud(options.mesh, options.closing.settings.mesh).closed);
  const auto start = std::chrono::steady_clock::now();
  const std::vector<MedialNode> nodes = medial_nodes(*solid, settings);
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start;
  write_text(options.output, table_of(nodes));
  if (!options.quiet && !is_standard_output(options.output))
    fmt::print("{}\n  nodes {}, {:.1f} ms\n", options.output, nodes.size(), elapsed.count());
}

}  // namespace

void add_medial(CLI::App& app) {
  const auto options = std::make_shared<MedialOptions>();
  CLI::App* const command = app.add_subcommand(
      "medial", "Write points of a closed mesh's medial axis with their distance to the surface");
  add_input(command, "MESH", options->mesh, "OBJ, STL, PLY, OFF, GLB/glTF, DAE, …");
  add_output(command, options->output,
             "The CSV file to write; - = standard output. Columns x,y,z,r in the mesh's own unit "
             "and frame",
             Dash::standard_output);
  add_whole(command, "--resolution", options->settings.resolution,
            "Grid cells along the longest side, each with at most one node; 0 = automatic", 0u,
            unsigned{kMostGridCells});
  add_whole(command, "--seed", options->settings.seed, "Random seed; each seed gives other points");
  add_device_option(command, options->device,
                    "Device; auto = the GPU if there is one, else the CPU");
  add_whole(command, "--threads", options->settings.threads,
            "Number of threads; 0 = all cores. The result does not depend on it");
  add_setting_options(command, options->closing, closing_settings());
  command->add_flag("--quiet", options->quiet, "Print errors only");
  command->footer("Example: ist medial bolt.obj -o nodes.csv");
  command->callback([options] { run_medial(*options); });
}

}  // namespace ist::app
