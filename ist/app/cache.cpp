#include "library/cache.h"

#include <fmt/format.h>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "app/options.h"
#include "library/text.h"

namespace ist::app {
namespace {

struct CacheOptions {
  std::string folder;
  bool prune = false, json = false;
  std::optional<std::uint64_t> most;
};

std::string days(double seconds) { return fmt::format("{:.1f} days ago", seconds / 86'400); }

void run_cache(const CacheOptions& options) {
  Pruned pruned;
  if (options.prune) pruned = prune_cache(options.folder, options.most);
  const CacheUse use = look_at_cache(options.folder);
  if (options.json) {
    const auto if_any = [&](double value) {
      return use.entries > 0 ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
    };
    const nlohmann::ordered_json result = {
        {"schema", 1},
        {"cache", options.folder},
        {"entries", use.entries},
        {"bytes", use.bytes},
        {"oldest_use", if_any(use.oldest)},
        {"newest_use", if_any(use.newest)},
        {"left_over", {{"files", use.left_over}, {"bytes", use.left_over_bytes}}},
        {"pruned", {{"files", pruned.entries}, {"bytes", pruned.bytes}}}};
    fmt::print("{}\n", json_text(result));
    return;
  }
  fmt::print("{}\n  {:<10} {}, {} bytes\n", options.folder, "assets", grouped(use.entries),
             grouped(use.bytes));
  if (use.entries > 0)
    fmt::print("  {:<10} {} to {}\n", "last used", days(use.oldest), days(use.newest));
  if (use.left_over > 0)
    fmt::print("  {:<10} {} files, {} bytes, of running or killed programs\n", "unfinished",
               grouped(use.left_over), grouped(use.left_over_bytes));
  if (options.prune)
    fmt::print("  {:<10} {} files, {} bytes\n", "removed", grouped(pruned.entries),
               grouped(pruned.bytes));
}

}  // namespace

void add_cache(CLI::App& app) {
  const auto options = std::make_shared<CacheOptions>();
  CLI::App* const command =
      app.add_subcommand("cache", "Show or prune a cache of `ist bake --manifest`");
  if (const char* const folder = std::getenv("IST_CACHE")) options->folder = folder;
  command->add_option("DIR", options->folder, "Cache folder")
      ->required(options->folder.empty())
      ->capture_default_str();
  CLI::Option* const prune = command->add_flag(
      "--prune", options->prune,
      "Remove unfinished files that are at least one hour old; with --max-size also assets");
  add_bytes(
      command, "--max-size", options->most,
      "Remove the least recently used assets until the cache is at most this large, in bytes, "
      "e.g. 10G; 0 = remove all")
      ->needs(prune);
  command->add_flag("--json", options->json, "Print JSON");
  command->footer("Example: ist cache ~/.cache/ist --prune --max-size 10G");
  command->callback([options] { run_cache(*options); });
}

}  // namespace ist::app
