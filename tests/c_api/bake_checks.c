/* A bake from vertices, and a contact law on what it made. */
#include <ist/c_bake.h>
#include <math.h>
#include <stdlib.h>

#include "checks.h"
#include "scene.h"

static const double kVertices[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,
                                   0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
static const uint32_t kTriangles[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                      1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};

static int small_cube_sinks_into_cube(const ist_asset_t* tree) {
  ist_placed_t a = {.size = sizeof a, .asset = tree, .pose = {.q = {1}}};
  ist_placed_t b = {
      .size = sizeof b, .asset = tree, .pose = {.q = {1}, .t = {0.25, 0.25, 0.9}}, .scale = 0.5};
  ist_contact_settings_t settings = {.size = sizeof settings, .measure = IST_EXACT};
  ist_contact_patch_t storage[1];
  ist_contact_patches_t patches = {.size = sizeof patches, .patch_size = sizeof storage[0]};
  ist_penetration_t whole = {.size = sizeof whole};
  ist_contact_law_t law = {
      .size = sizeof law, .stiffness = 50, .friction = 0.5, .friction_stiffness = 10};
  ist_contact_force_t force = {.size = sizeof force};
  ist_contact_memory_t memory = {0}, before;
  ist_workspace_t workspace = {0};
  const ist_motion_t sideways = {.velocity = {1, 0, 0}};
  patches.patches = storage;
  patches.capacity = 1;
  CHECK(ist_workspace_make(1 << 12, NULL, &workspace) == IST_OK);
  CHECK(ist_contact_patches(&a, &b, &settings, &workspace, &patches, &whole) == IST_OK);
  CHECK(fabs(whole.volume - 0.025) < 1e-12 && patches.count == 1);
  CHECK(ist_contact_force(&law, storage, patches.count, &a, &b, NULL, NULL, 1e-3, &memory,
                          &force) == IST_OK);
  CHECK(fabs(force.force[2] - 1.25) < 1e-9 && fabs(force.normal_force - 1.25) < 1e-9);
  CHECK(fabs(force.energy - 0.0625) < 1e-9 && memory.count == patches.count);
  CHECK(ist_contact_force(&law, storage, patches.count, &a, &b, NULL, &sideways, 1e-3, &memory,
                          &force) == IST_OK);
  CHECK(fabs(force.force[0] + 0.0025) < 1e-9); /* 10 · 0.001 · 0.25 */
  before = memory;
  law.stiffness = 0;
  CHECK(ist_contact_force(&law, storage, patches.count, &a, &b, NULL, NULL, 1e-3, &memory,
                          &force) == IST_INVALID_INPUT);
  law.stiffness = 50;
  CHECK(ist_contact_force(&law, storage, patches.count, &a, &b, NULL, NULL, NAN, &memory, &force) ==
        IST_INVALID_INPUT);
  CHECK(force.force[0] == 0 && memcmp(&before, &memory, sizeof memory) == 0);
  CHECK(ist_contact_force(&law, NULL, 1, &a, &b, NULL, NULL, 0, &memory, &force) ==
        IST_NULL_POINTER);
  CHECK(ist_contact_force(&law, storage, patches.count, &a, NULL, NULL, NULL, 0, &memory, &force) ==
        IST_NULL_POINTER);
  CHECK(ist_contact_force(NULL, storage, patches.count, &a, &b, NULL, NULL, 0, &memory, &force) ==
        IST_NULL_POINTER);
  law.size = 1;
  CHECK(ist_contact_force(&law, storage, patches.count, &a, &b, NULL, NULL, 0, &memory, &force) ==
        IST_WRONG_SIZE);
  return ist_workspace_release(&workspace) != IST_OK;
}

int c_bake_checks(void) {
  ist_asset_t tree = {0};
  ist_asset_info_t info = {.size = sizeof info};
  ist_bake_settings_t settings = {.size = sizeof settings, .spheres = 200};
  char message[300];
  CHECK(ist_bake(kVertices, 8, kTriangles, 12, &settings, &tree, message, sizeof message) ==
        IST_OK);
  CHECK(message[0] == 0 && ist_asset_get_info(&tree, &info) == IST_OK);
  CHECK(info.spheres == 200 && fabs(info.volume - 1) < 1e-12 && info.mesh_triangles == 12);
  if (small_cube_sinks_into_cube(&tree)) return 1;
  CHECK(ist_asset_release(&tree) == IST_OK);

  settings.mesh_only = 1;
  CHECK(ist_bake(kVertices, 8, kTriangles, 12, &settings, &tree, NULL, 0) == IST_OK);
  CHECK(ist_asset_get_info(&tree, &info) == IST_OK && info.spheres == 0 &&
        info.mesh_triangles == 12);
  CHECK(ist_asset_release(&tree) == IST_OK);

  /* Open, without vertices, of wrong sizes. */
  CHECK(ist_bake(kVertices, 8, kTriangles, 11, NULL, &tree, message, sizeof message) ==
        IST_NOT_BAKED);
  CHECK(strstr(message, "boundary") != NULL && strstr(message, "repair = 1") != NULL);
  CHECK(ist_asset_get_info(&tree, &info) == IST_NO_HANDLE);
  settings.repair = 1;
  CHECK(ist_bake(kVertices, 8, kTriangles, 11, &settings, &tree, NULL, 0) == IST_OK);
  CHECK(ist_asset_get_info(&tree, &info) == IST_OK && fabs(info.volume - 1) < 1e-12);
  CHECK(ist_asset_release(&tree) == IST_OK);
  CHECK(ist_bake(kVertices, 7, kTriangles, 12, NULL, &tree, message, 8) == IST_NOT_BAKED);
  CHECK(strlen(message) == 7);
  CHECK(ist_bake(kVertices, 0, kTriangles, 0, NULL, &tree, message, sizeof message) ==
        IST_NOT_BAKED);
  CHECK(ist_bake(NULL, 8, kTriangles, 12, NULL, &tree, NULL, 0) == IST_NULL_POINTER);
  CHECK(ist_bake(kVertices, 8, kTriangles, 12, NULL, NULL, NULL, 0) == IST_NULL_POINTER);
  settings.size = 0;
  CHECK(ist_bake(kVertices, 8, kTriangles, 12, &settings, &tree, NULL, 0) == IST_WRONG_SIZE);
  return 0;
}
