#include "library/summary.h"

#include <fmt/format.h>
#include <ist/bake.h>
#include <ist/mass_properties.h>
#include <ist/raycast.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "app/bake_library.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/options.h"
#include "library/text.h"
#include "mesh/import/xml_document.h"

namespace ist::app {
namespace {

/// The remark on an asset: the reason of its failure; else the confidence with which its open mesh
/// was closed, the first warning and the number of others.
std::string remark_on(const JobResult& result) {
  if (!result.message.empty()) return result.message;
  if (result.warnings.empty()) return "";
  const std::size_t more = result.warnings.size() - 1;
  return (result.confidence ? fmt::format("confidence {:.2f}; ", *result.confidence) : "") +
         result.warnings.front() + (more == 0 ? "" : fmt::format(" (and {} more)", more));
}

std::string counts_in_words(const Summary& summary) {
  return fmt::format("{} baked, {} cached, {} failed, {} not baked, {:.1f} s",
                     grouped(summary.count(JobStatus::baked)),
                     grouped(summary.count(JobStatus::cached)),
                     grouped(summary.count(JobStatus::failed)),
                     grouped(summary.count(JobStatus::not_baked)), summary.seconds);
}

void print_table(const Summary& summary, bool failed) {
  std::size_t width = 4;
  for (const JobResult& result : summary.results) width = std::max(width, result.name.size());
  fmt::print("{:<{}}  {:<9} {:>8} {:>10} {:>8} {:>7}  {}\n", "name", width, "status", "seconds",
             "spheres", "covered", "error", "remarks");
  for (const JobResult& result : summary.results) {
    const bool done = result.done();
    if (failed && done) continue;
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
  fmt::print("{}{}: {} assets, {}\n", summary.manifest, shard, grouped(summary.results.size()),
             counts_in_words(summary));
}

using Eigen::Vector3d;

constexpr int kSide = 96;  ///< [pixels] of a picture, a multiple of 4

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63];
  }
  return out;
}

/// A bitmap of grey values, the lowest row first.
std::string bitmap(const std::array<unsigned char, kSide * kSide>& grey) {
  const auto word = [](std::uint32_t value, std::size_t bytes) {
    std::string out;
    for (std::size_t k = 0; k < bytes; ++k) out += static_cast<char>(value >> 8 * k & 255);
    return out;
  };
  constexpr std::uint32_t kData = 14 + 40 + 4 * 256;
  std::string out = "BM" + word(kData + kSide * kSide, 4) + word(0, 4) + word(kData, 4);
  out += word(40, 4) + word(kSide, 4) + word(kSide, 4) + word(1, 2) + word(8, 2) + word(0, 4) +
         word(kSide * kSide, 4) + word(0, 4) + word(0, 4) + word(256, 4) + word(0, 4);
  for (std::uint32_t i = 0; i < 256; ++i) out += word(i * 0x010101u, 4);
  return out.append(reinterpret_cast<const char*>(grey.data()), grey.size());
}

/// The solid from the front, right and above, Z up; empty without a mesh.
std::string picture(const AssetView& tree) {
  if (!tree.has_mesh()) return "";
  const Bounds around = bounds(tree);
  const Vector3d out = Vector3d(1, -2, 1.2).normalized();
  const Vector3d right = Vector3d::UnitZ().cross(out).normalized(), up = out.cross(right);
  const Vector3d light = (out + 0.6 * up - 0.5 * right).normalized();
  const PlacedAsset placed = {tree, {}};
  std::array<unsigned char, kSide * kSide> grey;
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      const double x = (2 * column + 1.0) / kSide - 1, y = (2 * row + 1.0) / kSide - 1;
      const Vector3d from = around.centre + around.radius * (2 * out + x * right + y * up);
      const RayHit hit = raycast(placed, {from, -out});
      const double shade = 60 + 170 * std::max(0.0, hit.normal.dot(light));
      grey[static_cast<std::size_t>(row * kSide + column)] =
          static_cast<unsigned char>(hit.hit() ? shade : 255);
    }
  return bitmap(grey);
}

std::string image(const JobResult& result) {
  try {
    const std::string bytes =
        result.done() ? picture(Asset::load(result.asset).view()) : std::string();
    if (bytes.empty()) return "";
    return fmt::format("<img width={0} height={0} src=\"data:image/bmp;base64,{1}\">", kSide,
                       base64(bytes));
  } catch (const Error&) {  // the file was moved since
    return "";
  }
}

std::string row(const JobResult& r) {
  const bool done = r.done();
  const auto number = [&](double value, double unit = 1) {
    return done ? fmt::format("{:.4g}", unit * value) : std::string();
  };
  std::string remarks = xml_text(r.message);
  for (const std::string& warning : r.warnings)
    remarks += (remarks.empty() ? "" : "<br>") + xml_text(warning);
  std::string out = fmt::format("<tr class={}><td>{}<td>{}<td>{}", name_of(r.status), image(r),
                                xml_text(r.name), name_of(r.status));
  out += fmt::format(
      "<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}", done ? grouped(r.spheres) : "",
      number(r.coverage, 100), number(r.volume), number(r.protrusion),
      done ? xml_text(r.mesh_state) : "", r.error ? fmt::format("{:.2g}", 100 * *r.error) : "",
      r.confidence ? fmt::format("{:.2f}", *r.confidence) : "", fmt::format("{:.2f}", r.seconds));
  return out + fmt::format("<td class=t>{}</tr>\n", remarks);
}

struct SummaryOptions {
  std::vector<std::string> files;
  std::string page;
  bool json = false, failed = false;
};

/// Sorts by a column when its head is clicked, and hides rows without the typed text.
constexpr const char* kScript = R"(<script>
const body = document.querySelector('tbody'), rows = [...body.rows];
document.querySelectorAll('th').forEach((head, i) => head.onclick = () => {
  const key = row => row.cells[i].textContent, n = text => parseFloat(text.replace(/,/g, ''));
  const down = head.dataset.down = head.dataset.down === '1' ? '0' : '1';
  rows.sort((a, b) => {
    const x = n(key(a)), y = n(key(b));
    const by = isNaN(x) || isNaN(y) ? isNaN(x) - isNaN(y) || key(a).localeCompare(key(b)) : x - y;
    return down === '1' ? by : -by;
  });
  body.append(...rows);
});
document.querySelector('input').oninput = event => rows.forEach(row => {
  row.hidden = !row.textContent.toLowerCase().includes(event.target.value.toLowerCase());
});
</script>)";

std::string links_of_pages(const std::vector<std::string>& files, std::size_t page) {
  std::string out;
  for (std::size_t i = 0; i < files.size() && files.size() > 1; ++i) {
    const std::string name = xml_text(std::filesystem::path(files[i]).filename().string());
    out += i == page ? fmt::format("<b>{}</b> ", i + 1)
                     : fmt::format("<a href=\"{}\">{}</a> ", name, i + 1);
  }
  return out.empty() ? "" : "<p>pages: " + out + "\n";
}

/// A page of a library for a browser, in a single file: a table of assets with a picture of each
/// that keeps a readable mesh.
std::string summary_page(const Summary& summary, std::span<const JobResult* const> results,
                         const std::string& pages) {
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=en><meta charset=utf-8><title>{0}</title>\n<style>"
      "body{{font:14px sans-serif;margin:2em}}table{{border-collapse:collapse}}"
      "td,th{{padding:4px 10px;border-bottom:1px solid #ddd;text-align:right}}"
      "td:nth-child(-n+3),.t{{text-align:left}}"
      "th{{position:sticky;top:0;background:#fff;cursor:pointer}}"
      ".failed,.not_baked{{background:#fdd}}</style>\n<h1>{0}</h1>\n"
      "<p>{1} assets: {2}\n{3}<p><input placeholder=\"filter this page\">\n",
      xml_text(summary.manifest), grouped(summary.results.size()), counts_in_words(summary), pages);
  out += "<table><thead><tr><th><th class=t>name<th class=t>status";
  for (const char* const head : {"spheres", "covered [%]", "volume [u³]", "protrusion [u]", "mesh",
                                 "error [%]", "confidence", "time [s]"})
    out += fmt::format("<th>{}", head);
  out += "<th class=t>remarks</tr></thead><tbody>\n";
  for (const JobResult* const result : results) out += row(*result);
  return out + "</tbody></table>" + kScript + "</html>\n";
}

/// One page for some hundred assets, failures first: FILE.html, FILE-2.html and so on.
void write_pages(const Summary& summary, const SummaryOptions& options) {
  constexpr std::size_t kOfAPage = 500;
  std::vector<const JobResult*> results;
  for (const bool done : {false, true})
    for (const JobResult& result : summary.results)
      if (result.done() == done && !(options.failed && done)) results.push_back(&result);
  const std::filesystem::path first = options.page;
  std::vector<std::string> files = {options.page};
  while (files.size() * kOfAPage < results.size())
    files.push_back(
        (first.parent_path() / fmt::format("{}-{}{}", first.stem().string(), files.size() + 1,
                                           first.extension().string()))
            .string());
  if (is_standard_output(options.page)) files.resize(1);
  const InterruptGuard guard;
  for (std::size_t i = 0; i < files.size() && !interrupted(); ++i) {
    const std::size_t begin = i * kOfAPage, end = files.size() == 1
                                                      ? results.size()
                                                      : std::min(results.size(), begin + kOfAPage);
    write_text(files[i], summary_page(summary, std::span(results).subspan(begin, end - begin),
                                      links_of_pages(files, i)));
  }
}

void run_summary(const SummaryOptions& options) {
  std::vector<Summary> shards;
  for (const std::string& file : options.files) shards.push_back(read_summary(file));
  Summary whole = merge(std::move(shards));
  if (!options.page.empty()) write_pages(whole, options);
  exit_if_interrupted();
  print_summary(whole, options.json, !options.page.empty() && !options.json, options.failed);
  if (!whole.complete()) throw ExitCode{kExitError};
}

}  // namespace

void print_summary(const Summary& summary, bool json, bool quiet, bool failed) {
  if (json)
    fmt::print("{}\n", json_text(to_json(summary, failed)));
  else if (!quiet)
    print_table(summary, failed);
}

void add_summary(CLI::App& app) {
  const auto options = std::make_shared<SummaryOptions>();
  CLI::App* const command = app.add_subcommand(
      "summary", "Show the results of a manifest bake, or merge those of its shards");
  command->add_option("FILE", options->files, "Output of `ist bake --manifest … --json`")
      ->required();
  command->add_flag("--failed", options->failed, "Show only assets that failed or were not baked");
  command->add_flag("--json", options->json, "Print JSON");
  command->add_option("--html", options->page,
                      "Write an HTML page instead, with a picture and the numbers of each asset: "
                      "FILE.html, then FILE-2.html and so on for each 500 more");
  command->footer(
      "Exits 1 if an asset failed, or if a shard is missing, given twice or of another library.\n"
      "Example: ist summary shard-1.json shard-2.json\n"
      "Example: ist summary summary.json --html library.html");
  command->callback([options] { run_summary(*options); });
}

}  // namespace ist::app
