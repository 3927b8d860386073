/* Every query of a table of poses through the C functions, as bits: what another build of the
 * library must answer too (web/package/test). And how long they take.
 *
 * native_rows A.ist B.ist poses.csv > answers        or        … --time PASSES > µs, as JSON */
#define _POSIX_C_SOURCE 199309L  // clock_gettime

#include <ist/c.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { kMostRows = 1024, kMostPatches = 16 };

typedef struct row {
  ist_pose_t pose;
  double scale;
} row_t;

static row_t rows[kMostRows];
static int row_count;
static ist_asset_t tree_a, tree_b;
static ist_workspace_t workspace;

static void stop(const char* what) {
  fprintf(stderr, "native_rows: %s\n", what);
  exit(1);
}

static int read_rows(const char* path) {
  char line[1024];
  FILE* const file = fopen(path, "r");
  if (file == NULL || fgets(line, sizeof line, file) == NULL) return 0;
  while (row_count < kMostRows && fgets(line, sizeof line, file) != NULL) {
    row_t* const row = &rows[row_count++];
    double* const q = row->pose.q;
    double* const t = row->pose.t;
    if (sscanf(line, "%*[^,],%*[^,],%*[^,],%*[^,],%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", q, q + 1, q + 2,
               q + 3, t, t + 1, t + 2, &row->scale) != 8)
      stop("a row that is none");
  }
  fclose(file);
  return row_count;
}

static void print_doubles(const double* numbers, int count) {
  int i;
  for (i = 0; i < count; ++i) {
    uint64_t bits;
    memcpy(&bits, numbers + i, sizeof bits);
    printf(" %016llx", (unsigned long long)bits);
  }
}

static void print_penetration(const ist_penetration_t* p) {
  printf(" %d", p->status);
  print_doubles(&p->volume, 12);
  printf(" %u %u", p->node_visits, p->sphere_pairs);
}

static void print_patches(const ist_contact_patches_t* found) {
  size_t k;
  for (k = 0; k < found->count; ++k) {
    printf(" %llu", (unsigned long long)found->patches[k].id);
    print_doubles(found->patches[k].centroid, 15);
  }
}

static ist_placed_t placed_a(void) {
  const ist_placed_t a = {sizeof a, &tree_a, NULL, IST_POSE_IDENTITY, 1};
  return a;
}
static ist_placed_t placed_b(int i) {
  const ist_placed_t b = {sizeof b, &tree_b, NULL, rows[i].pose, rows[i].scale};
  return b;
}

/* --- Queries, by name. Each answers row i and, if asked to, prints the answer -------------------
 */

static void ask_penetration(int i, int print, ist_measure_t measure, uint32_t spheres_only,
                            uint32_t pair_budget, uint32_t max_visits) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  const ist_penetration_settings_t settings = {.size = sizeof settings,
                                               .measure = measure,
                                               .spheres_only = spheres_only,
                                               .pair_budget = pair_budget,
                                               .max_visits = max_visits};
  ist_penetration_t answer = {.size = sizeof answer};
  ist_penetration(&a, &b, &settings, &workspace, &answer);
  if (print) print_penetration(&answer);
}

static void matched(int i, int print) {
  ask_penetration(i, print, IST_MATCHED, 0, 0, 0);
}
static void spheres_only(int i, int print) {
  ask_penetration(i, print, IST_MATCHED, 1, 0, 0);
}
static void exact(int i, int print) {
  ask_penetration(i, print, IST_EXACT, 0, 0, 0);
}
static void inner(int i, int print) {
  ask_penetration(i, print, IST_INNER, 0, 0, 0);
}
static void budget(int i, int print) {
  ask_penetration(i, print, IST_MATCHED, 0, 200, 300);
}

static void ask_field(int i, int print, const ist_shape_t* field) {
  const ist_placed_t a = {sizeof a, NULL, field, IST_POSE_IDENTITY, 1};
  const ist_placed_t b = placed_b(i);
  ist_penetration_t answer = {.size = sizeof answer};
  ist_penetration(&a, &b, NULL, &workspace, &answer);
  if (print) print_penetration(&answer);
}

static void half_space(int i, int print) {
  const ist_shape_t field = {
      .size = sizeof field, .kind = IST_HALF_SPACE, .as.half_space = {{0, 0.6, 0.8}, 0.0625}};
  ask_field(i, print, &field);
}
static void box(int i, int print) {
  const ist_shape_t field = {.size = sizeof field, .kind = IST_BOX, .as.box = {{0.25, 0.5, 0.125}}};
  ask_field(i, print, &field);
}
static void capsule(int i, int print) {
  const ist_shape_t field = {
      .size = sizeof field, .kind = IST_CAPSULE, .as.capsule = {0.25, 0.375}};
  ask_field(i, print, &field);
}

static void separation(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  ist_separation_t answer = {.size = sizeof answer};
  ist_separation(&a, &b, NULL, &workspace, &answer);
  if (!print) return;
  printf(" %d", answer.status);
  print_doubles(&answer.distance, 12);
  printf(" %u %u", answer.node_visits, answer.sphere_pairs);
}

static void patches(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  ist_contact_patch_t storage[kMostPatches];
  ist_contact_patches_t found = {sizeof found, sizeof storage[0], storage, kMostPatches, 0};
  ist_penetration_t whole = {.size = sizeof whole};
  ist_contact_patches(&a, &b, NULL, &workspace, &found, &whole);
  if (!print) return;
  print_penetration(&whole);
  print_patches(&found);
}

static void outline(int i, int print) {
  static ist_outline_segment_t storage[1 << 15];
  const ist_placed_t a = placed_a(), b = placed_b(i);
  ist_contact_patch_t patch_storage[kMostPatches];
  ist_contact_patches_t found = {sizeof found, sizeof patch_storage[0], patch_storage, kMostPatches,
                                 0};
  ist_outline_t all = {.size = sizeof all,
                       .segment_size = sizeof storage[0],
                       .segments = storage,
                       .capacity = sizeof storage / sizeof storage[0]};
  ist_penetration_t whole = {.size = sizeof whole};
  size_t k;
  ist_overlap_outline(&a, &b, NULL, &workspace, &found, &all, &whole);
  if (!print) return;
  print_penetration(&whole);
  print_patches(&found);
  for (k = 0; k < all.count; k += 7) {
    print_doubles(storage[k].from, 6);
    printf(" %u", storage[k].patch);
  }
}

static void without_protrusion(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  const ist_penetration_settings_t settings = {.size = sizeof settings,
                                               .spheres_only = 1};
  ist_penetration_t answer = {.size = sizeof answer};
  ist_penetration(&a, &b, &settings, &workspace, &answer);
  ist_without_protrusion(&answer, &a, &b, &answer);
  if (print) print_penetration(&answer);
}

static void patches_without_protrusion(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  const ist_contact_settings_t settings = {.size = sizeof settings, .spheres_only = 1};
  ist_contact_patch_t storage[kMostPatches];
  ist_contact_patches_t found = {sizeof found, sizeof storage[0], storage, kMostPatches, 0};
  ist_contact_patches(&a, &b, &settings, &workspace, &found, NULL);
  ist_patches_without_protrusion(&a, &b, &settings, &found);
  if (print) print_patches(&found);
}

static void fit(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  ist_size_match_t found = {.size = sizeof found};
  ist_get_size_match(&a, &b, &found);
  if (!print) return;
  print_doubles(&found.feature_size_a, 3);
  printf(" %u %u %u %u", found.a_is_coarser, found.has_mesh, found.needs_mesh, found.fits);
}

static void wrenches(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  const double of_a[3] = {0.1, 0.2, 0.3}, of_b[3] = {-0.3, 0.2, 0.1};
  ist_penetration_t contact = {.size = sizeof contact};
  ist_wrenches_t found = {.size = sizeof found};
  ist_penetration(&a, &b, NULL, &workspace, &contact);
  ist_wrenches(&contact, &b.pose, of_a, of_b, &found);
  if (!print) return;
  print_doubles(found.on_a.force, 6);
  print_doubles(found.on_b.force, 6);
}

/* From A's pose to the row's pose, and a part of that motion. */
static void motions(int i, int print) {
  const ist_pose_t from = IST_POSE_IDENTITY;
  const double about[3] = {0.1, -0.2, 0.3};
  ist_motion_t motion;
  ist_pose_t there;
  ist_motion_between(&from, &rows[i].pose, 0.5, about, rows[i].scale, &motion);
  ist_moved(&from, rows[i].scale, &motion, 0.2, &there);
  if (!print) return;
  print_doubles(motion.velocity, 9);
  print_doubles(there.q, 7);
}

/* B moves across A's origin while A turns. */
static void impact(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  const double* const t = rows[i].pose.t;
  const ist_motion_t of_a = {.angular_velocity = {0, 0.25, 0}};
  const ist_motion_t of_b = {.velocity = {-2 * t[0], -2 * t[1], -2 * t[2]},
                             .angular_velocity = {0.5, 0, 0.25}};
  const ist_impact_settings_t settings = {
      .size = sizeof settings, .max_visits = 20000, .duration = 0.5};
  ist_impact_t answer = {.size = sizeof answer};
  ist_time_of_impact(&a, &b, &of_a, &of_b, &settings, &workspace, &answer);
  if (!print) return;
  printf(" %d %d", answer.status, answer.kind);
  print_doubles(&answer.time, 12);
  printf(" %u %u", answer.node_visits, answer.surface_pairs);
}

static void batches(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  const ist_shape_t half_space = {
      .size = sizeof half_space, .kind = IST_HALF_SPACE, .as.half_space = {{0, 0.6, 0.8}, 0.0625}};
  const ist_placed_t ground = {sizeof ground, NULL, &half_space, IST_POSE_IDENTITY, 1};
  const ist_pair_t pairs[2] = {{&a, &b}, {&b, &a}};
  const ist_pair_t field_pair = {&ground, &b};
  ist_contact_patch_t storage[kMostPatches];
  ist_contact_patches_t found = {sizeof found, sizeof storage[0], storage, kMostPatches, 0};
  ist_penetration_t answers[3], whole;
  int k;
  ist_penetration_batch(pairs, 2, NULL, &workspace, 1, answers, sizeof whole, NULL);
  ist_penetration_batch(&field_pair, 1, NULL, &workspace, 1, answers + 2, sizeof whole, NULL);
  ist_contact_patches_batch(pairs, 1, NULL, &workspace, 1, &found, &whole, sizeof whole, NULL);
  if (!print) return;
  for (k = 0; k < 3; ++k) print_penetration(&answers[k]);
  print_penetration(&whole);
  print_patches(&found);
}

/* From behind B, past its origin. */
static void rays(int i, int print) {
  const ist_placed_t b = placed_b(i);
  const double* const t = rows[i].pose.t;
  const double sideways[3] = {0, 0.125, -0.03125};
  ist_ray_t asked[3];
  ist_ray_hit_t hits[3];
  int k;
  for (k = 0; k < 3; ++k) {
    const ist_ray_t ray = {
        {2 * t[0], 2 * t[1], 2 * t[2]}, {sideways[k] - t[0], -t[1], -t[2]}, k == 2 ? 100 : 0};
    asked[k] = ray;
  }
  ist_raycast(&b, asked, 3, hits, sizeof hits[0]);
  for (k = 0; k < 3 && print; ++k) {
    printf(" %u", hits[k].triangle);
    print_doubles(&hits[k].distance, 7);
  }
}

/* Points about B's origin, against it and a half-space. */
static void points(int i, int print) {
  const ist_placed_t b = placed_b(i);
  const ist_shape_t half_space = {
      .size = sizeof half_space, .kind = IST_HALF_SPACE, .as.half_space = {{0, 0.6, 0.8}, 0.0625}};
  const ist_placed_t ground = {sizeof ground, NULL, &half_space, IST_POSE_IDENTITY, 1};
  const double* const t = rows[i].pose.t;
  const double asked[9] = {t[0], t[1], t[2], t[0] + 0.25, t[1], t[2], t[0], t[1] + 0.0625, t[2]};
  ist_surface_point_t feet[6];
  ist_yes_no_t inside[6];
  int k;
  ist_closest_point(&b, asked, 3, feet, sizeof feet[0]);
  ist_closest_point(&ground, asked, 3, feet + 3, sizeof feet[0]);
  ist_contains(&b, asked, 3, inside);
  ist_contains(&ground, asked, 3, inside + 3);
  for (k = 0; k < 6 && print; ++k) {
    printf(" %d %u", inside[k], feet[k].triangle);
    print_doubles(&feet[k].distance, 8);
  }
}

static void overlapping(int i, int print) {
  const ist_placed_t a = placed_a(), b = placed_b(i);
  ist_yes_no_t answer;
  ist_overlap(&a, &b, &workspace, &answer);
  if (print) printf(" %d", answer);
}

/* In the order of the trees. */
static void lenses(int i, int print) {
  static ist_lens_t storage[8];
  const ist_placed_t a = placed_a(), b = placed_b(i);
  ist_lenses_t found = {
      .size = sizeof found, .lens_size = sizeof storage[0], .lenses = storage, .capacity = 8};
  size_t k;
  ist_overlap_lenses(&a, &b, NULL, &found);
  if (!print) return;
  printf(" %zu", found.total);
  for (k = 0; k < found.count; ++k) {
    print_doubles(storage[k].centre, 8);
    printf(" %u %u", storage[k].sphere_a, storage[k].sphere_b);
  }
}

static const struct {
  const char* name;
  void (*ask)(int i, int print);
} kQueries[] = {
    {"matched", matched},
    {"spheres only", spheres_only},
    {"exact", exact},
    {"inner", inner},
    {"budget", budget},
    {"half-space", half_space},
    {"box", box},
    {"capsule", capsule},
    {"separation", separation},
    {"patches", patches},
    {"outline", outline},
    {"rays", rays},
    {"points", points},
    {"overlap", overlapping},
    {"lenses", lenses},
    {"without protrusion", without_protrusion},
    {"patches without protrusion", patches_without_protrusion},
    {"fit", fit},
    {"wrenches", wrenches},
    {"motions", motions},
    {"impact", impact},
    {"batches", batches},
};
enum { kQueryCount = sizeof kQueries / sizeof kQueries[0] };

static double now_us(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

/* Mean time of a query over all rows, of the best of so many passes. */
static void time_queries(int passes) {
  int q, pass, i;
  printf("{");
  for (q = 0; q < kQueryCount; ++q) {
    double best = 1e300;
    for (pass = 0; pass < passes; ++pass) {
      const double start = now_us();
      double time;
      for (i = 0; i < row_count; ++i) kQueries[q].ask(i, 0);
      time = (now_us() - start) / row_count;
      if (time < best) best = time;
    }
    printf("%s\"%s\": %.3f", q > 0 ? ", " : "", kQueries[q].name, best);
  }
  printf("}\n");
}

int main(int argc, char** argv) {
  int i, q;
  if (argc != 4 && argc != 6) stop("native_rows A.ist B.ist poses.csv [--time PASSES]");
  if (ist_asset_load(argv[1], NULL, &tree_a) != IST_OK) stop(argv[1]);
  if (ist_asset_load(argv[2], NULL, &tree_b) != IST_OK) stop(argv[2]);
  if (ist_workspace_make(0, NULL, &workspace) != IST_OK) stop("no memory");
  if (read_rows(argv[3]) == 0) stop(argv[3]);
  if (argc == 6) {
    time_queries(atoi(argv[5]));
    return 0;
  }
  for (i = 0; i < row_count; ++i)
    for (q = 0; q < kQueryCount; ++q) {
      printf("%d %s:", i, kQueries[q].name);
      kQueries[q].ask(i, 1);
      printf("\n");
    }
  return 0;
}
