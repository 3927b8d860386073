/* Queries of two assets and a floor from C. By CMake, or without it:
 *   cc -std=c11 c.c $(pkg-config --cflags --libs ist-query) -o c */
#include <ist/c.h>
#include <stdio.h>

static int failed(const char* what, ist_status_t status) {
  if (status >= 0) return 0;
  fprintf(stderr, "%s: %s\n", what, ist_describe(status));
  return 1;
}

int main(int argc, char** argv) {
  const ist_pose_t here = IST_POSE_IDENTITY;
  ist_asset_t tree_a = {0}, tree_b = {0};
  ist_workspace_t workspace = {0}; /* one a thread */
  ist_shape_t floor = {.size = sizeof floor, .kind = IST_HALF_SPACE};
  int step, bad;
  if (argc != 3) return fprintf(stderr, "usage: c A.ist B.ist\n"), 2;
  if (failed("ist", ist_check_version(IST_VERSION)) ||
      failed(argv[1], ist_asset_load(argv[1], NULL, &tree_a)) ||
      failed(argv[2], ist_asset_load(argv[2], NULL, &tree_b)) ||
      failed("workspace", ist_workspace_make(0, NULL, &workspace)))
    return 1;

  floor.as.half_space.normal[2] = 1; /* z <= 0 */
  for (step = bad = 0; step < 10 && !bad; ++step) {
    ist_placed_t a = {.size = sizeof a, .asset = &tree_a, .pose = here};
    ist_placed_t b = {.size = sizeof b, .asset = &tree_b, .pose = here};
    ist_placed_t ground = {.size = sizeof ground, .shape = &floor, .pose = here};
    ist_penetration_settings_t settings = {.size = sizeof settings, .pair_budget = 10000};
    ist_penetration_t overlap = {.size = sizeof overlap}, sunk = {.size = sizeof sunk};
    ist_separation_t gap = {.size = sizeof gap};
    b.pose.t[2] = 1.0 - 0.1 * step;
    bad = failed("query", ist_query(&a, &b, &settings, NULL, &workspace, &overlap, &gap)) ||
          failed("floor", ist_penetration(&ground, &b, NULL, &workspace, &sunk));
    printf("z %4.1f  volume %-10.4g gap %-8.4g force/k on B along z %-9.4g in the floor %.4g\n",
           b.pose.t[2], overlap.volume, gap.distance, overlap.force[2],
           sunk.volume);
  }
  ist_workspace_release(&workspace);
  ist_asset_release(&tree_b);
  ist_asset_release(&tree_a);
  return bad;
}
