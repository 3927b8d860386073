#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/commands.h"
#include "app/options.h"
#include "library/input_mesh.h"
#include "library/text.h"

namespace ist::app {
namespace {

struct CheckOptions {
  std::string asset, mesh;
  SettingOptions placed;
  unsigned threads = 0;
  bool json = false;
};

void print_json(const CheckOptions& options, const std::vector<Invariant>& invariants, bool sound) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Invariant& i : invariants)
    list.push_back({{"name", i.name},
                    {"worst", i.worst},
                    {"meaning", i.meaning},
                    {"where", i.where},
                    {"checked", i.checked},
                    {"violations", i.violations}});
  const nlohmann::ordered_json result = {
      {"asset", options.asset}, {"mesh", options.mesh}, {"sound", sound}, {"invariants", list}};
  fmt::print("{}\n", json_text(result));
}

void print_table(const CheckOptions& options, const std::vector<Invariant>& invariants,
                 bool sound) {
  std::size_t width = 0;
  for (const Invariant& i : invariants) width = std::max(width, i.name.size());
  fmt::print("{} against {}\n", options.asset, options.mesh);
  for (const Invariant& i : invariants) {
    fmt::print("  {:<4} {:<{}}  worst {:>10.3g}  {} checked  ({})\n",
               i.violations == 0 ? "ok" : "FAIL", i.name, width, i.worst, grouped(i.checked),
               i.meaning);
    if (i.violations != 0)
      fmt::print("       {} violations, the worst at index {}\n", grouped(i.violations), i.where);
  }
  fmt::print("{}\n", sound ? "sound: no violations" : "NOT SOUND");
}

ClosedMesh baked_mesh(std::uint32_t flags, const CheckOptions& options) {
  MeshSettings settings = options.placed.settings.mesh;
  settings.repair = (flags & kFlagRepaired) != 0;
  const double detail = std::exchange(settings.wrap, 0);
  if ((flags & kFlagWrapped) == 0) return read_input_mesh(options.mesh, settings).closed;
  if (detail == 0)
    throw Error(options.asset +
                ": the asset was baked from a wrapped mesh; pass the same detail with --wrap");
  TriangleMesh mesh = load_mesh(options.mesh);
  place(mesh, settings);
  return wrap_mesh(std::move(mesh), options.mesh, detail);
}

void run_check(const CheckOptions& options) {
  const Asset asset = Asset::load(options.asset);
  const ClosedMesh mesh = baked_mesh(asset.view().header().flags, options);
  const std::vector<Invariant> invariants = check(asset, mesh, options.threads);
  const bool sound = std::all_of(invariants.begin(), invariants.end(),
                                 [](const Invariant& i) { return i.violations == 0; });
  options.json ? print_json(options, invariants, sound) : print_table(options, invariants, sound);
  if (!sound) throw ExitCode{kExitViolation};
}

}  // namespace

void add_check(CLI::App& app) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* const command =
      app.add_subcommand("check", "Verify every invariant of an asset against its mesh");
  add_input(command, "ASSET", options->asset, "An .ist file");
  add_input(command, "--mesh", options->mesh, "The mesh file that the asset was baked from");
  add_setting_options(command, options->placed, checking_settings());
  add_whole(command, "--threads", options->threads, "Number of threads; 0 = all cores");
  command->add_flag("--json", options->json, "Print the invariants as JSON");
  command->footer(
      "Exits 3 if an invariant is violated.\nExample: ist check bolt.ist --mesh bolt.obj");
  command->callback([options] {
    complete_settings(options->placed);
    run_check(*options);
  });
}

}  // namespace ist::app
