#include <ist/gpu_scene.h>

#include <memory>
#include <utility>
#include <vector>

#include "device_arrays.h"
#include "gpu_solids.h"
#include "module.h"
#include "penetration.h"
#include "solid_rows.h"

// ist.gpu.Scene: a broad phase on a device, whose pairs are arguments of queries there.

namespace ist::python {
namespace {

/// The result of find_pairs(): arrays of the scene.
struct DevicePairs {
  py::object count, boxes_met, a, b, solid_a, solid_b, poses_a, poses, scales_a, scales, status;
};

class DeviceScene {
 public:
  DeviceScene(DeviceSolids& solids, const std::vector<GpuSceneBody>& bodies,
              const GpuSceneSettings& settings)
      : solids_(solids) {
    const py::gil_scoped_release released;
    all_ = std::make_shared<Memory>(solids.solids(), bodies, settings);
  }

  DevicePairs find_pairs(const py::object& poses, const py::object& stream) {
    const cuda::Stream on = stream_of(stream);
    const int device = all_->block.device();
    LentArray lent = lend(poses, {"poses", {kFloat64}, {7}}, device, on);
    if (static_cast<std::size_t>(lent.rows) != size())
      throw value_error("poses: " + std::to_string(lent.rows) + " rows; there are " +
                        std::to_string(size()) + " bodies");
    const auto done = solids_.in_order(on, {std::move(lent.keep), all_}, [&] {
      all_->scene.find_pairs(static_cast<const Pose*>(lent.data), on);
    });
    if (done != nullptr)
      ready_ = done;
    else if (ready_ == nullptr)
      ready_ = std::make_shared<cuda::Moment>(device, cuda::legacy_stream());
    const GpuScenePairs& found = all_->scene.pairs();
    const std::size_t most = found.pairs.count;
    const auto array = [&](const auto* data, Shape shape, ElementType type) {
      DeviceArray out;
      out.block = {all_, &all_->block};
      out.ready = ready_;
      out.data = reinterpret_cast<std::byte*>(const_cast<void*>(static_cast<const void*>(data)));
      out.shape = std::move(shape);
      out.type = type;
      return py::cast(std::move(out));
    };
    return {array(found.count, {1}, kUInt32),
            array(found.boxes_met, {1}, kUInt32),
            array(found.a, {most}, kUInt32),
            array(found.b, {most}, kUInt32),
            array(found.pairs.a.solid, {most}, kUInt32),
            array(found.pairs.b.solid, {most}, kUInt32),
            array(found.pairs.a.pose, {most, 7}, kFloat64),
            array(found.pairs.b.pose, {most, 7}, kFloat64),
            array(found.pairs.a.scale, {most}, kFloat64),
            array(found.pairs.b.scale, {most}, kFloat64),
            array(found.status, {size()}, kUInt32)};
  }

  std::size_t size() const { return all_->scene.size(); }
  std::size_t bytes() const { return all_->scene.bytes(); }

 private:
  /// The memory of arrays, without the solids, whose last batch may own the arrays.
  struct Memory {
    Memory(const GpuSolids& solids, const std::vector<GpuSceneBody>& bodies,
           const GpuSceneSettings& settings)
        : scene(solids, bodies, settings, {.device = solids.device()}),
          block(solids.device(), nullptr) {}

    GpuScene scene;
    cuda::Block block;
  };

  DeviceSolids& solids_;
  std::shared_ptr<Memory> all_;
  std::shared_ptr<const cuda::Moment> ready_;
};

/// One integer for each body, or one for all.
void take_column(const py::object& value, const char* name, std::vector<GpuSceneBody>& bodies,
                 std::uint32_t GpuSceneBody::*member) {
  if (value.is_none()) return;
  const Integers numbers = take_integers(value, name, "(n,)");
  if (numbers.ndim() > 1 || (numbers.ndim() == 1 && numbers.shape(0) != bodies.size()))
    refuse_shape(numbers, name, text_of(Shape{bodies.size()}));
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const std::int64_t number = numbers.data()[numbers.ndim() == 0 ? 0 : i];
    if (number < 0 || number > 0xFFFFFFFF)
      throw value_error(std::string(name) + ": " + std::to_string(number) +
                        "; wanted a whole number from 0 to 2³² − 1");
    bodies[i].*member = static_cast<std::uint32_t>(number);
  }
}

std::unique_ptr<DeviceScene> make_scene(const py::object& solids, const py::object& solid,
                                        const py::object& scales, const py::object& worlds,
                                        const py::object& moves, const py::object& layers,
                                        const py::object& meets, const py::object& excluded,
                                        double margin, std::size_t max_pairs,
                                        const std::string& measure) {
  Solids& all = py::cast<Solids&>(solids);
  if (all.on_device == nullptr)
    throw type_error("solids: on the CPU; wanted ist.Solids on a GPU (ist.Scene is the CPU's)");
  const Integers of = take_integers(solid, "solid", "(n,)");
  if (of.ndim() != 1) refuse_shape(of, "solid", "(n,)");
  std::vector<GpuSceneBody> bodies(of.shape(0));
  take_column(solid, "solid", bodies, &GpuSceneBody::solid);
  take_column(worlds, "worlds", bodies, &GpuSceneBody::world);
  take_column(layers, "layers", bodies, &GpuSceneBody::layers);
  take_column(meets, "meets", bodies, &GpuSceneBody::meets);
  const std::string rows = text_of(Shape{bodies.size()});
  const auto each = [&](const auto& array, const char* name, const auto& set) {
    if (array.ndim() > 1 || (array.ndim() == 1 && array.shape(0) != bodies.size()))
      refuse_shape(array, name, rows);
    for (std::size_t i = 0; i < bodies.size(); ++i)
      set(bodies[i], array.data()[array.ndim() == 0 ? 0 : i]);
  };
  if (!scales.is_none())
    each(take_doubles(scales, "scales", rows), "scales",
         [](GpuSceneBody& body, double scale) { body.scale = scale; });
  if (!moves.is_none()) {
    const py::object flags =
        py::module_::import_("numpy").attr("asarray")(moves, "?", py::arg("order") = "C");
    each(py::cast<Array<bool>>(flags), "moves",
         [](GpuSceneBody& body, bool is) { body.moves = is; });
  }
  std::vector<ScenePairName> joined;
  if (!excluded.is_none()) {
    const Integers pairs = take_integers(excluded, "excluded", "(n, 2)");
    if (pairs.ndim() != 2 || pairs.shape(1) != 2) refuse_shape(pairs, "excluded", "(n, 2)");
    const auto body = [&](std::int64_t number) {
      if (number < 0 || number >= static_cast<std::int64_t>(bodies.size()))
        throw value_error("excluded: " + std::to_string(number) + "; there are " +
                          std::to_string(bodies.size()) + " bodies");
      return static_cast<std::uint32_t>(number);
    };
    for (std::size_t k = 0; k < pairs.shape(0); ++k)
      joined.push_back({body(pairs.data()[2 * k]), body(pairs.data()[2 * k + 1])});
  }
  GpuSceneSettings settings;
  settings.max_pairs = max_pairs;
  settings.margin = margin;
  settings.measure = named(measure, "measure", kMeasures);
  settings.excluded = joined;
  return std::make_unique<DeviceScene>(*all.on_device, bodies, settings);
}

}  // namespace

void add_gpu_scene(py::module_& module) {
  py::class_<DevicePairs> pairs(
      module, "ScenePairs",
      "The pairs of a step: arrays of the scene, written again by the next find_pairs(). Those of "
      "pairs have max_pairs rows, of which `count` hold pairs; as arguments of a query the others "
      "are invalid_input, with NaN.");
  const std::pair<const char*, py::object DevicePairs::*> columns[] = {
      {"count", &DevicePairs::count},
      {"boxes_met", &DevicePairs::boxes_met},
      {"a", &DevicePairs::a},
      {"b", &DevicePairs::b},
      {"solid_a", &DevicePairs::solid_a},
      {"solid_b", &DevicePairs::solid_b},
      {"poses_a", &DevicePairs::poses_a},
      {"poses", &DevicePairs::poses},
      {"scales_a", &DevicePairs::scales_a},
      {"scales", &DevicePairs::scales},
      {"status", &DevicePairs::status}};
  for (const auto& [name, column] : columns)
    pairs.def_prop_ro(name, [column = column](const DevicePairs& self) { return self.*column; });
  py::class_<DeviceScene>(
      module, "Scene",
      "Many bodies on a GPU, and whose boxes meet; thousands of small worlds side by side.\n\n"
      "found = scene.find_pairs(poses); ist.penetration(solids[found.solid_a], "
      "solids[found.solid_b], found.poses, poses_a=found.poses_a, scales=found.scales, "
      "scales_a=found.scales_a) answers all its pairs; both may be captured by a CUDA graph. The "
      "pairs are those of ist.Scene, by (a, b).")
      .def(py::new_(&make_scene), py::arg("solids"), py::arg("solid"), py::kw_only(),
           py::arg("scales") = py::none(), py::arg("worlds") = py::none(),
           py::arg("moves") = py::none(), py::arg("layers") = py::none(),
           py::arg("meets") = py::none(), py::arg("excluded") = py::none(), py::arg("margin") = 0.0,
           py::arg("max_pairs") = 8192, py::arg("measure") = "matched", py::keep_alive<0, 2>(),
           "solids: ist.Solids on a GPU. solid: (n,) which of them each body is. scales: (n,) or "
           "one. worlds: (n,) whole numbers below 2²⁴; bodies of different worlds never meet. "
           "moves: (n,) bool; two bodies that do not move are no pair, nor are two Shapes. layers, "
           "meets: (n,) bits; each of a pair must be on a layer that the other meets. excluded: "
           "(k, 2) bodies that are joined. margin: [u] boxes of a pair come as near. max_pairs: in "
           "one step. measure: that pairs will be asked by.")
      .def("__len__", &DeviceScene::size)
      .def_prop_ro("bytes", &DeviceScene::bytes, "Device memory of the scene.")
      .def("find_pairs", &DeviceScene::find_pairs, py::arg("poses"), py::kw_only(),
           py::arg("stream") = py::none(),
           "poses: (n, 7) float64 on the device. Returns ScenePairs: count, (1,), 0 if there are "
           "more than max_pairs; boxes_met, (1,), how many there are; a, b, (max_pairs,) bodies; "
           "status, (n,) of each body: invalid_input for a pose or scale that is not usable, which "
           "leaves it out.");
}

}  // namespace ist::python
