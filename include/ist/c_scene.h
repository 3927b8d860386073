#ifndef IST_C_SCENE_H
#define IST_C_SCENE_H

/* Scenes in C11: scene.h, with the same bits. Many solids, and which of them meet. Links
 * ist::query; the rules are those of c.h. A scene belongs to one call at a time, but functions
 * that take it as const may run on several threads. ist_scene_set_poses(), ist_scene_set_motions()
 * and ist_scene_take_step() neither allocate nor lock. */

#include <ist/c.h>

#ifdef __cplusplus
extern "C" {
#endif
#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif

/* A handle, which owns memory. All zero: empty. */
typedef struct ist_scene {
  uint64_t opaque[2];
} ist_scene_t;

/* SceneSettings; a null pointer, and any member that is 0, is the default. */
typedef struct ist_scene_settings {
  uint32_t size;
  uint32_t patches_per_pair; /* at most, for IST_SCENE_PATCHES; 0: 8 */
  size_t max_bodies;         /* 0: 1,024 */
  size_t max_pairs;          /* pairs of bodies whose boxes meet, in one step; 0: 8,192 */
  size_t workers;            /* as many threads may work at a step; 0: 1 */
  size_t workspace_capacity; /* of each worker, see ist_workspace_make() */
} ist_scene_settings_t;

/* IST_INVALID_INPUT: a number is too large. */
ist_status_t ist_scene_make(const ist_scene_settings_t* settings, ist_scene_t* scene);
ist_status_t ist_scene_release(ist_scene_t* scene);

/* SceneBody. What `solid` points to, its asset, its shape and what that points to, must outlive the
 * body; `solid` itself need not. */
typedef struct ist_scene_body {
  uint32_t size;
  uint32_t number; /* the caller's, unique in its scene: pairs are in its order */
  const ist_placed_t* solid;
  uint32_t is_still;          /* not 0: it does not move; two such bodies are not queried */
  uint32_t group;             /* < 8: selects the rule of a pair */
  uint32_t layers, meets;     /* bits: each must be on a layer that the other meets; 0: layer 1, and
                                 all */
  const ist_motion_t* motion; /* for IST_SCENE_IMPACT; null: at rest */
} ist_scene_body_t;

/* IST_NUMBER_TAKEN, or IST_SCENE_FULL; IST_INVALID_INPUT for a group that is too large. A pose that
 * is not usable is refused in the step. */
ist_status_t ist_scene_add(ist_scene_t* scene, const ist_scene_body_t* body);
/* Its pairs end in the next step. IST_NO_BODY: there is none. */
ist_status_t ist_scene_remove(ist_scene_t* scene, uint32_t number);
/* Of bodies numbers[i] the values[i]. IST_NO_BODY: some are not there; the others are set. */
ist_status_t ist_scene_set_poses(ist_scene_t* scene, const uint32_t* numbers,
                                 const ist_pose_t* poses, size_t count);
ist_status_t ist_scene_set_motions(ist_scene_t* scene, const uint32_t* numbers,
                                   const ist_motion_t* motions, size_t count);

/* The query of two bodies. */
typedef int32_t ist_scene_answer_t;
enum {
  IST_SCENE_PENETRATION = 0, /* and ist_separation() where a margin is set */
  IST_SCENE_NOTHING = 1,     /* they do not meet */
  IST_SCENE_BOXES = 2,       /* they meet where their boxes do, each half the margin wider */
  IST_SCENE_OVERLAP = 3,     /* yes, no or unknown, within the margin */
  IST_SCENE_PATCHES = 4,     /* as IST_SCENE_PENETRATION, with patches */
  IST_SCENE_IMPACT = 5       /* ist_time_of_impact() */
};

/* SceneRule; a null pointer is the default. */
typedef struct ist_scene_rule {
  uint32_t size;
  ist_scene_answer_t answer;
  const ist_penetration_settings_t* penetration; /* without pair_id; null: defaults */
  const ist_impact_settings_t* impact;           /* null: defaults */
  double margin; /* [u] ≥ 0: bodies within this distance are reported too */
} ist_scene_rule_t;

/* The rule for bodies of two groups, whichever is which. All pairs are queried again. */
ist_status_t ist_scene_set_rule(ist_scene_t* scene, uint32_t group_a, uint32_t group_b,
                                const ist_scene_rule_t* rule);
/* joined, not 0: until one of them is removed they do not meet. */
ist_status_t ist_scene_join(ist_scene_t* scene, uint32_t a, uint32_t b, uint32_t joined);
/* Pairs for which it returns 0 do not meet. It may be called by the thread of a step alone, and
 * must not change from call to call while neither body moves. Null: all meet. */
ist_status_t ist_scene_set_filter(ist_scene_t* scene,
                                  int32_t (*filter)(const void* context, uint32_t a, uint32_t b),
                                  const void* context);

/* Two bodies that meet. */
typedef struct ist_scene_pair {
  uint32_t a, b;            /* numbers, a < b; A of the query is `a` */
  uint32_t stays;           /* 0: they did not meet in the step before */
  ist_yes_no_t overlapping; /* IST_SCENE_OVERLAP alone; else unknown */
  uint32_t slot;            /* where its answers are */
  uint32_t patch_count;
} ist_scene_pair_t;

typedef struct ist_scene_pair_name {
  uint32_t a, b;
} ist_scene_pair_name_t;

/* SceneStep: the arrays stay until the next call that changes the scene. */
typedef struct ist_scene_step {
  uint32_t size;
  ist_status_t status;
  const ist_scene_pair_t* pairs;      /* [pair_count] that meet, by (a, b) */
  const ist_scene_pair_name_t* ended; /* [ended_count] met in the step before, by (a, b) */
  const uint32_t* refused;            /* [refused_count] left out: not usable */
  size_t pair_count, ended_count, refused_count;
  size_t boxes_met; /* pairs of bodies whose boxes meet */
} ist_scene_step_t;

/* Queries all pairs that may have changed. `parallel`: null is the calling thread.
 * IST_BUDGET_EXHAUSTED: there were too many pairs (max_pairs); none was queried, no pair ended. */
ist_status_t ist_scene_take_step(ist_scene_t* scene, const ist_parallel_t* parallel,
                                 ist_scene_step_t* step);

/* Answers to a pair of the last step: all zero if its rule requests none. Each returns the
 * status of the answer. */
ist_status_t ist_scene_get_penetration(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                       ist_penetration_t* answer);
ist_status_t ist_scene_get_separation(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                      ist_separation_t* answer);
ist_status_t ist_scene_get_impact(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                  ist_impact_t* answer);
/* As many as fit. */
ist_status_t ist_scene_get_patches(const ist_scene_t* scene, const ist_scene_pair_t* pair,
                                   ist_contact_patches_t* patches);

/* The first body that each ray meets, where bodies stand now; equally near ones: the lowest number.
 * `numbers`, `hits`: [count]; a number is 0 where there is no hit. Bodies that rays do not support
 * are passed. `hit_size`: sizeof(ist_ray_hit_t). Returns the least of their statuses, as
 * ist_raycast(). */
ist_status_t ist_scene_raycast(const ist_scene_t* scene, const ist_ray_t* rays, size_t count,
                               uint32_t* numbers, ist_ray_hit_t* hits, size_t hit_size);
/* The body nearest to each point, where bodies stand now: that of the least signed distance;
 * equally near ones: the lowest number. `points`: [3 · count]. `numbers`, `answers`: [count]; the
 * distance is infinite where no body is within `max_distance` [u], which may be infinite. Bodies
 * that ist_closest_point() does not support are passed. `answer_size`: sizeof(ist_surface_point_t).
 * Returns the least of their statuses. */
ist_status_t ist_scene_nearest(const ist_scene_t* scene, const double* points, size_t count,
                               double max_distance, uint32_t* numbers, ist_surface_point_t* answers,
                               size_t answer_size);
/* Bodies whose boxes meet a box [u], in no order. `count`: how many there are; the first `capacity`
 * of them are written. `numbers` may be null if that is 0. IST_INVALID_INPUT: lower > upper, or
 * NaN. */
ist_status_t ist_scene_in_box(const ist_scene_t* scene, const double lower[3],
                              const double upper[3], uint32_t* numbers, size_t capacity,
                              size_t* count);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif
#ifdef __cplusplus
}
#endif

#endif
