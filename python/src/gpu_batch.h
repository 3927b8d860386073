#pragma once

#include <ist/error.h>
#include <ist/gpu_fields.h>
#include <ist/gpu_query.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "device_arrays.h"
#include "solids.h"

// What all batches on a device share: assets, arguments that describe pairs, columns of answers.

namespace ist::python {

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
  /// `lent`: what the batch reads and writes, kept until it is done. `batch`: launches it.
  template <class Launch>
  std::shared_ptr<const cuda::Moment> launch(const GpuPairs& pairs, cuda::Stream stream,
                                             std::vector<std::shared_ptr<void>> lent,
                                             const Launch& batch) {
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
    batch(*assets_, *workspace_);
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

/// Fields on a device. Batches that read them hold them until they are done.
class DeviceFields {
 public:
  DeviceFields(const py::sequence& fields, int device) {
    std::vector<Field> all;
    for (const py::handle field : fields) all.push_back(field_of(field, "fields"));
    const std::vector<py::object> held(fields.begin(), fields.end());
    const py::gil_scoped_release released;
    GpuSettings settings;
    settings.device = device;
    fields_ = std::make_unique<GpuFields>(all, settings);
  }

  const GpuFields& fields() const { return *fields_; }

 private:
  std::unique_ptr<GpuFields> fields_;
};

/// A column that a batch can write.
template <class Answers>
struct Answer {
  const char* name;
  ElementType type;
  int width;
  void (*set)(Answers& to, void* data);
  const char* doc;
  bool unasked;  ///< written where nobody says what is wanted
};

template <auto kColumn, class Answers>
void set_column(Answers& to, void* data) {
  to.*kColumn = static_cast<std::remove_reference_t<decltype(to.*kColumn)>>(data);
}

/// The columns of a kind of answers.
template <class Answers>
std::span<const Answer<Answers>> columns_of();

template <class Answers>
std::string names_of_columns() {
  std::string all;
  for (const Answer<Answers>& answer : columns_of<Answers>())
    all += (all.empty() ? "'" : ", '") + std::string(answer.name) + "'";
  return all;
}

template <class Answers>
std::size_t number_of(const std::string& name, const char* argument) {
  const auto columns = columns_of<Answers>();
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (name == columns[k].name) return k;
  throw py::value_error(std::string(argument) + ": '" + name + "'; there are " +
                        names_of_columns<Answers>());
}

/// Answers as arrays, ours or those that were given, in the order of columns_of(); null: not
/// wanted.
template <class Answers>
struct DeviceAnswers {
  std::vector<py::object> column = std::vector<py::object>(columns_of<Answers>().size());
};

/// The arguments that describe pairs, as many rows as they have.
class PairArguments {
 public:
  PairArguments(int device, cuda::Stream stream) : device_(device), stream_(stream) {}

  void take_pose(const py::object& value, const char* name, const Pose*& to) {
    if (value.is_none()) return;
    static_assert(sizeof(Pose) == 7 * sizeof(double));
    to = static_cast<const Pose*>(take(value, {name, {kFloat64}, 7, false}));
  }
  void take_scale(const py::object& value, const char* name, const double*& to) {
    if (!value.is_none())
      to = static_cast<const double*>(take(value, {name, {kFloat64}, 0, false}));
  }
  /// Numbers of solids, of which there are `size`; one for all is kept until the number of rows is
  /// known.
  void take_numbers(const py::object& value, const char* name, std::size_t size, const char* kind,
                    const std::uint32_t*& to) {
    if (!py::isinstance<py::int_>(value)) {
      to = static_cast<const std::uint32_t*>(take(value, {name, {kUInt32, kInt32}, 0, false}));
      return;
    }
    const auto number = value.cast<std::int64_t>();
    if (number < 0 || number >= static_cast<std::int64_t>(size))
      throw py::value_error(std::string(name) + ": " + std::to_string(number) + "; there are " +
                            std::to_string(size) + " " + kind);
    same_.push_back({static_cast<std::uint32_t>(number), &to});
  }

  /// To be called when all are taken.
  std::size_t count() {
    if (rows_ < 0)
      throw py::value_error("pose_b: None; one argument must have rows: poses, scales or assets");
    const auto count = static_cast<std::size_t>(rows_);
    for (const auto& [number, to] : same_) {
      repeated_.push_back(std::make_unique<cuda::Repeated>(device_, number, count, stream_));
      *to = repeated_.back()->data();
    }
    return count;
  }

  std::vector<std::shared_ptr<void>> lent;

 private:
  void* take(const py::object& value, const WantedArray& wanted) {
    LentArray array = lend(value, wanted, device_, stream_);
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
  int device_;
  cuda::Stream stream_;
  std::int64_t rows_ = -1;
  std::vector<Same> same_;
  std::vector<std::unique_ptr<cuda::Repeated>> repeated_;  // until the batch is launched
};

/// Which columns are wanted.
template <class Answers>
std::vector<bool> wanted_columns(const py::object& wanted) {
  std::vector<bool> asked;
  for (const Answer<Answers>& answer : columns_of<Answers>())
    asked.push_back(wanted.is_none() && answer.unasked);
  if (wanted.is_none()) return asked;
  if (py::isinstance<py::str>(wanted))
    throw py::type_error("wanted: a str; wanted a sequence of names: " +
                         names_of_columns<Answers>());
  for (const py::handle name : wanted) asked[number_of<Answers>(py::str(name), "wanted")] = true;
  return asked;
}

/// Where the answers of a batch go.
template <class Answers>
struct Places {
  Answers to;
  DeviceAnswers<Answers> found;
};

/// Arrays of ours, all in one block.
template <class Answers>
Places<Answers> new_columns(const std::vector<bool>& wanted, std::size_t count, int device,
                            cuda::Stream stream) {
  if (cuda::captures(device, stream))
    throw py::value_error(
        "out: None; wanted arrays for the answers, as the stream is captured and a graph's own "
        "memory does not outlive it");
  const auto columns = columns_of<Answers>();
  constexpr std::size_t kAlign = 256;
  std::size_t bytes = 0;
  std::vector<std::size_t> begin;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    begin.push_back(bytes);
    const auto width = static_cast<std::size_t>(std::max(1, columns[k].width));
    if (wanted[k])
      bytes += (count * width * columns[k].type.bytes() + kAlign - 1) / kAlign * kAlign;
  }
  const auto block = cuda::allocate(device, std::max(bytes, kAlign), stream);
  Places<Answers> places;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (!wanted[k]) continue;
    DeviceArray array;
    array.block = block;
    array.data = block->data() + begin[k];
    array.shape = {static_cast<std::int64_t>(count)};
    if (columns[k].width != 0) array.shape.push_back(columns[k].width);
    array.type = columns[k].type;
    columns[k].set(places.to, array.data);
    places.found.column[k] = py::cast(std::move(array));
  }
  return places;
}

/// The arrays that were given.
template <class Answers>
Places<Answers> given_columns(const py::object& out, std::size_t count, int device,
                              cuda::Stream stream, std::vector<std::shared_ptr<void>>& lent) {
  const auto columns = columns_of<Answers>();
  Places<Answers> places;
  if (py::isinstance<DeviceAnswers<Answers>>(out)) {
    places.found = out.cast<const DeviceAnswers<Answers>&>();
  } else if (py::isinstance<py::dict>(out)) {
    for (const auto& [name, array] : out.cast<py::dict>())
      places.found.column[number_of<Answers>(py::str(name), "out")] =
          py::reinterpret_borrow<py::object>(array);
  } else {
    throw py::type_error("out: wanted a dict of arrays, or what an earlier call returned");
  }
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const py::object& given = places.found.column[k];
    if (!given) continue;
    WantedArray wanted{
        std::string("out['") + columns[k].name + "']", {columns[k].type}, columns[k].width, true};
    if (columns[k].type == kUInt32) wanted.types.push_back(kInt32);
    LentArray array = lend(given, wanted, device, stream);
    if (array.rows != static_cast<std::int64_t>(count))
      throw py::value_error(wanted.name + ": " + std::to_string(array.rows) +
                            " rows; the batch has " + std::to_string(count));
    columns[k].set(places.to, array.data);
    lent.push_back(std::move(array.keep));
  }
  return places;
}

/// The arguments that describe pairs, as they were given.
struct GivenPairs {
  const py::object &asset_a, &asset_b, &pose_a, &pose_b, &scale_a, &scale_b;
  std::shared_ptr<DeviceFields> fields;  ///< those that asset_a names; null: assets
};

/// Takes all arguments and launches a batch: launch(assets, pairs, workspace, answers, stream).
template <class Answers, class Launch>
DeviceAnswers<Answers> ask(DeviceAssets& assets, const GivenPairs& given, const py::object& wanted,
                           const py::object& out, const py::object& stream, const Launch& launch) {
  const cuda::Stream on = stream_of(stream);
  const int device = assets.assets().device();
  PairArguments arguments(device, on);
  GpuPairs pairs;
  if (given.fields != nullptr)
    arguments.take_numbers(given.asset_a, "asset_a", given.fields->fields().size(), "fields",
                           pairs.asset_a);
  else
    arguments.take_numbers(given.asset_a, "asset_a", assets.assets().size(), "assets",
                           pairs.asset_a);
  arguments.take_numbers(given.asset_b, "asset_b", assets.assets().size(), "assets", pairs.asset_b);
  arguments.take_pose(given.pose_a, "pose_a", pairs.pose_a);
  arguments.take_pose(given.pose_b, "pose_b", pairs.pose_b);
  arguments.take_scale(given.scale_a, "scale_a", pairs.scale_a);
  arguments.take_scale(given.scale_b, "scale_b", pairs.scale_b);
  pairs.count = arguments.count();
  if (given.fields != nullptr) arguments.lent.push_back(given.fields);
  if (!out.is_none() && !wanted.is_none())
    throw py::value_error("wanted: the arrays of `out` say what is wanted already");
  Places<Answers> places =
      out.is_none() ? new_columns<Answers>(wanted_columns<Answers>(wanted), pairs.count, device, on)
                    : given_columns<Answers>(out, pairs.count, device, on, arguments.lent);
  const auto done = assets.launch(pairs, on, std::move(arguments.lent),
                                  [&](const GpuAssets& all, GpuWorkspace& workspace) {
                                    launch(all, pairs, workspace, places.to, on);
                                  });
  if (done != nullptr)
    for (const py::object& column : places.found.column)
      if (column && py::isinstance<DeviceArray>(column)) column.cast<DeviceArray&>().ready = done;
  return std::move(places.found);
}

/// The class of a kind of answers.
template <class Answers>
void add_answers(py::module_& module, const char* name, const char* doc) {
  py::class_<DeviceAnswers<Answers>> type(module, name, doc);
  const auto columns = columns_of<Answers>();
  for (std::size_t k = 0; k < columns.size(); ++k)
    type.def_property_readonly(
        columns[k].name,
        [k](const DeviceAnswers<Answers>& self) -> py::object {
          return self.column[k] ? self.column[k] : py::none();
        },
        columns[k].doc);
}

}  // namespace ist::python
