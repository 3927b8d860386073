#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "device_arrays.h"
#include "pair_queries.h"
#include "penetration.h"

// The common parts of all batches on a device: arguments that describe pairs, columns of answers.

namespace ist::python {

/// A column that a batch can write.
struct DeviceColumn {
  std::string name;
  const char* doc;
  ElementType type;
  std::size_t width;  ///< 0: a number
  std::size_t place;  ///< of its pointer among the answers
  bool of_patches;    ///< answers.most rows for each pair

  /// The shape of a pair's part of the column. `to`: the query.
  template <class Answers>
  std::vector<std::int64_t> inner_shape(const Answers& to) const {
    std::vector<std::int64_t> shape;
    if constexpr (requires { to.most; })
      if (of_patches) shape.push_back(to.most);
    if (width != 0) shape.push_back(static_cast<std::int64_t>(width));
    return shape;
  }

  template <class Answers>
  void set(Answers& to, void* data) const {
    std::memcpy(reinterpret_cast<std::byte*>(&to) + place, &data, sizeof data);
  }

  /// Written by default.
  bool unasked() const { return name != "node_visits" && name != "sphere_pairs"; }
};

template <class Answers>
std::vector<DeviceColumn>& columns_of() {
  static std::vector<DeviceColumn> all;
  return all;
}

/// Makes columns on a device like those of `Columns` on the CPU.
template <class Answers, class Columns>
struct LikeColumns {
  Answers answers;
  Columns columns;

  template <class T, std::size_t kEach>
  void add(const auto& pointer, const Column<T, kEach>& like, bool of_patches) {
    static_assert(sizeof(*pointer) == sizeof(T));
    for (const auto& part : Pickled<Columns>::parts)
      if (part.where(columns) == &like)
        add(pointer, part.name, part.doc, py::dtype<T>(), kEach, of_patches);
  }
  void add(const auto& pointer, const char* name, const char* doc, ElementType type,
           std::size_t width = 0, bool of_patches = false) {
    const auto place =
        reinterpret_cast<const std::byte*>(&pointer) - reinterpret_cast<const std::byte*>(&answers);
    columns_of<Answers>().push_back(
        {name, doc, type, width, static_cast<std::size_t>(place), of_patches});
  }
  void add_members() {
    constexpr bool kOfPatches = requires(Answers of) { of.most; };
    for_each_member([&](const auto& pointer, const auto& like) { add(pointer, like, kOfPatches); },
                    answers, columns);
  }
};

template <class Answers>
std::string names_of_columns() {
  std::string all;
  for (const DeviceColumn& column : columns_of<Answers>())
    all += (all.empty() ? "'" : ", '") + column.name + "'";
  return all;
}

template <class Answers>
std::size_t number_of(const std::string& name, const char* argument) {
  const auto& columns = columns_of<Answers>();
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (name == columns[k].name) return k;
  throw value_error(std::string(argument) + ": '" + name + "'; there are " +
                    names_of_columns<Answers>());
}

/// Answers as arrays, newly allocated or given, in the order of columns_of(); null: not wanted.
template <class Answers>
struct DeviceAnswers {
  std::vector<py::object> column = std::vector<py::object>(columns_of<Answers>().size());
};

/// The arguments that describe pairs, with as many rows as `poses`.
class PairArguments {
 public:
  PairArguments(const DeviceSides& sides, const GivenPair& given, cuda::Stream stream)
      : device_(sides.solids->solids().device()), stream_(stream) {
    static_assert(sizeof(Pose) == 7 * sizeof(double));
    take(given.poses, {"poses", {kFloat64}, {7}}, pairs.b.pose);
    if (!given.poses_a.is_none()) take(given.poses_a, {"poses_a", {kFloat64}, {7}}, pairs.a.pose);
    if (!given.scales.is_none()) take(given.scales, {"scales", {kFloat64}, {}}, pairs.b.scale);
    if (!given.scales_a.is_none())
      take(given.scales_a, {"scales_a", {kFloat64}, {}}, pairs.a.scale);
    take_solid(sides.a, "a", pairs.a.solid);
    take_solid(sides.b, "b", pairs.b.solid);
  }

  GpuPairs pairs;
  std::vector<std::shared_ptr<void>> lent;

 private:
  template <class T>
  void take(const py::object& value, const WantedArray& wanted, const T*& to) {
    LentArray array = lend(value, wanted, device_, stream_);
    const auto rows = static_cast<std::size_t>(array.rows);
    if (!lent.empty() && rows != pairs.count)
      throw value_error(wanted.name + ": " + std::to_string(rows) +
                        " rows; the arguments before it have " + std::to_string(pairs.count));
    pairs.count = rows;
    to = static_cast<const T*>(array.data);
    lent.push_back(std::move(array.keep));
  }

  void take_solid(const py::object& index, const char* name, const std::uint32_t*& to) {
    if (!py::isinstance<py::int_>(index)) return take(index, {name, {kUInt32, kInt32}, {}}, to);
    repeated_.push_back(std::make_unique<cuda::Repeated>(device_, py::cast<std::uint32_t>(index),
                                                         pairs.count, stream_));
    to = repeated_.back()->data();
  }

  int device_;
  cuda::Stream stream_;
  std::vector<std::unique_ptr<cuda::Repeated>> repeated_;  // until the batch is launched
};

template <class Answers>
std::vector<bool> wanted_columns(const py::object& wanted) {
  std::vector<bool> asked;
  for (const DeviceColumn& column : columns_of<Answers>())
    asked.push_back(wanted.is_none() && column.unasked());
  if (wanted.is_none()) return asked;
  if (py::isinstance<py::str>(wanted))
    throw type_error("wanted: a str; must be a sequence of names: " + names_of_columns<Answers>());
  for (const py::handle name : wanted) asked[number_of<Answers>(text_of(name), "wanted")] = true;
  return asked;
}

/// The destination of a batch's answers.
template <class Answers>
struct DevicePlaces {
  Answers to;
  DeviceAnswers<Answers> found;
};

/// New arrays in a single block. `blank`: the query, without arrays.
template <class Answers>
DevicePlaces<Answers> new_columns(const Answers& blank, const std::vector<bool>& wanted,
                                  std::size_t count, int device, cuda::Stream stream) {
  if (cuda::captures(device, stream))
    throw value_error(
        "out: None; wanted arrays for the answers, because the stream is captured and a graph's "
        "memory does not outlive it");
  const auto& columns = columns_of<Answers>();
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
                                       [](const auto& column) { return !column.of_patches; });
  if (!all_written) cuda::clear(*block, bytes, stream);
  DevicePlaces<Answers> places{blank, {}};
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

template <class Answers>
DevicePlaces<Answers> given_columns(const Answers& blank, const py::object& out, std::size_t count,
                                    int device, cuda::Stream stream,
                                    std::vector<std::shared_ptr<void>>& lent) {
  const auto& columns = columns_of<Answers>();
  DevicePlaces<Answers> places{blank, {}};
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
    WantedArray wanted{
        "out['" + columns[k].name + "']", {columns[k].type}, columns[k].inner_shape(blank), true};
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

/// Reads all arguments and launches a batch: launch(solids, pairs, workspace, answers, stream).
/// `blank`: answers without arrays.
template <class Answers, class Launch>
py::object ask(const DeviceSides& sides, const GivenPair& pair, const GivenOutput& given,
               const Answers& blank, const Launch& launch) {
  const cuda::Stream on = stream_of(given.stream);
  DeviceSolids& solids = *sides.solids;
  const int device = solids.solids().device();
  PairArguments arguments(sides, pair, on);
  const GpuPairs& pairs = arguments.pairs;
  if (!given.out.is_none() && !given.wanted.is_none())
    throw value_error("wanted: excludes `out`, whose arrays already select the answers");
  DevicePlaces<Answers> places =
      given.out.is_none()
          ? new_columns(blank, wanted_columns<Answers>(given.wanted), pairs.count, device, on)
          : given_columns(blank, given.out, pairs.count, device, on, arguments.lent);
  const auto done = solids.launch(pairs, on, std::move(arguments.lent),
                                  [&](const GpuSolids& all, GpuWorkspace& workspace) {
                                    launch(all, pairs, workspace, places.to, on);
                                  });
  if (done != nullptr)
    for (const py::object& column : places.found.column)
      if (column.is_valid() && py::isinstance<DeviceArray>(column))
        py::cast<DeviceArray&>(column).ready = done;
  return py::cast(std::move(places.found));
}

/// The class of a kind of answers, with all its columns. `doc`: its description.
template <class Answers>
void add_answers(py::module_& module, const char* name, const char* doc) {
  py::class_<DeviceAnswers<Answers>> type(
      module, name,
      (std::string(doc) + " of a batch: arrays on the device, None if not requested. Arrays passed "
                          "as `out` are the same objects.")
          .c_str());
  const auto& columns = columns_of<Answers>();
  for (std::size_t k = 0; k < columns.size(); ++k)
    type.def_prop_ro(
        columns[k].name.c_str(),
        [k](const DeviceAnswers<Answers>& self) -> py::object {
          return self.column[k].is_valid() ? self.column[k] : py::none();
        },
        columns[k].doc);
}

}  // namespace ist::python
