#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <system_error>

#include <ist/error.h>
#include <ist/version.h>

#include "app/commands.h"
#include "app/help_format.h"
#include "app/interrupt.h"
#include "app/suggestion.h"

int main(int argc, char** argv) {
  using namespace ist::app;
  install_interrupt_handler();
  // https://no-color.org
  const char* const no_color = std::getenv("NO_COLOR");
  spdlog::set_default_logger(spdlog::stderr_color_mt("ist", no_color != nullptr && *no_color != '\0'
                                                                ? spdlog::color_mode::never
                                                                : spdlog::color_mode::automatic));
  spdlog::set_pattern("ist: %^%l%$: %v");
  CLI::App app(
      "Sphere packings, inner sphere trees and overlap volumes of two solids.\n"
      "Lengths are in [u], the mesh's own unit.",
      "ist");
  app.formatter(std::make_shared<HelpFormat>());
  app.set_version_flag("--version", "ist " IST_VERSION_STRING);
  app.footer(
      "Exit codes: 0 success, 1 error, 2 wrong usage, 3 check found a violation, 130 interrupted.");
  add_bake(app);
  add_cache(app);
  add_summary(app);
  add_query(app);
  add_info(app);
  add_check(app);
  add_export(app);
  add_medial(app);
  add_sample(app);
  add_spheres(app);
  add_reference(app);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) throw CLI::RequiredError("A subcommand");
    // A full disk may show only here.
    if (std::fflush(stdout) != 0)
      throw ist::Error("standard output: cannot write: " + std::generic_category().message(errno));
    return 0;
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) return 0;
    if (const std::string meant = suggestion(app, {argv + 1, argv + argc}); !meant.empty())
      std::fprintf(stderr, "Did you mean '%s'?\n", meant.c_str());
    return kExitUsage;
  } catch (const ExitCode& code) {
    return code.value;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kExitError;
  }
}
