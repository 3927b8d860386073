/* Every function of ist/ist.h from C11, right and wrong. */
#include "checks.h"

#include <stdlib.h>

#include "scene.h"

/* --- Memory that is counted, and that runs out ------------------------------------------------ */

typedef struct counted {
  size_t taken, given_back, blocks, blocks_left;
  int misaligned;
} counted_t;

static void* take(void* context, size_t bytes, size_t alignment) {
  counted_t* counted = (counted_t*)context;
  void* memory;
  if (counted->blocks_left == 0 || bytes > (size_t)1 << 40) return NULL;
  --counted->blocks_left;
  memory = aligned_alloc(alignment < sizeof(void*) ? sizeof(void*) : alignment,
                         (bytes + 4095) / 4096 * 4096);
  counted->taken += bytes;
  ++counted->blocks;
  return memory;
}

static void give_back(void* context, void* memory, size_t bytes, size_t alignment) {
  counted_t* counted = (counted_t*)context;
  if ((uintptr_t)memory % alignment != 0) counted->misaligned = 1;
  counted->given_back += bytes;
  free(memory);
}

static int memory_is_the_callers(const char* path) {
  counted_t counted = {0};
  ist_allocator_t allocator = {.size = sizeof allocator, .allocate = take, .release = give_back};
  ist_asset_t tree = {0};
  ist_workspace_t workspace = {0};
  size_t left, needed;
  allocator.context = &counted;
  counted.blocks_left = 1000;
  CHECK(ist_asset_load(path, &allocator, &tree) == IST_OK);
  CHECK(counted.blocks == 1);
  CHECK(ist_workspace_make(1000, &allocator, &workspace) == IST_OK);
  CHECK(counted.blocks > 1);
  CHECK(ist_asset_release(&tree) == IST_OK);
  CHECK(ist_workspace_release(&workspace) == IST_OK);
  CHECK(counted.taken == counted.given_back && !counted.misaligned);

  needed = counted.blocks - 1;            /* by the workspace */
  for (left = 0; left < needed; ++left) { /* whichever block is the one too many */
    counted.blocks_left = left;
    CHECK(ist_workspace_make(1000, &allocator, &workspace) == IST_NO_MEMORY);
    CHECK(counted.taken == counted.given_back);
    CHECK(ist_workspace_release(&workspace) == IST_NO_HANDLE);
  }
  counted.blocks_left = 0;
  CHECK(ist_asset_load(path, &allocator, &tree) == IST_NO_MEMORY);
  CHECK(ist_asset_release(&tree) == IST_NO_HANDLE);
  CHECK(ist_workspace_make(SIZE_MAX, NULL, &workspace) == IST_NO_MEMORY);
  counted.blocks_left = 1000;
  CHECK(ist_workspace_make(SIZE_MAX / 16, &allocator, &workspace) == IST_NO_MEMORY);
  CHECK(counted.taken == counted.given_back);

  allocator.release = NULL;
  CHECK(ist_asset_load(path, &allocator, &tree) == IST_NULL_POINTER);
  CHECK(ist_workspace_make(0, &allocator, &workspace) == IST_NULL_POINTER);
  allocator.release = give_back;
  allocator.size = 0;
  CHECK(ist_asset_load(path, &allocator, &tree) == IST_WRONG_SIZE);
  CHECK(ist_workspace_make(0, &allocator, &workspace) == IST_WRONG_SIZE);
  return 0;
}

/* --- Trees ------------------------------------------------------------------------------------ */

static int trees_are_checked(const char* path) {
  ist_asset_t tree = {0}, copy;
  const ist_asset_t none = {0};
  ist_asset_info_t info = {.size = sizeof info};
  ist_predicted_errors_t errors = {.size = sizeof errors};
  char* block;
  char* bytes;
  size_t size;
  FILE* file = fopen(path, "rb");
  CHECK(file != NULL);
  block = malloc(1 << 24);
  CHECK(block != NULL);
  bytes = block + (64 - (uintptr_t)block % 64) % 64;
  size = fread(bytes, 1, (1 << 24) - 64, file);
  fclose(file);

  CHECK(ist_asset_view(bytes, size, &tree) == IST_OK);
  CHECK(ist_asset_get_info(&tree, &info) == IST_OK);
  CHECK(info.spheres > 0 && info.volume > 0 && info.coverage >= 0 && info.coverage <= 1);
  CHECK(info.mesh_triangles == 0 || info.mesh_state == IST_MESH_OWN);
  CHECK(ist_asset_get_predicted_errors(&tree, &errors) == IST_OK && errors.size == sizeof errors);
  CHECK(errors.poses == 0 && errors.target_met == 0 && errors.classes[0].median == 0);
  CHECK(ist_asset_get_predicted_errors(NULL, &errors) == IST_NULL_POINTER && errors.poses == 0);
  CHECK(ist_asset_get_predicted_errors(&none, &errors) == IST_NO_HANDLE);
  CHECK(ist_asset_get_predicted_errors(&tree, NULL) == IST_NULL_POINTER);
  errors.size = 8;
  CHECK(ist_asset_get_predicted_errors(&tree, &errors) == IST_WRONG_SIZE);
  copy = tree; /* it owns nothing */
  CHECK(ist_asset_release(&copy) == IST_OK && ist_asset_release(&copy) == IST_NO_HANDLE);
  CHECK(ist_asset_get_info(&copy, &info) == IST_NO_HANDLE && info.spheres == 0);
  CHECK(ist_asset_get_info(&tree, &info) == IST_OK);
  CHECK(ist_asset_get_info(NULL, &info) == IST_NULL_POINTER);
  CHECK(ist_asset_get_info(&tree, NULL) == IST_NULL_POINTER);
  info.size = 1;
  CHECK(ist_asset_get_info(&tree, &info) == IST_WRONG_SIZE);
  memset(&copy, 0xab, sizeof copy); /* never made */
  info.size = sizeof info;
  CHECK(ist_asset_get_info(&copy, &info) == IST_NO_HANDLE);
  CHECK(ist_asset_release(&copy) == IST_NO_HANDLE);

  CHECK(ist_asset_view(NULL, size, &tree) == IST_NULL_POINTER);
  CHECK(ist_asset_release(&tree) == IST_NO_HANDLE); /* a failure leaves it empty */
  CHECK(ist_asset_view(bytes, size, NULL) == IST_NULL_POINTER);
  CHECK(ist_asset_view(bytes + 1, size - 1, &tree) == IST_MISALIGNED);
  CHECK(ist_asset_view(bytes, 4, &tree) == IST_TOO_SHORT);
  CHECK(ist_asset_view(bytes, 0, &tree) == IST_TOO_SHORT);
  CHECK(ist_asset_view(bytes, size - 1, &tree) == IST_TOO_SHORT);
  CHECK(ist_asset_view(bytes, size + 1, &tree) == IST_CORRUPT_LAYOUT);
  bytes[size / 2] = (char)(bytes[size / 2] ^ 1);
  CHECK(ist_asset_view(bytes, size, &tree) == IST_CORRUPT_HASH);
  bytes[8] = (char)(bytes[8] ^ 64);
  CHECK(ist_asset_view(bytes, size, &tree) == IST_OTHER_FORMAT);
  bytes[0] = 'X';
  CHECK(ist_asset_view(bytes, size, &tree) == IST_NOT_AN_ASSET);
  CHECK(ist_asset_release(NULL) == IST_NULL_POINTER);
  free(block);

  CHECK(ist_asset_load(NULL, NULL, &tree) == IST_NULL_POINTER);
  CHECK(ist_asset_load(path, NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_asset_load("/nowhere/at/all.ist", NULL, &tree) == IST_CANNOT_READ);
  CHECK(ist_asset_load("/", NULL, &tree) == IST_CANNOT_READ);
  CHECK(ist_asset_load("/dev/null", NULL, &tree) < 0);
  CHECK(ist_asset_release(&tree) == IST_NO_HANDLE);
  return 0;
}

/* --- All of it -------------------------------------------------------------------------------- */

static int make_scene(scene_t* scene, const char* path_a, const char* path_b) {
  const ist_pose_t identity = IST_POSE_IDENTITY;
  memset(scene, 0, sizeof *scene);
  CHECK(ist_asset_load(path_a, NULL, &scene->tree_a) == IST_OK);
  CHECK(ist_asset_load(path_b, NULL, &scene->tree_b) == IST_OK);
  CHECK(ist_workspace_make(1 << 16, NULL, &scene->workspace) == IST_OK);
  scene->a.size = scene->b.size = sizeof scene->a;
  scene->a.asset = &scene->tree_a;
  scene->b.asset = &scene->tree_b;
  scene->a.pose = scene->b.pose = identity;
  scene->b.pose.t[0] = 0.25;
  return 0;
}

static int capacities_are_told(const scene_t* s) {
  ist_placed_t inverted, none = {0};
  ist_workspace_t workspace = {0};
  ist_penetration_t answer = {.size = sizeof answer};
  size_t capacity = 7;
  CHECK(ist_workspace_capacity(&s->a, &s->b, NULL) == IST_NULL_POINTER);
  CHECK(ist_workspace_capacity(&s->a, NULL, &capacity) == IST_NULL_POINTER && capacity == 0);
  CHECK(ist_workspace_capacity(&none, &s->b, &capacity) != IST_OK && capacity == 0);
  inverted = s->a;
  inverted.scale = -1;
  CHECK(ist_workspace_capacity(&inverted, &s->b, &capacity) == IST_INVALID_INPUT && capacity == 0);
  CHECK(ist_workspace_capacity(&s->a, &s->b, &capacity) == IST_OK && capacity > 0);
  CHECK(ist_workspace_make(capacity, NULL, &workspace) == IST_OK);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &workspace, &answer) == IST_OK);
  CHECK(ist_workspace_release(&workspace) == IST_OK);
  return 0;
}

static int released_handles_are_known(scene_t* s) {
  ist_penetration_t answer = {.size = sizeof answer};
  CHECK(ist_asset_release(&s->tree_b) == IST_OK);
  CHECK(ist_penetration(&s->a, &s->b, NULL, &s->workspace, &answer) == IST_NO_HANDLE);
  CHECK(ist_asset_release(&s->tree_b) == IST_NO_HANDLE);
  CHECK(ist_workspace_release(&s->workspace) == IST_OK);
  CHECK(ist_penetration(&s->a, &s->a, NULL, &s->workspace, &answer) == IST_NO_HANDLE);
  CHECK(ist_workspace_release(&s->workspace) == IST_NO_HANDLE);
  CHECK(ist_workspace_release(NULL) == IST_NULL_POINTER);
  CHECK(ist_workspace_make(0, NULL, NULL) == IST_NULL_POINTER);
  CHECK(ist_asset_release(&s->tree_a) == IST_OK);
  return 0;
}

static int versions_and_words(void) {
  int status;
  CHECK(ist_version() == IST_VERSION);
  CHECK(ist_check_version(IST_VERSION) == IST_OK);
  CHECK(ist_check_version(IST_VERSION + 1) == IST_WRONG_VERSION); /* newer than the library */
  CHECK(ist_check_version(IST_VERSION + 100) == IST_WRONG_VERSION);
  CHECK(ist_check_version(IST_VERSION + 10000) == IST_WRONG_VERSION);
  CHECK(ist_check_version(0) == IST_WRONG_VERSION);
  for (status = IST_NO_BODY - 1; status <= IST_ERROR_EXCEEDED + 1; ++status) {
    const int known = status >= IST_NO_BODY && status <= IST_ERROR_EXCEEDED;
    const int unknown = strcmp(ist_describe(status), ist_describe(12345)) == 0;
    CHECK(known != unknown);
  }
  return 0;
}

int c_api_checks(const char* path_a, const char* path_b) {
  scene_t scene;
  if (versions_and_words() != 0 || memory_is_the_callers(path_a) != 0 ||
      trees_are_checked(path_a) != 0 || make_scene(&scene, path_a, path_b) != 0)
    return 1;
  return penetrations_answer(&scene) != 0 || deadlines_limit(&scene) != 0 ||
         separations_answer(&scene) != 0 || overlaps_answer(&scene) != 0 ||
         patches_answer(&scene) != 0 || outlines_answer(&scene) != 0 ||
         fields_answer(&scene) != 0 || bodies_are_told(&scene) != 0 ||
         impacts_are_found(&scene) != 0 || batches_answer(&scene) != 0 ||
         balls_are_told(&scene) != 0 || surfaces_are_told(&scene) != 0 ||
         lenses_are_told(&scene) != 0 || scenes_answer(&scene) != 0 || capacities_are_told(&scene) != 0 ||
         released_handles_are_known(&scene) != 0;
}
