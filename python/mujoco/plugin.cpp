// ist as MuJoCo's narrow phase. mj_loadPluginLibrary() runs the function at the end of this file:
// it registers the plug-in "ist.solid" and puts collide() into the SDF column of MuJoCo's table of
// collision functions. A geom of type "sdf" with an instance of the plug-in then collides as the
// solid of its asset; all other geoms collide as before.

#include <ist/ist.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace {

constexpr char kName[] = "ist.solid";
constexpr int kMostPatches = 50;  ///< MuJoCo's own limit of contacts of two SDF geoms

int slot = -1;
mjfCollision before[mjNGEOMTYPES][mjNGEOMTYPES];  ///< MuJoCo's functions

struct Tree {
  ist_tree_t tree = {};
  ~Tree() { ist_tree_release(&tree); }
};

/// One copy of a file, whichever models and states use it.
std::shared_ptr<Tree> load(const std::string& file, ist_status_t& status) {
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<Tree>> loaded;
  const std::lock_guard lock(mutex);
  std::shared_ptr<Tree> tree = loaded[file].lock();
  if (tree) return tree;
  tree = std::make_shared<Tree>();
  status = ist_tree_load(file.c_str(), nullptr, &tree->tree);
  if (status < 0) return nullptr;
  loaded[file] = tree;
  return tree;
}

/// Meshes of more triangles are left to their spheres, which cost the same for any mesh.
constexpr uint32_t kMostExact = 5000;

/// What an <instance> configures.
struct Instance {
  std::shared_ptr<Tree> tree;
  int patches = 0;  ///< 0: by the pair's measure
  uint32_t measure = IST_MATCHED;
  double scale = 0;  ///< 0: the mesh's
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

/// An asset is in the frame of the mesh's file; MuJoCo moves a mesh to its centre of mass and turns
/// it to its principal axes.
ist_placed_t place(const mjModel* m, const mjData* d, int geom, const Instance& solid) {
  ist_placed_t out = {};
  out.size = sizeof out;
  out.tree = &solid.tree->tree;
  mjtNum q[4] = {d->geom_xquat[4 * geom], d->geom_xquat[4 * geom + 1], d->geom_xquat[4 * geom + 2],
                 d->geom_xquat[4 * geom + 3]};
  mjtNum t[3] = {d->geom_xpos[3 * geom], d->geom_xpos[3 * geom + 1], d->geom_xpos[3 * geom + 2]};
  out.scale = solid.scale > 0 ? solid.scale : 1;
  if (const int mesh = m->geom_dataid[geom]; mesh >= 0) {
    mjtNum back[4], shift[3];
    mju_negQuat(back, m->mesh_quat + 4 * mesh);
    mju_mulQuat(q, d->geom_xquat + 4 * geom, back);
    mju_normalize4(q);
    mju_rotVecQuat(shift, m->mesh_pos + 3 * mesh, q);
    mju_subFrom3(t, shift);
    if (!(solid.scale > 0)) out.scale = m->mesh_scale[3 * mesh];
  }
  write_pose(out.pose, q, t);
  return out;
}

/// A geom without an asset, as a shape. False: there is none for it.
bool shape_of(const mjModel* m, const mjData* d, int geom, ist_field_t& field,
              ist_placed_t& placed) {
  field = {};
  field.size = sizeof field;
  placed = {};
  placed.size = sizeof placed;
  placed.field = &field;
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

/// At the patch's point a force acts as the patch does: at its centroid it would have another
/// torque.
void write_contact(const ist_contact_patch_t& patch, mjPreContact& out) {
  mjtNum shift[3];
  mju_sub3(shift, patch.point, patch.centroid);
  // A patch that pushes both ways has its point far away, and little area.
  const double length = mju_norm3(shift), most = 2 * std::sqrt(patch.area);
  if (length > most) mju_scl3(shift, shift, most / length);
  for (int k = 0; k < 3; ++k) {
    out.pos[k] = patch.centroid[k] + shift[k];
    out.normal[k] = patch.normal[k];
    out.tangent[k] = 0;
  }
  // Where forces cancel the area goes to nothing: the cube root of the volume bounds the depth.
  out.dist = -std::min(patch.volume / patch.area, std::cbrt(patch.volume));
}

void complain_once(const char* text) {
  static std::mutex mutex;
  static std::map<std::string, bool> said;
  const std::lock_guard lock(mutex);
  if (!std::exchange(said[text], true)) mju_warning("%s", text);
}

/// MuJoCo's collision function of two geoms of which the second is of type sdf: types come in the
/// order of mjtGeom, and sdf is the last.
int collide(const mjModel* m, mjData* d, mjPreContact* out, int g1, int g2, mjtNum margin) {
  const Instance *first = instance_of(m, d, g1), *second = instance_of(m, d, g2);
  if (first == nullptr && second == nullptr)
    return before[m->geom_type[g1]][m->geom_type[g2]](m, d, out, g1, g2, margin);
  Scratch& memory = scratch();
  ist_placed_t a;
  ist_field_t field;
  if (first != nullptr) a = place(m, d, g1, *first);
  if (second == nullptr || (first == nullptr && !shape_of(m, d, g1, field, a))) {
    complain_once(
        "ist.solid: a solid meets an ellipsoid, a height field, or a mesh or SDF without an "
        "ist.solid: "
        "they do not collide. ist.mujoco.attach() makes solids of meshes.");
    return 0;
  }
  const ist_placed_t b = place(m, d, g2, *second);
  ist_contact_settings_t settings = {};
  settings.size = sizeof settings;
  settings.measure = second->measure;
  // A shape has no mesh, so that matched spheres meet it.
  if (settings.measure == IST_EXACT && (first == nullptr || first->measure != IST_EXACT))
    settings.measure = IST_MATCHED;
  // Steps of this pair in this data are those of one motion.
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
  ist_penetration_t whole = {};
  whole.size = sizeof whole;
  ist_status_t status = ist_contact_patches(&a, &b, &settings, &memory.workspace, &patches, &whole);
  if (status < 0) {
    complain_once((std::string("ist.solid: ") + ist_describe(status)).c_str());
    return 0;
  }
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

/// Refuses what cannot be read: MuJoCo raises an error of its own after the warning.
bool read_number(const mjModel* m, int i, const char* key, double& value) {
  const char* text = mj_getPluginConfig(m, i, key);
  if (text == nullptr || *text == 0) return true;
  char* end = nullptr;
  value = std::strtod(text, &end);
  if (end != text && *end == 0 && std::isfinite(value) && value >= 0) return true;
  mju_warning("ist.solid: %s=\"%s\" is not a number ≥ 0", key, text);
  return false;
}

int init(const mjModel* m, mjData* d, int i) {
  auto made = std::make_unique<Instance>();
  double patches = made->patches;
  if (!read_number(m, i, "patches", patches) || !read_number(m, i, "scale", made->scale)) return -1;
  made->patches =
      patches > 0 ? static_cast<int>(std::clamp(patches, 1.0, double{kMostPatches})) : 0;
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
  const char* file = mj_getPluginConfig(m, i, "file");
  if (file == nullptr || *file == 0) {
    mju_warning("ist.solid: the instance has no config key \"file\", the path of an .ist file");
    return -1;
  }
  ist_status_t status = IST_OK;
  made->tree = load(file, status);
  if (!made->tree) {
    mju_warning("ist.solid: %s: %s", file, ist_describe(status));
    return -1;
  }
  ist_tree_info_t info = {};
  info.size = sizeof info;
  if (!chosen && ist_tree_get_info(&made->tree->tree, &info) == IST_OK && info.mesh_triangles > 0 &&
      info.mesh_triangles <= kMostExact && info.counted_twice == 0)
    made->measure = IST_EXACT;
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
  d->plugin_data[i] = reinterpret_cast<uintptr_t>(made.release());
  return 0;
}

}  // namespace

mjPLUGIN_LIB_INIT(ist) {
  if (mj_version() != mjVERSION_HEADER) {
    mju_warning("ist.solid is for MuJoCo %d; this is %d: it is not registered", mjVERSION_HEADER,
                mj_version());
    return;
  }
  if (mjp_getPlugin(kName, nullptr) != nullptr) {
    mju_warning("ist.solid is registered already: this copy of the plug-in is not used");
    return;
  }
  std::memcpy(before, mjCOLLISIONFUNC, sizeof before);
  // A plane meets a solid where it meets its hull: MuJoCo's own function is exact.
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
  plugin.reset = [](const mjModel*, mjtNum*, void*, int) {};
  plugin.compute = [](const mjModel*, mjData*, int, int) {};
  // MuJoCo asks these of SDF geoms that it collides itself, and builds an octree by one of them.
  // No geom of ours comes there.
  plugin.sdf_distance = [](const mjtNum*, const mjData*, int) -> mjtNum { return 1; };
  plugin.sdf_gradient = [](mjtNum gradient[3], const mjtNum*, const mjData*, int) {
    gradient[0] = gradient[1] = 0;
    gradient[2] = 1;
  };
  plugin.sdf_staticdistance = [](const mjtNum x[3], const mjtNum*) -> mjtNum {
    return mju_norm3(x) - 0.5;
  };
  plugin.sdf_aabb = [](mjtNum box[6], const mjtNum*) {
    for (int k = 0; k < 6; ++k) box[k] = k < 3 ? 0 : 1;
  };
  plugin.sdf_attribute = [](mjtNum*, const char**, const char**) {};
  slot = mjp_registerPlugin(&plugin);
}
