#include <ist/query.h>
#include <ist/shapes.h>

#include <memory>
#include <optional>
#include <string>

#include <nanobind/stl/optional.h>

#include "gpu_batch.h"

namespace ist::python {
namespace {

/// Patches of a batch on a device, and a flag for invalid queries.
struct GpuPatches : GpuContactPatches {
  QueryStatus* status = nullptr;
};

constexpr std::size_t kUsualPatches = 8;

Shape with(Shape rows, std::size_t each) {
  rows.push_back(each);
  return rows;
}

struct Patches {
  Shape rows, patches;
  std::shared_ptr<Penetrations> penetration = std::make_shared<Penetrations>(Penetrations{rows});
  Column<std::uint32_t> count{rows};
  Column<std::uint64_t> id{patches};
  Column<double, 3> centroid{patches}, normal{patches}, force{patches}, torque{patches},
      point{patches};
  Column<double> area{patches}, depth{patches}, volume{patches}, torsion{patches};

  explicit Patches(const Shape& of = {}, std::size_t each = 0)
      : rows(of), patches(with(of, each)) {}

  void write(std::size_t i, const Row& row, const ContactPatches& whole,
             std::span<const ContactPatch> found) const {
    penetration->write(i, row, whole.penetration);
    count.write(i, whole.count);
    for (std::size_t k = 0; k < whole.count; ++k)
      write_row(*this, i * patches.back() + k, found[k]);
  }
};

struct Outline {
  std::shared_ptr<Patches> contact;
  Column<double, 3> segments;
  Column<std::uint32_t> patch;
};

std::unique_ptr<Separations> separations(const Rows& rows, const SeparationSettings& settings,
                                         unsigned threads) {
  auto answers = std::make_unique<Separations>(Separations{rows.shape()});
  for_each_row(rows, threads, [&](std::size_t i, Workspace& workspace) {
    const Row row = rows.at(i);
    write_row(*answers, i, separation(row.a.placed(), row.b.placed(), settings, workspace));
  });
  refuse_unanswered(rows, answers->status);
  return answers;
}

std::unique_ptr<Patches> patches(const Rows& rows, std::size_t each,
                                 const ContactSettings& settings, unsigned threads) {
  auto answers = std::make_unique<Patches>(rows.shape(), each);
  for_each_row(rows, threads, [&](std::size_t i, Workspace& workspace) {
    const Row row = rows.at(i);
    thread_local std::vector<ContactPatch> found;
    found.resize(each);
    answers->write(
        i, row, contact_patches(row.a.placed(), row.b.placed(), settings, workspace, found), found);
  });
  refuse_unanswered(rows, answers->penetration->status, settings.measure);
  return answers;
}

std::unique_ptr<Outline> outline(const Rows& rows, std::size_t each,
                                 const ContactSettings& settings) {
  if (!rows.shape().empty())
    throw value_error("poses: " + std::to_string(rows.count()) +
                      " rows; an outline is that of one pose, (7,)");
  const auto contact = std::make_shared<Patches>(rows.shape(), each);
  std::vector<ContactPatch> patches(each);
  std::vector<OutlineSegment> segments(1024);
  for_each_row(rows, 1, [&](std::size_t i, Workspace& workspace) {
    const Row row = rows.at(i);
    const auto ask = [&]() -> OverlapOutline {
      const AssetView *const a = row.a.tree(), *const b = row.b.tree();
      if (a == nullptr || b == nullptr)  // a Shape has no mesh
        return {contact_patches(row.a.placed(), row.b.placed(), settings, workspace, patches), 0};
      return overlap_outline({*a, row.a.pose, row.a.scale}, {*b, row.b.pose, row.b.scale}, settings,
                             workspace, patches, segments);
    };
    OverlapOutline found = ask();
    if (found.segments > segments.size()) {
      segments.resize(found.segments);
      found = ask();
    }
    segments.resize(found.segments);
    contact->write(i, row, found.contact, patches);
  });
  refuse_unanswered(rows, contact->penetration->status, {Measure::exact});
  auto answer = std::make_unique<Outline>(Outline{contact, Column<double, 3>({segments.size(), 2}),
                                                  Column<std::uint32_t>({segments.size()})});
  for (std::size_t i = 0; i < segments.size(); ++i) {
    answer->segments.write(2 * i, segments[i].from);
    answer->segments.write(2 * i + 1, segments[i].to);
    answer->patch.write(i, segments[i].patch);
  }
  return answer;
}

py::object overlaps(const Rows& rows, double margin, unsigned threads) {
  const Column<std::uint32_t> answers(rows.shape());
  QueryStatus status = QueryStatus::ok;
  for_each_row(rows, threads, [&](std::size_t i, Workspace& workspace) {
    const Row row = rows.at(i);
    const YesNoAnswer found = margin > 0
                                  ? overlap(row.a.placed(), row.b.placed(), margin, workspace)
                                  : overlap(row.a.placed(), row.b.placed(), workspace);
    answers.write(i, found.answer);
    if (rows.shape().empty()) status = found.status;
  });
  refuse_unanswered(rows, status);
  return answers.handed_out();
}

constexpr const char* kSeparationDoc =
    R"(Distance, nearest points, and a certified interval for the solids.

If both assets keep a mesh, the distance of their surfaces. Otherwise, or with inner_spheres=True,
that of their inner spheres. Arguments as for penetration(). max_visits: 0: no limit.
max_distance: [u] of solids that are certain to be farther apart the answer says no more, and takes
    little time: distance and distance_min are max_distance, distance_max is inf, points and normal are
    NaN, the status is ok. 0: no limit.
pair_id: your id of this pair of solids, 0: none. Calls with the same id, and their rows, are steps of
    one motion: between surfaces the nearest triangles are kept from step to step. Same answers.

Solids on a GPU: of two Assets; a row of a Shape is missing_data. Of surfaces the CPU's distance, mostly to
the bit; of inner spheres the minimum over all pairs in double, where the CPU's may be larger by 1e-6 of
the solids' size, and among equally near pairs the two may differ. inner_spheres=True and pair_id raise.
A stopped row's interval may differ from the CPU's.

Returns a Separation: arrays of one row a pose, or numbers and (3,) arrays for one pose.)";

constexpr const char* kPatchesDoc =
    R"(The contact condensed into at most max_patches patches.

Arguments as for penetration(). The patches sum to the whole contact. max_patches:
on the CPU any number from 1.

Solids on a GPU: of two Assets, 1 to 32 patches, without limits; a row of a Shape is missing_data, and
by 'exact' a pair that lacks memory is budget_exhausted, with count 0. Patches are in order of id. Beyond
count[i] a pair's patches are zero, or unchanged with `out`.

Returns ContactPatches: arrays of shape (n, max_patches), or (max_patches,) for one pose.)";

constexpr const char* kOutlineDoc =
    R"(The patches of measure='exact', and the curves on which the two surfaces cross.

Arguments as for penetration(), of one pose; max_visits: 0: no limit. Both solids are Assets
with a mesh; otherwise ist.Error is raised.

Returns an OverlapOutline. It has no segment if max_visits stopped the query;
contact.penetration.status reports that.)";

constexpr const char* kOverlapDoc = R"(Whether solids share a point. Yes and no are certified.

Arguments as for penetration(). Costs a fraction of a penetration query.
margin: [u] whether they come within this of each other: by their surfaces, if both Assets keep a mesh.
    0: whether inner spheres meet, or no covers do; of assets without spheres by their surfaces.

Returns (n,) uint32, a YesNo: 0 no, 1 yes, 2 unknown, also for invalid rows; a number for one
pose.)";

void add_classes(py::module_& module) {
  py::class_<Separations> separation(module, "Separation",
                                     "Gaps of placed solids; all zero if these overlap.");
  add_column(separation, "distance", &Separations::distance,
             "(n,) [u] between surfaces or inner spheres.");
  add_column(separation, "distance_min", &Separations::distance_min,
             "(n,) [u] the true distance of the solids is at least this, certified.");
  add_column(separation, "distance_max", &Separations::distance_max,
             "(n,) [u] and at most this, certified.");
  add_column(separation, "point_a", &Separations::point_a,
             "(n, 3) [u] on A's surface or spheres, world.");
  add_column(separation, "point_b", &Separations::point_b,
             "(n, 3) [u] on B's surface or spheres, world.");
  add_column(separation, "normal", &Separations::normal, "(n, 3) unit, from A to B, world.");
  add_column(separation, "status", &Separations::status, "(n,) uint32, a QueryStatus.");
  add_column(separation, "node_visits", &Separations::node_visits, "(n,) uint32.");
  add_column(separation, "sphere_pairs", &Separations::sphere_pairs, "(n,) uint32.");
  add_pickling(separation);

  py::class_<Patches> patch(module, "ContactPatches",
                            "Contact patches; the first `count` of m are valid.");
  add_inner(patch, "penetration", &Patches::penetration, "The whole: a Penetration.");
  patch.def_prop_ro(
      "status", [](const Patches& self) { return self.penetration->status.handed_out(); },
      "(n,) uint32, a QueryStatus: the whole's.");
  add_column(patch, "count", &Patches::count, "(n,) uint32, patches written; the rest is zero.");
  add_column(patch, "id", &Patches::id,
             "(n, m) uint64, identifies a region of the smaller solid, in every query of the same "
             "two assets.");
  add_column(patch, "centroid", &Patches::centroid, "(n, m, 3) [u] of the patch's overlap, world.");
  add_column(patch, "normal", &Patches::normal,
             "(n, m, 3) unit, world: the patch pushes B along it.");
  add_column(patch, "area", &Patches::area, "(n, m) [u²] seen along the normal.");
  add_column(patch, "depth", &Patches::depth, "(n, m) [u] volume/area.");
  add_column(patch, "volume", &Patches::volume, "(n, m) [u³]");
  add_column(patch, "force", &Patches::force, "(n, m, 3) [u²] share of Penetration.force.");
  add_column(patch, "torque", &Patches::torque,
             "(n, m, 3) [u³] share of Penetration.torque, about B's origin.");
  add_column(patch, "point", &Patches::point,
             "(n, m, 3) [u] world: the point of the wrench's central axis that is nearest to the "
             "centroid.");
  add_column(patch, "torsion", &Patches::torsion,
             "(n, m) [u³] residual moment about the normal of a force at `point`.");
  add_pickling(patch);

  py::class_<Outline> outline(module, "OverlapOutline", "Contact patches and their outlines.");
  add_inner(outline, "contact", &Outline::contact, "The patches: ContactPatches of one pose.");
  add_column(
      outline, "segments", &Outline::segments,
      "(n, 2, 3) [u] from and to of each, world: they form closed curves. A's surface inside "
      "B lies to the left of each, seen from outside A.");
  add_column(outline, "patch", &Outline::patch,
             "(n,) uint32, number of the patch that each bounds; 0 where max_patches is 0.");
  add_pickling(outline);
}

}  // namespace

void add_separation(py::module_& module) {
  add_classes(module);
  add_pair_query(
      module, "separation",
      +[](const GivenPair& pair, std::uint32_t max_visits, std::optional<bool> inner_spheres,
          double max_distance, std::uint32_t pair_id, unsigned threads, const py::object& wanted,
          const py::object& out, const py::object& stream) -> py::object {
        const GivenOutput given{wanted, out, stream};
        if (!(max_distance >= 0))
          throw value_error("max_distance: " + std::to_string(max_distance) + "; wanted 0 or more");
        if (const DeviceSides sides = device_sides(pair.a, pair.b); sides.solids != nullptr) {
          refuse_given("not on a GPU", {{"inner_spheres", inner_spheres.value_or(false)},
                                        {"pair_id", pair_id != 0}});
          return ask<GpuSeparations>(
              sides, pair, given, {},
              [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
                  const GpuSeparations& to, cuda::Stream on) {
                separation_batch(all, pairs, {max_visits, max_distance}, workspace, to, on);
              });
        }
        refuse_output(given);
        return py::cast(separations(
            pair.rows(), {max_visits, inner_spheres.value_or(false), max_distance, pair_id},
            threads));
      },
      py::arg("max_visits") = 0, py::arg("inner_spheres") = py::none(),
      py::arg("max_distance") = 0.0, py::arg("pair_id") = 0, py::arg("threads") = 0,
      py::arg("wanted") = py::none(), py::arg("out") = py::none(), py::arg("stream") = py::none(),
      kSeparationDoc);
  add_pair_query(
      module, "contact_patches",
      +[](const GivenPair& pair, std::size_t max_patches, const std::string& measure,
          bool spheres_only, std::uint32_t pair_budget, std::uint32_t max_visits,
          double relative_error, std::uint32_t pair_id, unsigned threads, const py::object& wanted,
          const py::object& out, const py::object& stream) -> py::object {
        const GivenOutput given{wanted, out, stream};
        if (const DeviceSides sides = device_sides(pair.a, pair.b); sides.solids != nullptr) {
          refuse_given("not on a GPU", {{"pair_budget", pair_budget != 0},
                                        {"max_visits", max_visits != 0},
                                        {"relative_error", relative_error != 0}});
          const Measure which = named(measure, "measure", kMeasures);
          if (max_patches < 1 || max_patches > kMostGpuPatches)
            throw value_error("max_patches: " + std::to_string(max_patches) + "; wanted 1 to " +
                              std::to_string(kMostGpuPatches) + " on a GPU");
          GpuPatches blank;
          blank.most = static_cast<std::uint32_t>(max_patches);
          return ask<GpuPatches>(
              sides, pair, given, blank,
              [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
                  const GpuPatches& to, cuda::Stream on) {
                GpuPenetrations whole;
                whole.status = to.status;
                contact_patches_batch(all, pairs, which, workspace, whole, to, on);
              });
        }
        refuse_output(given);
        if (max_patches < 1) throw value_error("max_patches: 0; wanted 1 or more");
        return py::cast(patches(pair.rows(), max_patches,
                                contact_settings(measure, spheres_only, pair_budget, max_visits,
                                                 relative_error, pair_id),
                                threads));
      },
      py::arg("max_patches") = kUsualPatches, py::arg("measure") = "matched",
      py::arg("spheres_only") = false, py::arg("pair_budget") = 0, py::arg("max_visits") = 0,
      py::arg("relative_error") = 0.0, py::arg("pair_id") = 0, py::arg("threads") = 0,
      py::arg("wanted") = py::none(), py::arg("out") = py::none(), py::arg("stream") = py::none(),
      kPatchesDoc);
  add_pair_query(
      module, "overlap_outline",
      +[](const GivenPair& pair, std::size_t max_patches, std::uint32_t max_visits,
          std::uint32_t pair_id) {
        ContactSettings settings;
        settings.measure = Measure::exact;
        settings.max_visits = max_visits;
        settings.pair_id = pair_id;
        return outline(pair.rows(), max_patches, settings);
      },
      py::arg("max_patches") = kUsualPatches, py::arg("max_visits") = 0, py::arg("pair_id") = 0,
      kOutlineDoc);
  add_pair_query(
      module, "overlap",
      +[](const GivenPair& pair, double margin, unsigned threads) {
        if (!(margin >= 0))
          throw value_error("margin: " + std::to_string(margin) + "; wanted 0 or more");
        return overlaps(pair.rows(), margin, threads);
      },
      py::arg("margin") = 0.0, py::arg("threads") = 0, kOverlapDoc);
}

void add_gpu_separation(py::module_& module) {
  LikeColumns<GpuSeparations, Separations>().add_members();
  add_answers<GpuSeparations>(module, "Separation", "Gaps");
  LikeColumns<GpuPatches, Patches> like;
  like.add(like.answers.count, like.columns.count, false);
  like.add_members();
  like.add(like.answers.status, "status", "(n,) uint32, a QueryStatus.", kUInt32);
  add_answers<GpuPatches>(module, "ContactPatches", "Patches");
}

}  // namespace ist::python
