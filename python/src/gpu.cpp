#include <ist/error.h>
#include <ist/gpu.h>
#include <ist/gpu_query.h>

#include <array>
#include <deque>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "device_arrays.h"
#include "module.h"
#include "penetration.h"
#include "solids.h"

namespace ist::python {
namespace {

/// Assets on a device, and what their batches work in.
class DeviceAssets {
 public:
  DeviceAssets(const py::sequence& assets, int device) {
    std::vector<TreeView> views;
    for (const py::handle asset : assets) views.push_back(tree_of(asset, "assets"));
    const std::vector<py::object> held(assets.begin(), assets.end());
    const py::gil_scoped_release released;
    GpuSettings settings;
    settings.device = device;
    assets_ = std::make_unique<GpuAssets>(views, settings);
  }

  ~DeviceAssets() {
    if (in_flight_.empty()) return;
    const py::gil_scoped_release released;
    in_flight_.back().done->wait();  // what they read is about to go
  }

  const GpuAssets& assets() const { return *assets_; }

  /// Launches a batch after those before it, on whatever streams they were. Returns when it will
  /// be done, or null where the stream's work goes into a graph.
  ///
  /// `lent`: what the batch reads and writes, kept until it is done.
  std::shared_ptr<const cuda::Moment> launch(const GpuPairs& pairs, Measure measure,
                                             const GpuPenetrations& answers, cuda::Stream stream,
                                             std::vector<std::shared_ptr<void>> lent) {
    const int device = assets_->device();
    const bool captured = cuda::captures(device, stream);
    if (workspace_ == nullptr || workspace_->most_pairs() < pairs.count) {
      if (captured)
        throw Error("GPU: a batch of " + std::to_string(pairs.count) +
                    " pairs is captured, and none so large was asked before: ask once without "
                    "capturing");
      make_room(pairs.count);
    }
    if (!captured && !in_flight_.empty()) in_flight_.back().done->hold(stream);
    penetration_batch(*assets_, pairs, measure, *workspace_, answers, stream);
    if (captured) {
      workspace_captured_ = true;
      return nullptr;
    }
    while (!in_flight_.empty() && in_flight_.front().done->passed()) in_flight_.pop_front();
    in_flight_.push_back({std::make_shared<cuda::Moment>(device, stream), std::move(lent)});
    return in_flight_.back().done;
  }

 private:
  struct Batch {
    std::shared_ptr<const cuda::Moment> done;
    std::vector<std::shared_ptr<void>> lent;
  };

  void make_room(std::size_t pairs) {
    GpuSettings settings;
    settings.device = assets_->device();
    if (!in_flight_.empty()) in_flight_.back().done->wait();
    // A graph that was captured uses the old one as long as these assets.
    if (workspace_captured_) captured_.push_back(std::move(workspace_));
    workspace_captured_ = false;
    workspace_ = nullptr;
    std::size_t most = 4096;
    while (most < pairs) most *= 2;
    workspace_ = std::make_unique<GpuWorkspace>(most, settings);
  }

  std::unique_ptr<GpuAssets> assets_;
  std::unique_ptr<GpuWorkspace> workspace_;
  bool workspace_captured_ = false;
  std::vector<std::unique_ptr<GpuWorkspace>> captured_;
  std::deque<Batch> in_flight_;
};

/// A column that a batch can write.
struct Answer {
  const char* name;
  ElementType type;
  int width;
  void (*set)(GpuPenetrations& to, void* data);
  const char* doc;
  bool unasked;  ///< written where nobody says what is wanted
};

constexpr Answer kAnswers[] = {
    {"volume", kFloat64, 0,
     [](GpuPenetrations& to, void* data) { to.volume = static_cast<double*>(data); },
     "(n,) float64 [u³] of the overlap.", true},
    {"centroid", kFloat64, 3,
     [](GpuPenetrations& to, void* data) { to.centroid = static_cast<double*>(data); },
     "(n, 3) float64 [u] of the overlap, world; zero if none.", true},
    {"translation_gradient", kFloat64, 3,
     [](GpuPenetrations& to, void* data) { to.translation_gradient = static_cast<double*>(data); },
     "(n, 3) float64 [u²] dV/d(translation of B), world: the force on B is opposite.", true},
    {"rotation_gradient", kFloat64, 3,
     [](GpuPenetrations& to, void* data) { to.rotation_gradient = static_cast<double*>(data); },
     "(n, 3) float64 [u³/rad] dV/d(rotation vector of B about its origin), world.", true},
    {"status", kUInt32, 0,
     [](GpuPenetrations& to, void* data) { to.status = static_cast<QueryStatus*>(data); },
     "(n,) uint32, a QueryStatus: ok or invalid_input.", true},
    {"node_visits", kUInt32, 0,
     [](GpuPenetrations& to, void* data) { to.node_visits = static_cast<std::uint32_t*>(data); },
     "(n,) uint32, node pairs opened.", false},
    {"sphere_pairs", kUInt32, 0,
     [](GpuPenetrations& to, void* data) { to.sphere_pairs = static_cast<std::uint32_t*>(data); },
     "(n,) uint32, lenses summed.", false},
};
constexpr std::size_t kAnswerCount = std::size(kAnswers);

std::string names_of_answers() {
  std::string all;
  for (const Answer& answer : kAnswers)
    all += (all.empty() ? "'" : ", '") + std::string(answer.name) + "'";
  return all;
}

std::size_t number_of(const std::string& name, const char* argument) {
  for (std::size_t k = 0; k < kAnswerCount; ++k)
    if (name == kAnswers[k].name) return k;
  throw py::value_error(std::string(argument) + ": '" + name + "'; there are " +
                        names_of_answers());
}

/// Answers as arrays: ours, or those that were given.
struct DevicePenetrations {
  std::array<py::object, kAnswerCount> column;  ///< null: not wanted
};

/// The arguments that describe pairs, as many rows as they have.
class PairArguments {
 public:
  PairArguments(const GpuAssets& assets, cuda::Stream stream) : assets_(assets), stream_(stream) {}

  void take_pose(const py::object& value, const char* name, const Pose*& to) {
    if (value.is_none()) return;
    static_assert(sizeof(Pose) == 7 * sizeof(double));
    to = static_cast<const Pose*>(take(value, {name, {kFloat64}, 7, false}));
  }
  void take_scale(const py::object& value, const char* name, const double*& to) {
    if (!value.is_none())
      to = static_cast<const double*>(take(value, {name, {kFloat64}, 0, false}));
  }
  /// Numbers of assets; one for all is kept until the number of rows is known.
  void take_assets(const py::object& value, const char* name, const std::uint32_t*& to) {
    if (!py::isinstance<py::int_>(value)) {
      to = static_cast<const std::uint32_t*>(take(value, {name, {kUInt32, kInt32}, 0, false}));
      return;
    }
    const auto number = value.cast<std::int64_t>();
    if (number < 0 || number >= static_cast<std::int64_t>(assets_.size()))
      throw py::value_error(std::string(name) + ": " + std::to_string(number) + "; there are " +
                            std::to_string(assets_.size()) + " assets");
    same_.push_back({static_cast<std::uint32_t>(number), &to});
  }

  /// To be called when all are taken.
  std::size_t count() {
    if (rows_ < 0)
      throw py::value_error("pose_b: None; one argument must have rows: poses, scales or assets");
    const auto count = static_cast<std::size_t>(rows_);
    for (const auto& [number, to] : same_) {
      repeated_.push_back(
          std::make_unique<cuda::Repeated>(assets_.device(), number, count, stream_));
      *to = repeated_.back()->data();
    }
    return count;
  }

  std::vector<std::shared_ptr<void>> lent;

 private:
  void* take(const py::object& value, const WantedArray& wanted) {
    LentArray array = lend(value, wanted, assets_.device(), stream_);
    if (rows_ >= 0 && array.rows != rows_)
      throw py::value_error(wanted.name + ": " + std::to_string(array.rows) +
                            " rows; the arguments before it have " + std::to_string(rows_));
    rows_ = array.rows;
    lent.push_back(std::move(array.keep));
    return array.data;
  }

  struct Same {
    std::uint32_t number;
    const std::uint32_t** to;
  };
  const GpuAssets& assets_;
  cuda::Stream stream_;
  std::int64_t rows_ = -1;
  std::vector<Same> same_;
  std::vector<std::unique_ptr<cuda::Repeated>> repeated_;  // until the batch is launched
};

std::array<bool, kAnswerCount> wanted_answers(const py::object& wanted) {
  std::array<bool, kAnswerCount> asked = {};
  if (wanted.is_none()) {
    for (std::size_t k = 0; k < kAnswerCount; ++k) asked[k] = kAnswers[k].unasked;
    return asked;
  }
  if (py::isinstance<py::str>(wanted))
    throw py::type_error("wanted: a str; wanted a sequence of names: " + names_of_answers());
  for (const py::handle name : wanted) asked[number_of(py::str(name), "wanted")] = true;
  return asked;
}

/// Arrays of ours for the answers, all in one block.
void make_columns(const std::array<bool, kAnswerCount>& wanted, std::size_t count, int device,
                  cuda::Stream stream, GpuPenetrations& answers,
                  std::vector<std::pair<std::size_t, DeviceArray>>& made) {
  if (cuda::captures(device, stream))
    throw py::value_error(
        "out: None; wanted arrays for the answers, as the stream is captured and a graph's own "
        "memory does not outlive it");
  constexpr std::size_t kAlign = 256;
  std::size_t bytes = 0;
  std::vector<std::size_t> offsets;
  for (std::size_t k = 0; k < kAnswerCount; ++k) {
    if (!wanted[k]) continue;
    const Answer& answer = kAnswers[k];
    const std::size_t width = answer.width == 0 ? 1 : static_cast<std::size_t>(answer.width);
    DeviceArray array;
    array.type = answer.type;
    array.shape = {static_cast<std::int64_t>(count)};
    if (answer.width != 0) array.shape.push_back(answer.width);
    made.emplace_back(k, std::move(array));
    offsets.push_back(bytes);
    bytes += (count * width * answer.type.bytes() + kAlign - 1) / kAlign * kAlign;
  }
  const auto block = cuda::allocate(device, std::max(bytes, kAlign), stream);
  for (std::size_t i = 0; i < made.size(); ++i) {
    made[i].second.block = block;
    made[i].second.data = block->data() + offsets[i];
    kAnswers[made[i].first].set(answers, made[i].second.data);
  }
}

/// The arrays that were given for the answers.
void take_columns(const py::object& out, std::size_t count, int device, cuda::Stream stream,
                  GpuPenetrations& answers, DevicePenetrations& found,
                  std::vector<std::shared_ptr<void>>& lent) {
  std::array<py::object, kAnswerCount> given;
  if (py::isinstance<DevicePenetrations>(out)) {
    given = out.cast<const DevicePenetrations&>().column;
  } else if (py::isinstance<py::dict>(out)) {
    for (const auto& [name, array] : out.cast<py::dict>())
      given[number_of(py::str(name), "out")] = py::reinterpret_borrow<py::object>(array);
  } else {
    throw py::type_error("out: wanted a dict of arrays, or what an earlier call returned");
  }
  for (std::size_t k = 0; k < kAnswerCount; ++k) {
    if (!given[k]) continue;
    const Answer& answer = kAnswers[k];
    const std::string name = std::string("out['") + answer.name + "']";
    WantedArray wanted{name, {kFloat64}, answer.width, true};
    if (answer.type == kUInt32) wanted.types = {kUInt32, kInt32};
    LentArray array = lend(given[k], wanted, device, stream);
    if (array.rows != static_cast<std::int64_t>(count))
      throw py::value_error(name + ": " + std::to_string(array.rows) + " rows; the batch has " +
                            std::to_string(count));
    answer.set(answers, array.data);
    lent.push_back(std::move(array.keep));
    found.column[k] = given[k];
  }
}

DevicePenetrations penetrations(DeviceAssets& assets, const py::object& asset_a,
                                const py::object& asset_b, const py::object& pose_a,
                                const py::object& pose_b, const py::object& scale_a,
                                const py::object& scale_b, const std::string& measure,
                                const py::object& wanted, const py::object& out,
                                const py::object& stream) {
  const Measure which = named(measure, "measure", kMeasures);
  const cuda::Stream on = stream_of(stream);
  const int device = assets.assets().device();
  PairArguments arguments(assets.assets(), on);
  GpuPairs pairs;
  arguments.take_assets(asset_a, "asset_a", pairs.asset_a);
  arguments.take_assets(asset_b, "asset_b", pairs.asset_b);
  arguments.take_pose(pose_a, "pose_a", pairs.pose_a);
  arguments.take_pose(pose_b, "pose_b", pairs.pose_b);
  arguments.take_scale(scale_a, "scale_a", pairs.scale_a);
  arguments.take_scale(scale_b, "scale_b", pairs.scale_b);
  pairs.count = arguments.count();
  GpuPenetrations answers;
  DevicePenetrations found;
  std::vector<std::pair<std::size_t, DeviceArray>> made;
  if (out.is_none()) {
    make_columns(wanted_answers(wanted), pairs.count, device, on, answers, made);
  } else {
    if (!wanted.is_none())
      throw py::value_error("wanted: the arrays of `out` say what is wanted already");
    take_columns(out, pairs.count, device, on, answers, found, arguments.lent);
  }
  const auto done = assets.launch(pairs, which, answers, on, std::move(arguments.lent));
  for (auto& [k, array] : made) found.column[k] = py::cast(std::move(array));
  if (done != nullptr)
    for (const py::object& column : found.column)
      if (column && py::isinstance<DeviceArray>(column)) column.cast<DeviceArray&>().ready = done;
  return found;
}

constexpr const char* kPenetrationDoc = R"(Penetrations of a batch of pairs, on the device.

assets: Assets. asset_a, asset_b: (n,) uint32 or int32 numbers of them, or one number for all.
pose_a, pose_b: (n, 7) float64: qw, qx, qy, qz, tx [u], ty, tz; None: at the origin, unturned.
scale_a, scale_b: (n,) float64 > 0; None: 1.
measure: 'matched' (the accurate one) or 'inner' (certified lower bound of the true volume).
wanted: names of answers; None: all but node_visits and sphere_pairs.
out: a dict of arrays by the answers' names, or what an earlier call returned: answers go there, and
    nothing is allocated. uint32 answers fit int32 arrays.
stream: a handle, or an object with __cuda_stream__, cuda_stream (PyTorch) or ptr (CuPy); None: the
    legacy default stream. Answers are written in its order.

Arrays are those of any framework, in the memory of the assets' device, in C order: they are taken by
__dlpack__ or __cuda_array_interface__, never copied, and held until the batch is done. One that
does not fit is a TypeError or a ValueError that names it.

By lenses, as ist.penetration(…, field='never'): volumes are within 1e-6 of the sum in double. The
same bits in every run, whatever else is in the batch. Rows that are invalid are all zero, with the
status invalid_input.
Nothing waits on the host, but in the first batch that is larger than all before. A stream that is
captured needs `out`; graphs and other batches of the same Assets must follow one another.

Returns a Penetration.)";

void add_classes(py::module_& module) {
  py::class_<DeviceAssets>(
      module, "Assets",
      "Assets in the memory of a device, for batches: pairs name them by their place.\n\n"
      "Batches of one Assets follow one another, whatever their streams: they share memory to work "
      "in. Graphs that were captured need it as long as they are used.")
      .def(py::init<const py::sequence&, int>(), py::arg("assets"), py::kw_only(),
           py::arg("device") = 0,
           "assets: ist.Asset each. Raises ist.Error where the device cannot be used or has no "
           "memory left.")
      .def("__len__", [](const DeviceAssets& self) { return self.assets().size(); })
      .def_property_readonly(
          "device", [](const DeviceAssets& self) { return self.assets().device(); },
          "CUDA's number.")
      .def_property_readonly(
          "bytes", [](const DeviceAssets& self) { return self.assets().bytes(); },
          "Of device memory that the assets take.");
  py::class_<DevicePenetrations> type(
      module, "Penetration",
      "Overlaps of a batch: arrays on the device, None where not wanted; those that were given as "
      "`out` are the same objects.");
  for (std::size_t k = 0; k < kAnswerCount; ++k)
    type.def_property_readonly(
        kAnswers[k].name,
        [k](const DevicePenetrations& self) -> py::object {
          return self.column[k] ? self.column[k] : py::none();
        },
        kAnswers[k].doc);
}

}  // namespace

void add_gpu(py::module_& package) {
  // ist.gpu, since the package has its users' name meanwhile.
  py::module_ module = package.def_submodule(
      "gpu",
      "Batches on a GPU: arrays of any framework, in and out, without a copy.\n\n"
      "available() says whether there is one. docs/batch.md, docs/python.md.");
  add_device_array(module);
  add_classes(module);
  module.def(
      "available", [](int device) { return gpu_available(device); }, py::arg("device") = 0,
      "Whether this build can use the device here; why_not() says what is missing.");
  module.def(
      "why_not",
      [](int device) -> py::object {
        std::string why;
        if (gpu_available(device, &why)) return py::none();
        return py::str(why);
      },
      py::arg("device") = 0, "What is missing where available() is False; None where it is True.");
  module.def("penetration", &penetrations, py::arg("assets"), py::arg("asset_a"),
             py::arg("asset_b"), py::arg("pose_a"), py::arg("pose_b"),
             py::arg("scale_a") = py::none(), py::arg("scale_b") = py::none(), py::kw_only(),
             py::arg("measure") = "matched", py::arg("wanted") = py::none(),
             py::arg("out") = py::none(), py::arg("stream") = py::none(), kPenetrationDoc);
  // So that arguments can be tried where there is no device.
  module.def(
      "_lend",
      [](const py::object& value, const std::string& name, int width, bool written, int device) {
        return lend(value, {name, {kFloat64}, width, written}, device, cuda::legacy_stream()).rows;
      },
      py::arg("value"), py::arg("name"), py::arg("width"), py::arg("written") = false,
      py::arg("device") = 0);
}

}  // namespace ist::python
