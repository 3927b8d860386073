#include "solid_rows.h"

#include <charconv>

#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "module.h"

namespace ist::python {
namespace {

/// −1: the CPU.
int device_number(const std::string& device) {
  if (device == "cpu") return -1;
  if (device == "cuda") return 0;
  constexpr std::string_view kCuda = "cuda:";
  int number = -1;
  if (device.starts_with(kCuda)) {
    const char* const end = device.data() + device.size();
    const auto [at, error] = std::from_chars(device.data() + kCuda.size(), end, number);
    if (error == std::errc() && at == end && number >= 0) return number;
  }
  throw value_error("device: '" + device + "'; one of 'cpu', 'cuda', 'cuda:0', 'cuda:1', …");
}

const SolidRows* rows_of(const py::object& solid) {
  return py::isinstance<SolidRows>(solid) ? &py::cast<const SolidRows&>(solid) : nullptr;
}

}  // namespace

Solids::Solids(const py::sequence& solids, const std::string& device) {
  const int number = device_number(device);
  for (const py::handle solid : solids) {
    const std::string name = "solids[" + std::to_string(views.size()) + "]";
    views.push_back(solid_of(solid, name.c_str()));
    owners.push_back(py::borrow<py::object>(solid));
    if (std::holds_alternative<ist::Shape>(views.back())) shapes.push_back(views.size() - 1);
  }
  count = views.size();
  if (number < 0) return;
  on_device = std::make_unique<DeviceSolids>(views, number);
  views.clear();
  owners.clear();
}

std::string Solids::device() const {
  return on_device == nullptr ? "cpu" : "cuda:" + std::to_string(on_device->solids().device());
}

DeviceSides device_sides(const py::object& a, const py::object& b) {
  const SolidRows *const of_a = rows_of(a), *const of_b = rows_of(b);
  for (const SolidRows* const side : {of_a, of_b}) {
    if (side == nullptr || side->among().on_device == nullptr) continue;
    if (of_a == nullptr || of_b == nullptr || !of_a->solids.is(of_b->solids))
      throw type_error("a, b: one is on " + side->among().device() +
                       "; wanted both of the same ist.Solids");
    return {side->among().on_device.get(), of_a->index, of_b->index};
  }
  return {};
}

void add_solid_rows(py::module_& module) {
  py::class_<SolidRows>(module, "SolidRows",
                        "Solids of the rows of a query, which takes them as `a` or `b`: "
                        "ist.Solids[index].")
      .def("__repr__",
           [](const SolidRows& self) {
             return "<solids " +
                    (py::isinstance<py::int_>(self.index) ? text_of(self.index) : "of many rows") +
                    " of ist.Solids on " + self.among().device() + ">";
           })
      .def("__reduce__", [](const SolidRows& self) {
        return py::make_tuple(py::module_::import_("operator").attr("getitem"),
                              py::make_tuple(self.solids, self.index));
      });
  py::class_<Solids>(
      module, "Solids",
      "Solids for rows of unlike pairs, on the CPU or a GPU.\n\n"
      "solids[i] with one index, or solids[indices] with one for each row, is the `a` or the `b` "
      "of a query: ist.penetration(solids[0], solids[indices], poses). On the CPU indices are "
      "whole numbers, on a GPU uint32 or int32 in its memory.")
      .def(
          py::new_([](const py::sequence& solids, const py::object& device) {
            return std::make_unique<Solids>(solids, text_of(device));
          }),
          py::arg("solids"), py::kw_only(), py::arg("device") = "cpu",
          "solids: an ist.Asset or ist.Shape each. device: 'cpu', 'cuda', 'cuda:1', …, or a device "
          "of PyTorch. A GPU gets a copy; batches "
          "of one Solids run there one after another, on any streams, because they share working "
          "memory. Keep it alive as long as captured graphs use it. Raises ist.Error if the device "
          "cannot be used or is out of memory.")
      .def("__repr__",
           [](const Solids& self) {
             return "<ist.Solids of " + std::to_string(self.count) + " on " + self.device() + ">";
           })
      .def("__len__", [](const Solids& self) { return self.count; })
      .def("__reduce__",
           [](const Solids& self) {
             if (self.on_device != nullptr)
               throw type_error("Solids on " + self.device() +
                                " are not pickled: pickle the assets, and make them again");
             py::list solids;
             for (const py::object& solid : self.owners) solids.append(solid);
             return py::make_tuple(py::module_::import_("ist").attr("Solids"),
                                   py::make_tuple(solids));
           })
      .def(
          "__getitem__",
          [](const py::object& self, const py::object& index) {
            const std::size_t size = py::cast<const Solids&>(self).count;
            const bool is_empty = py::isinstance<py::list>(index) && py::len(index) == 0;
            if (py::isinstance<py::slice>(index) || is_empty) {
              const py::object all = py::module_::import_("numpy").attr("arange")(size);
              return SolidRows{self, all[is_empty ? py::object(py::slice(0)) : index]};
            }
            if (py::isinstance<py::bool_>(index))
              throw type_error("solids[" + text_of(index) + "]: wanted whole numbers");
            if (!py::isinstance<py::int_>(index)) return SolidRows{self, index};
            std::size_t number = 0;
            if (!py::try_cast(index, number) || number >= size)
              throw py::index_error(
                  ("solids[" + text_of(index) + "]: there are " + std::to_string(size) + " solids")
                      .c_str());
            return SolidRows{self, index};
          },
          py::arg("index"))
      .def_prop_ro("device", &Solids::device, "'cpu' or 'cuda:0', …")
      .def_prop_ro(
          "shapes", [](const Solids& self) { return self.shapes; },
          "Indices of those that are Shapes.")
      .def_prop_ro(
          "bytes",
          [](const Solids& self) {
            return self.on_device == nullptr ? 0 : self.on_device->solids().bytes();
          },
          "Device memory of the solids; 0 on the CPU, where nothing is copied.");
}

}  // namespace ist::python
