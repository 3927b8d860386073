#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "device_arrays.h"
#include "gpu_solids.h"

// What all batches on a device share: arguments that describe pairs, columns of answers.

namespace ist::python {

/// A column that a batch can write.
template <class Answers>
struct Answer {
  const char* name;
  ElementType type;
  int width;
  void (*set)(Answers& to, void* data);
  const char* doc;
  bool unasked;  ///< written where nobody says what is wanted
  /// Rows for each pair; null: one, without a dimension of its own.
  std::uint32_t (*each)(const Answers&) = nullptr;

  /// Of a pair's part of the column. `to`: how it is asked.
  std::vector<std::int64_t> inner_shape(const Answers& to) const {
    std::vector<std::int64_t> shape;
    if (each != nullptr) shape.push_back(each(to));
    if (width != 0) shape.push_back(width);
    return shape;
  }
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
  throw value_error(std::string(argument) + ": '" + name + "'; there are " +
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
    to = static_cast<const Pose*>(take(value, {name, {kFloat64}, {7}, false}));
  }
  void take_scale(const py::object& value, const char* name, const double*& to) {
    if (!value.is_none())
      to = static_cast<const double*>(take(value, {name, {kFloat64}, {}, false}));
  }
  /// Indices of solids, of which there are `size`; one for all is kept until the number of rows is
  /// known.
  void take_solid(const py::object& value, const char* name, std::size_t size,
                  const std::uint32_t*& to) {
    if (!py::isinstance<py::int_>(value)) {
      to = static_cast<const std::uint32_t*>(take(value, {name, {kUInt32, kInt32}, {}, false}));
      return;
    }
    const auto number = py::cast<std::int64_t>(value);
    if (number < 0 || number >= static_cast<std::int64_t>(size))
      throw value_error(std::string(name) + ": " + std::to_string(number) + "; there are " +
                        std::to_string(size) + " solids");
    same_.push_back({static_cast<std::uint32_t>(number), &to});
  }

  /// To be called when all are taken.
  std::size_t count() {
    if (rows_ < 0)
      throw value_error("pose_b: None; one argument must have rows: poses, scales or solids");
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
      throw value_error(wanted.name + ": " + std::to_string(array.rows) +
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
    throw type_error("wanted: a str; must be a sequence of names: " + names_of_columns<Answers>());
  for (const py::handle name : wanted) asked[number_of<Answers>(text_of(name), "wanted")] = true;
  return asked;
}

/// Where the answers of a batch go.
template <class Answers>
struct Places {
  Answers to;
  DeviceAnswers<Answers> found;
};

/// Arrays of ours, all in one block. `blank`: how it is asked, without arrays.
template <class Answers>
Places<Answers> new_columns(const Answers& blank, const std::vector<bool>& wanted,
                            std::size_t count, int device, cuda::Stream stream) {
  if (cuda::captures(device, stream))
    throw value_error(
        "out: None; wanted arrays for the answers, because the stream is captured and a graph's "
        "memory does not outlive it");
  const auto columns = columns_of<Answers>();
  constexpr std::size_t kAlign = 256;
  std::size_t bytes = 0;
  std::vector<std::size_t> begin;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    begin.push_back(bytes);
    std::size_t each = columns[k].type.bits / 8u;
    for (const std::int64_t n : columns[k].inner_shape(blank)) each *= static_cast<std::size_t>(n);
    if (wanted[k]) bytes += (count * each + kAlign - 1) / kAlign * kAlign;
  }
  const auto block = cuda::allocate(device, std::max(bytes, kAlign), stream);
  const bool all_written = std::all_of(columns.begin(), columns.end(),
                                       [](const auto& column) { return column.each == nullptr; });
  if (!all_written) cuda::clear(*block, bytes, stream);
  Places<Answers> places{blank, {}};
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (!wanted[k]) continue;
    DeviceArray array;
    array.block = block;
    array.data = block->data() + begin[k];
    array.shape = {count};
    for (const std::int64_t n : columns[k].inner_shape(blank))
      array.shape.push_back(static_cast<std::size_t>(n));
    array.type = columns[k].type;
    columns[k].set(places.to, array.data);
    places.found.column[k] = py::cast(std::move(array));
  }
  return places;
}

/// The arrays that were given.
template <class Answers>
Places<Answers> given_columns(const Answers& blank, const py::object& out, std::size_t count,
                              int device, cuda::Stream stream,
                              std::vector<std::shared_ptr<void>>& lent) {
  const auto columns = columns_of<Answers>();
  Places<Answers> places{blank, {}};
  if (py::isinstance<DeviceAnswers<Answers>>(out)) {
    places.found = py::cast<const DeviceAnswers<Answers>&>(out);
  } else if (py::isinstance<py::dict>(out)) {
    for (const auto& [name, array] : py::cast<py::dict>(out))
      places.found.column[number_of<Answers>(text_of(name), "out")] = py::borrow<py::object>(array);
  } else {
    throw type_error("out: wanted a dict of arrays, or what an earlier call returned");
  }
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const py::object& given = places.found.column[k];
    if (!given.is_valid()) continue;
    WantedArray wanted{std::string("out['") + columns[k].name + "']",
                       {columns[k].type},
                       columns[k].inner_shape(blank),
                       true};
    if (columns[k].type == kUInt32) wanted.types.push_back(kInt32);
    if (columns[k].type == kUInt64) wanted.types.push_back(kInt64);
    LentArray array = lend(given, wanted, device, stream);
    if (array.rows != static_cast<std::int64_t>(count))
      throw value_error(wanted.name + ": " + std::to_string(array.rows) + " rows; the batch has " +
                        std::to_string(count));
    columns[k].set(places.to, array.data);
    lent.push_back(std::move(array.keep));
  }
  return places;
}

/// The arguments that describe pairs, as they were given.
struct GivenPairs {
  const py::object &solid_a, &solid_b, &pose_a, &pose_b, &scale_a, &scale_b;
};

/// Takes all arguments and launches a batch: launch(solids, pairs, workspace, answers, stream).
/// `blank`: answers without arrays.
template <class Answers, class Launch>
DeviceAnswers<Answers> ask(DeviceSolids& solids, const GivenPairs& given, const Answers& blank,
                           const py::object& wanted, const py::object& out,
                           const py::object& stream, const Launch& launch) {
  const cuda::Stream on = stream_of(stream);
  const int device = solids.solids().device();
  PairArguments arguments(device, on);
  GpuPairs pairs;
  arguments.take_solid(given.solid_a, "solid_a", solids.solids().size(), pairs.a.solid);
  arguments.take_solid(given.solid_b, "solid_b", solids.solids().size(), pairs.b.solid);
  arguments.take_pose(given.pose_a, "pose_a", pairs.a.pose);
  arguments.take_pose(given.pose_b, "pose_b", pairs.b.pose);
  arguments.take_scale(given.scale_a, "scale_a", pairs.a.scale);
  arguments.take_scale(given.scale_b, "scale_b", pairs.b.scale);
  pairs.count = arguments.count();
  if (!out.is_none() && !wanted.is_none())
    throw value_error("wanted: excludes `out`, whose arrays already select the answers");
  Places<Answers> places =
      out.is_none() ? new_columns(blank, wanted_columns<Answers>(wanted), pairs.count, device, on)
                    : given_columns(blank, out, pairs.count, device, on, arguments.lent);
  const auto done = solids.launch(pairs, on, std::move(arguments.lent),
                                  [&](const GpuSolids& all, GpuWorkspace& workspace) {
                                    launch(all, pairs, workspace, places.to, on);
                                  });
  if (done != nullptr)
    for (const py::object& column : places.found.column)
      if (column.is_valid() && py::isinstance<DeviceArray>(column))
        py::cast<DeviceArray&>(column).ready = done;
  return std::move(places.found);
}

/// The class of a kind of answers.
template <class Answers>
void add_answers(py::module_& module, const char* name, const char* doc) {
  py::class_<DeviceAnswers<Answers>> type(module, name, doc);
  const auto columns = columns_of<Answers>();
  for (std::size_t k = 0; k < columns.size(); ++k)
    type.def_prop_ro(
        columns[k].name,
        [k](const DeviceAnswers<Answers>& self) -> py::object {
          return self.column[k].is_valid() ? self.column[k] : py::none();
        },
        columns[k].doc);
}

}  // namespace ist::python
