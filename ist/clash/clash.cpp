#include "clash/clash.h"

#include <fmt/format.h>
#include <ist/mass_properties.h>
#include <ist/pose_eigen.h>
#include <ist/raycast.h>
#include <ist/scene.h>
#include <tbb/enumerable_thread_specific.h>
#include <algorithm>
#include <cmath>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <tuple>

#include "base/thread_arena.h"
#include "mesh/import/source_file.h"
#include "query/exact/kept_mesh.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kPatches = 512;
constexpr double kFlush =
    1e-7;  ///< faces within this distance are flush, relative to the smaller part's diameter

struct Scratch {
  Workspace workspace;
  std::vector<ContactPatch> patches = std::vector<ContactPatch>(kPatches);
};

double reach(const Bounds& box) {
  return std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff());
}

/// A part's kept mesh in the world frame.
struct WorldMesh {
  /// A triangle's plane, from either side: n · x = offset.
  struct Plane {
    double key;  ///< equal for equal planes, and for hardly any others
    Vector3d normal;
    double offset;
  };

  /// `origin`, `size`: of the whole assembly.
  WorldMesh(const PlacedAsset& solid, const Vector3d& origin, double size) {
    const AssetHeader& asset = solid.asset.header();
    const MeshTree mesh = mesh_of(solid);
    const Eigen::Isometry3d place = to_isometry(solid.pose);
    const double unit = std::ldexp(1.0, asset.exponent);
    for (std::uint32_t v = 0; v < mesh.header->vertex_count; ++v) {
      const Vector3d own = unit * vector(mesh.vertex(v)) + Vector3d(asset.centre);
      vertices.emplace_back(place * Vector3d(solid.scale * own));
    }
    // A direction unlikely to occur in a part.
    const Vector3d across(0.267, 0.534, 0.802);
    for (std::uint32_t b = 0; b < mesh.count; ++b) {
      const MeshBlock& block = mesh.blocks[b];
      for (std::uint32_t t = 0; t < block.triangles; ++t) {
        const auto corner = [&](int c) -> const Vector3d& {
          return vertices[block.vertex[block.corner[c][t]]];
        };
        Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        const double length = normal.norm();
        if (!(length > 0)) continue;
        normal /= length;
        faces.push_back({{corner(0), corner(1), corner(2)}, normal});
        for (const double side : {1.0, -1.0}) {
          const Vector3d n = side * normal;
          const double offset = n.dot(corner(0) - origin);
          planes.push_back({size * n.dot(across) + offset, n, offset});
        }
      }
    }
    std::sort(planes.begin(), planes.end(),
              [](const Plane& x, const Plane& y) { return x.key < y.key; });
    const auto same = [&](const Plane& x, const Plane& y) {
      return y.key - x.key <= 1e-12 * size && (x.normal - y.normal).norm() <= 1e-12;
    };
    planes.erase(std::unique(planes.begin(), planes.end(), same), planes.end());
  }

  /// A triangle, counter-clockwise from outside.
  struct Face {
    std::array<Vector3d, 3> corner;
    Vector3d normal;

    Eigen::AlignedBox3d box() const {
      return Eigen::AlignedBox3d(corner[0]).extend(corner[1]).extend(corner[2]);
    }
  };

  std::vector<Vector3d> vertices;
  std::vector<Face> faces;
  std::vector<Plane> planes;  ///< by key
};

constexpr double kParallel = 1e-7;  ///< of normals

/// True if a plane of one is within `within` [u] of one of the other, in an assembly of this size.
bool have_common_plane(const WorldMesh& a, const WorldMesh& b, double size, double within) {
  const double margin = within + kParallel * size;  // of keys
  std::size_t first = 0;
  for (const WorldMesh::Plane& plane : a.planes) {
    while (first < b.planes.size() && b.planes[first].key < plane.key - margin) ++first;
    for (std::size_t i = first; i < b.planes.size() && b.planes[i].key <= plane.key + margin; ++i)
      if (std::abs(b.planes[i].offset - plane.offset) <= within &&
          (b.planes[i].normal - plane.normal).norm() <= kParallel)
        return true;
  }
  return false;
}

/// The faces of two parts that face each other within a tolerance.
class FlushFaces {
 public:
  /// `within`: a box that contains the contact. `touch` [u].
  FlushFaces(const WorldMesh& a, const WorldMesh& b, const Eigen::AlignedBox3d& within,
             double touch)
      : touch_(touch) {
    // Faces in the order in which a sweep along x reaches their boxes.
    struct Item {
      Eigen::AlignedBox3d box;
      const WorldMesh::Face* face;
      int side;
    };
    std::vector<Item> items, open[2];
    for (const int side : {0, 1})
      for (const WorldMesh::Face& face : (side == 0 ? a : b).faces) {
        Eigen::AlignedBox3d box = face.box();
        box.min().array() -= touch / 2;
        box.max().array() += touch / 2;
        if (box.intersects(within)) items.push_back({box, &face, side});
      }
    std::sort(items.begin(), items.end(),
              [](const Item& x, const Item& y) { return x.box.min().x() < y.box.min().x(); });
    for (const Item& item : items) {
      std::vector<Item>& others = open[1 - item.side];
      std::erase_if(others, [&](const Item& x) { return x.box.max().x() < item.box.min().x(); });
      for (const Item& other : others) {
        if (!item.box.intersects(other.box)) continue;
        const bool first = item.side == 0;
        add(first ? *item.face : *other.face, first ? *other.face : *item.face);
      }
      open[item.side].push_back(item);
    }
  }

  double area = 0;                     ///< [u²] measured on the first part
  Vector3d moment = Vector3d::Zero();  ///< [u³] area times position, halfway between both

 private:
  /// The part of a convex polygon with from + along · x ≥ 0.
  static std::vector<Vector3d> clipped(const std::vector<Vector3d>& polygon, double from,
                                       const Vector3d& along) {
    std::vector<Vector3d> out;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector3d &x = polygon[i], &y = polygon[(i + 1) % polygon.size()];
      const double at_x = from + along.dot(x), at_y = from + along.dot(y);
      if (at_x >= 0) out.push_back(x);
      if ((at_x >= 0) != (at_y >= 0)) out.push_back(x + at_x / (at_x - at_y) * (y - x));
    }
    return out;
  }

  void add(const WorldMesh::Face& a, const WorldMesh::Face& b) {
    if (!(a.normal.dot(b.normal) < -kFacing)) return;
    const double height = b.normal.dot(b.corner[0]);
    std::vector<Vector3d> shared(a.corner.begin(), a.corner.end());
    for (const double side : {1.0, -1.0})
      shared = clipped(shared, touch_ + side * height, -side * b.normal);
    for (std::size_t k = 0; k < 3 && !shared.empty(); ++k) {
      const Vector3d inward = (b.corner[(k + 1) % 3] - b.corner[k]).cross(a.normal);
      shared = clipped(shared, -inward.dot(b.corner[k]), inward);
    }
    for (std::size_t i = 2; i < shared.size(); ++i) {
      const Vector3d &x = shared[0], &y = shared[i - 1], &z = shared[i];
      const double part = (y - x).cross(z - x).norm() / 2;
      const Vector3d middle = (x + y + z) / 3;
      area += part;
      moment += part * (middle - (b.normal.dot(middle) - height) / 2 * b.normal);
    }
  }

  static constexpr double kFacing = 0.5;  ///< the cosine of 60°
  double touch_;
};

/// A part in the form that pairs use.
struct Placed {
  Placed(const ClashPart& given, const ClashSettings& settings) : part(given) {
    const PlacedAsset& solid = part.solid;
    if (!solid.asset.has_mesh()) throw Error(part.name + ": its asset keeps no mesh");
    const Bounds world = bounds(solid), own = bounds(solid.asset);
    if (!world.lower.allFinite() || !world.upper.allFinite())
      throw Error(part.name +
                  ": its pose or scale is invalid: numbers must be finite, the quaternion not 0, "
                  "the scale above 0");
    const double largest = std::max(reach(world), solid.scale * reach(own));
    const double uncertain = uncertainty_of(part);
    rounded = uncertain - part.slack;
    touch = settings.touch_within >= 0 ? settings.touch_within / 2 : uncertain;
    margin = touch + settings.clearance / 2 + 4 * kFloat64 * largest;
    box = {world.lower.array() - margin, world.upper.array() + margin};
    volume = solid.asset.volume() * solid.scale * solid.scale * solid.scale;
    diameter = 2 * world.radius;
  }
  /// Built at the first use. `all`: a box around the assembly.
  const WorldMesh& mesh(const Eigen::AlignedBox3d& all) const {
    std::call_once(once_, [&] { mesh_.emplace(part.solid, all.center(), all.diagonal().norm()); });
    return *mesh_;
  }

  const ClashPart& part;
  Eigen::AlignedBox3d box;
  double margin = 0;   ///< [u] enlargement of the box
  double touch = 0;    ///< [u] its share of the touching distance
  double rounded = 0;  ///< [u] bound on the motion of its surface by rounding
  double volume = 0, diameter = 0;

 private:
  mutable std::once_flag once_;
  mutable std::optional<WorldMesh> mesh_;
};
using PlacedParts = std::deque<Placed>;

constexpr PenetrationSettings kExactly = {.measure = Measure::exact};

/// Pairs whose boxes meet, sorted.
std::vector<std::pair<std::size_t, std::size_t>> candidates(const PlacedParts& parts,
                                                            const PairFilter& ignored) {
  double margin = 0;
  for (const Placed& part : parts) margin = std::max(margin, part.margin);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  SceneSettings settings = {.max_bodies = std::max<std::size_t>(parts.size(), 1),
                            .workspace_capacity = 1};
  for (bool complete = false; !complete; settings.max_pairs *= 8) {
    Scene scene(settings);
    scene.set_rule(0, 0, {SceneAnswer::boxes, kExactly, 2 * margin});
    for (std::uint32_t i = 0; i < parts.size(); ++i)
      scene.add({.number = i, .solid = parts[i].part.solid});
    const SceneStep step = scene.step();
    if (!step.refused.empty())
      throw Error(parts[step.refused.front()].part.name +
                  ": its box, with clearance and tolerance, reaches beyond 1e37 u");
    complete = !step.pairs_exceeded;
    for (const ScenePair& pair : step.pairs)
      if (parts[pair.a].box.intersects(parts[pair.b].box) && !(ignored && ignored(pair.a, pair.b)))
        pairs.emplace_back(pair.a, pair.b);
  }
  return pairs;
}

Vector3d unit(const Vector3d& v) {
  const double length = v.norm();
  return length > 0 ? Vector3d(v / length) : Vector3d::Zero();
}

struct Sums {
  double volume = 0, area = 0;  ///< [u³], [u²] the patches' areas
  Vector3d force = Vector3d::Zero();

  /// True if more than a quarter of the faces' area points in one direction; those of a pin cancel,
  /// and those of a bar through a plate, whose area is 0.
  bool has_exit() const { return area > 0 && force.norm() > area / 4; }
  double depth() const { return volume / (has_exit() ? force.norm() : area); }
};

class PairQuery {
 public:
  PairQuery(const Placed& a, const Placed& b, const Eigen::AlignedBox3d& all,
            const ClashSettings& settings, Scratch& scratch)
      : a_(a),
        b_(b),
        all_(all),
        touch_(settings.touch_within < 0 ? a.touch + b.touch : settings.touch_within),
        clearance_(settings.clearance),
        scratch_(scratch) {}

  /// Returns false if there is nothing to report.
  bool ask(Clash& out) {
    Penetration found;
    const Sums whole = patches(b_.part.solid, found, &out.depth);
    out.status = found.status;
    out.volume = found.volume;
    out.volume_min = found.volume_min;
    out.volume_max = found.volume_max;
    out.centroid = found.centroid;
    if (found.status != QueryStatus::ok) {
      out.kind = ClashKind::overlapping;
      return true;
    }
    if (!(found.volume > 0)) {
      out.depth = 0;  // patches may be rounding alone
      return found.touching ? touches(found, out) : is_near(out);
    }
    if (whole.has_exit()) out.direction = unit(whole.force);
    // Flush sides are irrelevant if the depth is rounding.
    const bool deep = out.depth > 1e-3 * std::min(a_.diameter, b_.diameter);
    if (deep && whole.has_exit() && may_be_flush()) measure_exit(out, whole);
    if (out.depth <= touch_ && deepest_vertex() <= touch_) {
      measure_contact(out);
      return true;
    }
    out.kind = ClashKind::overlapping;
    if (!deep && whole.has_exit() && may_be_flush()) measure_exit(out, whole);
    const double most = std::max(a_.volume, b_.volume);
    const double noise = 1e-9 + 20 * (a_.rounded + b_.rounded) / std::cbrt(most);
    out.duplicate = most - out.volume <= std::min(noise, 0.01) * most;
    return true;
  }

 private:
  /// Sums of the overlap with B at this place. `depth`: of the deepest connected part.
  Sums patches(const PlacedAsset& solid_b, Penetration& found, double* depth = nullptr) {
    const ContactPatches all =
        contact_patches(a_.part.solid, solid_b, kExactly, scratch_.workspace, scratch_.patches);
    found = all.penetration;
    std::map<std::uint64_t, Sums> parts;
    Sums whole;
    for (std::size_t i = 0; i < all.count; ++i) {
      const ContactPatch& patch = scratch_.patches[i];
      for (Sums* const sums : {&whole, &parts[patch.id / 8]}) {  // the octant is in the last digits
        sums->volume += patch.volume;
        sums->area += patch.area;
        sums->force += patch.force;
      }
    }
    parts_ = parts.size();
    const double diameter = std::min(a_.diameter, b_.diameter);
    const double rounding = found.volume_max - found.volume_min;
    for (const auto& [id, sums] : parts) {
      if (depth == nullptr || !(sums.volume > 0)) continue;
      // If the part is rounding, so is its area.
      const double most = sums.volume > rounding ? diameter : std::cbrt(sums.volume);
      *depth = std::max(*depth, sums.area > 0 ? std::min(sums.depth(), most) : most);
    }
    return whole;
  }

  Penetration aside(const Vector3d& by) {
    return penetration(a_.part.solid, moved(by), kExactly, scratch_.workspace);
  }

  bool may_be_flush() const {
    return have_common_plane(a_.mesh(all_), b_.mesh(all_), all_.diagonal().norm(),
                             kFlush * std::min(a_.diameter, b_.diameter));
  }

  /// Along a direction with flush sides, the volume decreases both ways: averaging two slightly
  /// displaced positions cancels that.
  void measure_exit(Clash& out, const Sums& whole) {
    const Vector3d by =
        std::min(kFlush * std::min(a_.diameter, b_.diameter), 1e-3 * out.depth) * out.direction;
    Vector3d force = aside(-by).force, ahead = force;
    if ((force - whole.force).norm() > 1e-4 * whole.force.norm()) {
      ahead = aside(by).force;
      force = (force + ahead) / 2;
    }
    if (!(force.norm() > whole.area / 4)) return;
    out.direction = unit(force);
    // Faces that are flush across the way out count on the way out.
    if (parts_ == 1) out.depth = whole.volume / std::max(force.norm(), ahead.dot(out.direction));
  }

  PlacedAsset moved(const Vector3d& by) const {
    PlacedAsset solid = b_.part.solid;
    for (int k = 0; k < 3; ++k) solid.pose.t[k] += by[k];
    return solid;
  }

  /// [u] The largest depth of a vertex of either solid inside the other, up to a relevant limit.
  double deepest_vertex() const {
    const Eigen::AlignedBox3d both = a_.box.intersection(b_.box);
    double deepest = 0;
    for (const auto& [of, in] : {std::pair(&a_, &b_), std::pair(&b_, &a_)}) {
      for (const Vector3d& world : of->mesh(all_).vertices) {
        if (deepest > touch_) return deepest;
        if (both.contains(world))
          deepest = std::max(deepest, -closest_point(in->part.solid, world).distance);
      }
    }
    return deepest;
  }

  Separation distance(double limit) {
    return separation(a_.part.solid, b_.part.solid, {.max_distance = limit}, scratch_.workspace);
  }

  bool touches(const Penetration& found, Clash& out) {
    out.kind = ClashKind::touching;
    out.direction = found.contact_normal;
    out.contact_area = found.contact_area;
    if (out.contact_area > 0) return true;
    const Separation nearest = distance(0);
    out.centroid = (nearest.point_a + nearest.point_b) / 2;
    return true;
  }

  bool is_near(Clash& out) {
    const double limit = std::max(touch_, clearance_);
    if (!(limit > 0)) return false;
    const Separation found = distance(limit);
    out.status = found.status;
    out.distance_min = found.distance_min;
    out.distance_max = found.distance_max;
    out.direction = found.normal;
    out.centroid = (found.point_a + found.point_b) / 2;
    if (found.status == QueryStatus::ok && !(found.distance < limit)) return false;
    if (found.distance > touch_) return true;
    measure_contact(out);
    return true;
  }

  /// Area and centroid of a contact of faces.
  void measure_contact(Clash& out) {
    out.kind = ClashKind::touching;
    const FlushFaces found(a_.mesh(all_), b_.mesh(all_), a_.box.intersection(b_.box), touch_);
    out.contact_area = found.area;
    if (found.area > 0) out.centroid = found.moment / found.area;
  }

  const Placed &a_, &b_;
  const Eigen::AlignedBox3d& all_;
  const double touch_, clearance_;
  Scratch& scratch_;
  std::size_t parts_ = 0;  ///< connected parts that patches() found
};

}  // namespace

double rounding_of_file(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".obj" || ending == ".off" || ending == ".dae") return kFloat64;
  if (ending != ".ply") return kFloat32;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line) && !line.starts_with("end_header");)
    if (line.starts_with("property double x") || line.starts_with("property float64 x"))
      return kFloat64;
  return kFloat32;
}

double uncertainty_of(const ClashPart& part) {
  const PlacedAsset& solid = part.solid;
  const double own = solid.scale * reach(bounds(solid.asset));
  return 4 * std::max(part.rounding * own, part.placing * std::max(own, reach(bounds(solid)))) +
         part.slack + solid.scale * solid.asset.mesh_error();
}

void note_rounding(std::span<const ClashPart> parts, const ClashSettings& settings,
                   std::vector<std::string>& notes) {
  const ClashPart* first = nullptr;
  std::size_t count = 0;
  double most = 0;
  for (const ClashPart& part : parts) {
    const double rounded = uncertainty_of(part) - part.slack;
    if (settings.touch_within >= 0 || !(rounded > 1e-3 * bounds(part.solid).radius)) continue;
    if (count++ == 0) first = &part;
    most = std::max(most, 2 * rounded);
  }
  if (count == 0) return;
  notes.push_back(fmt::format(
      "{}{}: so far from the origin that rounding is a thousandth of the part and more: overlaps "
      "up to {:.4g} u deep may count as touching. Give --touch-within, or move the assembly",
      first->name, count > 1 ? fmt::format(" and {} more", count - 1) : "", most));
}

std::vector<Clash> find_clashes(std::span<const ClashPart> parts, const ClashSettings& settings,
                                const PairFilter& ignored) {
  PlacedParts all;
  Eigen::AlignedBox3d bounds;
  for (const ClashPart& part : parts) bounds.extend(all.emplace_back(part, settings).box);
  const auto pairs = candidates(all, ignored);
  std::vector<Clash> answers(pairs.size());
  std::vector<char> listed(pairs.size());
  tbb::enumerable_thread_specific<Scratch> scratch;
  thread_arena(settings.threads).execute([&] {
    for_each_index(0, pairs.size(), 1, [&](std::size_t i) {
      std::tie(answers[i].a, answers[i].b) = pairs[i];
      listed[i] = PairQuery(all[answers[i].a], all[answers[i].b], bounds, settings, scratch.local())
                      .ask(answers[i]);
    });
  });
  std::vector<Clash> out;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    if (listed[i] != 0) out.push_back(std::move(answers[i]));
  return out;
}

bool is_worse(const Clash& x, const Clash& y) {
  const auto rank = [](const Clash& c) {
    // Pairs without an answer come first, as their volume is unknown.
    return std::tuple(c.status != QueryStatus::ok ? 0 : 1, static_cast<int>(c.kind),
                      c.kind == ClashKind::overlapping ? -c.volume : 0.0, c.distance_min,
                      -c.contact_area);
  };
  return rank(x) < rank(y);
}

}  // namespace ist
