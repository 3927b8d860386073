#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include <ist/packing.h>

namespace ist::app {

/// Adds --device: auto, cpu or cuda.
void add_device_option(CLI::App* command, std::string& name, const std::string& help);

/// The device of that name. Throws Error if it is a GPU and there is none to be used.
Device usable_device(const std::string& name);

/// Says where a bake runs, if that was left open.
void announce_device(Device device);

}  // namespace ist::app
