#include <fmt/format.h>
#include <memory>

#include "app/commands.h"
#include "app/options.h"
#include "mesh/samples/samples.h"

namespace ist::app {
namespace {

struct SampleOptions {
  std::string name, output;
};

std::string names_of_samples() {
  std::string names;
  for (const Sample& sample : samples())
    names += (names.empty() ? std::string() : ",") + sample.name;
  return names;
}

std::string list_of_samples() {
  std::string list = "NAME is one of\n";
  for (const Sample& sample : samples())
    list += fmt::format("  {:<14} {}\n", sample.name, sample.description);
  return list + "\nExample: ist sample bolt -o bolt.obj";
}

}  // namespace

void add_sample(CLI::App& app) {
  const auto options = std::make_shared<SampleOptions>();
  CLI::App* const command = app.add_subcommand("sample", "Write a generated closed mesh");
  command->add_option("NAME", options->name, "Name of the mesh, see below")
      ->required()
      ->type_name("TEXT:{" + names_of_samples() + "}");
  add_output(command, options->output, "The mesh file to write: .obj, .ply, .off or .stl",
             Dash::refused);
  command->footer(list_of_samples());
  command->callback([options] { write_mesh(make_sample(options->name), options->output); });
}

}  // namespace ist::app
