// check_glb FILE: checks that an animated .glb conforms to glTF 2.0, as far as the writer of
// examples/bullet uses it. Says what is wrong and exits 1.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

void expect(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

class Glb {
 public:
  explicit Glb(const char* path) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
    expect(bytes_.size() > 20 && std::memcmp(bytes_.data(), "glTF", 4) == 0, "no binary glTF");
    expect(word(4) == 2 && word(8) == bytes_.size(), "header");
    const std::size_t text = word(12);
    expect(text % 4 == 0 && std::memcmp(&bytes_[16], "JSON", 4) == 0, "first chunk");
    json = nlohmann::json::parse(bytes_.begin() + 20,
                                 bytes_.begin() + 20 + static_cast<std::ptrdiff_t>(text));
    data_ = 20 + text + 8;
    expect(std::memcmp(&bytes_[data_ - 4], "BIN\0", 4) == 0, "second chunk");
    expect(data_ + word(data_ - 8) == bytes_.size(), "length of the second chunk");
    expect(json.at("buffers").at(0).at("byteLength") <= word(data_ - 8), "buffer");
  }

  std::vector<float> accessor(std::size_t index) const {
    const auto& a = json.at("accessors").at(index);
    const auto& view = json.at("bufferViews").at(a.at("bufferView").get<std::size_t>());
    expect(a.at("componentType") == 5126, "floats");
    const std::string type = a.at("type");
    const std::size_t width = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : 4;
    const std::size_t count = a.at("count").get<std::size_t>() * width;
    expect(view.at("byteLength") == count * 4, "a view's length");
    const std::size_t at = view.at("byteOffset").get<std::size_t>();
    expect(at % 4 == 0 && data_ + at + count * 4 <= bytes_.size(), "a view's place");
    std::vector<float> out(count);
    std::memcpy(out.data(), &bytes_[data_ + at], count * 4);
    for (const float x : out) expect(std::isfinite(x), "a number that is none");
    return out;
  }

  nlohmann::json json;

 private:
  std::size_t word(std::size_t at) const {
    std::uint32_t w;
    std::memcpy(&w, &bytes_.at(at), 4);
    return w;
  }

  std::vector<char> bytes_;
  std::size_t data_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  expect(argc == 2, "usage: check_glb FILE");
  const Glb glb(argv[1]);
  expect(glb.json.at("asset").at("version") == "2.0", "version");
  const std::size_t nodes = glb.json.at("nodes").size();
  for (const auto& mesh : glb.json.at("meshes")) {
    const auto& attributes = mesh.at("primitives").at(0).at("attributes");
    const auto positions = glb.accessor(attributes.at("POSITION"));
    const auto normals = glb.accessor(attributes.at("NORMAL"));
    expect(!positions.empty() && positions.size() % 9 == 0, "triangles");
    expect(positions.size() == normals.size(), "a normal a corner");
  }
  for (const auto& child : glb.json.at("nodes").at(0).at("children")) expect(child < nodes, "node");
  const auto& animation = glb.json.at("animations").at(0);
  std::size_t moved = 0;
  for (const auto& channel : animation.at("channels")) {
    const auto& sampler = animation.at("samplers").at(channel.at("sampler").get<std::size_t>());
    const auto times = glb.accessor(sampler.at("input"));
    const auto values = glb.accessor(sampler.at("output"));
    for (std::size_t i = 1; i < times.size(); ++i) expect(times[i] > times[i - 1], "time runs on");
    const bool turns = channel.at("target").at("path") == "rotation";
    const std::size_t width = turns ? 4 : 3;
    expect(times.size() > 1 && values.size() == width * times.size(), "a value a time");
    for (std::size_t i = 0; turns && i < times.size(); ++i) {
      double square = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        square += static_cast<double>(values[4 * i + k]) * values[4 * i + k];
      }
      expect(std::abs(square - 1) < 1e-5, "unit quaternions");
    }
    expect(channel.at("target").at("node") < nodes, "a channel's node");
    ++moved;
  }
  expect(moved > 0, "nothing moves");
  std::printf("%s: %zu nodes, %zu channels\n", argv[1], nodes, moved);
} catch (const std::exception& error) {
  std::fprintf(stderr, "check_glb: %s\n", error.what());
  return 1;
}
