// ist as MuJoCo's narrow phase. mj_loadPluginLibrary() runs the function at the end of this file:
// it registers the plug-in "ist.solid" and puts collide() into the SDF column of MuJoCo's table of
// collision functions. A geom of type "sdf" with an instance of the plug-in then collides as the
// solid of its asset; all other geoms collide as before. Rays meet the solid's mesh.

#include <ist/c.h>
#include <ist/c_bake.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr char kName[] = "ist.solid";
constexpr int kMostPatches = 50;  ///< MuJoCo's own limit of contacts of two SDF geoms

int slot = -1;
mjfCollision before[mjNGEOMTYPES][mjNGEOMTYPES];  ///< MuJoCo's functions

struct Tree {
  ist_asset_t tree = {};
  ist_asset_info_t info = {};
  ~Tree() { ist_asset_release(&tree); }
  bool has_mesh() const { return info.mesh_triangles > 0; }
};

/// One copy for each key, shared by all models and states that use it. `make` fills the tree.
template <class Key, class Make>
std::shared_ptr<Tree> shared(const Key& key, Make make) {
  static std::mutex mutex;
  static std::map<Key, std::weak_ptr<Tree>> known;
  const std::lock_guard lock(mutex);
  if (std::shared_ptr<Tree> tree = known[key].lock()) return tree;
  const auto tree = std::make_shared<Tree>();
  if (!make(tree->tree)) return nullptr;
  tree->info.size = sizeof tree->info;
  ist_asset_get_info(&tree->tree, &tree->info);
  known[key] = tree;
  return tree;
}

struct Triangles {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> faces;

  /// Bakes only the mesh: exact queries need no spheres.
  bool bake(ist_asset_t& tree, std::string& message) const {
    ist_bake_settings_t settings = {};
    settings.size = sizeof settings;
    settings.threads = 1;
    settings.mesh_only = 1;
    char text[512] = "";
    const ist_status_t status =
        ist_bake(vertices.data()->data(), vertices.size(), faces.data()->data(), faces.size(),
                 &settings, &tree, text, sizeof text);
    if (status < 0) message = status == IST_NOT_BAKED ? text : ist_describe(status);
    return status >= 0;
  }
};

/// Identifies primitive geoms up to scale: type and half sizes over `scale_of`. The exact measure
/// uses an inscribed mesh, which makes no contact if the solids are apart.
using ShapeKey = std::array<double, 4>;

double scale_of(int type, const mjtNum* size) {
  return type == mjGEOM_BOX || type == mjGEOM_ELLIPSOID ? std::max({size[0], size[1], size[2]})
                                                        : size[0];
}

ShapeKey shape_key(int type, const mjtNum* size) {
  const double by = 1 / scale_of(type, size);
  switch (type) {
    case mjGEOM_CAPSULE:
    case mjGEOM_CYLINDER:
      return {double(type), 1, 1, size[1] * by};
    default:
      return {double(type), size[0] * by, size[1] * by, size[2] * by};
  }
}

bool is_primitive(int type) { return type >= mjGEOM_SPHERE && type <= mjGEOM_BOX; }

/// Rings from pole to pole. Those of a ball subdivide the faces of an octahedron: no vertex has
/// many triangles. The mesh is within 1/1,800 of the radius of a round shape.
Triangles mesh_of(const ShapeKey& key) {
  constexpr uint32_t kQuarter = 24;  // of a ring's points
  struct Ring {
    uint32_t count;
    double radius, height;
  };
  const auto type = static_cast<int>(key[0]);
  const bool capsule = type == mjGEOM_CAPSULE, box = type == mjGEOM_BOX;
  // Stiff contacts feel the bumps of facets, and what rolls over them gains energy. A cylinder that
  // stands touches with its whole edge, in a time that grows with it.
  const uint32_t around = (capsule ? 16 : 8) * kQuarter;
  std::vector<Ring> lower;  // and its mirror image
  const double half = capsule || type == mjGEOM_CYLINDER ? key[3] : 1;
  if (box || type == mjGEOM_CYLINDER) {
    lower = {{1, 0, -half}, {box ? 4 : around, 1, -half}};
  } else {
    for (uint32_t k = 0; k <= kQuarter; ++k) {
      const double angle = 0.5 * std::numbers::pi * k / kQuarter;
      lower.push_back({capsule && k == kQuarter ? around : std::max(1u, 4 * k), std::sin(angle),
                       (k < kQuarter ? -std::cos(angle) : 0) - (capsule ? half : 0)});
    }
  }
  const bool stretched = box || type == mjGEOM_ELLIPSOID;
  const double by[3] = {stretched ? key[1] : 1, stretched ? key[2] : 1, stretched ? key[3] : 1};
  Triangles out;
  const auto add = [&](const Ring& ring, double sign) {
    for (uint32_t k = 0; k < ring.count; ++k) {
      const double angle = 2 * std::numbers::pi * k / ring.count;
      const double x =
          box && ring.count > 1 ? (k % 3 == 0 ? 1 : -1) : ring.radius * std::cos(angle);
      const double y = box && ring.count > 1 ? (k < 2 ? 1 : -1) : ring.radius * std::sin(angle);
      out.vertices.push_back({x * by[0], y * by[1], sign * ring.height * by[2]});
    }
  };
  std::vector<uint32_t> counts;
  for (const Ring& ring : lower) {
    counts.push_back(ring.count);
    add(ring, 1);
  }
  const size_t shared_rings = lower.back().height == 0 ? 1 : 0;  // a ball's equator
  for (size_t k = lower.size() - shared_rings; k-- > 0;) {
    counts.push_back(lower[k].count);
    add(lower[k], -1);
  }
  uint32_t below = 0;
  for (size_t ring = 0; ring + 1 < counts.size(); ++ring) {
    const uint32_t a = counts[ring], b = counts[ring + 1], above = below + a;
    for (uint32_t i = 0, j = 0; i < a || j < b;) {
      if (j == b || (i < a && (i + 1) * b <= (j + 1) * a)) {
        if (a > 1) out.faces.push_back({below + i, below + (i + 1) % a, above + j % b});
        ++i;
      } else {
        if (b > 1) out.faces.push_back({below + i % a, above + (j + 1) % b, above + j});
        ++j;
      }
    }
    below = above;
  }
  return out;
}

struct Shape {
  std::shared_ptr<Tree> tree;
  ShapeKey key = {};
};

/// The configuration of an <instance>.
struct Instance {
  std::shared_ptr<Tree> tree;
  int patches = 0;  ///< 0: chosen by the pair's measure
  uint32_t measure = IST_EXACT;
  double scale = 0;           ///< 0: the mesh's
  uint64_t number = 0;        ///< unique in this process; copies have the same content
  int geom = -1;              ///< one of the geoms with this instance
  ist_placed_t local = {};    ///< the asset in that geom's own frame, for rays
  std::vector<Shape> shapes;  ///< of the model's primitive geoms, by geom; else empty
};

/// A thread's own scratch memory.
struct Scratch {
  ist_workspace_t workspace = {};
  ist_contact_patch_t patches[kMostPatches];
  Scratch() { ist_workspace_make(0, nullptr, &workspace); }
  ~Scratch() { ist_workspace_release(&workspace); }
};

Scratch& scratch() {
  static thread_local Scratch mine;
  return mine;
}

const Instance* instance_of(const mjModel* m, const mjData* d, int geom) {
  const int i = m->geom_plugin[geom];
  return i >= 0 && m->plugin[i] == slot ? reinterpret_cast<const Instance*>(d->plugin_data[i])
                                        : nullptr;
}

template <class Pose>
void write_pose(Pose& pose, const mjtNum* q, const mjtNum* t) {
  for (int k = 0; k < 4; ++k) pose.q[k] = q[k];
  for (int k = 0; k < 3; ++k) pose.t[k] = t[k];
}

/// An asset is in the frame of the mesh's file; MuJoCo moves a mesh to its centre of mass and
/// rotates it to its principal axes. `quat`, `pos`: of the geom.
ist_placed_t place(const mjModel* m, const mjtNum* quat, const mjtNum* pos, int geom,
                   const Instance& solid) {
  ist_placed_t out = {};
  out.size = sizeof out;
  out.asset = &solid.tree->tree;
  mjtNum q[4] = {quat[0], quat[1], quat[2], quat[3]}, t[3] = {pos[0], pos[1], pos[2]};
  out.scale = solid.scale > 0 ? solid.scale : 1;
  if (const int mesh = m->geom_dataid[geom]; mesh >= 0) {
    mjtNum back[4], shift[3];
    mju_negQuat(back, m->mesh_quat + 4 * mesh);
    mju_mulQuat(q, quat, back);
    mju_normalize4(q);
    mju_rotVecQuat(shift, m->mesh_pos + 3 * mesh, q);
    mju_subFrom3(t, shift);
    if (!(solid.scale > 0)) out.scale = m->mesh_scale[3 * mesh];
  }
  write_pose(out.pose, q, t);
  return out;
}

ist_placed_t place(const mjModel* m, const mjData* d, int geom, const Instance& solid) {
  return place(m, d->geom_xquat + 4 * geom, d->geom_xpos + 3 * geom, geom, solid);
}

/// A geom without an asset, as a shape. False if there is no such shape.
bool shape_of(const mjModel* m, const mjData* d, int geom, ist_shape_t& field,
              ist_placed_t& placed) {
  field = {};
  field.size = sizeof field;
  placed = {};
  placed.size = sizeof placed;
  placed.shape = &field;
  write_pose(placed.pose, d->geom_xquat + 4 * geom, d->geom_xpos + 3 * geom);
  const mjtNum* size = m->geom_size + 3 * geom;
  switch (m->geom_type[geom]) {
    case mjGEOM_SPHERE:
      field.kind = IST_BALL;
      field.as.ball.radius = size[0];
      return true;
    case mjGEOM_CAPSULE:
      field.kind = IST_CAPSULE;
      field.as.capsule.radius = size[0];
      field.as.capsule.half_height = size[1];
      return true;
    case mjGEOM_CYLINDER:
      field.kind = IST_CYLINDER;
      field.as.cylinder.radius = size[0];
      field.as.cylinder.half_height = size[1];
      return true;
    case mjGEOM_BOX:
      field.kind = IST_BOX;
      for (int k = 0; k < 3; ++k) field.as.box.half_extents[k] = size[k];
      return true;
    default:
      return false;
  }
}

/// A force at the patch's point is equivalent to the patch; at its centroid it would have another
/// torque.
void write_contact(const ist_contact_patch_t& patch, mjPreContact& out) {
  mjtNum shift[3];
  mju_sub3(shift, patch.point, patch.centroid);
  // A patch that pushes in both directions has its point far away, and little area.
  const double length = mju_norm3(shift), most = 2 * std::sqrt(patch.area);
  if (length > most) mju_scl3(shift, shift, most / length);
  for (int k = 0; k < 3; ++k) {
    out.pos[k] = patch.centroid[k] + shift[k];
    out.normal[k] = patch.normal[k];
    out.tangent[k] = 0;
  }
  // The area vanishes where forces cancel, so the cube root of the volume bounds the depth.
  out.dist = -std::min(patch.volume / patch.area, std::cbrt(patch.volume));
}

void complain_once(const char* text) {
  static std::mutex mutex;
  static std::map<std::string, bool> said;
  const std::lock_guard lock(mutex);
  if (!std::exchange(said[text], true)) mju_warning("%s", text);
}

/// MuJoCo's own function for a geom against the hull of g2's mesh. It may write the maximum number
/// of contacts of two geoms, while there may be memory for fewer.
int collide_hull(const mjModel* m, mjData* d, mjPreContact* out, int g1, int g2, mjtNum margin) {
  mjPreContact all[mjMAXCONPAIR];
  const int type = std::min<int>(m->geom_type[g1], mjGEOM_MESH);  // for a solid its hull too
  const mjfCollision collide_convex = before[type][mjGEOM_MESH];
  // A margin of metres, as in mj_geomDistance(), makes the depths of overlaps wrong.
  int count = collide_convex(m, d, all, g1, g2, 0);
  if (count == 0 && margin > 0) count = collide_convex(m, d, all, g1, g2, margin);
  count = std::min(count, mj_maxContact(m, g1, g2, margin > 0));
  std::copy_n(all, count, out);
  return count;
}

/// A ball g1 against a solid's mesh: the nearest point of the mesh, and anything that the ball
/// still overlaps once it is pushed out there, such as the other wall of a groove.
int collide_ball(const mjModel* m, mjData* d, mjPreContact* out, int g1, const ist_placed_t& solid,
                 mjtNum margin, int most) {
  const mjtNum radius = m->geom_size[3 * g1];
  const mjtNum* const centre = d->geom_xpos + 3 * g1;
  mjtNum place[3] = {centre[0], centre[1], centre[2]};
  int count = 0;
  for (mjtNum deep = 0; count < std::min(most, 4); ++count) {
    ist_surface_point_t near = {};
    if (const ist_status_t status = ist_closest_point(&solid, place, 1, &near, sizeof near);
        status < 0) {
      complain_once((std::string("ist.solid: ") + ist_describe(status)).c_str());
      return count;
    }
    const mjtNum push = radius - near.distance;
    if (count == 0 ? push <= -margin : push <= 0.02 * deep) return count;
    mjtNum way[3];
    mju_sub3(way, centre, near.point);
    mjPreContact& contact = out[count];
    contact.dist = mju_dot3(way, near.gradient) - radius;
    if (count > 0 && contact.dist > 0) return count;
    mju_scl3(contact.normal, near.gradient, -1);
    mju_addScl3(contact.pos, centre, near.gradient, -(radius + 0.5 * contact.dist));
    mju_zero3(contact.tangent);
    mju_addToScl3(place, near.gradient, push);
    deep = std::max(deep, push);
  }
  return count;
}

/// The measure of two solids, or nothing if their data suits none.
std::optional<uint32_t> measure_of(const Instance& a, const Instance& b) {
  const uint32_t wish = a.measure == IST_EXACT ? b.measure : a.measure;
  if (wish != IST_EXACT && a.tree->info.spheres > 0 && b.tree->info.spheres > 0) return wish;
  if (a.tree->has_mesh() && b.tree->has_mesh()) return IST_EXACT;
  return std::nullopt;
}

/// If one solid is wholly inside the other, no force of the overlap leads out. Returns a contact
/// that pushes the inner one to the nearest face, at most as deep as its own size.
bool find_way_out(const ist_placed_t& a, const ist_placed_t& b, const ist_penetration_t& whole,
                  mjPreContact& out) {
  constexpr double kWhole = 0.99, kNone = 0.01;
  const double size = std::cbrt(whole.volume);
  if (a.asset == nullptr || !(mju_norm3(whole.force) < kNone * size * size)) return false;
  for (const bool inner_is_b : {false, true}) {
    const ist_placed_t &inner = inner_is_b ? b : a, &outer = inner_is_b ? a : b;
    ist_asset_info_t info = {};
    info.size = sizeof info;
    ist_bounds_t box = {};
    box.size = sizeof box;
    ist_surface_point_t near = {};
    if (ist_asset_get_info(inner.asset, &info) < 0 || ist_placed_bounds(&inner, &box) < 0 ||
        !(whole.volume > kWhole * info.volume * std::pow(inner.scale, 3)) ||
        ist_closest_point(&outer, box.centre, 1, &near, sizeof near) < 0)
      continue;
    out.dist = -std::min(size, box.radius - near.distance);
    mju_copy3(out.pos, box.centre);
    mju_scl3(out.normal, near.gradient, inner_is_b ? 1 : -1);
    mju_zero3(out.tangent);
    return true;
  }
  return false;
}

/// MuJoCo's collision function of two geoms, the second of type sdf: types are in the order of
/// mjtGeom, and sdf is the last.
int collide(const mjModel* m, mjData* d, mjPreContact* out, int g1, int g2, mjtNum margin) {
  const int type = m->geom_type[g1];
  const Instance *first = instance_of(m, d, g1), *second = instance_of(m, d, g2);
  // An SDF of another plug-in: MuJoCo queries distances of both.
  if (second == nullptr || (first == nullptr && type == mjGEOM_SDF))
    return before[type][mjGEOM_SDF](m, d, out, g1, g2, margin);
  ist_contact_settings_t settings = {};
  settings.size = sizeof settings;
  ist_placed_t a;
  ist_shape_t field;
  if (first != nullptr) {
    const std::optional<uint32_t> measure = measure_of(*first, *second);
    if (!measure) {
      complain_once(
          "ist.solid: of two solids one has no spheres and the other no mesh: their hulls collide");
      return collide_hull(m, d, out, g1, g2, margin);
    }
    settings.measure = *measure;
    a = place(m, d, g1, *first);
  } else if (!is_primitive(type)) {
    return collide_hull(m, d, out, g1, g2, margin);
  } else if (second->measure != IST_EXACT && shape_of(m, d, g1, field, a)) {
    settings.measure = second->measure;
  } else if (type == mjGEOM_SPHERE) {
    return collide_ball(m, d, out, g1, place(m, d, g2, *second), margin,
                        std::min(second->patches > 0 ? second->patches : kMostPatches,
                                 mj_maxContact(m, g1, g2, margin > 0)));
  } else {
    const Shape& shape = second->shapes[static_cast<size_t>(g1)];
    const ShapeKey now = shape_key(type, m->geom_size + 3 * g1);
    bool same = shape.tree != nullptr && second->tree->has_mesh();
    // The facets of a huge shape are too coarse for a tiny solid.
    const bool flat = type == mjGEOM_BOX || type == mjGEOM_CYLINDER;
    same = same && (flat || scale_of(type, m->geom_size + 3 * g1) < 50 * m->geom_rbound[g2]);
    for (size_t k = 0; k < now.size(); ++k) same = same && std::fabs(now[k] - shape.key[k]) < 1e-6;
    // In that case, and if the model has changed since mjData was made, MuJoCo queries distances.
    if (!same) return before[type][mjGEOM_SDF](m, d, out, g1, g2, margin);
    settings.measure = IST_EXACT;
    a = {};
    a.size = sizeof a;
    a.asset = &shape.tree->tree;
    a.scale = scale_of(type, m->geom_size + 3 * g1);
    write_pose(a.pose, d->geom_xquat + 4 * g1, d->geom_xpos + 3 * g1);
  }
  Scratch& memory = scratch();
  const ist_placed_t b = place(m, d, g2, *second);
  // Steps of this pair in this data belong to one motion.
  settings.pair_id = static_cast<uint32_t>((reinterpret_cast<uintptr_t>(d) >> 4) * 31 +
                                           static_cast<uintptr_t>(g1 * m->ngeom + g2 + 1));
  ist_contact_patches_t patches = {};
  patches.size = sizeof patches;
  patches.patch_size = sizeof memory.patches[0];
  patches.patches = memory.patches;
  const int room = std::min(mj_maxContact(m, g1, g2, margin > 0), kMostPatches);
  const int usual = settings.measure == IST_EXACT ? 16 : 8;
  const int most = second->patches > 0 ? second->patches : usual;
  patches.capacity = static_cast<size_t>(std::max(0, std::min(most, room)));
  if (patches.capacity == 0) return 0;
  ist_penetration_t whole = {};
  whole.size = sizeof whole;
  ist_status_t status = ist_contact_patches(&a, &b, &settings, &memory.workspace, &patches, &whole);
  if (status < 0) {
    complain_once((std::string("ist.solid: ") + ist_describe(status)).c_str());
    return 0;
  }
  if (std::isnan(whole.volume)) {
    complain_once("ist.solid: a limit stopped an exact query: there the hulls collide");
    return collide_hull(m, d, out, g1, g2, margin);
  }
  if (whole.volume > 0 && find_way_out(a, b, whole, *out)) return 1;
  int count = 0;
  for (size_t i = 0; i < patches.count; ++i)
    if (memory.patches[i].area > 0) write_contact(memory.patches[i], out[count++]);
  if (count > 0 || !(margin > 0) || whole.volume > 0 || room < 1) return count;
  // Apart: one contact at the gap, for margins and mj_geomDistance().
  ist_separation_t gap = {};
  gap.size = sizeof gap;
  status = ist_separation(&a, &b, nullptr, &memory.workspace, &gap);
  if (status < 0 || !(gap.distance > 0) || gap.distance >= margin) return 0;
  out->dist = gap.distance;
  for (int k = 0; k < 3; ++k) {
    out->pos[k] = 0.5 * (gap.point_a[k] + gap.point_b[k]);
    out->normal[k] = gap.normal[k];
    out->tangent[k] = 0;
  }
  return 1;
}

/// MuJoCo marches along a ray by sdf_distance() with at most 40 steps, which misses grazing hits.
/// After reset() the first point is the ray's origin, and the second is as far along it as the
/// first distance. So the second answer is the remaining distance to the hit, and the third is 0.
struct March {
  const void* solid = nullptr;  ///< null: no march
  int step = 0;
  bool missed = false;
  double way = 0;  ///< distance from the origin to the next point
  mjtNum origin[3] = {}, target[3] = {}, normal[3] = {};
};
thread_local March march;

bool near(double a, double b, double size) { return std::fabs(a - b) <= 1e-9 * (size + b); }

/// Positive outside. Points and answers are in the geom's own frame.
ist_surface_point_t find_nearest(const Instance& solid, const mjtNum x[3]) {
  ist_surface_point_t answer = {};
  if (ist_closest_point(&solid.local, x, 1, &answer, sizeof answer) >= 0) return answer;
  complain_once("ist.solid: a solid has no mesh: neither rays nor cloths meet it");
  answer.distance = 2e6;  // MuJoCo treats 1e6 as a miss
  return answer;
}

/// MuJoCo's search on a triangle queries its corners again and again, so answers are cached.
ist_surface_point_t nearest(const Instance& solid, const mjtNum x[3]) {
  struct Known {
    uint64_t number = 0;
    mjtNum x[3] = {};
    ist_surface_point_t answer = {};
  };
  static thread_local Known known[64];
  uint64_t bits = solid.number;
  for (int k = 0; k < 3; ++k) bits = (bits ^ std::bit_cast<uint64_t>(x[k])) * 0x9e3779b97f4a7c15u;
  Known& one = known[bits >> 58];
  if (one.number != solid.number || std::memcmp(one.x, x, sizeof one.x) != 0) {
    one.answer = find_nearest(solid, x);
    one.number = solid.number;
    mju_copy3(one.x, x);
  }
  return one.answer;
}

mjtNum distance(const mjtNum x[3], const mjData* d, int i) {
  const auto& solid = *reinterpret_cast<const Instance*>(d->plugin_data[i]);
  March& now = march;
  if (now.solid == &solid && now.step > 0) {
    mjtNum way[3];
    mju_sub3(way, x, now.origin);
    const double length = mju_norm3(way);
    if (!near(length, now.way, mju_norm3(now.origin) + mju_norm3(x))) {
      now.solid = nullptr;
    } else if (now.step == 2) {
      now.step = 3;
      return 0;
    } else if (now.step == 1 && solid.tree->has_mesh()) {
      ist_ray_t ray = {};
      mju_copy3(ray.origin, now.origin);
      mju_copy3(ray.direction, way);
      ist_ray_hit_t hit = {};
      if (ist_raycast(&solid.local, &ray, 1, &hit, sizeof hit) < 0 ||
          !std::isfinite(hit.distance)) {
        now.missed = true;
        return 2e6;
      }
      now.step = 2;
      now.way = std::max(hit.distance, length);
      mju_copy3(now.target, hit.point);
      mju_copy3(now.normal, hit.normal);
      return now.way - length;
    }
  }
  const double answer = nearest(solid, x).distance;
  if (now.solid == &solid && now.step == 0) {
    now.step = 1;
    now.way = std::fabs(answer);
    mju_copy3(now.origin, x);
  }
  return answer;
}

void gradient(mjtNum out[3], const mjtNum x[3], const mjData* d, int i) {
  const auto& solid = *reinterpret_cast<const Instance*>(d->plugin_data[i]);
  if (march.solid == &solid && march.step >= 2 &&
      mju_dist3(x, march.target) <= 1e-6 * (march.way + mju_norm3(x))) {
    mju_copy3(out, march.normal);
    return;
  }
  mju_copy3(out, nearest(solid, x).gradient);
}

/// Refuses unreadable values: MuJoCo raises its own error after the warning.
bool read_number(const mjModel* m, int i, const char* key, double& value) {
  const char* text = mj_getPluginConfig(m, i, key);
  if (text == nullptr || *text == 0) return true;
  char* end = nullptr;
  value = std::strtod(text, &end);
  if (end != text && *end == 0 && std::isfinite(value) && value >= 0) return true;
  mju_warning("ist.solid: %s=\"%s\" is not a number ≥ 0", key, text);
  return false;
}

bool collides(const mjModel* m, int geom) {
  bool paired = m->geom_contype[geom] != 0 || m->geom_conaffinity[geom] != 0;
  for (int k = 0; k < m->npair && !paired; ++k)
    paired = m->pair_geom1[k] == geom || m->pair_geom2[k] == geom;
  return paired;
}

/// The mesh of a geom in the model: in the frame of its file, with its scale.
Triangles mesh_of_model(const mjModel* m, int mesh) {
  Triangles out;
  const float* const v = m->mesh_vert + 3 * m->mesh_vertadr[mesh];
  const int* const f = m->mesh_face + 3 * m->mesh_faceadr[mesh];
  for (int k = 0; k < m->mesh_vertnum[mesh]; ++k) {
    const mjtNum x[3] = {v[3 * k], v[3 * k + 1], v[3 * k + 2]};
    std::array<double, 3> y;
    mju_rotVecQuat(y.data(), x, m->mesh_quat + 4 * mesh);
    mju_addTo3(y.data(), m->mesh_pos + 3 * mesh);
    out.vertices.push_back(y);
  }
  for (int k = 0; k < m->mesh_facenum[mesh]; ++k)
    out.faces.push_back({static_cast<uint32_t>(f[3 * k]), static_cast<uint32_t>(f[3 * k + 1]),
                         static_cast<uint32_t>(f[3 * k + 2])});
  return out;
}

/// Warns if an asset lies elsewhere than a mesh of the model, as one baked from the file of a mesh
/// with refpos does, or an old one.
void compare_boxes(const mjModel* m, int mesh, double scale, const char* file, const Tree& tree) {
  ist_bounds_t box = {};
  box.size = sizeof box;
  if (ist_asset_get_bounds(&tree.tree, &box) < 0) return;
  double size = 0, off = 0;
  const Triangles own = mesh_of_model(m, mesh);
  for (size_t k = 0; k < 3; ++k) {
    const auto along = [k](const auto& a, const auto& b) { return a[k] < b[k]; };
    const auto [low, high] = std::minmax_element(own.vertices.begin(), own.vertices.end(), along);
    size = std::max(size, (*high)[k] - (*low)[k]);
    off = std::max({off, std::abs((*low)[k] - scale * box.lower[k]),
                    std::abs((*high)[k] - scale * box.upper[k])});
  }
  constexpr double kElsewhere = 0.05;
  if (off > kElsewhere * size)
    complain_once(("ist.solid: " + std::string(file) + " lies elsewhere than the mesh \"" +
                   (m->names + m->name_meshadr[mesh]) +
                   "\": bake it with the mesh's scale, refpos and refquat, and set the config "
                   "key scale to 1, or use ist.mujoco.attach")
                      .c_str());
}

/// Loads the file, or bakes the model's own mesh if there is none, e.g. after a move.
bool find_tree(const mjModel* m, const char* file, Instance& out) {
  ist_status_t status = IST_OK;
  if (file != nullptr && *file != 0) {
    out.tree = shared(std::string(file), [&](ist_asset_t& tree) {
      errno = 0;
      return (status = ist_asset_load(file, nullptr, &tree)) >= 0;
    });
    if (out.tree) return true;
    if (status != IST_CANNOT_READ || errno != ENOENT) {
      mju_warning("ist.solid: %s: %s", file, ist_describe(status));
      return false;
    }
  }
  const int mesh = out.geom < 0 ? -1 : m->geom_dataid[out.geom];
  if (mesh < 0) {
    mju_warning("ist.solid: the instance has no file, and no geom with a mesh has the instance");
    return false;
  }
  const Triangles triangles = mesh_of_model(m, mesh);
  std::string message;
  std::string key(reinterpret_cast<const char*>(triangles.vertices.data()),
                  triangles.vertices.size() * sizeof triangles.vertices[0]);
  key.append(reinterpret_cast<const char*>(triangles.faces.data()),
             triangles.faces.size() * sizeof triangles.faces[0]);
  out.tree = shared(key, [&](ist_asset_t& tree) { return triangles.bake(tree, message); });
  out.scale = 1;
  const char* const name = m->names + m->name_meshadr[mesh];
  if (!out.tree) {
    mju_warning("ist.solid: the mesh \"%s\" cannot be baked: %s", name, message.c_str());
    return false;
  }
  if (file != nullptr && *file != 0)
    complain_once(("ist.solid: there is no " + std::string(file) +
                   ": the solid is MuJoCo's copy of the mesh \"" + name + "\"")
                      .c_str());
  return true;
}

int init(const mjModel* m, mjData* d, int i) {
  static std::atomic<uint64_t> count = 0;
  auto made = std::make_unique<Instance>();
  made->number = ++count;
  double patches = made->patches;
  if (!read_number(m, i, "patches", patches) || !read_number(m, i, "scale", made->scale)) return -1;
  if (patches != 0 &&
      !(patches >= 1 && patches <= kMostPatches && patches == std::floor(patches))) {
    mju_warning("ist.solid: patches=\"%g\" is not a whole number from 1 to %d", patches,
                kMostPatches);
    return -1;
  }
  made->patches = static_cast<int>(patches);
  const char* measure = mj_getPluginConfig(m, i, "measure");
  const bool chosen = measure != nullptr && *measure != 0;
  if (chosen) {
    static const std::map<std::string, uint32_t> kMeasures = {
        {"matched", IST_MATCHED}, {"inner", IST_INNER}, {"exact", IST_EXACT}};
    const auto found = kMeasures.find(measure);
    if (found == kMeasures.end()) {
      mju_warning("ist.solid: measure=\"%s\" is none of matched, inner, exact", measure);
      return -1;
    }
    made->measure = found->second;
  }
  for (auto geom = static_cast<int>(m->ngeom); geom-- > 0;)
    if (m->geom_plugin[geom] == i) made->geom = geom;
  const char* file = mj_getPluginConfig(m, i, "file");
  if (!find_tree(m, file, *made)) return -1;
  if (!chosen && !made->tree->has_mesh()) made->measure = IST_INNER;
  if (made->measure == IST_EXACT ? !made->tree->has_mesh() : made->tree->info.spheres == 0) {
    mju_warning("ist.solid: %s: measure=\"%s\" needs an asset with %s",
                file ? file : "a mesh without file", measure,
                made->measure == IST_EXACT ? "a mesh" : "spheres");
    return -1;
  }
  for (int geom = 0; geom < m->ngeom && !(made->scale > 0); ++geom) {
    const int mesh = m->geom_dataid[geom];
    if (m->geom_plugin[geom] != i || mesh < 0) continue;
    const mjtNum* const s = m->mesh_scale + 3 * mesh;
    if (s[0] > 0 && s[0] == s[1] && s[0] == s[2]) continue;
    mju_warning(
        "ist.solid: %s: the mesh has the scale \"%g %g %g\"; bake with --scale %g,%g,%g "
        "and set the config key scale to 1",
        file, s[0], s[1], s[2], s[0], s[1], s[2]);
    return -1;
  }
  for (int geom = 0; geom < m->ngeom; ++geom)
    if (const int mesh = m->geom_dataid[geom]; m->geom_plugin[geom] == i && mesh >= 0 && file)
      compare_boxes(m, mesh, made->scale > 0 ? made->scale : m->mesh_scale[3 * mesh], file,
                    *made->tree);
  if (made->geom >= 0) {
    const mjtNum quat[4] = {1, 0, 0, 0}, pos[3] = {0, 0, 0};
    made->local = place(m, quat, pos, made->geom, *made);
  }
  made->shapes.resize(static_cast<size_t>(m->ngeom));
  for (int geom = 0; geom < m->ngeom; ++geom) {
    const int type = m->geom_type[geom];
    if (!is_primitive(type) || type == mjGEOM_SPHERE || !collides(m, geom)) continue;
    Shape& shape = made->shapes[static_cast<size_t>(geom)];
    shape.key = shape_key(type, m->geom_size + 3 * geom);
    std::string message;
    shape.tree = shared(shape.key,
                        [&](ist_asset_t& tree) { return mesh_of(shape.key).bake(tree, message); });
    if (shape.tree) continue;
    mju_warning("ist.solid: the shape of geom %d cannot be baked: %s", geom, message.c_str());
    return -1;
  }
  d->plugin_data[i] = reinterpret_cast<uintptr_t>(made.release());
  return 0;
}

}  // namespace

mjPLUGIN_LIB_INIT(ist) {
  // In 4000000 (4.0.0) the last three digits are fixes, which change no type.
  if (mj_version() / 1000 != mjVERSION_HEADER / 1000) {
    mju_warning("ist.solid is for MuJoCo %d.%d; this is %d: it is not registered",
                mjVERSION_HEADER / 1000000, mjVERSION_HEADER / 1000 % 1000, mj_version());
    return;
  }
  if (mjp_getPlugin(kName, nullptr) != nullptr) {
    mju_warning("ist.solid is registered already: this copy of the plug-in is not used");
    return;
  }
  std::memcpy(before, mjCOLLISIONFUNC, sizeof before);
  // A plane meets a solid exactly where it meets its hull, so MuJoCo's own function is exact.
  for (int type = mjGEOM_PLANE + 1; type <= mjGEOM_SDF; ++type)
    mjCOLLISIONFUNC[type][mjGEOM_SDF] = collide;
  static const char* const kKeys[] = {"file", "patches", "measure", "scale"};
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = kName;
  plugin.capabilityflags = mjPLUGIN_SDF;
  plugin.nattribute = sizeof kKeys / sizeof *kKeys;
  plugin.attributes = kKeys;
  plugin.nstate = [](const mjModel*, int) { return 0; };
  plugin.init = init;
  plugin.copy = [](mjData* to, const mjModel*, const mjData* from, int i) {
    to->plugin_data[i] = reinterpret_cast<uintptr_t>(
        new Instance(*reinterpret_cast<const Instance*>(from->plugin_data[i])));
  };
  plugin.destroy = [](mjData* d, int i) {
    delete reinterpret_cast<Instance*>(d->plugin_data[i]);
    d->plugin_data[i] = 0;
  };
  // A ray begins with a call without state, and ends with one if it misses.
  plugin.reset = [](const mjModel*, mjtNum* state, void* solid, int) {
    const bool ends = march.solid == solid && march.missed;
    march = {};
    if (state == nullptr && !ends) march.solid = solid;
  };
  plugin.compute = [](const mjModel*, mjData*, int, int) { march.solid = nullptr; };
  // MuJoCo calls these for rays, cloths, touch grids and SDFs of other plug-ins.
  plugin.sdf_distance = distance;
  plugin.sdf_gradient = gradient;
  // These would build a mesh by marching cubes; the mesh of an asset is a file.
  plugin.sdf_staticdistance = [](const mjtNum x[3], const mjtNum*) -> mjtNum {
    return mju_norm3(x) - 0.5;
  };
  plugin.sdf_aabb = [](mjtNum box[6], const mjtNum*) {
    for (int k = 0; k < 6; ++k) box[k] = k < 3 ? 0 : 1;
  };
  plugin.sdf_attribute = [](mjtNum*, const char**, const char**) {};
  slot = mjp_registerPlugin(&plugin);
}
