// The main() of a fuzz target that is built without libFuzzer: the target takes every file of a
// folder and seeded damages of each, the same ones on every run. A finding ends the program by an
// abort or a sanitizer's report. `./dev test` runs it under the sanitizers.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "support/damage.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr int kDamages = 12000;  // of each file

void feed(const std::string& bytes) {
  // On the heap and no larger, so that the address sanitizer detects reads beyond its end.
  const std::vector<std::uint8_t> input(bytes.begin(), bytes.end());
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER\n";
    return 2;
  }
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1]))
    paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const std::filesystem::path& path : paths) {
    std::cout << path.filename().string() << std::endl;  // the last one named is to blame
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    feed(bytes);
    std::mt19937_64 random(1);
    for (int i = 0; i < kDamages; ++i) feed(ist::testing::damaged(bytes, random));
  }
  return paths.empty() ? 1 : 0;
}
