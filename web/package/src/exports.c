/* The C functions for JavaScript: assets, shapes, and queries of two. */
#include <stdlib.h>
#include <string.h>

#include "desk.h"

desk_t desk = {
    .settings = {.size = sizeof desk.settings},
    .penetration = {.size = sizeof desk.penetration},
    .separation = {.size = sizeof desk.separation},
    .info = {.size = sizeof desk.info},
    .bounds = {.size = sizeof desk.bounds},
    .mass = {.size = sizeof desk.mass},
    .impact_settings = {.size = sizeof desk.impact_settings},
    .impact = {.size = sizeof desk.impact},
    .fit = {.size = sizeof desk.fit},
    .wrenches = {.size = sizeof desk.wrenches},
};

/* The addresses of the desk's parts, in the order of src/desk.js. */
EXPORT(places) const void* const* places(void) {
  static const void* const all[] = {
      &desk.a,     &desk.b,        &desk.settings, &desk.penetration,     &desk.separation,
      &desk.info,  &desk.bounds,   &desk.mass,     &desk.impact_settings, &desk.impact,
      &desk.fit,   &desk.wrenches, &desk.motion_a, &desk.motion_b,        desk.patches,
      desk.counts, desk.numbers};
  return all;
}

EXPORT(start) ist_status_t start(void) { return ist_workspace_make(0, NULL, &desk.workspace); }

/* On a 64-byte boundary; null if there is none. */
EXPORT(take) void* take(size_t bytes) {
  const size_t whole = (bytes + 63) / 64 * 64;
  return whole < bytes ? NULL : aligned_alloc(64, whole);
}
EXPORT(give) void give(void* memory) { free(memory); }

EXPORT(describe) const char* describe(ist_status_t status) { return ist_describe(status); }
EXPORT(version) uint32_t version(void) { return ist_version(); }

/* --- Trees and shapes ------------------------------------------------------------------------- */

/* `block`: a handle, followed at the next 64-byte boundary by an asset of `size` bytes. */
EXPORT(tree) ist_status_t tree(void* block, size_t size) {
  _Static_assert(sizeof(ist_asset_t) == 64, "handle");
  return ist_asset_view((char*)block + sizeof(ist_asset_t), size, (ist_asset_t*)block);
}

EXPORT(info) ist_status_t info(const ist_asset_t* tree) {
  ist_status_t status = ist_asset_get_info(tree, &desk.info);
  if (status == IST_OK) status = ist_asset_get_bounds(tree, &desk.bounds);
  return status == IST_OK ? ist_asset_get_mass_properties(tree, &desk.mass) : status;
}

/* The number of balls goes to counts[0]. */
EXPORT(balls)
ist_status_t balls(const ist_asset_t* tree, ist_measure_t measure, uint32_t detail, uint32_t level,
                   ist_ball_t* room, size_t capacity) {
  const ist_ball_set_t set = {
      .size = sizeof set, .measure = measure, .detail = detail, .level = level};
  size_t count;
  const ist_status_t status = ist_asset_get_balls(tree, &set, room, capacity, &count);
  desk.counts[0] = (uint32_t)count;
  return status;
}

/* The numbers of vertices and triangles go to counts. */
EXPORT(mesh)
ist_status_t mesh(const ist_asset_t* tree, double (*vertices)[3], size_t vertex_capacity,
                     uint32_t (*triangles)[3], size_t triangle_capacity) {
  ist_mesh_t all = {.size = sizeof all,
                       .vertices = vertices,
                       .triangles = triangles,
                       .vertex_capacity = vertex_capacity,
                       .triangle_capacity = triangle_capacity};
  const ist_status_t status = ist_asset_get_mesh(tree, &all);
  desk.counts[0] = (uint32_t)all.vertex_count;
  desk.counts[1] = (uint32_t)all.triangle_count;
  return status;
}

/* A shape of the eight numbers of place A; null if there is no memory. `data`: heights or
 * distances. `columns`, `rows`, `layers`: of data. */
EXPORT(field)
ist_shape_t* field(ist_shape_kind_t kind, const void* data, uint32_t columns, uint32_t rows,
                   uint32_t layers) {
  const double* const numbers = (const double*)&desk.a;
  ist_shape_t* const made = calloc(1, sizeof *made);
  if (made == NULL) return NULL;
  made->size = sizeof *made;
  made->kind = kind;
  switch (kind) {
    case IST_HEIGHTS:
      made->as.heights.heights = data;
      made->as.heights.columns = columns;
      made->as.heights.rows = rows;
      memcpy(made->as.heights.spacing, numbers, 4 * sizeof *numbers); /* lowest, highest too */
      break;
    case IST_DISTANCE_GRID:
      made->as.distance_grid.distances = data;
      made->as.distance_grid.points[0] = columns;
      made->as.distance_grid.points[1] = rows;
      made->as.distance_grid.points[2] = layers;
      memcpy(made->as.distance_grid.origin, numbers, 5 * sizeof *numbers); /* spacing, error too */
      break;
    default: /* at most four numbers, in the order of the header */
      memcpy(&made->as, numbers, 4 * sizeof *numbers);
  }
  return made;
}
_Static_assert(offsetof(ist_shape_t, as.heights.highest) ==
                   offsetof(ist_shape_t, as.heights.spacing) + 3 * sizeof(double),
               "heights");
_Static_assert(offsetof(ist_shape_t, as.distance_grid.error) ==
                   offsetof(ist_shape_t, as.distance_grid.origin) + 4 * sizeof(double),
               "grid");

/* --- Queries ---------------------------------------------------------------------------------- */

EXPORT(penetration) ist_status_t penetration(solid_t a, solid_t b) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  return ist_penetration(&first, &second, &desk.settings, &desk.workspace, &desk.penetration);
}

/* numbers[0]: the largest relevant distance, 0: any. */
EXPORT(separation) ist_status_t separation(solid_t a, solid_t b, uint32_t inner_spheres) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  const ist_separation_settings_t settings = {.size = sizeof settings,
                                              .max_visits = desk.settings.max_visits,
                                              .inner_spheres = inner_spheres,
                                              .max_distance = desk.numbers[0],
                                              .pair_id = desk.settings.pair_id};
  return ist_separation(&first, &second, &settings, &desk.workspace, &desk.separation);
}

/* The number of patches goes to counts[0]. */
EXPORT(contact_patches) ist_status_t contact_patches(solid_t a, solid_t b, uint32_t most) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  ist_contact_patches_t found = {.size = sizeof found,
                                 .patch_size = sizeof desk.patches[0],
                                 .patches = desk.patches,
                                 .capacity = most < kMostPatches ? most : kMostPatches};
  const ist_status_t status = ist_contact_patches(&first, &second, &desk.settings, &desk.workspace,
                                                  &found, &desk.penetration);
  desk.counts[0] = (uint32_t)found.count;
  return status;
}

/* The numbers of patches and of all segments go to counts. */
EXPORT(overlap_outline)
ist_status_t overlap_outline(solid_t a, solid_t b, uint32_t most, ist_outline_segment_t* room,
                             size_t capacity) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  ist_contact_patches_t found = {sizeof found, sizeof desk.patches[0], desk.patches, most, 0};
  ist_outline_t outline = {
      .size = sizeof outline, .segment_size = sizeof *room, .segments = room, .capacity = capacity};
  const ist_status_t status = ist_overlap_outline(&first, &second, &desk.settings, &desk.workspace,
                                                  &found, &outline, &desk.penetration);
  desk.counts[0] = (uint32_t)found.count;
  desk.counts[1] = (uint32_t)outline.total;
  return status;
}

/* 0, 1, 2 as ist_yes_no_t, or an error. */
EXPORT(overlap) int32_t overlap(solid_t a, solid_t b) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  ist_yes_no_t answer;
  const ist_status_t status = ist_overlap(&first, &second, &desk.workspace, &answer);
  return status < 0 ? status : answer;
}

/* The numbers of all and of written ones go to counts. */
EXPORT(lenses)
ist_status_t lenses(solid_t a, solid_t b, uint32_t detail_a, uint32_t detail_b, ist_lens_t* room,
                    size_t capacity) {
  const ist_placed_t first = placed(a, &desk.a), second = placed(b, &desk.b);
  const ist_lens_settings_t settings = {sizeof settings, desk.settings.measure, detail_a, detail_b};
  ist_lenses_t found = {
      .size = sizeof found, .lens_size = sizeof *room, .lenses = room, .capacity = capacity};
  const ist_status_t status = ist_overlap_lenses(&first, &second, &settings, &found);
  desk.counts[0] = (uint32_t)found.total;
  desk.counts[1] = (uint32_t)found.count;
  return status;
}
