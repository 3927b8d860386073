#include <fmt/format.h>
#include <ist/bake.h>
#include <memory>

#include "app/commands.h"
#include "app/options.h"
#include "library/asset_summary.h"
#include "library/text.h"

namespace ist::app {
namespace {

struct InfoOptions {
  std::string asset;
  bool json = false;
};

void info(const InfoOptions& options) {
  const Asset asset = Asset::load(options.asset);
  if (options.json)
    fmt::print("{}\n", json_text(asset_json(asset.view())));
  else
    fmt::print("{}\n{}", options.asset, describe_asset(asset.view()));
}

}  // namespace

void add_info(CLI::App& app) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* const command = app.add_subcommand("info", "Show the contents of an asset");
  add_input(command, "ASSET", options->asset, "An .ist file");
  command->add_flag("--json", options->json, "Print every header field as JSON");
  command->footer("Example: ist info bolt.ist --json");
  command->callback([options] { info(*options); });
}

}  // namespace ist::app
