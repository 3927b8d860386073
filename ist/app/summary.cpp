#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/file_options.h"
#include "app/interrupt.h"
#include "app/summary_page.h"
#include "app/summary_table.h"
#include "library/summary.h"

namespace ist::app {
namespace {

struct SummaryOptions {
  std::vector<std::string> files;
  std::string page;
  bool json = false, failed = false;
};

void run_summary(const SummaryOptions& options) {
  std::vector<Summary> shards;
  for (const std::string& file : options.files) shards.push_back(read_summary(file));
  Summary whole = merge(std::move(shards));
  if (options.failed)
    std::erase_if(whole.results, [](const JobResult& result) { return result.done(); });
  if (!options.page.empty()) {
    const InterruptGuard guard;
    write_text(options.page, summary_page(whole));
  }
  exit_if_interrupted();
  print_summary(whole, options.json, !options.page.empty() && !options.json);
  if (!whole.complete()) throw ExitCode{kExitError};
}

}  // namespace

void add_summary(CLI::App& app) {
  const auto options = std::make_shared<SummaryOptions>();
  CLI::App* const command = app.add_subcommand(
      "summary", "Show the results of a manifest bake, or merge those of its shards");
  command->add_option("FILE", options->files, "Output of `ist bake --manifest … --json`")
      ->required();
  command->add_flag("--failed", options->failed, "Show only assets that failed or were not baked");
  command->add_flag("--json", options->json, "Print JSON");
  command->add_option("--html", options->page,
                      "Write a page for browsers instead: a picture and the numbers of each asset");
  command->footer(
      "Exits 1 if an asset failed, or if a shard is missing, given twice or of another library.\n"
      "Example: ist summary shard-1.json shard-2.json\n"
      "Example: ist summary summary.json --html library.html");
  command->callback([options] { run_summary(*options); });
}

}  // namespace ist::app
