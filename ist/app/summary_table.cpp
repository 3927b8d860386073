#include "app/summary_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "library/text.h"

namespace ist::app {
namespace {

/// What is said last of an asset: why it failed, else with what confidence its mesh was closed if
/// it was not, the first warning and how many follow.
std::string remark_on(const JobResult& result) {
  if (!result.message.empty()) return result.message;
  if (result.warnings.empty()) return "";
  const std::size_t more = result.warnings.size() - 1;
  return (result.confidence ? fmt::format("confidence {:.2f}; ", *result.confidence) : "") +
         result.warnings.front() + (more == 0 ? "" : fmt::format(" (and {} more)", more));
}

void print_table(const Summary& summary) {
  std::size_t width = 4;
  for (const JobResult& result : summary.results) width = std::max(width, result.name.size());
  fmt::print("{:<{}}  {:<9} {:>8} {:>10} {:>8} {:>7}  {}\n", "name", width, "status", "seconds",
             "spheres", "covered", "error", "remarks");
  for (const JobResult& result : summary.results) {
    const bool done = result.done();
    fmt::print("{:<{}}  {:<9} {:>8.2f} {:>10} {:>8} {:>7}  {}\n", result.name, width,
               name_of(result.status), result.seconds, done ? grouped(result.spheres) : "-",
               done ? fmt::format("{:.1f} %", 100 * result.coverage) : "-",
               result.error ? fmt::format("{:.2g} %", 100 * *result.error) : "-",
               remark_on(result));
  }
  const std::string shard =
      summary.shard.count == 1
          ? ""
          : fmt::format(", shard {}/{}", summary.shard.index, summary.shard.count);
  fmt::print("{}{}: {} assets, {} baked, {} cached, {} failed, {} not baked, {:.1f} s\n",
             summary.manifest, shard, grouped(summary.results.size()),
             grouped(summary.count(JobStatus::baked)), grouped(summary.count(JobStatus::cached)),
             grouped(summary.count(JobStatus::failed)),
             grouped(summary.count(JobStatus::not_baked)), summary.seconds);
}

}  // namespace

void print_summary(const Summary& summary, bool json, bool quiet) {
  if (json)
    fmt::print("{}\n", json_text(to_json(summary)));
  else if (!quiet)
    print_table(summary);
}

}  // namespace ist::app
