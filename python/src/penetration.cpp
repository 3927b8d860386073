#include "penetration.h"

#include <cmath>

#include <ist/contact_law.h>
#include <ist/shapes.h>

#include "gpu_batch.h"

namespace ist::python {
namespace {

/// Rows of qw, qx, qy, qz, tx, ty, tz: the slope of a function of q/|q| and t, from its slopes by a
/// translation and by a rotation vector about t.
void write_pose_gradient(const Pose& pose, const Eigen::Vector3d& by_translation,
                         const Eigen::Vector3d& by_rotation, double* out) {
  const Eigen::Vector4d q(pose.q);
  const double norm = q.norm();
  const Eigen::Vector3d v = q.tail<3>() / norm;
  const double w = q[0] / norm;
  // A rotation vector δ moves the unit quaternion by ½ (0, δ) q, whose squared length is a quarter
  // of δ's. So the slope along the sphere is 2 (0, by_rotation) q. Across it there is none.
  Eigen::Map<Eigen::Matrix<double, 7, 1>> gradient(out);
  gradient[0] = -2 * by_rotation.dot(v) / norm;
  gradient.segment<3>(1) = 2 / norm * (w * by_rotation + by_rotation.cross(v));
  gradient.tail<3>() = by_translation;
}

/// The derivatives of the volume by the scales of B and A.
struct ScaleGradient {
  double b = 0, a = 0;
};

/// No answer of a query determines the derivative by B's scale: it is 3 V / scale if a ball of B
/// lies in a larger one of A, and 0 if one of A lies in a larger one of B, with the same volume,
/// centroid and gradients. So it is the difference of two queries, 0.05 % of the scale to either
/// side, where rounding and curvature cause similar errors, 2e-5 to 2e-4. The volume of the whole
/// scene scales with the third power, which gives A's.
ScaleGradient scale_gradient(const Row& row, const Penetration& answer,
                             const PenetrationSettings& settings, Workspace& workspace) {
  const double step = row.b.scale / 2048;
  const auto volume = [&](double scale) {
    Side moved = row.b;
    moved.scale = scale;
    return penetration(row.a.placed(), moved.placed(), settings, workspace).volume;
  };
  ScaleGradient gradient;
  gradient.b = (volume(row.b.scale + step) - volume(row.b.scale - step)) / (2 * step);
  const Eigen::Vector3d way = Eigen::Map<const Eigen::Vector3d>(row.b.pose.t) -
                              Eigen::Map<const Eigen::Vector3d>(row.a.pose.t);
  gradient.a = (3 * answer.volume - row.b.scale * gradient.b + way.dot(answer.force)) / row.a.scale;
  return gradient;
}

std::shared_ptr<Penetrations> answer(const Rows& rows, const PenetrationSettings& settings,
                                     bool scale_gradients, unsigned threads) {
  auto answers = std::make_shared<Penetrations>(Penetrations{rows.shape()});
  if (scale_gradients) {
    answers->scale_gradient = Column<double>(rows.shape());
    answers->scale_gradient_a = Column<double>(rows.shape());
  }
  for_each_row(rows, threads, [&](std::size_t i, Workspace& workspace) {
    const Row row = rows.at(i);
    const Penetration found = penetration(row.a.placed(), row.b.placed(), settings, workspace);
    answers->write(i, row, found);
    if (!scale_gradients) return;
    const ScaleGradient gradient = found.volume != 0 && !std::isnan(found.volume)
                                       ? scale_gradient(row, found, settings, workspace)
                                       : ScaleGradient{found.volume, found.volume};
    answers->scale_gradient.write(i, gradient.b);
    answers->scale_gradient_a.write(i, gradient.a);
  });
  refuse_unanswered(rows, answers->status, settings.measure);
  return answers;
}

constexpr const char* kDoc =
    R"(Volume, wrench and centroid of the overlap, for one pose or many.

a, b: Assets, or an Asset and a Shape; for rows of different solids, solids[indices].
poses: of B, (7,) or (n, 7): qw, qx, qy, qz, tx [u], ty, tz, or matrices (4, 4) or (n, 4, 4).
    Quaternions of any length but 0 are normalised. A C-ordered float64 array of rows is not copied.
    ist.poses() makes rows of other conventions.
scales: of B, a number or (n,), > 0. poses_a, scales_a: of A; None: at the origin, 1.
scale_gradients: fill scale_gradient and scale_gradient_a, at three times the cost.
measure: 'matched' (the accurate spheres), 'inner' (certified lower bound of the true volume) or
    'exact' (the true volume and its gradients: of two Assets that hold their mesh, which bake()
    keeps by default; max_visits is its only limit).
spheres_only: 'matched' alone: spheres answer even where they are too coarse for the contact of two
    Assets of unlike sizes, and may be wrong by any factor (size_match). False: there the meshes do, if
    both hold theirs. On a GPU spheres always answer.
pair_budget, max_visits: cost limits; 0: no limit. See <ist/query.h>.
relative_error: accepted relative error of the volume, such as 0.005 for 0.5 %, of two Assets with
    'matched'. The query uses the cheapest level of detail, or the exact measure, whose predicted
    error is smaller, blended smoothly. Over random poses about 19 of 20 errors are smaller, half are
    below a third. 0: all spheres. Status error_exceeded: the predicted error is larger, since an
    Asset has no mesh or one that errs more, a pair_budget is set, or copies of an Asset coincide.
pair_id: your id of this pair of solids, 0: none. Calls with the same id, and their rows, are steps
    of one motion: 'exact' keeps nearby triangles from step to step and returns the same answers
    faster. On a GPU it keeps 8 KB a row for each id, as long as the ist.Solids.
threads: 0: all cores. The bits of the answers do not depend on it. The GIL is released.

Rows that cannot be answered are NaN with a status and do not affect others. invalid_input: NaN, a
quaternion of length 0, a scale ≤ 0. missing_data: a solid lacks what the measure needs, or both
are Shapes. For one pose ValueError or ist.Error is raised instead.
Ctrl-C raises KeyboardInterrupt.

Solids on a GPU, ist.Solids(…, device='cuda'): the same call gives the same answers there;
unsupported arguments raise. A GPU takes every measure, and pair_budget.
Two Assets are summed as with spheres_only=True. Volumes are within 1e-6 of the sum in double, and of an Asset and a Shape within
1e-9 of the CPU's. The bits are the same in every run, whatever else is in the batch.
Arrays are of any framework, in that device's memory and in C order: poses (n, 7) and scales (n,)
float64, indices uint32 or int32. They are read by __dlpack__ or __cuda_array_interface__, never
copied, and kept alive until the batch is done. An index without a solid makes its row invalid_input.
wanted: names of the columns to compute; None: all but node_visits and sphere_pairs.
out: a dict of arrays by name, or the answer of an earlier call. Answers are written there, and
    nothing is allocated. uint32 answers fit int32 arrays.
stream: a handle, or an object with __cuda_stream__, cuda_stream (PyTorch) or ptr (CuPy); None: the
    legacy default stream. Answers are written in its order. The host waits only in a batch that is
    larger than all before. A captured stream needs `out`.

Returns a Penetration: arrays of one row a pose, or numbers and (3,) arrays for one pose. Of solids on a
GPU an ist.gpu.Penetration, whose columns are arrays there.)";

void add_class(py::module_& module) {
  py::class_<Penetrations> type(
      module, "Penetration",
      "Overlaps of placed solids: columns of one row a pose, without the (n,) for one pose.");
  add_column(type, "volume", &Penetrations::volume, "(n,) [u³] of the overlap.");
  add_column(type, "volume_min", &Penetrations::volume_min,
             "(n,) [u³] With measure='exact' a lower bound of the true volume. With spheres the "
             "lower end of the interval of the finished sum; no bound of the true volume.");
  add_column(type, "volume_max", &Penetrations::volume_max, "(n,) [u³] the upper end, likewise.");
  add_column(type, "centroid", &Penetrations::centroid,
             "(n, 3) [u] of the overlap, world; zero if none.");
  add_column(type, "force", &Penetrations::force,
             "(n, 3) [u²] −dV/d(translation of B), world: the force on B of a pressure of 1. The "
             "force on A is opposite.");
  add_column(type, "torque", &Penetrations::torque,
             "(n, 3) [u³] −dV/d(rotation vector of B) about B's origin, world.");
  add_column(type, "pose_gradient", &Penetrations::pose_gradient,
             "(n, 7) dV/d(row of B's pose): [u³] for the quaternion, of V(q/|q|), and [u²].");
  add_column(type, "pose_gradient_a", &Penetrations::pose_gradient_a,
             "(n, 7) the same for A's pose.");
  add_column(type, "scale_gradient", &Penetrations::scale_gradient,
             "(n,) [u³] dV/d(B's scale), by the difference of two queries; None if not requested.");
  add_column(type, "scale_gradient_a", &Penetrations::scale_gradient_a,
             "(n,) [u³] the same for A's scale.");
  add_column(type, "touching", &Penetrations::touching,
             "(n,) bool: with measure='exact' the solids meet in points, edges or faces and the "
             "volume is 0. Spheres cannot tell: False.");
  add_column(type, "contact_area", &Penetrations::contact_area,
             "(n,) [u²] where they touch: of the faces that lie on each other.");
  add_column(type, "contact_normal", &Penetrations::contact_normal,
             "(n, 3) unit, from A to B, world: the mean normal of these faces; zero without faces "
             "and where their normals cancel.");
  add_column(type, "status", &Penetrations::status, "(n,) uint32, a QueryStatus.");
  add_column(type, "node_visits", &Penetrations::node_visits, "(n,) uint32, node pairs opened.");
  add_column(type, "sphere_pairs", &Penetrations::sphere_pairs,
             "(n,) uint32, lenses summed and spheres overlapped with a Shape; with "
             "measure='exact' intersecting triangles.");
  add_pickling(type);
}

}  // namespace

void Penetrations::write(std::size_t i, const Row& row, const Penetration& answer) const {
  const bool touches =
      answer.volume_max != 0 || answer.touching;  // else everything is zero except the counts
  for_each_member(
      [&]<class T, std::size_t kEach>(const Column<T, kEach>& column, const auto& value) {
        if (touches || std::is_integral_v<T>) column.write(i, value);
      },
      *this, answer);
  if (!touches) return;
  const Eigen::Vector3d origin_a(row.a.pose.t), origin_b(row.b.pose.t);
  const Wrenches push = wrenches(answer, row.b.pose, origin_a, origin_b);
  write_pose_gradient(row.b.pose, -answer.force, -answer.torque, pose_gradient.row(i));
  write_pose_gradient(row.a.pose, -push.on_a.force, -push.on_a.torque, pose_gradient_a.row(i));
}

ContactSettings contact_settings(const std::string& measure, bool spheres_only,
                                 std::uint32_t pair_budget, std::uint32_t max_visits,
                                 double relative_error, std::uint32_t pair_id) {
  return {named(measure, "measure", kMeasures),         spheres_only, pair_budget, max_visits,
          take_limit(relative_error, "relative_error"), pair_id};
}

void add_penetration(py::module_& module) {
  add_class(module);
  add_pair_query(
      module, "penetration",
      +[](const GivenPair& pair, bool scale_gradients, const std::string& measure,
          bool spheres_only, std::uint32_t pair_budget, std::uint32_t max_visits,
          double relative_error, std::uint32_t pair_id, unsigned threads, const py::object& wanted,
          const py::object& out, const py::object& stream) -> py::object {
        const GivenOutput given{wanted, out, stream};
        if (const DeviceSides sides = device_sides(pair.a, pair.b); sides.solids != nullptr) {
          refuse_given("not on a GPU", {{"scale_gradients", scale_gradients},
                                        {"max_visits", max_visits != 0},
                                        {"relative_error", relative_error != 0}});
          GpuPenetrationSettings settings{named(measure, "measure", kMeasures), pair_budget};
          return ask<GpuPenetrations>(
              sides, pair, given, {},
              [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
                  const GpuPenetrations& to, cuda::Stream on) {
                if (pair_id != 0 && settings.measure == Measure::exact)
                  settings.kept = &sides.solids->kept(pair_id, pairs.count, on);
                penetration_batch(all, pairs, settings, workspace, to, on);
              });
        }
        refuse_output(given);
        return py::cast(answer(pair.rows(),
                               contact_settings(measure, spheres_only, pair_budget, max_visits,
                                                relative_error, pair_id),
                               scale_gradients, threads));
      },
      py::arg("scale_gradients") = false, py::arg("measure") = "matched",
      py::arg("spheres_only") = false, py::arg("pair_budget") = 0, py::arg("max_visits") = 0,
      py::arg("relative_error") = 0.0, py::arg("pair_id") = 0, py::arg("threads") = 0,
      py::arg("wanted") = py::none(), py::arg("out") = py::none(), py::arg("stream") = py::none(),
      kDoc);
}

void add_gpu_penetration(py::module_& module) {
  LikeColumns<GpuPenetrations, Penetrations>().add_members();
  add_answers<GpuPenetrations>(module, "Penetration", "Overlaps");
}

}  // namespace ist::python
