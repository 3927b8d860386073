#include "app/device_option.h"

#include <spdlog/spdlog.h>

#include <ist/error.h>
#include <ist/gpu.h>

namespace ist::app {

void add_device_option(CLI::App* command, std::string& name, const std::string& help) {
  command->add_option("--device", name, help)
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
}

Device usable_device(const std::string& name) {
  if (name == "cpu") return Device::cpu;
  if (name == "auto") return Device::automatic;
  std::string why;
  if (!gpu_available(0, &why)) throw Error("--device cuda: " + why + "; --device cpu needs no GPU");
  return Device::cuda;
}

void announce_device(Device device) {
  if (device != Device::automatic) return;
  std::string why;
  if (gpu_available(0, &why))
    spdlog::info("baking on the GPU: {}", gpu_info().name);
  else
    spdlog::info("baking on the CPU: {}", why);
}

}  // namespace ist::app
