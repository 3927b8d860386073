#include <ist/mesh.h>
#include <ist/types.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "mesh/mesh_files.h"

// A file of one format ends in a mesh or in an Error that begins with its name; what becomes a
// small mesh is closed, or refused, likewise. One in sixteen may be repaired: judging what a repair
// makes takes longer than all else.

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
    unsigned sum = 0;
    for (std::size_t i = 0; i < size; ++i) sum += data[i];
    const ist::ClosedMesh closed =
        ist::close_mesh(std::move(mesh), name,
                        sum % 16 == 0 ? ist::OpenMeshPolicy::repair : ist::OpenMeshPolicy::refuse);
    if (!(closed.report.volume > 0)) std::abort();
  } catch (const ist::Error& error) {
    if (std::string(error.what()).rfind(name + ": ", 0) != 0) std::abort();
  }
  return 0;
}
