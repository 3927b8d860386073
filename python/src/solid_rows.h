#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gpu_solids.h"
#include "solids.h"

// Solids that rows of pairs choose from, where their answers are wanted.

namespace ist::python {

/// ist.Solids.
struct Solids {
  Solids(const py::sequence& solids, const std::string& device);

  std::string device() const;

  std::size_t count;
  std::vector<std::size_t> shapes;  ///< which of them are Shapes
  // On the CPU, with whoever owns what they view:
  std::vector<Solid> views;
  std::vector<py::object> owners;
  std::unique_ptr<DeviceSolids> on_device;  ///< null: on the CPU
};

/// ist.Solids[index].
struct SolidRows {
  py::object solids;  ///< Solids
  py::object index;   ///< a number for all rows, or an array of each row's

  Solids& among() const { return py::cast<Solids&>(solids); }
};

/// Both solids of a query on a device; null `solids`: they are on the CPU.
struct DeviceSides {
  DeviceSolids* solids = nullptr;
  py::object a, b;  ///< indices
};

/// Refuses one solid on a device beside one that is elsewhere.
DeviceSides device_sides(const py::object& a, const py::object& b);

/// The classes of both.
void add_solid_rows(py::module_& module);

}  // namespace ist::python
