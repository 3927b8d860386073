#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/c_bake.h>
#include <ist/mesh.h>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <utility>

#include "c_api/handles.h"
#include "query/base/hooked_memory.h"

using namespace ist;

ist_status_t ist_bake(const double* vertices, std::size_t vertex_count,
                      const std::uint32_t* triangles, std::size_t triangle_count,
                      const ist_bake_settings_t* settings, ist_asset_t* out, char* message,
                      std::size_t message_size) {
  if (out == nullptr) return IST_NULL_POINTER;
  *out = {};
  if (message != nullptr && message_size > 0) *message = 0;
  if ((vertices == nullptr && vertex_count > 0) || (triangles == nullptr && triangle_count > 0))
    return IST_NULL_POINTER;
  if (settings != nullptr && settings->size != sizeof *settings) return IST_WRONG_SIZE;
  const ist_bake_settings_t wanted = settings != nullptr ? *settings : ist_bake_settings_t{};
  try {
    TriangleMesh mesh;
    for (std::size_t i = 0; i < vertex_count; ++i) mesh.vertices.emplace_back(vertices + 3 * i);
    for (std::size_t i = 0; i < triangle_count; ++i)
      mesh.triangles.push_back({triangles[3 * i], triangles[3 * i + 1], triangles[3 * i + 2]});
    const ClosedMesh closed =
        close_mesh(std::move(mesh), "the mesh",
                   wanted.repair != 0 ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
    PackingSettings packing;
    packing.threads = wanted.threads;
    if (wanted.spheres > 0) packing.max_spheres = wanted.spheres;
    const Asset asset =
        wanted.mesh_only != 0 ? bake_mesh_only(closed, wanted.threads) : bake(closed, packing);
    const std::size_t size = asset.bytes().size();
    HookedArray<std::byte> bytes = {static_cast<std::byte*>(take_memory({}, size, kAssetAlignment)),
                                    {{}, size, kAssetAlignment}};
    std::memcpy(bytes.get(), asset.bytes().data(), size);
    const ist_status_t status = ist_asset_view(bytes.get(), size, out);
    if (status != IST_OK) return status;
    c_api::AssetHandle& handle = c_api::AssetHandle::in(*out);
    handle.size = size;
    handle.bytes = bytes.release();
    return IST_OK;
  } catch (const std::bad_alloc&) {
    return IST_NO_MEMORY;
  } catch (const std::exception& error) {
    if (message != nullptr) std::snprintf(message, message_size, "%s", error.what());
    return IST_NOT_BAKED;
  }
}
