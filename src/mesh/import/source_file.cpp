#include "mesh/import/source_file.h"

#include <ist/types.h>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace ist {
namespace {

struct Signature {
  std::string_view start;
  std::string_view meaning;
};

using namespace std::string_view_literals;
constexpr std::array kForeign{
    Signature{"\x89PNG"sv, "a PNG image"},
    Signature{"\xff\xd8\xff"sv, "a JPEG image"},
    Signature{"GIF8"sv, "a GIF image"},
    Signature{"%PDF"sv, "a PDF document"},
    Signature{"\x1f\x8b"sv, "a gzip archive: unpack it first"},
    Signature{"version https://git-lfs"sv,
              "a Git LFS pointer, not the mesh itself: fetch it with `git lfs pull`"},
};

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// The first bytes of a mesh format, and its name.
struct MeshSignature {
  std::string_view start, meaning, endings;
};

constexpr std::array kMeshes{
    MeshSignature{"glTF"sv, "a binary glTF (.glb)", ".glb .gltf"},
    MeshSignature{"solid "sv, "STL", ".stl"},
    MeshSignature{"OFF\n"sv, "OFF", ".off"},
    MeshSignature{"ply\n"sv, "PLY", ".ply"},
    MeshSignature{"ply\r"sv, "PLY", ".ply"},
    MeshSignature{"Kaydara FBX Binary"sv, "FBX", ".fbx"},
    MeshSignature{"PK\x03\x04"sv, "a ZIP archive", ".3mf .zae .usdz .zip"},
    MeshSignature{"#usda "sv, "USD, which is not supported", ".usd .usda"},
    MeshSignature{"PXR-USDC"sv, "USD, which is not supported", ".usd .usdc"},
    MeshSignature{"ISO-10303-21;"sv, "STEP, which is not supported", ".step .stp .ifc"},
    MeshSignature{"\xff\xfe"sv, "text in UTF-16, not UTF-8", ""},
    MeshSignature{"\xfe\xff"sv, "text in UTF-16, not UTF-8", ""},
};
constexpr std::string_view kOurEndings = ".obj .stl .ply .off .glb .gltf .dae .vdb";

bool looks_like_web_page(std::string_view bytes) {
  const std::string start = lower_case(std::string(bytes.substr(0, 512)));
  const auto first = start.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first == std::string::npos || start[first] != '<') return false;
  return start.find("<html") != std::string::npos || start.find("<!doctype html") == first;
}

}  // namespace

std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  return text.starts_with(kByteOrderMark) ? text.substr(kByteOrderMark.size()) : text;
}

SourceFile read_source_file(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw Error(path + ": no such file. Check the path");
  if (std::filesystem::is_directory(path, error))
    throw Error(path + ": is a folder. Name a mesh file in it");
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  if (!stream) throw Error(path + ": cannot be opened. Check its permissions");
  const std::streamoff size = stream.tellg();
  if (size == 0) throw Error(path + ": empty file");
  SourceFile file{path, {}};
  if (size > 0) {
    file.bytes.resize(static_cast<std::size_t>(size));
    stream.seekg(0);
    stream.read(file.bytes.data(), size);
  }
  if (size < 0 || !stream) throw Error(path + ": cannot be read");
  return file;
}

void refuse_other_content(const SourceFile& file) {
  const std::string_view bytes = file.bytes;
  for (const Signature& foreign : kForeign)
    if (bytes.substr(0, foreign.start.size()) == foreign.start)
      fail(file, "is " + std::string(foreign.meaning));
  if (looks_like_web_page(bytes))
    fail(file, "is a web page, perhaps a saved error message: download the file again");
}

void refuse_other_format(const SourceFile& file) {
  const std::string ending = ending_of(file.path);
  if (kOurEndings.find(ending) == std::string_view::npos) return;
  for (const MeshSignature& mesh : kMeshes)
    if (std::string_view(file.bytes).starts_with(mesh.start) &&
        mesh.endings.find(ending) == std::string_view::npos)
      fail(file, "is named " + ending + " and holds " + std::string(mesh.meaning) +
                     (mesh.endings.empty() ? ". Save it as UTF-8"
                                           : ". Give it the ending of its format, or convert it"));
}

void fail(const SourceFile& file, const std::string& what) { throw Error(file.path + ": " + what); }

void fail_at_line(const SourceFile& file, std::size_t line, const std::string& what) {
  fail(file, "line " + std::to_string(line) + ": " + what);
}

std::string ending_of(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string());
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text = "\"";
  for (const char c : word.substr(0, kLongest)) text += (c >= ' ' && c <= '~') ? c : '?';
  return text + (word.size() > kLongest ? "…\"" : "\"");
}

std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool escaped = uri[i] == '%' && i + 2 < uri.size() &&
                         std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
                         std::isxdigit(static_cast<unsigned char>(uri[i + 2]));
    text += escaped ? static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16)) : uri[i];
    if (escaped) i += 2;
  }
  return text;
}

}  // namespace ist
