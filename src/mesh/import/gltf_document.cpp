#include "mesh/import/gltf_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

namespace ist {
namespace {

std::uint32_t word_at(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

template <std::size_t Count>
bool starts_with_any(std::string_view text, const std::array<std::string_view, Count>& starts) {
  return std::any_of(starts.begin(), starts.end(),
                     [&](std::string_view start) { return text.starts_with(start); });
}

/// Extensions that change the appearance of a surface, not its shape; and those that are supported:
/// integer coordinates and instances.
bool is_harmless(std::string_view extension) {
  constexpr std::array<std::string_view, 6> kHarmless{
      "KHR_mesh_quantization", "EXT_mesh_gpu_instancing",
      "KHR_materials_",        "KHR_texture_",
      "EXT_texture_",          "KHR_lights_"};
  return starts_with_any(extension, kHarmless);
}

/// Unless it is required, the file contains the same numbers uncompressed.
bool is_compression(std::string_view extension) {
  constexpr std::array<std::string_view, 3> kCompressions{
      "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"};
  return starts_with_any(extension, kCompressions);
}

std::optional<std::string> decode_base64(std::string_view text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::size_t value = kDigits.find(c);
    if (value == std::string_view::npos) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 0xff);
  }
  return bytes;
}

struct ComponentType {
  std::size_t code, bytes;
  double largest;  ///< the integer that represents 1.0, if normalized
  double (*read)(const char*);
};

template <class T>
double read_as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

template <class T>
constexpr ComponentType component(std::size_t code) {
  return {code, sizeof(T), static_cast<double>(std::numeric_limits<T>::max()), read_as<T>};
}

constexpr std::array<ComponentType, 6> kComponentTypes = {
    component<std::int8_t>(5120),   component<std::uint8_t>(5121),  component<std::int16_t>(5122),
    component<std::uint16_t>(5123), component<std::uint32_t>(5125), {5126, 4, 1, read_as<float>}};

std::size_t width_of(std::string_view type) {
  return type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
}

}  // namespace

GltfDocument::GltfDocument(const SourceFile& file) : file_(file) {
  const std::string_view text = parse_container();
  root_ = Json::parse(text.begin(), text.end());
  if (!root_.is_object()) fail("its JSON is not an object");
  const std::string version = root_.at("asset").at("version");
  if (version.substr(0, 2) != "2.")
    fail("glTF version " + in_quotes(version) + " is not supported. Export it as version 2.0");
  check_extensions();
  load_buffers();
}

std::vector<std::string> GltfDocument::files() const {
  std::vector<std::string> paths;
  for (const auto& [path, bytes] : files_) paths.push_back(path);
  return paths;
}

void GltfDocument::fail(const std::string& what) const { ist::fail(file_, what); }

std::string_view GltfDocument::parse_container() {
  std::string_view bytes = file_.bytes;
  if (bytes.substr(0, 4) != "glTF") return bytes;
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
  if (bytes.size() < kHeader + kChunkHeader)
    fail("the file ends early: " + std::to_string(bytes.size()) + " bytes are too few for a glTF");
  if (word_at(bytes, 4) != 2)
    fail("version " + std::to_string(word_at(bytes, 4)) +
         " of the glTF container is not supported. Export it as version 2.0");
  const std::size_t length = word_at(bytes, 8);
  if (length > bytes.size())
    fail("the file ends early: it announces " + std::to_string(length) + " bytes, here are " +
         std::to_string(bytes.size()));
  if (length < kHeader + kChunkHeader)
    fail("its header announces " + std::to_string(length) + " bytes, which are too few for a glTF");
  bytes = bytes.substr(0, length);
  std::optional<std::string_view> json;
  for (std::size_t at = kHeader; bytes.size() - at >= kChunkHeader;) {
    const std::size_t size = word_at(bytes, at);
    const std::uint32_t type = word_at(bytes, at + 4);
    at += kChunkHeader;
    if (size > bytes.size() - at)
      fail("byte " + std::to_string(at - kChunkHeader) + ": a chunk of " + std::to_string(size) +
           " bytes in a file that has " + std::to_string(bytes.size() - at) + " left");
    if (!json && type != kJson) fail("its first chunk is not JSON");
    if (!json)
      json = bytes.substr(at, size);
    else if (type == kBinary && !binary_chunk_)
      binary_chunk_ = bytes.substr(at, size);
    at += size;
  }
  if (!json) fail("contains no JSON chunk");
  return *json;
}

void GltfDocument::check_extensions() const {
  if (!root_.contains("extensionsRequired")) return;
  for (const Json& entry : root_.at("extensionsRequired")) {
    const std::string name = entry;
    if (!is_harmless(name))
      fail("requires the extension " + in_quotes(name) +
           ", which is not supported. Export it without (no compression)");
  }
}

std::vector<std::string> GltfDocument::unread_extensions() const {
  std::vector<std::string> unread;
  for (const Json& entry : root_.value("extensionsUsed", Json::array()))
    if (std::string name = entry; !is_harmless(name) && !is_compression(name))
      unread.push_back(std::move(name));
  return unread;
}

void GltfDocument::load_buffers() {
  if (!root_.contains("buffers")) return;
  const std::size_t count = root_.at("buffers").size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = "buffer " + std::to_string(i);
    const Json& buffer = at("buffers", i, name);
    std::string_view bytes;
    if (buffer.contains("uri")) {
      bytes = external_buffer(buffer.at("uri"), name);
    } else {
      if (i != 0 || !binary_chunk_) fail(name + " has no data: no uri, and no binary chunk");
      bytes = *binary_chunk_;
    }
    const std::size_t length = whole(buffer, "byteLength");
    if (length > bytes.size())
      fail(name + " ends early: it announces " + std::to_string(length) + " bytes, there are " +
           std::to_string(bytes.size()));
    buffers_.push_back(bytes.substr(0, length));
  }
}

std::string_view GltfDocument::external_buffer(const std::string& uri, const std::string& name) {
  if (uri.substr(0, 5) == "data:") {
    const std::size_t comma = uri.find(";base64,");
    auto bytes = comma == std::string::npos
                     ? std::nullopt
                     : decode_base64(std::string_view(uri).substr(comma + 8));
    if (!bytes) fail(name + " is a data URI that is not base64");
    return decoded_.emplace_back(std::move(*bytes));
  }
  const std::filesystem::path relative = percent_decoded(uri);
  const bool leaves_folder =
      relative.is_absolute() || uri.find(':') != std::string::npos ||
      uri.find('\\') != std::string::npos || uri.find('\0') != std::string::npos ||
      std::any_of(relative.begin(), relative.end(), [](const auto& part) { return part == ".."; });
  if (leaves_folder)
    fail(name + " refers to " + in_quotes(uri) +
         ", outside its own folder: refused. Put the data beside it");
  const std::string path =
      (std::filesystem::path(file_.path).parent_path() / relative).lexically_normal().string();
  const auto found = files_.find(path);
  if (found != files_.end()) return found->second;
  return files_.emplace(path, read_source_file(path).bytes).first->second;
}

const GltfDocument::Json& GltfDocument::at(const std::string& name, std::size_t index,
                                           const std::string& from) const {
  const bool exists = root_.contains(name) && root_.at(name).is_array();
  const std::size_t count = exists ? root_.at(name).size() : 0;
  if (index >= count)
    fail(from + " refers to entry " + std::to_string(index) + " of " + in_quotes(name) +
         ", which has " + std::to_string(count));
  return root_.at(name)[index];
}

std::size_t GltfDocument::whole(const Json& object, const std::string& key,
                                const std::optional<std::size_t> fallback) const {
  const auto found = object.find(key);
  if (found == object.end() && fallback) return *fallback;
  if (found == object.end() || !found->is_number_unsigned())
    fail("expected a whole number ≥ 0 as " + in_quotes(key));
  return *found;
}

std::vector<std::size_t> GltfDocument::whole_list(const Json& object,
                                                  const std::string& key) const {
  std::vector<std::size_t> values;
  const auto found = object.find(key);
  if (found == object.end()) return values;
  for (const Json& value : *found) {
    if (!value.is_number_unsigned()) fail("expected whole numbers ≥ 0 in " + in_quotes(key));
    values.push_back(value);
  }
  return values;
}

double GltfDocument::real(const Json& value, const std::string& where) const {
  const double number = value.get<double>();
  if (!(std::abs(number) <= static_cast<double>(std::numeric_limits<float>::max())))
    fail(where + ": the number " + in_quotes(value.dump()) + " does not fit into float32");
  return number;
}

std::vector<double> GltfDocument::numbers(const Json& where, const Json& type_owner,
                                          std::string_view type, std::size_t count,
                                          const std::string& name) const {
  const std::size_t code = whole(type_owner, "componentType");
  const auto component = std::find_if(kComponentTypes.begin(), kComponentTypes.end(),
                                      [&](const auto& c) { return c.code == code; });
  if (component == kComponentTypes.end())
    fail(name + ": unknown componentType " + std::to_string(code));
  const std::size_t width = width_of(type);
  const std::size_t element = width * component->bytes;

  const Json& view = at("bufferViews", whole(where, "bufferView"), name);
  const std::size_t buffer = whole(view, "buffer");
  at("buffers", buffer, name);
  const std::size_t view_offset = whole(view, "byteOffset", 0);
  const std::size_t view_length = whole(view, "byteLength");
  const std::string_view bytes = buffers_[buffer];
  if (view_offset > bytes.size() || view_length > bytes.size() - view_offset)
    fail(name + ": its view lies outside of buffer " + std::to_string(buffer));
  const std::size_t stride = whole(view, "byteStride", element);
  if (stride < element || (view.contains("byteStride") && (stride % 4 != 0 || stride > 252)))
    fail(name + ": a byteStride of " + std::to_string(stride) + " for elements of " +
         std::to_string(element) + " bytes");
  const std::size_t offset = whole(where, "byteOffset", 0);
  if (count == 0 || offset > view_length || element > view_length - offset ||
      (view_length - offset - element) / stride < count - 1)
    fail(name + ": " + std::to_string(count) + " elements do not fit into its view of " +
         std::to_string(view_length) + " bytes");
  spend(width, count, name);

  const bool normalized = type_owner.value("normalized", false);
  std::vector<double> values(width * count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* const start = bytes.data() + view_offset + offset + i * stride;
    for (std::size_t k = 0; k < width; ++k) {
      const double value = component->read(start + k * component->bytes);
      values[width * i + k] = normalized ? std::max(value / component->largest, -1.0) : value;
    }
  }
  return values;
}

std::vector<double> GltfDocument::accessor(std::size_t index, std::string_view type,
                                           const std::string& from) const {
  const Json& accessor = at("accessors", index, from);
  const std::string name = "accessor " + std::to_string(index);
  const std::string stored_type = accessor.at("type");
  if (stored_type != type)
    fail(name + " is " + in_quotes(stored_type) + ", not " + in_quotes(type));
  const std::size_t count = whole(accessor, "count");
  const std::size_t width = width_of(type);
  std::vector<double> values;  // zeros where nothing is stored
  if (accessor.contains("bufferView")) {
    values = numbers(accessor, accessor, type, count, name);
  } else {
    // Adds no more zeros than the file has bytes: other attributes of the vertices take more.
    std::size_t stored = file_.bytes.size();
    for (const std::string_view buffer : buffers_) stored += buffer.size();
    if (count > stored) fail(name + ": " + std::to_string(count) + " elements without data");
    spend(width, count, name);
    values.resize(width * count);
  }
  if (!accessor.contains("sparse")) return values;
  const Json& patch = accessor.at("sparse");
  const std::size_t patched = whole(patch, "count");
  const Json &places = patch.at("indices"), &news = patch.at("values");
  const std::vector<double> at_place = numbers(places, places, "SCALAR", patched, name);
  const std::vector<double> replaced = numbers(news, accessor, type, patched, name);
  for (std::size_t i = 0; i < patched; ++i) {
    if (!(at_place[i] >= 0 && at_place[i] < static_cast<double>(count)) ||
        at_place[i] != std::floor(at_place[i]))
      fail(name + ": its sparse part names element " + std::to_string(at_place[i]) + " of " +
           std::to_string(count));
    std::copy_n(replaced.begin() + static_cast<std::ptrdiff_t>(width * i), width,
                values.begin() +
                    static_cast<std::ptrdiff_t>(width) * static_cast<std::ptrdiff_t>(at_place[i]));
  }
  return values;
}

void GltfDocument::spend(std::size_t width, std::size_t count, const std::string& name) const {
  const std::size_t most = 32 * most_corners();
  if (count > (most - numbers_read_) / width)
    fail(name + ": the file asks for more than " + std::to_string(most) +
         " numbers. Flatten or split the scene");
  numbers_read_ += width * count;
}

}  // namespace ist
