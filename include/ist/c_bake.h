#ifndef IST_C_BAKE_H
#define IST_C_BAKE_H

/* Bakes in C11: bake.h. Links ist::ist; the rules are those of c.h. */

#include <ist/c.h>

#ifdef __cplusplus
extern "C" {
#endif
#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif

/* A null pointer means the defaults, all 0 except `size`. */
typedef struct ist_bake_settings {
  uint32_t size;
  uint32_t threads;   /* 0: all cores; never changes the asset */
  uint64_t spheres;   /* count; 0: 10,000 */
  uint32_t mesh_only; /* not 0: no spheres; the asset serves the exact measure alone */
  uint32_t repair;    /* not 0: an open mesh is closed, as by OpenMeshPolicy::repair */
} ist_bake_settings_t;

/* Makes the asset of a closed mesh. `asset` owns it: release it with ist_asset_release().
 * `vertices`: [3 · vertex_count] [u]; `triangles`: [3 · triangle_count] vertices, counter-clockwise
 * seen from outside.
 * `message`: [message_size] receives a sentence, cut to fit, where the status is IST_NOT_BAKED: an
 * open mesh, a vertex index or a setting out of range. May be null.
 * Allocates, takes seconds, and uses many threads. */
ist_status_t ist_bake(const double* vertices, size_t vertex_count, const uint32_t* triangles,
                      size_t triangle_count, const ist_bake_settings_t* settings,
                      ist_asset_t* asset, char* message, size_t message_size);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif
#ifdef __cplusplus
}
#endif

#endif
