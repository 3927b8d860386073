#include <ist/error.h>
#include <ist/mesh.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "mesh/import/read_mesh.h"

// A file of one format ends in a mesh or in an Error that begins with its name; what becomes a
// small mesh is closed, or refused, likewise.

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kSmall = 2000;  // triangles; closing takes longer than reading
  const std::string name = "fuzz." IST_FUZZ_ENDING;
  try {
    const ist::SourceFile file{name, {reinterpret_cast<const char*>(data), size}};
    ist::TriangleMesh mesh = ist::read_mesh(file, {});
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t v : triangle)
        if (v >= mesh.vertices.size() || !mesh.vertices[v].allFinite()) std::abort();
    if (mesh.triangles.size() > kSmall) return 0;
    const ist::ClosedMesh closed =
        ist::close_mesh(std::move(mesh), name, ist::OpenMeshPolicy::repair);
    if (!(closed.report.volume > 0)) std::abort();
  } catch (const ist::Error& error) {
    if (std::string(error.what()).rfind(name + ": ", 0) != 0) std::abort();
  }
  return 0;
}
