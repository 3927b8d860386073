#include "rows.h"

#include <ist/query_tbb.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <thread>

#include <ist/asset_layout.h>
#include <ist/types.h>

#include "base/thread_arena.h"
#include "query/base/batch.h"
#include "query/base/relative_pose.h"

namespace ist::python {
namespace {

constexpr const char* kPoses = "(7,) or (n, 7): qw, qx, qy, qz, tx, ty, tz; or (n, 4, 4)";

constexpr double kOrigin[7] = {1, 0, 0, 0, 0, 0, 0};  // and a scale of 1

Pose pose_from(const double* values) {
  Pose pose;
  std::memcpy(pose.q, values, sizeof pose.q);
  std::memcpy(pose.t, values + 4, sizeof pose.t);
  return pose;
}

/// Scratch memory that calls reuse: creating it takes longer than a query.
class Workspaces {
 public:
  std::vector<Workspace> take(std::size_t count) {
    std::vector<Workspace> taken;
    taken.reserve(count);
    {
      const std::lock_guard lock(mutex_);
      for (; taken.size() < count && !idle_.empty(); idle_.pop_back())
        taken.push_back(std::move(idle_.back()));
    }
    while (taken.size() < count) taken.emplace_back();
    return taken;
  }

  void give_back(std::vector<Workspace>& taken) {
    const std::lock_guard lock(mutex_);
    for (Workspace& workspace : taken) idle_.push_back(std::move(workspace));
  }

 private:
  std::mutex mutex_;
  std::vector<Workspace> idle_;
};

Workspaces& workspaces() {
  static Workspaces all;
  return all;
}

/// Checks for Ctrl-C now and then, on the thread that Python called on; others see the result.
class Interrupt {
 public:
  bool seen() {
    if (std::this_thread::get_id() == caller_ && ++calls_ % kCalls == 0 &&
        Clock::now() - last_ > std::chrono::milliseconds(50)) {
      const py::gil_scoped_acquire held;
      if (PyErr_CheckSignals() != 0) seen_ = true;  // the exception is kept in this thread's state
      last_ = Clock::now();
    }
    return seen_.load(std::memory_order_relaxed);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr unsigned kCalls = 8;  // queries between two checks of the clock

  const std::thread::id caller_ = std::this_thread::get_id();
  unsigned calls_ = 0;
  Clock::time_point last_ = Clock::now();
  std::atomic<bool> seen_ = false;
};

}  // namespace

Rows Rows::of_pair(const py::object& a, const py::object& b, const py::object& poses,
                   const py::object& scales, const py::object& poses_a, const py::object& scales_a,
                   const char* name) {
  Rows rows;
  rows.a_ = Choice(a, "a");
  rows.b_ = Choice(b, "b");
  const auto is_field = [](const Choice& side) {
    return side.step == 0 && std::holds_alternative<ist::Shape>(side.among[0]);
  };
  if (is_field(rows.a_) && is_field(rows.b_))
    throw type_error("a, b: two shapes; one of them must be an Asset");
  std::optional<std::size_t> count;  // the common number of rows of the arguments with many
  const auto agree = [&](const auto& array, const char* name) {
    if (count && array.shape(0) != *count)
      throw value_error(std::string(name) + ": " + std::to_string(array.shape(0)) +
                        " rows; the arguments before it have " + std::to_string(*count));
    count = array.shape(0);
  };
  if (rows.a_.step != 0) agree(rows.a_.indices, "a");
  if (rows.b_.step != 0) agree(rows.b_.indices, "b");
  const auto take = [&](const py::object& value, const char* name) -> Values {
    Doubles array = take_poses(value, name, kPoses);
    if (array.ndim() < 1 || array.ndim() > 2 || array.shape(array.ndim() - 1) != 7)
      refuse_shape(array, name, kPoses);
    const bool many = array.ndim() == 2;
    if (many) agree(array, name);
    return Values(std::move(array), 7, many);
  };
  const auto take_scales = [&](const py::object& value, const char* name) -> Values {
    if (value.is_none()) return Values(kOrigin);
    Doubles array = take_doubles(value, name, "a number or (n,)");
    if (array.ndim() > 1) refuse_shape(array, name, "a number or (n,)");
    const bool many = array.ndim() == 1;
    if (many) agree(array, name);
    return Values(std::move(array), 1, many);
  };
  rows.pose_b_ = take(poses, name);
  rows.scale_b_ = take_scales(scales, "scales");
  rows.pose_a_ = poses_a.is_none() ? Values(kOrigin) : take(poses_a, "poses_a");
  rows.scale_a_ = take_scales(scales_a, "scales_a");
  if (count) rows.shape_ = {*count};
  rows.count_ = count.value_or(1);
  rows.sort_by_asset();
  return rows;
}

Rows::Choice::Choice(const py::object& given, const char* name) : owner(given) {
  if (py::isinstance<Solids>(given))
    throw type_error(std::string(name) + ": an ist.Solids; wanted solids[index] of it");
  if (!py::isinstance<SolidRows>(given)) {
    own = {solid_of(given, name)};
    among = own;
    return;
  }
  const auto& rows = py::cast<const SolidRows&>(given);
  const Solids& solids = rows.among();
  if (solids.on_device != nullptr)
    throw type_error(std::string(name) + ": on " + solids.device() +
                     "; this query is for the CPU alone");
  among = solids.views;
  if (py::isinstance<py::int_>(rows.index)) {
    among = among.subspan(py::cast<std::size_t>(rows.index), 1);
    return;
  }
  indices = take_integers(rows.index, name, "(n,) indices of solids");
  if (indices.ndim() != 1) refuse_shape(indices, name, "(n,) indices of solids");
  step = 1;
  for (std::size_t i = 0; i < indices.shape(0); ++i)
    if (const std::int64_t k = indices.data()[i]; k < 0 || k >= std::ssize(among))
      throw value_error(std::string(name) + ": row " + std::to_string(i) + " is solid " +
                        std::to_string(k) + "; there are " + std::to_string(among.size()) +
                        " solids");
}

void Rows::sort_by_asset() {
  // Below this, sorting costs more than it saves: 2 % of a batch over four assets, 6 to 9 % over 80
  // MB and more (benchmarks/run.sh cpu_batch).
  constexpr std::uint64_t kCache = 32u << 20;
  constexpr std::size_t kFew = 64;  // rows
  if (a_.step + b_.step == 0 || count_ < kFew) return;
  const auto header = [](const Solid& solid) -> const AssetHeader* {
    const AssetView* const tree = std::get_if<AssetView>(&solid);
    return tree != nullptr ? &tree->header() : nullptr;
  };
  std::set<const AssetHeader*> assets;
  std::uint64_t bytes = 0;
  for (const Choice* const side : {&a_, &b_})
    for (const Solid& solid : side->among)
      if (const AssetHeader* const asset = header(solid);
          asset != nullptr && assets.insert(asset).second)
        bytes += asset->file_bytes;
  if (bytes < kCache) return;
  order_.resize(count_);
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  const auto key = [&](std::size_t i) { return std::pair(header(a_.at(i)), header(b_.at(i))); };
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::size_t one, std::size_t other) { return key(one) < key(other); });
}

Row Rows::at(std::size_t i) const {
  return {{&a_.at(i), pose_from(pose_a_.at(i)), *scale_a_.at(i)},
          {&b_.at(i), pose_from(pose_b_.at(i)), *scale_b_.at(i)}};
}

std::string fault_of(const Pose& pose, double scale, const char* pose_name,
                     const char* scale_name) {
  constexpr const char* kNames[] = {"qw", "qx", "qy", "qz", "tx", "ty", "tz"};
  for (int k = 0; k < 7; ++k)
    if (const double x = k < 4 ? pose.q[k] : pose.t[k - 4]; !std::isfinite(x))
      return std::string(pose_name) + ": " + kNames[k] + " is " + text_of(py::float_(x));
  if (!(scale > 0) || !std::isfinite(scale))
    return std::string(scale_name) + ": " + text_of(py::float_(scale)) + "; wanted > 0";
  if (!usable_rotation(pose, scale))
    return std::string(pose_name) + ": the quaternion qw, qx, qy, qz has length 0";
  return {};
}

std::string fault_of(const Row& row, const char* name) {
  const std::string of_b = fault_of(row.b.pose, row.b.scale, name, "scales");
  if (!of_b.empty()) return of_b;
  const std::string of_a = fault_of(row.a.pose, row.a.scale, "poses_a", "scales_a");
  if (!of_a.empty()) return of_a;
  const Side& asset = row.b.tree() != nullptr ? row.b : row.a;
  const Side& other = row.b.tree() != nullptr ? row.a : row.b;
  if (asset.tree() == nullptr) return {};
  const PlacedAsset placed{*asset.tree(), asset.pose, asset.scale};
  const bool near =
      other.tree() != nullptr
          ? relative_pose({*other.tree(), other.pose, other.scale}, placed).has_value()
          : relative_pose(other.pose, other.scale, placed).has_value();
  return near ? std::string()
              : std::string(name) + ": sizes or distances are more than 1e60 : 1 apart";
}

void refuse_unanswered(const Rows& rows, QueryStatus status, Measure asked) {
  if (!rows.shape().empty()) return;
  const Row row = rows.at(0);
  if (status == QueryStatus::invalid_input) {
    const std::string fault = fault_of(row);
    throw value_error(fault.empty() ? "a, b: the Shape has a number that is not finite" : fault);
  }
  if (status != QueryStatus::missing_data) return;
  for (const Side* const side : {&row.b, &row.a}) {
    const AssetView* const tree = side->tree();
    const std::string name = side == &row.a ? "a" : "b";
    if (asked != Measure::exact) {
      if (tree != nullptr && tree->sphere_count() == 0)
        throw Error(name + ": is a mesh alone, without spheres; " +
                    (row.a.tree() != nullptr && row.b.tree() != nullptr
                         ? "use penetration() with measure='exact', or "
                         : "") +
                    "bake it with bake()");
    } else if (tree == nullptr) {
      throw Error(name + ": a Shape has no mesh, which measure='exact' needs; pass an Asset");
    } else if (!tree->has_mesh()) {
      throw Error(name + ": has no mesh, which measure='exact' needs; bake it with keep_mesh=True");
    }
  }
}

const char* write_pose(const double* matrix, double* row) {
  constexpr double kRigid = 1e-6;  // tolerance of each entry of RᵀR for a rotation
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> m(matrix);
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  if ((m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > kRigid)
    return "its last row is not 0, 0, 0, 1";
  Eigen::Map<Eigen::Vector3d>(row + 4) = m.topRightCorner<3, 1>();
  if (r.hasNaN()) {
    std::fill_n(row, 4, std::numeric_limits<double>::quiet_NaN());
    return nullptr;
  }
  const Eigen::Matrix3d off = r.transpose() * r - Eigen::Matrix3d::Identity();
  if (!(off.cwiseAbs().array() <= kRigid).all())
    return "its columns are not of length 1 and at right angles";
  if (r.determinant() < 0) return "it mirrors";
  // 4 q_k q, for each k: the longest of the four avoids cancellation.
  const double x = r(0, 0), y = r(1, 1), z = r(2, 2);
  const double yz = r(2, 1) - r(1, 2), zx = r(0, 2) - r(2, 0), xy = r(1, 0) - r(0, 1);
  const double in_yz = r(2, 1) + r(1, 2), in_zx = r(0, 2) + r(2, 0), in_xy = r(1, 0) + r(0, 1);
  const Eigen::Vector4d all[] = {{1 + x + y + z, yz, zx, xy},
                                 {yz, 1 + x - y - z, in_xy, in_zx},
                                 {zx, in_xy, 1 - x + y - z, in_yz},
                                 {xy, in_zx, in_yz, 1 - x - y + z}};
  const Eigen::Vector4d* best = all;
  double most = 0;
  for (const Eigen::Vector4d& q : all)
    if (const double length = std::sqrt(((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]);
        length > most) {
      best = &q;
      most = length;
    }
  for (int k = 0; k < 4; ++k) row[k] = (*best)[k] / most;
  return nullptr;
}

Column<double> rows_of_matrices(const Doubles& matrices, const std::string& name) {
  Shape shape = shape_of(matrices);
  shape.pop_back();
  shape.back() = 7;
  const Column<double> rows(shape);
  for (std::size_t i = 0; i < matrices.size() / 16; ++i)
    if (const char* const fault = write_pose(matrices.data() + 16 * i, rows.data.get() + 7 * i))
      throw value_error(name + ": matrix " + std::to_string(i) + " is no rigid motion: " + fault);
  return rows;
}

Doubles take_poses(const py::handle& value, const char* name, const std::string& wanted) {
  if (value.is_none())
    throw type_error(std::string(name) + ": None; wanted " + wanted +
                     "; [1, 0, 0, 0, 0, 0, 0] is the origin");
  Doubles given = take_doubles(value, name, wanted);
  const std::size_t d = given.ndim();
  if (d < 2 || given.shape(d - 1) != 4 || given.shape(d - 2) != 4) return given;
  return py::cast<Doubles>(rows_of_matrices(given, name).handed_out());
}

Pose take_pose(const py::object& pose, double scale, const std::string& name) {
  Pose taken;
  if (!pose.is_none()) {
    const char* const wanted = "(7,): qw, qx, qy, qz, tx, ty, tz; or (4, 4)";
    const Doubles values = take_poses(pose, name.c_str(), wanted);
    if (values.ndim() != 1 || values.shape(0) != 7) refuse_shape(values, name, wanted);
    taken = pose_from(values.data());
  }
  const std::string fault = fault_of(taken, scale, name.c_str(), "scale");
  if (!fault.empty()) throw value_error(fault);
  return taken;
}

void for_each_row(const Rows& rows, unsigned threads, const AnswerRow& answer) {
  for_each_of(rows.count(), threads,
              [&](std::size_t i, Workspace& workspace) { answer(rows.asked(i), workspace); });
}

void for_each_of(std::size_t count, unsigned threads, const AnswerRow& answer) {
  take_threads(threads);
  if (count == 0) return;
  Interrupt interrupt;
  bool interrupted = false;
  {
    const py::gil_scoped_release released;
    constexpr std::size_t kFew = 8;  // fewer rows are not worth a second thread
    const auto ask = [&](std::vector<Workspace>& scratch, const ParallelFor& parallel) {
      answer_all(count, scratch.size(), parallel, [&](std::size_t i, std::size_t worker) {
        if (!interrupt.seen()) answer(i, scratch[worker]);
      });
    };
    std::vector<Workspace> scratch;
    if (threads == 1 || count < kFew) {
      scratch = workspaces().take(1);
      ask(scratch, {});
    } else {
      oneapi::tbb::task_arena arena = thread_arena(threads);
      scratch = workspaces().take(static_cast<std::size_t>(arena.max_concurrency()));
      arena.execute([&] { ask(scratch, tbb_parallel_for()); });
    }
    workspaces().give_back(scratch);
    interrupted = interrupt.seen();
  }
  if (interrupted) throw py::python_error();
}

}  // namespace ist::python
