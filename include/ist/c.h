#ifndef IST_C_H
#define IST_C_H

/* The queries of ist::query in C11, with the same bits. query.h and shapes.h describe the answers
 * in more detail. The shared library needs nothing else at link time.
 *
 * Errors: every function that can fail returns a status. A negative one is an error, which
 * ist_describe() turns into words. Nothing is thrown or printed. A null pointer, a wrong size or an
 * invalid handle gives a status.
 * Results: if a query fails all numbers of its answer are NaN and its counts 0, so that no failure
 * reads as no contact. Other results of a call that fails are all zero except for `size` and
 * `status`, where they have space.
 * Sizes: set up a struct that starts with `size` as `ist_penetration_t x = {.size = sizeof x}`. All
 * other members may be 0, the default, except ist_impact_settings_t::duration and
 * ist_contact_law_t::stiffness. A library accepts
 * the sizes of all headers that it serves.
 * Handles: ist_asset_t and ist_workspace_t lie in the caller's memory and are empty when all zero.
 * A handle that owns memory must be released once and must not be copied. Released handles are
 * detected and refused; a copy of one, or freed memory under it, cannot be detected.
 * Threads: functions may be called from any thread. Objects passed as const may be shared while
 * nobody changes them; all others, workspaces in particular, belong to one call at a time.
 * Hot path: functions that take a workspace neither allocate nor lock.
 * Units: lengths are [u], the unit of the mesh that was baked. */

#include <stddef.h>
#include <stdint.h>

#include <ist/version.h>

#ifdef __cplusplus
extern "C" {
#endif
#ifdef __GNUC__
#pragma GCC visibility push(default)
#endif

/* --- Status ----------------------------------------------------------------------------------- */

typedef int32_t ist_status_t;
enum {
  IST_OK = 0,
  /* A limit or the workspace's capacity stopped the query. volume_min and volume_max still contain
   * the finished sum (IST_EXACT: the true volume). */
  IST_BUDGET_EXHAUSTED = 1,
  /* Finished, but the predicted error exceeds relative_error: an asset has no mesh or one that errs
   * more, or a pair budget or coincident copies left coarser spheres. */
  IST_ERROR_EXCEEDED = 2,
  /* A pose with NaN or Inf, a quaternion of length 0, a scale < 0, sizes or distances more than
   * 1e60 : 1 apart, a shape's number or an enum out of range, or a setting < 0 or NaN. */
  IST_INVALID_INPUT = -1,
  IST_NULL_POINTER = -2,
  IST_WRONG_SIZE = -3,    /* a struct's size that this library does not know */
  IST_WRONG_VERSION = -4, /* headers that this library does not serve */
  IST_NO_HANDLE = -5,     /* empty, released, or never made */
  IST_NO_MEMORY = -6,
  IST_CANNOT_READ = -7, /* the file; errno may say why */
  /* A solid lacks what the measure needs: IST_EXACT needs the meshes of both (a shape has none),
   * the others need spheres. All numbers of the answer are NaN. */
  IST_MISSING_DATA = -15,
  IST_NO_DURATION = -14, /* ist_impact_settings_t::duration is 0 */
  IST_NOT_BAKED = -16,   /* ist_bake() (c_bake.h): its message says why */
  /* Scenes (c_scene.h). */
  IST_SCENE_FULL = -17,   /* as many bodies as ist_scene_settings_t::max_bodies */
  IST_NUMBER_TAKEN = -18, /* a body of this number is in the scene */
  IST_NO_BODY = -19,      /* a number that no body of the scene has */
  /* Bytes that are not an asset. */
  IST_TOO_SHORT = -8,      /* fewer than their header says */
  IST_MISALIGNED = -9,     /* not on a 64-byte boundary */
  IST_NOT_AN_ASSET = -10,  /* wrong magic */
  IST_OTHER_FORMAT = -11,  /* another 0.x format: bake again */
  IST_CORRUPT_HASH = -12,  /* content differs from its hash */
  IST_CORRUPT_LAYOUT = -13 /* an offset, count or field out of range */
};

/* One English sentence for any number; never null. */
const char* ist_describe(ist_status_t status);

/* IST_VERSION of the library. */
uint32_t ist_version(void);

/* Call ist_check_version(IST_VERSION) first: IST_OK or IST_WRONG_VERSION. */
ist_status_t ist_check_version(uint32_t headers);

/* --- Memory ----------------------------------------------------------------------------------- */

/* Memory functions; a null ist_allocator_t* selects the C++ heap. Called by the functions that take
 * one, and by the release of what these made. Neither may throw. */
typedef struct ist_allocator {
  uint32_t size;
  /* Returns at least `bytes` bytes, at a multiple of `alignment` (a power of two), or null. */
  void* (*allocate)(void* context, size_t bytes, size_t alignment);
  void (*release)(void* context, void* memory, size_t bytes, size_t alignment);
  void* context; /* passed to both */
} ist_allocator_t;

/* --- Assets ----------------------------------------------------------------------------------- */

/* A checked asset. All zero: empty. */
typedef struct ist_asset {
  uint64_t opaque[8];
} ist_asset_t;

/* Views an asset in the caller's memory, such as a mapped file. Nothing is copied or allocated.
 * `bytes`: on a 64-byte boundary; they must outlive the view and stay unchanged.
 * The previous content of `asset` is forgotten. A view need not be released, and may be copied. */
ist_status_t ist_asset_view(const void* bytes, size_t size, ist_asset_t* asset);

/* Reads an asset from a file into memory of `allocator` (null: the heap), which the asset owns. */
ist_status_t ist_asset_load(const char* path, const ist_allocator_t* allocator, ist_asset_t* asset);

/* Empties the asset and frees its memory if it owns it. No query may be using it. Afterwards
 * objects that point to the ist_asset_t give IST_NO_HANDLE. */
ist_status_t ist_asset_release(ist_asset_t* asset);

/* The state of an asset's mesh (asset.h). */
typedef int32_t ist_mesh_state_t;
enum {
  IST_MESH_NONE = 0,
  IST_MESH_OWN = 1,
  IST_MESH_RESOLVED = 2,
  IST_MESH_POLYGONISED = 3, /* made from a signed distance */
  IST_MESH_UNRESOLVED = 4
};

typedef struct ist_asset_info {
  uint32_t size;
  uint32_t details;        /* levels of detail of the matched spheres: 0 is the finest */
  uint64_t spheres;        /* count; 0: a mesh alone, without spheres to query */
  double volume;           /* [u³] of the solid */
  double coverage;         /* [0, 1] share of the volume in inner spheres */
  double protrusion;       /* [u] bound on how far matched spheres stick out of the solid */
  uint32_t mesh_triangles; /* of the mesh kept for exact queries; 0: there is none */
  ist_mesh_state_t mesh_state;
  double mesh_error; /* [u] the mesh's surface and the solid's lie within this of each other */
  double self_overlap_volume; /* [u³] volume that the input mesh counts more than once */
} ist_asset_info_t;

ist_status_t ist_asset_get_info(const ist_asset_t* asset, ist_asset_info_t* info);

/* Partner of a solid in the trials of a bake to an error (asset.h). */
typedef int32_t ist_trial_partner_t;
enum {
  IST_TRIAL_COPY = 0,
  IST_TRIAL_PLANE = 1,
  IST_TRIAL_BALL = 2,
  IST_TRIAL_EDGE = 3,
  IST_TRIAL_CORNER = 4,
  IST_TRIAL_PLATE = 5
};

/* A class of overlaps, and the error of their volumes. */
typedef struct ist_overlap_class {
  double from, to; /* [0, 1] of the smaller solid's volume; both 1: it is contained */
  double median;   /* ≥ 0, 0.01 = 1 %; 0 also if no such pose was found */
} ist_overlap_class_t;

/* PredictedErrors: errors of penetration volumes, as the bake measured them, relative. */
typedef struct ist_predicted_errors {
  uint32_t size;
  uint32_t poses;                 /* of all classes together; 0: nothing is predicted */
  ist_overlap_class_t classes[5]; /* of two copies of the solid, deepest first */
  double target_error;            /* requested; 0: none */
  double target_overlap;          /* overlap for which it was requested */
  double measured_error;          /* median near target_overlap, of the worst partner there */
  uint32_t measured_poses;        /* of all partners; 0: nothing was measured there */
  ist_trial_partner_t worst_partner;
  uint32_t target_met; /* 0 or 1: requested, measured and reached */
} ist_predicted_errors_t;

/* `poses` is 0 for an asset baked without an error target. */
ist_status_t ist_asset_get_predicted_errors(const ist_asset_t* asset,
                                            ist_predicted_errors_t* errors);

/* MassProperties: of a solid of density 1. Multiply by a density for mass and inertia. */
typedef struct ist_mass_properties {
  uint32_t size;
  ist_status_t status;
  double volume;               /* [u³] */
  double centre_of_mass[3];    /* [u] */
  double inertia[3][3];        /* [u⁵] about the centre of mass; symmetric */
  double volume_error;         /* [u³] */
  double centre_of_mass_error; /* [u] of each component */
  double inertia_error;        /* [u⁵] of each entry */
} ist_mass_properties_t;

/* Bounds: a box and a ball that contain the solid. */
typedef struct ist_bounds {
  uint32_t size;
  ist_status_t status;
  double lower[3], upper[3]; /* [u] corners of the box along the axes */
  double centre[3], radius;  /* [u] of a ball */
} ist_bounds_t;

/* In the asset's own frame. Stored by the bake: takes nanoseconds. */
ist_status_t ist_asset_get_mass_properties(const ist_asset_t* asset,
                                           ist_mass_properties_t* properties);
ist_status_t ist_asset_get_bounds(const ist_asset_t* asset, ist_bounds_t* bounds);

/* --- Contents of an asset, for drawing (asset_layout.h) --------------------------------------- */

/* Measure: what represents the solid. */
typedef int32_t ist_measure_t;
enum {
  IST_MATCHED = 0, /* spheres whose volumes sum to the solid's: the accurate ones */
  IST_INNER = 1,   /* spheres inside the solid: a certified lower bound of the true volume */
  /* The two meshes: the true volume and its gradients. For penetrations and contact patches of two
   * trees that store their mesh (ist_asset_info_t::mesh_triangles). Functions about balls and
   * lenses return IST_INVALID_INPUT. */
  IST_EXACT = 2
};

typedef struct ist_ball {
  double centre[3]; /* [u] in the asset's own frame */
  double radius;    /* [u] */
} ist_ball_t;

/* Selects balls. */
typedef struct ist_ball_set {
  uint32_t size;
  ist_measure_t measure;
  uint32_t detail; /* of matched spheres: < ist_asset_info_t::details; of inner ones 0 */
  /* 0: the spheres, in insertion order. 1: balls around sixteen spheres each. Above: balls around
   * the spheres of sixteen balls of the level below, up to a level of at most sixteen. */
  uint32_t level;
} ist_ball_set_t;

/* `count`: balls in the set; the first `capacity` of them are written. `balls` may be null if that
 * is 0. IST_INVALID_INPUT, and a count of 0, if there is no such detail or level. */
ist_status_t ist_asset_get_balls(const ist_asset_t* asset, const ist_ball_set_t* set,
                                 ist_ball_t* balls, size_t capacity, size_t* count);

/* The mesh that an asset keeps: closed, oriented, triangles counter-clockwise from outside. */
typedef struct ist_mesh {
  uint32_t size;
  double (*vertices)[3];    /* [u] [vertex_capacity] in the asset's own frame */
  uint32_t (*triangles)[3]; /* [triangle_capacity] three vertices each */
  size_t vertex_capacity, triangle_capacity;
  size_t vertex_count, triangle_count; /* answer: total counts; 0 without a mesh */
} ist_mesh_t;

/* Writes as many as fit. An array may be null if its capacity is 0. */
ist_status_t ist_asset_get_mesh(const ist_asset_t* asset, ist_mesh_t* surface);

/* --- Places ----------------------------------------------------------------------------------- */

/* x_world = R(q) x + t */
typedef struct ist_pose {
  double q[4]; /* w, x, y, z; of length 1e-150 to 1e150: it is normalised */
  double t[3]; /* [u] */
} ist_pose_t;

/* clang-format off */
#define IST_POSE_IDENTITY {{1, 0, 0, 0}, {0, 0, 0}}
/* clang-format on */

/* --- Shapes: solids without spheres (shapes.h). Distances are negative inside. -----------------
 */

typedef int32_t ist_shape_kind_t;
enum {
  IST_HALF_SPACE = 1,
  IST_BOX = 2,
  IST_BALL = 3,
  IST_CAPSULE = 4,
  IST_CYLINDER = 5,
  IST_HEIGHTS = 6,
  IST_DISTANCE_GRID = 7,
  IST_FUNCTION = 8
};

/* A sample of a shape. */
typedef struct ist_shape_sample {
  double distance;    /* [u] to the surface, negative inside */
  double gradient[3]; /* of the distance: outward */
} ist_shape_sample_t;

/* A plain view: its memory must outlive its use. */
typedef struct ist_shape {
  uint32_t size;
  ist_shape_kind_t kind;
  union {
    /* normal · x ≤ offset */
    struct {
      double normal[3]; /* outward, not 0; its length divides `offset` */
      double offset;    /* [u] */
    } half_space;
    /* around the origin */
    struct {
      double half_extents[3]; /* [u] > 0 */
    } box;
    struct {
      double radius; /* [u] > 0, around the origin */
    } ball;
    /* about the z axis; for a capsule half_height is the segment's */
    struct {
      double radius;      /* [u] > 0 */
      double half_height; /* [u] > 0; of a capsule ≥ 0 */
    } capsule, cylinder;
    /* the solid under a grid of heights along z; beyond its border it continues level */
    struct {
      const float* heights;   /* [u] [rows · columns], columns (x) run fastest */
      uint32_t columns, rows; /* ≥ 2 */
      double spacing[2];      /* [u] > 0, along x and y; heights[0] is at the origin */
      double lowest, highest; /* [u] bounds of all heights; both 0: unknown */
    } heights;
    /* distances at the points of a grid; outside of it is outside of the solid */
    struct {
      const float* distances; /* [u] x runs fastest */
      uint32_t points[3];     /* along x, y, z, each ≥ 2 */
      double origin[3];       /* [u] of the first point */
      double spacing;         /* [u] > 0 */
      double error;           /* [u] bound on the error of the interpolated distance */
    } distance_grid;
    /* a function of the caller's, called on the thread of the query; it may not throw */
    struct {
      void (*sample)(const void* context, const double x[3], ist_shape_sample_t* answer);
      const void* context; /* passed to `sample` */
      double error;        /* [u] bound on the error of distances */
    } function;
    double reserved[16];
  } as;
} ist_shape_t;

/* A solid at a pose: an asset or a shape, the other pointer null. x_world = R (scale · x) + t */
typedef struct ist_placed {
  uint32_t size;
  const ist_asset_t* asset;
  const ist_shape_t* shape;
  ist_pose_t pose;
  double scale; /* > 0; 0 is taken for 1 */
} ist_placed_t;

/* In the world, axes and scale included. A shape: IST_MISSING_DATA. */
ist_status_t ist_placed_mass_properties(const ist_placed_t* placed,
                                        ist_mass_properties_t* properties);
ist_status_t ist_placed_bounds(const ist_placed_t* placed, ist_bounds_t* bounds);

/* --- Workspaces ------------------------------------------------------------------------------- */

/* Scratch memory of queries, one per thread. All zero: empty. */
typedef struct ist_workspace {
  uint64_t opaque[8];
} ist_workspace_t;

/* `capacity`: count of node pairs that may wait at once. It reserves 9 MB and 173 bytes per pair
 * of address space, touched as needed. 0 is the default, 1,048,576, which serves two trees of
 * 64,000 spheres at any pose. `allocator`: null is the heap. The previous content of `workspace` is
 * forgotten. */
ist_status_t ist_workspace_make(size_t capacity, const ist_allocator_t* allocator,
                                ist_workspace_t* workspace);
ist_status_t ist_workspace_release(ist_workspace_t* workspace);

/* A capacity that suffices for two solids at any pose by spheres alone: not for the exact measure,
 * the meshes that answer for unlike sizes (ist_penetration_settings_t::spheres_only) and
 * ist_time_of_impact(), see workspace_capacity() in ist/query.h. Poses are ignored, scales are not.
 * It allocates and takes some 0.3 s for 16,000 spheres. IST_INVALID_INPUT for two shapes
 * and for an asset without spheres. */
ist_status_t ist_workspace_capacity(const ist_placed_t* a, const ist_placed_t* b, size_t* capacity);

/* --- Settings: a null pointer means the defaults, all 0 except `size` ------------------------ */

/* PenetrationSettings. IST_EXACT obeys max_visits only. If that stops it, the answer is that of the
 * matched spheres (NaN if there are none), with bounds of the true volume. */
typedef struct ist_penetration_settings {
  uint32_t size;
  ist_measure_t measure;
  /* IST_MATCHED, not 0: spheres answer even where they are too coarse for two solids of unlike
   * sizes, and may be wrong by any factor (ist_get_size_match). 0: there the meshes do, if both
   * keep one. */
  uint32_t spheres_only;
  uint32_t pair_budget; /* count of sphere pairs to spend; 0: no limit, as in all that follow */
  uint32_t max_visits;  /* count of node pairs opened */
  /* The caller's number of this pair of solids; 0: none. Calls with one number and workspace are
   * steps of one motion: IST_EXACT keeps nearby triangles. It changes no bit of an answer except
   * node_visits. Nothing is kept under max_visits. */
  uint32_t pair_id;
  /* Accepted relative error of the volume, such as 0.005 for 0.5 %, of two trees with IST_MATCHED.
   * The query uses the coarsest level of detail whose predicted error is smaller, or IST_EXACT,
   * blended smoothly. If an asset has no mesh, or under a pair budget, the status may be
   * IST_ERROR_EXCEEDED. */
  double relative_error;
} ist_penetration_settings_t;

/* ContactSettings */
typedef ist_penetration_settings_t ist_contact_settings_t;

/* SeparationSettings */
typedef struct ist_separation_settings {
  uint32_t size;
  uint32_t max_visits;
  uint32_t inner_spheres; /* not 0: use them even if both assets keep a mesh */
  uint32_t pair_id;       /* as above: between surfaces the nearest triangles are kept */
  /* [u] Of solids that are farther apart, certified, distance and distance_min are max_distance,
   * distance_max is infinite, points and normal are NaN, and the status is IST_OK. 0: no limit. */
  double max_distance;
} ist_separation_settings_t;

/* --- Answers ---------------------------------------------------------------------------------- */

/* Penetration: derivatives are with respect to a motion of B, A held still. */
typedef struct ist_penetration_t {
  uint32_t size;
  ist_status_t status;
  double volume; /* [u³] */
  /* [u³] With IST_EXACT: bounds of the true volume. By spheres: the interval of the finished sum,
   * as wide as its rounding and the part that a limit left out. It does not bound the true
   * volume. */
  double volume_min, volume_max;
  double centroid[3];       /* [u] of the overlap, or of the faces in which they touch, world */
  double force[3];          /* [u²] on B for a pressure of 1: −dV/d(translation of B), world */
  double torque[3];         /* [u³/rad] on B about B's origin, likewise */
  double contact_area;      /* [u²] IST_EXACT, touching: of the faces that lie on each other */
  double contact_normal[3]; /* unit, from A to B, world: their mean; zero if there is none */
  uint32_t node_visits, sphere_pairs; /* with IST_EXACT: crossing triangles */
  uint32_t touching;                  /* IST_EXACT: 1 if they meet and the volume is 0; else 0 */
} ist_penetration_t;

/* Separation: between the surfaces if both assets keep a mesh, else between the inner spheres. All
 * zero once these overlap. */
typedef struct ist_separation_t {
  uint32_t size;
  ist_status_t status;
  double distance;                   /* [u] between surfaces or inner spheres */
  double distance_min, distance_max; /* [u] the solids' distance lies within, certified */
  double point_a[3], point_b[3];     /* [u] on the surfaces or spheres, world */
  double normal[3];                  /* unit, from A to B, world */
  uint32_t node_visits, sphere_pairs;
} ist_separation_t;

/* ContactPatch */
typedef struct ist_contact_patch {
  uint64_t id;        /* the same region in every query of the same two trees */
  double centroid[3]; /* [u] world */
  double normal[3];   /* unit, the direction in which the patch pushes B; zero if the area is 0 */
  double area;        /* [u²] */
  double depth;       /* [u] volume/area */
  double volume;      /* [u³] */
  double force[3];    /* [u²] force on B of a pressure of 1 [force/u²] */
  double torque[3];   /* [u³/rad] about B's origin */
  double point[3];    /* [u] world: on the central axis of the wrench, nearest to the centroid */
  double torsion;     /* [u³/rad] residual moment about the normal of a force at `point` */
} ist_contact_patch_t;

/* Space for patches. */
typedef struct ist_contact_patches_t {
  uint32_t size;
  uint32_t patch_size;          /* sizeof(ist_contact_patch_t) */
  ist_contact_patch_t* patches; /* [capacity] */
  size_t capacity;              /* 0: IST_INVALID_INPUT of ist_contact_patches() */
  size_t count;                 /* answer: patches written */
} ist_contact_patches_t;

/* OutlineSegment: a piece of the curve on which two surfaces cross. */
typedef struct ist_outline_segment {
  double from[3], to[3]; /* [u] world */
  uint32_t patch;        /* number of the patch that it bounds; 0 without memory for patches */
} ist_outline_segment_t;

/* Memory for an outline. */
typedef struct ist_outline {
  uint32_t size;
  uint32_t segment_size;           /* sizeof(ist_outline_segment_t) */
  ist_outline_segment_t* segments; /* [capacity] */
  size_t capacity;
  size_t total, count; /* answer: segments there are, and segments written */
} ist_outline_t;

/* --- Queries of two solids -------------------------------------------------------------------- */

/* Two assets, or an asset and a shape in either order; two shapes return IST_MISSING_DATA, as does
 * any field in functions for assets alone. Each function returns the status of its answer, or an
 * error of the call. Assets and shapes may be shared by threads; the workspace may not. */

ist_status_t ist_penetration(const ist_placed_t* a, const ist_placed_t* b,
                             const ist_penetration_settings_t* settings, ist_workspace_t* workspace,
                             ist_penetration_t* answer);

/* Removes the volume that protruding spheres add where flat faces meet. `whole` is the answer
 * of ist_penetration() with spheres_only, and may be the same struct as `answer`. */
ist_status_t ist_without_protrusion(const ist_penetration_t* whole, const ist_placed_t* a,
                                    const ist_placed_t* b, ist_penetration_t* answer);

ist_status_t ist_separation(const ist_placed_t* a, const ist_placed_t* b,
                            const ist_separation_settings_t* settings, ist_workspace_t* workspace,
                            ist_separation_t* answer);

/* Deadline (deadline.h): chooses the pair budget that keeps the queries of one pair of bodies
 * within a time, which the caller measures. May be copied; all zero: no deadline. */
typedef struct ist_deadline {
  double opaque[8];
} ist_deadline_t;

/* [µs] 0, a negative value or NaN: no deadline, and no pair budget. */
ist_status_t ist_deadline_make(double microseconds, ist_deadline_t* deadline);

/* Sets the pair budget of the next query, and spheres_only: meshes obey no budget. */
ist_status_t ist_deadline_limit(const ist_deadline_t* deadline,
                                ist_penetration_settings_t* settings);

/* Records the answer and the time of a query under this budget. */
ist_status_t ist_deadline_record(ist_deadline_t* deadline, const ist_penetration_t* answer,
                                 double microseconds);

/* Not 0 if the coarsest levels of detail take longer than the deadline. */
int32_t ist_deadline_too_slow(const ist_deadline_t* deadline);

/* Whether two placed solids share a point. */
typedef int32_t ist_yes_no_t;
enum { IST_NO = 0, IST_YES = 1, IST_UNKNOWN = 2 }; /* yes and no are certain */

/* Takes a fraction of the time of a penetration. Unless the status is IST_OK the answer is unknown.
 */
ist_status_t ist_overlap(const ist_placed_t* a, const ist_placed_t* b, ist_workspace_t* workspace,
                         ist_yes_no_t* answer);
/* Whether they come within `margin` [u] ≥ 0 of each other: by the surfaces if both assets keep a
 * mesh. A negative margin, or NaN: IST_INVALID_INPUT. */
ist_status_t ist_overlap_within(const ist_placed_t* a, const ist_placed_t* b, double margin,
                                ist_workspace_t* workspace, ist_yes_no_t* answer);

/* SizeMatch: whether the sizes of two assets suit each other, independent of their poses. */
typedef struct ist_size_match {
  uint32_t size;
  ist_status_t status;
  double feature_size_a, feature_size_b; /* [u] the spheres do not resolve finer features */
  double ratio;                          /* ≥ 1, coarser grain over the finer */
  uint32_t a_is_coarser;                 /* 0 or 1, as are the others */
  uint32_t has_mesh;                     /* both assets keep their meshes */
  uint32_t needs_mesh;                   /* volumes and forces by spheres alone are misleading */
  uint32_t fits;                         /* has_mesh or not needs_mesh */
} ist_size_match_t;

/* Needs no workspace: takes nanoseconds. */
ist_status_t ist_get_size_match(const ist_placed_t* a, const ist_placed_t* b,
                                ist_size_match_t* fit);

/* Both in one call. Returns the worse status: the more negative one, or else the larger. */
ist_status_t ist_query(const ist_placed_t* a, const ist_placed_t* b,
                       const ist_penetration_settings_t* penetration_settings,
                       const ist_separation_settings_t* separation_settings,
                       ist_workspace_t* workspace, ist_penetration_t* penetration,
                       ist_separation_t* separation);

/* `whole`: the whole contact; may be null. */
ist_status_t ist_contact_patches(const ist_placed_t* a, const ist_placed_t* b,
                                 const ist_contact_settings_t* settings, ist_workspace_t* workspace,
                                 ist_contact_patches_t* patches, ist_penetration_t* whole);

/* The connected parts of the overlap as patches, by IST_EXACT whatever the settings say, and their
 * outlines: segments of the closed curves on which the surfaces cross. Seen from outside A, A's
 * surface inside B is to the left of each. A patch wholly inside the other solid has none.
 * IST_BUDGET_EXHAUSTED: max_visits stopped it. There is no outline, and the matched spheres'
 * patches are written. `whole`: may be null. */
ist_status_t ist_overlap_outline(const ist_placed_t* a, const ist_placed_t* b,
                                 const ist_contact_settings_t* settings, ist_workspace_t* workspace,
                                 ist_contact_patches_t* patches, ist_outline_t* outline,
                                 ist_penetration_t* whole);

/* Removes from patches, in place, the volume that protruding spheres add where flat faces meet,
 * each by its own depth. A patch reduced to nothing is kept, with zeros.
 * `patches`: those that ist_contact_patches() wrote for these two under these settings. */
ist_status_t ist_patches_without_protrusion(const ist_placed_t* a, const ist_placed_t* b,
                                            const ist_contact_settings_t* settings,
                                            ist_contact_patches_t* patches);

/* LensSettings; a null pointer means the finest matched spheres. */
typedef struct ist_lens_settings {
  uint32_t size;
  ist_measure_t measure;
  uint32_t detail_a, detail_b;
} ist_lens_settings_t;

/* OverlapLens: the overlap of two spheres. */
typedef struct ist_lens {
  double centre[3];            /* [u] middle of its thickness, world */
  double axis[3];              /* unit, from A's sphere to B's, world */
  double radius;               /* [u] where it is widest, across the axis */
  double thickness;            /* [u] along the axis */
  uint32_t sphere_a, sphere_b; /* in insertion order */
} ist_lens_t;

/* Space for lenses. */
typedef struct ist_lenses {
  uint32_t size;
  uint32_t lens_size; /* sizeof(ist_lens_t) */
  ist_lens_t* lenses; /* [capacity] */
  size_t capacity;
  size_t total, count; /* answer: number of lenses, and of lenses written */
} ist_lenses_t;

/* For pictures (lenses.h), of two assets. Needs no workspace. IST_INVALID_INPUT also for a level of
 * detail that an asset does not have. */
ist_status_t ist_overlap_lenses(const ist_placed_t* a, const ist_placed_t* b,
                                const ist_lens_settings_t* settings, ist_lenses_t* lenses);

/* --- Rays and points against one solid (raycast.h) -------------------------------------------- */

/* An asset must keep its mesh. Rays support half-spaces, balls, boxes, capsules and cylinders;
 * points support all shapes. Others return IST_MISSING_DATA. These functions need no workspace.
 * Each answers `count` rays or points and returns the least of their statuses, or an error of the
 * call. The numbers of a ray or point that cannot be answered, or is not finite or too far, are
 * NaN. */

typedef struct ist_ray {
  double origin[3];    /* [u] world */
  double direction[3]; /* world, of any length but 0 */
  double max_distance; /* [u] its length; 0: infinite */
} ist_ray_t;

/* RayHit: where a ray first meets the surface, from inside if it starts there. */
typedef struct ist_ray_hit {
  ist_status_t status;
  uint32_t triangle; /* of the kept mesh; UINT32_MAX: no hit, or a shape */
  double distance;   /* [u] infinite: no hit */
  double point[3];   /* [u] world */
  double normal[3];  /* unit, outward, world */
} ist_ray_hit_t;

/* SurfacePoint: the nearest point of the surface. */
typedef struct ist_surface_point {
  ist_status_t status;
  uint32_t triangle;  /* as above */
  double distance;    /* [u] signed: < 0 inside */
  double error;       /* [u] the solid's distance is within this of `distance` */
  double point[3];    /* [u] world */
  double gradient[3]; /* of the distance: unit, outward, world */
} ist_surface_point_t;

/* `hit_size`: sizeof(ist_ray_hit_t). */
ist_status_t ist_raycast(const ist_placed_t* solid, const ist_ray_t* rays, size_t count,
                         ist_ray_hit_t* hits, size_t hit_size);
/* `points`: [3 · count]. `answer_size`: sizeof(ist_surface_point_t). */
ist_status_t ist_closest_point(const ist_placed_t* solid, const double* points, size_t count,
                               ist_surface_point_t* answers, size_t answer_size);
/* IST_YES: inside; IST_NO: outside; IST_UNKNOWN: the status says why. */
ist_status_t ist_contains(const ist_placed_t* solid, const double* points, size_t count,
                          ist_yes_no_t* inside);

/* --- Wrenches (contact_law.h): force and torque on both bodies
 * ------------------------------------- */

/* These functions need no workspace. */

/* For a pressure of 1: −dV/d(the body's motion). */
typedef struct ist_wrench {
  double force[3];  /* [u²] out of the other body */
  double torque[3]; /* [u³] about the given point */
} ist_wrench_t;

typedef struct ist_wrenches_t {
  uint32_t size;
  ist_wrench_t on_a, on_b;
} ist_wrenches_t;

/* Constant velocity: one point moves straight, and the object turns about it. [T] is a unit of time
 * of the caller's. */
typedef struct ist_motion {
  double velocity[3];         /* [u/T] of `about`, world */
  double angular_velocity[3]; /* [rad/T] world */
  double about[3];            /* [u] in the object's own frame, before its scale */
} ist_motion_t;

/* On A about `point_a`, on B about `point_b`; `b` is B's pose in the query. */
ist_status_t ist_wrenches(const ist_penetration_t* contact, const ist_pose_t* b,
                          const double point_a[3], const double point_b[3],
                          ist_wrenches_t* wrenches);
ist_status_t ist_patch_wrenches(const ist_contact_patch_t* patch, const ist_pose_t* b,
                                const double point_a[3], const double point_b[3],
                                ist_wrenches_t* wrenches);

/* [u³/T] dV/dt while both solids of the query move; a null motion: at rest. */
ist_status_t ist_volume_rate(const ist_penetration_t* contact, const ist_placed_t* a,
                             const ist_placed_t* b, const ist_motion_t* motion_a,
                             const ist_motion_t* motion_b, double* rate);
ist_status_t ist_patch_volume_rate(const ist_contact_patch_t* patch, const ist_placed_t* a,
                                   const ist_placed_t* b, const ist_motion_t* motion_a,
                                   const ist_motion_t* motion_b, double* rate);

/* --- Contact laws (contact_law.h): from patches to a force ---------------------------------------
 */

/* ContactLaw: the pressure grows with depth. `stiffness` must be set. */
typedef struct ist_contact_law {
  uint32_t size;
  double stiffness;          /* [force/u³] > 0 */
  double area;               /* [u²] reference area; 0: the largest that each patch had */
  double damping;            /* [s/u] ≥ 0 */
  double friction;           /* ≥ 0, Coulomb's coefficient */
  double friction_stiffness; /* [force/u³] ≥ 0, of shear stress over stretch */
  double friction_damping;   /* [force·s/u³] ≥ 0, of shear stress over velocity */
} ist_contact_law_t;

/* ContactMemory: one per contact of two bodies, plain data. All zero is a new contact. */
typedef struct ist_patch_memory {
  uint64_t id;
  double area;       /* [u²] */
  double stretch[3]; /* [u] */
} ist_patch_memory_t;
typedef struct ist_contact_memory {
  ist_patch_memory_t patches[32];
  uint32_t count;
} ist_contact_memory_t;

/* A receives the opposite, about the same point. */
typedef struct ist_contact_force_t {
  uint32_t size;
  double force[3];     /* [force] on B, world */
  double torque[3];    /* [force·u] on B about B's origin, world */
  double normal_force; /* [force] Σ of pressure times area */
  double energy;       /* [force·u] stored in the springs */
} ist_contact_force_t;

/* `patches`: as ist_contact_patches() wrote them. `a`, `b`: as in that query. `step`: [s] since
 * the last call; motions are per second, and a null one is at rest. IST_INVALID_INPUT for a law or
 * step out of range; then `memory` does not change. */
ist_status_t ist_contact_force(const ist_contact_law_t* law, const ist_contact_patch_t* patches,
                               size_t count, const ist_placed_t* a, const ist_placed_t* b,
                               const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                               double step, ist_contact_memory_t* memory,
                               ist_contact_force_t* force);

/* --- Time of impact (time_of_impact.h) ------------------------------------------------------- */

/* The motion from one pose to another in `duration` > 0 [T]. `about`: null is the origin.
 * `scale`: the object's; 0 is taken for 1. */
ist_status_t ist_motion_between(const ist_pose_t* from, const ist_pose_t* to, double duration,
                                const double about[3], double scale, ist_motion_t* motion);

/* The pose of an object of that scale after `time` of its motion. */
ist_status_t ist_moved(const ist_pose_t* start, double scale, const ist_motion_t* motion,
                       double time, ist_pose_t* pose);

typedef int32_t ist_impact_kind_t;
enum {
  IST_NO_IMPACT = 0,         /* clear of each other over the whole interval */
  IST_IMPACT = 1,            /* at `time` no further apart than the tolerance, and approaching */
  IST_IMPACT_UNRESOLVED = 2, /* clear up to `time`; a later contact can be neither shown nor
                                ruled out */
  IST_IMPACT_OVERLAPPING = 3 /* they meet at the start */
};

/* ImpactSettings; a null pointer is a duration of 1 and defaults. */
typedef struct ist_impact_settings {
  uint32_t size;
  uint32_t max_visits; /* count of node pairs visited; 0: no limit */
  double duration;     /* [T] > 0: the interval is [0, duration] */
  double tolerance;    /* [u] 0: a thousandth of the smaller solid's bounding radius, or ten
                          times the error of the meshes if that is more */
} ist_impact_settings_t;

/* TimeOfImpact */
typedef struct ist_impact {
  uint32_t size;
  ist_status_t status; /* IST_BUDGET_EXHAUSTED: a limit; clear up to `time` */
  ist_impact_kind_t kind;
  uint32_t node_visits, surface_pairs;
  double time; /* [T] certified: the solids do not touch before */
  /* [u] Certified bounds of the solids' distance at `time`. distance_min may be nearly 0, also for
   * an impact; `time` is the proof that the solids do not touch before. */
  double distance_min, distance_max;
  double point_a[3], point_b[3]; /* [u] points of A and B at `time`, world; others may be nearer
                                    by a part of the tolerance */
  double normal[3];              /* unit, from A to B, world */
} ist_impact_t;

/* Null motions are at rest. */
ist_status_t ist_time_of_impact(const ist_placed_t* a, const ist_placed_t* b,
                                const ist_motion_t* motion_a, const ist_motion_t* motion_b,
                                const ist_impact_settings_t* settings, ist_workspace_t* workspace,
                                ist_impact_t* answer);

/* --- Batches ---------------------------------------------------------------------------------- */

typedef struct ist_pair {
  const ist_placed_t *a, *b;
} ist_pair_t;

/* Runs a batch on the caller's threads. */
typedef struct ist_parallel {
  uint32_t size;
  /* Calls work(batch, i) once for each i in [0, workers), on any threads, concurrently or not, and
   * returns when all calls have returned. Null: the calling thread does it all. */
  void (*run)(void* pool, size_t workers, void (*work)(void* batch, size_t worker), void* batch);
  void* pool; /* passed to `run` */
} ist_parallel_t;

/* answers[i] is that of ist_penetration(pairs[i]), with its status, errors included.
 * `answer_size`: sizeof(ist_penetration_t); the answers' own `size` is written, not read.
 * `workspaces`: [workers], one per worker, each made; without any, every answer is
 * IST_BUDGET_EXHAUSTED with no upper bound.
 * `parallel`: null is the calling thread. No lock or allocation except its own.
 * Returns IST_OK, or an error of the call; then no pair was evaluated. */
ist_status_t ist_penetration_batch(const ist_pair_t* pairs, size_t count,
                                   const ist_penetration_settings_t* settings,
                                   ist_workspace_t* workspaces, size_t workers,
                                   ist_penetration_t* answers, size_t answer_size,
                                   const ist_parallel_t* parallel);

/* The same for distances: `answer_size` is sizeof(ist_separation_t). */
ist_status_t ist_separation_batch(const ist_pair_t* pairs, size_t count,
                                  const ist_separation_settings_t* settings,
                                  ist_workspace_t* workspaces, size_t workers,
                                  ist_separation_t* answers, size_t answer_size,
                                  const ist_parallel_t* parallel);

/* patches[i] and wholes[i] are what ist_contact_patches(pairs[i]) writes; wholes[i] has its status,
 * errors included.
 * `patches`: [count], each set up with its own space.
 * `whole_size`: sizeof(ist_penetration_t); the wholes' own `size` is written, not read.
 * All else as for ist_penetration_batch(). */
ist_status_t ist_contact_patches_batch(const ist_pair_t* pairs, size_t count,
                                       const ist_contact_settings_t* settings,
                                       ist_workspace_t* workspaces, size_t workers,
                                       ist_contact_patches_t* patches, ist_penetration_t* wholes,
                                       size_t whole_size, const ist_parallel_t* parallel);

#ifdef __GNUC__
#pragma GCC visibility pop
#endif
#ifdef __cplusplus
}
#endif

#endif
